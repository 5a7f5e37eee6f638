#pragma once
/** @file
Scoped control of this thread's rounding mode and treatment of denormal numbers (private header).
Loops of ParallelFor.h pass the mode on to every participating thread and restore that thread's own
mode afterwards. No effect on processors without SSE.

    const FlushDenormals flush;          // until the end of the scope
    const StandardArithmetic standard;   // whatever the caller has set

Disturbances decay along a long chain of bodies until they are denormal, and arithmetic on denormal
numbers is many times slower: a Newton iteration of 10 000 links released from rest took three times
as long. **/

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace simflex {

/** Sets a mode and restores the previous one at the end of the scope. **/
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

    static constexpr unsigned Standard = 0;       ///< round to nearest, keep denormals
    static constexpr unsigned Flushing = 0x8040;  ///< flush results to zero, treat denormal inputs
                                                  ///< as zero

    /** Returns the mode of this thread outside all scopes of this class: the one a new thread
    should inherit. **/
    static unsigned getOutermost() { return nesting().depth > 0 ? nesting().outermost : get(); }

    /** Returns the current mode of this thread. **/
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

    static constexpr unsigned All = Flushing | 0x6000;  // with the rounding bits

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
