#pragma once
/** @file
Eight doubles at a time (private header). The compiler maps them onto what the machine has; the
order of operations is fixed, so that results are the same to the bit at any address. **/

#include <cstring>

namespace simflex {

constexpr int ChunkSize = 8;

constexpr int roundUpToChunks(int size) {
    return (size + ChunkSize - 1) / ChunkSize * ChunkSize;
}

using Chunk = double __attribute__((vector_size(8 * ChunkSize)));

inline Chunk loadChunk(const double* values) {
    Chunk chunk;
    std::memcpy(&chunk, values, sizeof chunk);
    return chunk;
}

/** The first `count` of eight values, then zeros; nothing behind them is read. **/
inline Chunk loadChunk(const double* values, int count) {
    if (count == ChunkSize) return loadChunk(values);
    double padded[ChunkSize];
    for (int k = 0; k < ChunkSize; ++k) padded[k] = k < count ? values[k] : 0.0;  // a masked load
    return loadChunk(padded);
}

inline void storeChunk(const Chunk& chunk, double* values) {
    std::memcpy(values, &chunk, sizeof chunk);
}

inline void storeChunk(const Chunk& chunk, double* values, int count) {
    if (count == ChunkSize) return storeChunk(chunk, values);
    double padded[ChunkSize];
    storeChunk(chunk, padded);
    for (int k = 0; k < ChunkSize; ++k)
        if (k < count) values[k] = padded[k];
}

inline double sumChunk(const Chunk& chunk) {
    return ((chunk[0] + chunk[1]) + (chunk[2] + chunk[3])) +
           ((chunk[4] + chunk[5]) + (chunk[6] + chunk[7]));
}

}  // namespace simflex
