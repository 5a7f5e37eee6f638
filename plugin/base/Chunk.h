#pragma once
/** @file
Eight doubles at a time (private header). The compiler maps them onto what the machine has; the
order of operations is fixed, so that results are the same to the bit at any address. **/

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace simflex {

constexpr int ChunkSize = 8;

constexpr int roundUpToChunks(int size) {
    return (size + ChunkSize - 1) / ChunkSize * ChunkSize;
}

using Chunk = double __attribute__((vector_size(8 * ChunkSize)));
/** The same anywhere in memory. **/
using UnalignedChunk = double __attribute__((vector_size(8 * ChunkSize), aligned(8), may_alias));

inline Chunk loadChunk(const double* values) {
    return *reinterpret_cast<const UnalignedChunk*>(values);
}

/** The first `count` of eight values, then zeros; nothing behind them is read. **/
inline Chunk loadChunk(const double* values, int count) {
    if (count == ChunkSize) return loadChunk(values);
#ifdef __AVX512F__
    return _mm512_maskz_loadu_pd(__mmask8((1u << count) - 1), values);
#else
    double padded[ChunkSize];
    for (int k = 0; k < ChunkSize; ++k) padded[k] = k < count ? values[k] : 0.0;
    return loadChunk(padded);
#endif
}

inline void storeChunk(const Chunk& chunk, double* values) {
    *reinterpret_cast<UnalignedChunk*>(values) = chunk;
}

inline void storeChunk(const Chunk& chunk, double* values, int count) {
    if (count == ChunkSize) return storeChunk(chunk, values);
#ifdef __AVX512F__
    _mm512_mask_storeu_pd(values, __mmask8((1u << count) - 1), chunk);
#else
    double padded[ChunkSize];
    storeChunk(chunk, padded);
    for (int k = 0; k < ChunkSize; ++k)
        if (k < count) values[k] = padded[k];
#endif
}

inline double sumChunk(const Chunk& chunk) {
    return ((chunk[0] + chunk[1]) + (chunk[2] + chunk[3])) +
           ((chunk[4] + chunk[5]) + (chunk[6] + chunk[7]));
}

}  // namespace simflex
