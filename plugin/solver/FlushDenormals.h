#pragma once
/** @file
Makes numbers below 2⁻¹⁰²² count as zero for a while, in this thread and a team of OpenMP's (private
header).

Disturbances fade along a long chain of bodies until they are denormal numbers, on which processors
are many times slower: a Newton iteration of 10 000 links let go at rest took three times as long.
Without effect where the processor has no SSE.

    const FlushDenormals flush(numThreads);   // until the end of the scope **/

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace simflex {

class FlushDenormals {
public:
    explicit FlushDenormals(int numThreads) : m_numThreads(numThreads), m_before(getMode()) {
        if (m_before != Both) setModeOfTeam(Both);
    }
    ~FlushDenormals() {
        if (m_before != Both) setModeOfTeam(m_before);
    }
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
    static constexpr unsigned Both = 0x8040;  // flush to zero, denormals are zero

#ifdef __SSE2__
    static unsigned getMode() {
        return _mm_getcsr() & Both;
    }
    static void setMode(unsigned mode) {
        _mm_setcsr((_mm_getcsr() & ~Both) | mode);
    }
#else
    static unsigned getMode() {
        return Both;
    }
    static void setMode(unsigned) {}
#endif

    void setModeOfTeam(unsigned mode) const {
        if (m_numThreads <= 1) return setMode(mode);
#pragma omp parallel num_threads(m_numThreads)
        setMode(mode);
    }

    int m_numThreads;
    unsigned m_before;
};

}  // namespace simflex
