#include "simflex/base/NameDistance.h"

#include <algorithm>
#include <cstddef>

#include "simflex/base/AsciiText.h"

namespace simflex {
namespace {

const std::size_t kMaxLength = 200;  // longer names are not compared

std::string makePlain(std::string name) {
    for (char& c : name) {
        c = toLower(c);
        if (c == '-' || c == ' ') c = '_';
    }
    return name;
}

/** Returns the edit distance: insertions, deletions, replacements and swaps of neighbours. **/
std::size_t countEdits(const std::string& a, const std::string& b) {
    const std::size_t width = b.size() + 1;
    std::vector<std::size_t> before(width), last(width), now(width);
    for (std::size_t j = 0; j < width; ++j) last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        now[0] = i;
        for (std::size_t j = 1; j < width; ++j) {
            const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
            now[j] = std::min({replaced, last[j] + 1, now[j - 1] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = std::min(now[j], before[j - 2] + 1);
        }
        before.swap(last);
        last.swap(now);
    }
    return last[b.size()];
}

}  // namespace

std::string findNearestName(const std::string& name, const std::vector<std::string>& known) {
    if (name.empty() || name.size() > kMaxLength) return "";
    const std::string plain = makePlain(name);
    std::string nearest;
    std::size_t fewest = plain.size() / 3 + 1;
    for (const std::string& candidate : known) {
        if (candidate.size() > kMaxLength) continue;
        const std::string other = makePlain(candidate);
        std::size_t edits = countEdits(plain, other);
        // 'tolerance' suggests 'constraint_tolerance'.
        const bool isWithin = plain.size() > 3 && other.find(plain) != std::string::npos;
        if (isWithin) edits = std::min<std::size_t>(edits, fewest);
        if (edits < fewest || (edits == fewest && nearest.empty())) {
            fewest = edits;
            nearest = candidate;
        }
    }
    return nearest;
}

}  // namespace simflex
