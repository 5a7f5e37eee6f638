#pragma once
/** @file
Products of tall matrices in single precision, such as Φξ of a skin; internal to the renderer. Rows
are processed in chunks of a fixed size, so results are bit-identical for any number of threads. **/

#include <cstddef>

namespace simflex {

/** y = matrix·x, matrix rows×columns, column-major with `stride` ≥ rows between columns. **/
void multiplySkin(const float* matrix, std::size_t rows, std::size_t stride, int columns,
                  const float* x, float* y);

/** Chunk size of loops divided among threads. **/
constexpr std::ptrdiff_t skinChunk = 4096;

/** Calls work(first, end) for chunks of 0…count−1, in parallel if `cost`, the total number of
floating-point values moved, is worth waking threads for. work() must write to its own range only,
and not throw. **/
template <class Work>
void forSkinChunks(std::size_t count, std::size_t cost, const Work& work) {
    const std::ptrdiff_t chunks = (std::ptrdiff_t(count) + skinChunk - 1) / skinChunk;
    // Smaller loops finish before the rasterizer's threads have yielded the processors.
    [[maybe_unused]] const bool isLarge = cost > 2000000;
#pragma omp parallel for schedule(static) if (isLarge)
    for (std::ptrdiff_t chunk = 0; chunk < chunks; ++chunk) {
        const std::size_t first = std::size_t(chunk * skinChunk);
        const std::size_t end = first + std::size_t(skinChunk);
        work(first, end < count ? end : count);
    }
}

}  // namespace simflex
