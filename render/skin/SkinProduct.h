#pragma once
/** @file
Products of tall matrices in single precision, such as Φξ of a skin; internal to the renderer.

Rows are dealt with in chunks of a fixed size, so that results have the same bits for any number of
threads. **/

#include <cstddef>

namespace simflex {

/** y = matrix·x, matrix rows×columns, column-major with `stride` ≥ rows between columns. **/
void multiplySkin(const float* matrix, std::size_t rows, std::size_t stride, int columns,
                  const float* x, float* y);

/** Items of a loop that is divided among threads, and the size of the pieces. **/
constexpr std::ptrdiff_t skinChunk = 4096;

/** Calls work(first, end) for chunks of 0…count−1, in parallel where `cost` of all of them, in
floating point numbers moved, is worth waking threads for. work() must write to its own range only,
and not throw. **/
template <class Work>
void forSkinChunks(std::size_t count, std::size_t cost, const Work& work) {
    const std::ptrdiff_t chunks = (std::ptrdiff_t(count) + skinChunk - 1) / skinChunk;
    // Smaller loops are done before the threads that rasterize have given way.
    [[maybe_unused]] const bool isLarge = cost > 2000000;
#pragma omp parallel for schedule(static) if (isLarge)
    for (std::ptrdiff_t chunk = 0; chunk < chunks; ++chunk) {
        const std::size_t first = std::size_t(chunk * skinChunk);
        const std::size_t end = first + std::size_t(skinChunk);
        work(first, end < count ? end : count);
    }
}

}  // namespace simflex
