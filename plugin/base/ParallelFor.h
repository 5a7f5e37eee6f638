#pragma once
/** @file
Loops whose passes may run at the same time (private header). With one thread they are plain loops:
a team of one would still cost a fraction of a microsecond.

    threads = chooseNumThreads(threads, work, workPerThread);
    parallelFor(count, threads, [&](int i) { … });          // equal shares, in order
    parallelFor(count, threads, Schedule::WhoeverIsFree, [&](int i) { … });

What a pass throws comes out of the loop, as it would come out of a plain one: it is that of the
first pass that throws, whatever the number of threads. Passes after it may have run.

All threads do arithmetic as the calling one does, see FlushDenormals.h. **/

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>

#include "simflex/base/FlushDenormals.h"

namespace simflex {

/** Threads that `work` can feed, each at least its share: a parallel loop must outlast its barrier.
At most `most`, and at most as many as there are processors: waiting threads spin. **/
inline int chooseNumThreads(int most, double work, double workPerThread) {
    most = std::min(most, omp_get_num_procs());
    return std::max(1, int(std::min(double(most), work / workPerThread)));
}

/** What the passes of a parallel region throw: none may leave it. **/
class FirstException {
public:
    /** Runs a pass, unless one before it has thrown. **/
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
    /** After the region. **/
    void rethrow() const {
        if (m_exception) std::rethrow_exception(m_exception);
    }

private:
    std::atomic<long> m_number{std::numeric_limits<long>::max()};
    std::mutex m_mutex;
    std::exception_ptr m_exception;
};

enum class Schedule {
    EqualShares,   ///< each thread has its passes, in order
    WhoeverIsFree  ///< takes the next pass
};

template <class Index, class Body>
void parallelFor(Index count, int threads, Schedule schedule, const Body& body) {
    if (threads <= 1) {
        for (Index i = 0; i < count; ++i) body(i);
        return;
    }
    FirstException exception;
    const auto guarded = [&](Index i) { exception.guard(long(i), [&] { body(i); }); };
    const unsigned mode = ArithmeticMode::get();
    const ArithmeticMode ofNewThreads(ArithmeticMode::getOutermost());
#pragma omp parallel num_threads(threads)
    {
        const ArithmeticMode callers(mode);
        if (schedule == Schedule::EqualShares) {
#pragma omp for schedule(static)
            for (Index i = 0; i < count; ++i) guarded(i);
        } else {
#pragma omp for schedule(dynamic, 1)
            for (Index i = 0; i < count; ++i) guarded(i);
        }
    }
    exception.rethrow();
}

template <class Index, class Body>
void parallelFor(Index count, int threads, const Body& body) {
    parallelFor(count, threads, Schedule::EqualShares, body);
}

}  // namespace simflex
