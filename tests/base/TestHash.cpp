#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "simflex/base/Hash.h"

namespace simflex {
namespace {

template <class Content>
std::uint64_t hashOf(const Content& content) {
    Hash hash;
    hash.add(content);
    return hash.get();
}

TEST(Hash, TellsChangedSwappedAndShiftedContentApart) {
    using Numbers = std::vector<double>;
    EXPECT_EQ(hashOf(Numbers{1, 2, 3}), hashOf(Numbers{1, 2, 3}));
    EXPECT_NE(hashOf(Numbers{1, 2, 3}), hashOf(Numbers{1, 3, 2}));
    EXPECT_NE(hashOf(Numbers{1, 2, 3}), hashOf(Numbers{1, 2, std::nextafter(3, 4)}));
    EXPECT_NE(hashOf(Numbers{0, 0}), hashOf(Numbers{0, 0, 0}));
    EXPECT_NE(hashOf(std::string("ab")), hashOf(std::string("ab\0", 3)));
    Hash a, b;
    a.add(std::string("ab")), a.add(std::string("c"));
    b.add(std::string("a")), b.add(std::string("bc"));
    EXPECT_NE(a.get(), b.get());
}

TEST(Hash, EveryBitCounts) {
    const std::string text = "words of eight bytes, and three";
    std::set<std::uint64_t> hashes{hashOf(text)};
    for (size_t bit = 0; bit < 8 * text.size(); ++bit) {
        std::string changed = text;
        changed[bit / 8] = char(changed[bit / 8] ^ 1 << bit % 8);
        hashes.insert(hashOf(changed));
    }
    EXPECT_EQ(hashes.size(), 8 * text.size() + 1);
}

TEST(Hash, IsThatOfFilesWrittenBefore) {
    Hash hash;
    EXPECT_EQ(hash.getText(), "cbf29ce484222325");
    // Computed with Python's integers by the formula of Hash.h.
    hash.addBytes("part file", 9);
    EXPECT_EQ(hash.getText(), "ab5fc82394958489");
}

}  // namespace
}  // namespace simflex
