#pragma once
/** @file
Vector arithmetic on eight doubles (private header): one AVX-512 register, two AVX or four SSE2
registers. The order of operations is fixed, so results are bit-identical for any alignment.

    Chunk sum{};
    for (int i = 0; i < size; i += ChunkSize) {
        const int count = std::min(size - i, ChunkSize);
        sum += loadChunk(a + i, count) * loadChunk(b + i, count);
    }
    sumChunk(sum);  **/

#ifdef __AVX__
#include <immintrin.h>
#endif

#include <cstring>

namespace simflex {

constexpr int ChunkSize = 8;

constexpr int roundUpToChunks(int size) {
    return (size + ChunkSize - 1) / ChunkSize * ChunkSize;
}

/** Doubles in one hardware register. **/
#if defined __AVX512F__
constexpr int RegisterSize = 8;
#elif defined __AVX__
constexpr int RegisterSize = 4;
#else
constexpr int RegisterSize = 2;
#endif
using Register = double __attribute__((vector_size(8 * RegisterSize)));

/** A pair of halves on which all operations act alike; each half is a register or again a pair. The
compiler would keep a vector wider than a register in memory, at a tenth of the speed. **/
template <class Half>
struct Halves {
    Half low, high;

    static constexpr int HalfSize = int(sizeof(Half) / sizeof(double));

    double operator[](int k) const { return k < HalfSize ? low[k] : high[k - HalfSize]; }

    friend Halves operator-(const Halves& a) { return {-a.low, -a.high}; }
    friend Halves operator+(const Halves& a, const Halves& b) {
        return {a.low + b.low, a.high + b.high};
    }
    friend Halves operator-(const Halves& a, const Halves& b) {
        return {a.low - b.low, a.high - b.high};
    }
    friend Halves operator*(const Halves& a, const Halves& b) {
        return {a.low * b.low, a.high * b.high};
    }
    friend Halves operator+(const Halves& a, double b) { return {a.low + b, a.high + b}; }
    friend Halves operator+(double a, const Halves& b) { return {a + b.low, a + b.high}; }
    friend Halves operator*(const Halves& a, double b) { return {a.low * b, a.high * b}; }
    friend Halves operator*(double a, const Halves& b) { return {a * b.low, a * b.high}; }
    friend Halves operator/(const Halves& a, double b) { return {a.low / b, a.high / b}; }
    friend Halves operator/(double a, const Halves& b) { return {a / b.low, a / b.high}; }
    Halves& operator+=(const Halves& other) { return *this = *this + other; }
    Halves& operator-=(const Halves& other) { return *this = *this - other; }
};

#if defined __AVX512F__
using Chunk = Register;
#elif defined __AVX__
using Chunk = Halves<Register>;
#else
using Chunk = Halves<Halves<Register>>;
#endif

/** Operations that Halves does not provide as operators; here for one register. **/
template <class Part>
struct ChunkPart {
    static Part load(const double* values) {
        Part part;
        std::memcpy(&part, values, sizeof part);
        return part;
    }
    static Part load(const float* values) {
        float __attribute__((vector_size(4 * RegisterSize))) floats;
        std::memcpy(&floats, values, sizeof floats);
        return __builtin_convertvector(floats, Part);
    }
    static void store(const Part& part, double* values) { std::memcpy(values, &part, sizeof part); }
    static void set(Part& part, int k, double value) { part[k] = value; }
    static Part absolute(const Part& part) { return part < 0 ? -part : part; }
    static Part larger(const Part& a, const Part& b) { return a > b ? a : b; }
};

template <class Half>
struct ChunkPart<Halves<Half>> {
    using Both = Halves<Half>;
    using OfHalf = ChunkPart<Half>;
    static constexpr int HalfSize = Both::HalfSize;

    template <class Number>
    static Both load(const Number* values) {
        return {OfHalf::load(values), OfHalf::load(values + HalfSize)};
    }
    static void store(const Both& both, double* values) {
        OfHalf::store(both.low, values);
        OfHalf::store(both.high, values + HalfSize);
    }
    static void set(Both& both, int k, double value) {
        OfHalf::set(k < HalfSize ? both.low : both.high, k % HalfSize, value);
    }
    static Both absolute(const Both& both) {
        return {OfHalf::absolute(both.low), OfHalf::absolute(both.high)};
    }
    static Both larger(const Both& a, const Both& b) {
        return {OfHalf::larger(a.low, b.low), OfHalf::larger(a.high, b.high)};
    }
};

inline Chunk makeChunk(double a, double b, double c, double d, double e, double f, double g,
                       double h) {
#if defined __AVX512F__
    return Register{a, b, c, d, e, f, g, h};
#elif defined __AVX__
    return {Register{a, b, c, d}, Register{e, f, g, h}};
#else
    return {{Register{a, b}, Register{c, d}}, {Register{e, f}, Register{g, h}}};
#endif
}

inline Chunk loadChunk(const double* values) {
    return ChunkPart<Chunk>::load(values);
}
inline Chunk loadChunk(const float* values) {
    return ChunkPart<Chunk>::load(values);
}

/** Loads the first `count` of eight values and sets the others to zero. Reads no memory behind
them. **/
inline Chunk loadChunk(const double* values, int count) {
    if (count == ChunkSize) return loadChunk(values);
#if defined __AVX512F__
    return _mm512_maskz_loadu_pd(__mmask8((1u << count) - 1), values);
#elif defined __AVX__
    static const long long mask[2 * ChunkSize] = {-1, -1, -1, -1, -1, -1, -1, -1};
    const auto loadQuad = [&](int first) {
        const void* kept = mask + ChunkSize - count + first;
        return _mm256_maskload_pd(values + first,
                                  _mm256_loadu_si256(static_cast<const __m256i*>(kept)));
    };
    return {loadQuad(0), loadQuad(4)};
#else
    double padded[ChunkSize];
    for (int k = 0; k < ChunkSize; ++k) padded[k] = k < count ? values[k] : 0.0;
    return loadChunk(padded);
#endif
}

inline void storeChunk(const Chunk& chunk, double* values) {
    ChunkPart<Chunk>::store(chunk, values);
}

inline void storeChunk(const Chunk& chunk, double* values, int count) {
    if (count == ChunkSize) return storeChunk(chunk, values);
#if defined __AVX512F__
    _mm512_mask_storeu_pd(values, __mmask8((1u << count) - 1), chunk);
#elif defined __AVX__
    // No masked store: it is slow on some processors.
    __m256d rest = chunk.low;
    if (count & 4) {
        _mm256_storeu_pd(values, rest);
        rest = chunk.high;
        values += 4;
    }
    __m128d last = _mm256_castpd256_pd128(rest);
    if (count & 2) {
        _mm_storeu_pd(values, last);
        last = _mm256_extractf128_pd(rest, 1);
        values += 2;
    }
    if (count & 1) _mm_store_sd(values, last);
#else
    double padded[ChunkSize];
    storeChunk(chunk, padded);
    for (int k = 0; k < ChunkSize; ++k)
        if (k < count) values[k] = padded[k];
#endif
}

inline double getEntry(const Chunk& chunk, int k) {
    return chunk[k];
}
inline void setEntry(Chunk& chunk, int k, double value) {
    ChunkPart<Chunk>::set(chunk, k, value);
}

/** Element-wise |x|. **/
inline Chunk absolute(const Chunk& chunk) {
    return ChunkPart<Chunk>::absolute(chunk);
}
/** Element-wise maximum: a if a > b, else b, also where one of them is NaN. **/
inline Chunk larger(const Chunk& a, const Chunk& b) {
    return ChunkPart<Chunk>::larger(a, b);
}

inline double sumChunk(const Chunk& chunk) {
    return ((chunk[0] + chunk[1]) + (chunk[2] + chunk[3])) +
           ((chunk[4] + chunk[5]) + (chunk[6] + chunk[7]));
}

}  // namespace simflex
