#pragma once
/** @file
Loops whose passes may run at the same time (private header). With one thread they are plain loops:
a team of one would still cost a fraction of a microsecond.

    threads = chooseNumThreads(threads, work, workPerThread);
    parallelFor(count, threads, [&](int i) { … });          // equal shares, in order
    parallelForDynamic(count, threads, [&](int i) { … });   // whoever is free takes the next

All threads do arithmetic as the calling one does, see FlushDenormals.h. **/

#include <omp.h>

#include <algorithm>

#include "simflex/solver/FlushDenormals.h"

namespace simflex {

/** Threads that `work` can feed, each at least its share: a parallel loop must outlast its barrier.
At most `most`, and at most as many as there are processors: waiting threads spin. **/
inline int chooseNumThreads(int most, double work, double workPerThread) {
    most = std::min(most, omp_get_num_procs());
    return std::max(1, int(std::min(double(most), work / workPerThread)));
}

template <class Body>
void parallelFor(int count, int threads, const Body& body) {
    if (threads <= 1) {
        for (int i = 0; i < count; ++i) body(i);
        return;
    }
    const unsigned mode = ArithmeticMode::get();
    const ArithmeticMode ofNewThreads(ArithmeticMode::getOutermost());
#pragma omp parallel num_threads(threads)
    {
        const ArithmeticMode callers(mode);
#pragma omp for schedule(static)
        for (int i = 0; i < count; ++i) body(i);
    }
}

template <class Body>
void parallelForDynamic(int count, int threads, const Body& body) {
    if (threads <= 1) {
        for (int i = 0; i < count; ++i) body(i);
        return;
    }
    const unsigned mode = ArithmeticMode::get();
    const ArithmeticMode ofNewThreads(ArithmeticMode::getOutermost());
#pragma omp parallel num_threads(threads)
    {
        const ArithmeticMode callers(mode);
#pragma omp for schedule(dynamic, 1)
        for (int i = 0; i < count; ++i) body(i);
    }
}

}  // namespace simflex
