#pragma once
/** @file
How this thread rounds and what it does with denormal numbers, for a while (private header). Loops
of ParallelFor.h give it to every thread that takes part, and give back what that had. Without
effect where the processor has no SSE.

    const FlushDenormals flush;          // until the end of the scope
    const StandardArithmetic standard;   // whatever the caller has set

Disturbances fade along a long chain of bodies until they are denormal numbers, on which processors
are many times slower: a Newton iteration of 10 000 links let go at rest took three times as long.
**/

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace simflex {

/** Sets a mode, and the one before at the end of the scope. **/
class ArithmeticMode {
public:
    explicit ArithmeticMode(unsigned mode) : m_before(get()) {
        if (nesting().depth++ == 0) nesting().outermost = m_before;
        if (m_before != mode) set(mode);
    }
    ~ArithmeticMode() {
        --nesting().depth;
        if (get() != m_before) set(m_before);
    }
    ArithmeticMode(const ArithmeticMode&) = delete;
    ArithmeticMode& operator=(const ArithmeticMode&) = delete;

    static constexpr unsigned Standard = 0;       ///< rounds to nearest, has denormals
    static constexpr unsigned Flushing = 0x8040;  ///< flushes to zero, takes denormals for zero

    /** What this thread had before any of these: what a new thread shall inherit from it. **/
    static unsigned getOutermost() { return nesting().depth > 0 ? nesting().outermost : get(); }

    /** That of this thread. **/
#ifdef __SSE2__
    static unsigned get() {
        return _mm_getcsr() & All;
    }
#else
    static unsigned get() {
        return Standard;
    }
#endif

private:
    struct Nesting {
        int depth = 0;
        unsigned outermost = Standard;
    };
    static Nesting& nesting() {
        thread_local Nesting ofThread;
        return ofThread;
    }

    static constexpr unsigned All = Flushing | 0x6000;  // and the direction of rounding

#ifdef __SSE2__
    static void set(unsigned mode) {
        _mm_setcsr((_mm_getcsr() & ~All) | mode);
    }
#else
    static void set(unsigned) {}
#endif

    unsigned m_before;
};

class FlushDenormals : ArithmeticMode {
public:
    FlushDenormals() : ArithmeticMode(Flushing) {}
};

class StandardArithmetic : ArithmeticMode {
public:
    StandardArithmetic() : ArithmeticMode(Standard) {}
};

}  // namespace simflex
