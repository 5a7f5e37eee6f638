#pragma once
/** @file
Parallel loops (private header). With one thread they are plain loops: even a team of one would cost
a fraction of a microsecond.

    threads = chooseNumThreads(threads, work, workPerThread);
    parallelFor(count, threads, [&](int i) { … });          // equal shares, in order
    parallelFor(count, threads, Schedule::WhoeverIsFree, [&](int i) { … });

Threads that other programs keep busy are not waited for, see WorkTeam.h. A nested loop runs
serially. An exception leaves the loop as it would leave a serial one: it is that of the first
iteration that throws, for any number of threads, but later iterations may have run.

All threads use the caller's arithmetic mode, see FlushDenormals.h. **/

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>

#include "simflex/base/FlushDenormals.h"
#include "simflex/base/WorkTeam.h"

namespace simflex {

/** Returns the number of threads for which each gets at least `workPerThread`, so that the loop
outweighs its overhead. At most `most` and at most the number of processors. **/
inline int chooseNumThreads(int most, double work, double workPerThread) {
    most = std::min(most, omp_get_num_procs());
    return std::max(1, int(std::min(double(most), work / workPerThread)));
}

/** Collects exceptions of a parallel region, which none may leave. **/
class FirstException {
public:
    /** Runs an iteration unless an earlier one has thrown. **/
    template <class Pass>
    void guard(long number, const Pass& pass) noexcept {
        if (number > m_number) return;
        try {
            pass();
        } catch (...) {
            const std::lock_guard<std::mutex> lock(m_mutex);
            if (number > m_number) return;
            m_number = number;
            m_exception = std::current_exception();
        }
    }
    /** Call after the region. **/
    void rethrow() const {
        if (m_exception) std::rethrow_exception(m_exception);
    }

private:
    std::atomic<long> m_number{std::numeric_limits<long>::max()};
    std::mutex m_mutex;
    std::exception_ptr m_exception;
};

enum class Schedule {
    EqualShares,   ///< each thread starts with its own range, in order
    WhoeverIsFree  ///< each thread takes the next iteration
};

template <class Index, class Body>
void parallelFor(Index count, int threads, Schedule schedule, const Body& body) {
    WorkTeam* const team = threads > 1 && count > 1 ? WorkTeam::ofThisThread() : nullptr;
    if (!team) {
        for (Index i = 0; i < count; ++i) body(i);
        return;
    }
    constexpr long PiecesOfShare = 8;
    FirstException exception;
    const auto runPiece = [&](long begin, long end) {
        for (long i = begin; i < end; ++i) exception.guard(i, [&] { body(Index(i)); });
    };
    const int shares =
        schedule == Schedule::EqualShares ? int(std::min(long(threads), long(count))) : 1;
    const long size = schedule == Schedule::EqualShares
                          ? std::max(1L, long(count) / (shares * PiecesOfShare))
                          : 1;
    team->run(
        long(count), shares, size, threads, ArithmeticMode::get(),
        [](const void* loop, long begin, long end) {
            (*static_cast<decltype(&runPiece)>(loop))(begin, end);
        },
        &runPiece);
    exception.rethrow();
}

template <class Index, class Body>
void parallelFor(Index count, int threads, const Body& body) {
    parallelFor(count, threads, Schedule::EqualShares, body);
}

/** Calls body(begin, end) for ranges of 0 … size−1 that start at whole chunks; one range if the
vector is too short for several threads. **/
template <class Body>
void parallelRanges(int size, int threads, const Body& body) {
    constexpr int Range = 2048;
    if (threads <= 1 || size < 8 * Range) return body(0, size);
    parallelFor((size + Range - 1) / Range, threads,
                [&](int k) { body(k * Range, std::min(size, (k + 1) * Range)); });
}

}  // namespace simflex
