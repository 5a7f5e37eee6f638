#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "simflex/base/Chunk.h"

namespace simflex {
namespace {

TEST(Chunk, LoadsAndStoresTheFirstOfEightAndTouchesNoOthers) {
    for (int count = 0; count <= ChunkSize; ++count) {
        // Exact size, so that a sanitizer detects reads past the end.
        const auto values = std::make_unique<double[]>(size_t(count));
        for (int k = 0; k < count; ++k) values[size_t(k)] = k + 1;
        const Chunk chunk = loadChunk(values.get(), count);
        for (int k = 0; k < ChunkSize; ++k) EXPECT_EQ(getEntry(chunk, k), k < count ? k + 1 : 0);

        const auto stored = std::make_unique<double[]>(ChunkSize + 1);
        std::fill_n(stored.get(), ChunkSize + 1, -1.0);
        storeChunk(makeChunk(1, 2, 3, 4, 5, 6, 7, 8), stored.get(), count);
        for (int k = 0; k <= ChunkSize; ++k) EXPECT_EQ(stored[size_t(k)], k < count ? k + 1 : -1);
    }
}

TEST(Chunk, CalculatesAsEightNumbersDo) {
    const float floats[ChunkSize] = {1, -2, 3, -4, 5, -6, 7, -8};
    const Chunk a = loadChunk(floats), b = makeChunk(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8);
    Chunk sum = -a;
    sum += 2.5 * b;
    sum -= (1 + a * b) / 3;
    const Chunk quotient = 2 / (b + 0.5), size = absolute(a), most = larger(a, b);
    double all = 0;
    for (int k = 0; k < ChunkSize; ++k) {
        const double x = floats[k], y = b[k];
        EXPECT_DOUBLE_EQ(sum[k], -x + 2.5 * y - (1 + x * y) / 3);
        EXPECT_DOUBLE_EQ(quotient[k], 2 / (y + 0.5));
        EXPECT_EQ(size[k], std::abs(x));
        EXPECT_EQ(most[k], std::max(x, y));
        all += x;
    }
    EXPECT_EQ(sumChunk(a), all);
    Chunk changed{};
    for (int k = 0; k < ChunkSize; ++k) setEntry(changed, k, k * k);
    EXPECT_EQ(sumChunk(changed), 140);
}

TEST(Chunk, TakesTheSecondOfTwoWhereOneIsNotANumber) {
    const Chunk nan = makeChunk(NAN, 1, NAN, 1, NAN, 1, NAN, 1);
    EXPECT_EQ(larger(nan, Chunk{})[0], 0);
    EXPECT_TRUE(std::isnan(larger(Chunk{}, nan)[0]));
    EXPECT_TRUE(std::isnan(absolute(nan)[2]));
}

}  // namespace
}  // namespace simflex
