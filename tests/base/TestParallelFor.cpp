/** @file
Parallel loops whose passes throw or take long. **/

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "simflex/base/ParallelFor.h"

using namespace simflex;

namespace {

/** Returns the pass whose exception propagates; −1 for none. **/
template <class Loop>
int findThrown(const Loop& loop, int threads, const std::vector<int>& throwing) {
    try {
        loop(1000, threads, [&](int i) {
            for (int pass : throwing)
                if (i == pass) throw std::runtime_error(std::to_string(i));
        });
    } catch (const std::runtime_error& error) {
        return std::stoi(error.what());
    }
    return -1;
}

const auto kEqualShares = [](int count, int threads, const auto& body) {
    parallelFor(count, threads, body);
};
const auto kNextOne = [](int count, int threads, const auto& body) {
    parallelFor(count, threads, Schedule::WhoeverIsFree, body);
};

/** Runs it in a thread that has not waited for others before. **/
void runInNewThread(const std::function<void()>& work) {
    std::thread(work).join();
}

}  // namespace

TEST(ParallelFor, TheFirstExceptionComesOutForAnyNumberOfThreads) {
    for (int threads : {1, 2, 3, 8})
        for (int repeat = 0; repeat < 50; ++repeat) {
            EXPECT_EQ(findThrown(kEqualShares, threads, {}), -1);
            EXPECT_EQ(findThrown(kEqualShares, threads, {999}), 999);
            EXPECT_EQ(findThrown(kEqualShares, threads, {900, 501, 130, 700}), 130);
            EXPECT_EQ(findThrown(kNextOne, threads, {900, 501, 130, 131}), 130);
        }
}

TEST(ParallelFor, AllPassesBeforeTheOneThatThrowsHaveRun) {
    for (int threads : {1, 2, 8}) {
        std::vector<int> hasRun(1000, 0);
        EXPECT_THROW(parallelFor(1000, threads,
                                 [&](int i) {
                                     if (i == 700) throw std::runtime_error("stop");
                                     hasRun[size_t(i)] = 1;
                                 }),
                     std::runtime_error);
        for (int i = 0; i < 700; ++i) EXPECT_EQ(hasRun[size_t(i)], 1) << i;
    }
}

TEST(ParallelFor, APassThatTakesLongHoldsNoOtherUpWhereWhoeverIsFreeTakesTheNext) {
    constexpr int Count = 100;
    std::atomic<int> numDone{0};
    runInNewThread([&] {
        parallelFor(Count, 2, Schedule::WhoeverIsFree, [&](int i) {
            const auto start = std::chrono::steady_clock::now();
            while (i == 0 && numDone < Count - 1 &&
                   std::chrono::steady_clock::now() - start < std::chrono::seconds(10))
                std::this_thread::yield();
            EXPECT_TRUE(i > 0 || numDone == Count - 1);
            ++numDone;
        });
    });
}

TEST(ParallelFor, WhereAnotherThreadWasKeptFromWorkingTheCallerIsAloneForAWhile) {
    std::atomic<int> numByOthers{0};
    runInNewThread([&] {
        const std::thread::id caller = std::this_thread::get_id();
        const auto run = [&](std::chrono::milliseconds delay) {
            parallelFor(100, 2, [&](int) {
                const bool isOther = std::this_thread::get_id() != caller;
                const bool isFirst = isOther && numByOthers++ == 0;
                std::this_thread::sleep_for(isFirst ? delay : std::chrono::milliseconds(0));
                if (!isOther) std::this_thread::sleep_for(std::chrono::microseconds(100));
            });
        };
        while (numByOthers == 0) run(std::chrono::milliseconds(500));
        numByOthers = 0;
        run(std::chrono::milliseconds(0));
        EXPECT_EQ(numByOthers, 0);
    });
}

TEST(ParallelFor, ALoopInsideOfALoopIsAPlainOne) {
    std::atomic<int> sum{0}, numElsewhere{0};
    parallelFor(20, 3, [&](int) {
        const std::thread::id caller = std::this_thread::get_id();
        parallelFor(50, 3, [&](int i) {
            sum += i;
            numElsewhere += std::this_thread::get_id() != caller;
        });
    });
    EXPECT_EQ(sum, 20 * 49 * 25);
    EXPECT_EQ(numElsewhere, 0);
}

TEST(ParallelFor, LoopsAfterAnExceptionRunAsBefore) {
    for (int repeat = 0; repeat < 20; ++repeat) {
        EXPECT_EQ(findThrown(kEqualShares, 4, {3, 500}), 3);
        std::vector<int> squares(1000, 0);
        parallelFor(1000, 4, [&](int i) { squares[size_t(i)] = i * i; });
        for (int i = 0; i < 1000; ++i) ASSERT_EQ(squares[size_t(i)], i * i);
    }
}
