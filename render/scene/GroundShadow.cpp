#include "GroundShadow.h"

#include <algorithm>
#include <cmath>

namespace simflex {

namespace {

// exp(−k²/12.5) for k = 0 … 8, in 4096ths of the sum over −8 … 8.
constexpr std::uint32_t shadowWeights[GroundShadow::reach + 1] = {654, 604, 475, 318, 182,
                                                                  88,  37,  13,  4};
constexpr std::uint32_t wholeWeight = 654 + 2 * (604 + 475 + 318 + 182 + 88 + 37 + 13 + 4);
static_assert(wholeWeight == 4096);

}  // namespace

void GroundShadow::clear() {
    covered.assign(std::size_t(stride) * stride, 0);
    box = {};
}

// Fills texels whose centres are inside.
void GroundShadow::fill(const float* a, const float* b, const float* c) {
    const float low = std::min({a[1], b[1], c[1]}), high = std::max({a[1], b[1], c[1]});
    const int bottom = std::max(0, int(std::ceil(low - 0.5f)));
    const int top = std::min(size, int(std::ceil(high - 0.5f)));
    for (int row = bottom; row < top; ++row) {
        const float y = float(row) + 0.5f;
        float left = float(size), right = 0;
        const auto cut = [&](const float* p, const float* q) {
            if ((p[1] <= y) == (q[1] <= y)) return;
            const float x = p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
            left = std::min(left, x);
            right = std::max(right, x);
        };
        cut(a, b);
        cut(b, c);
        cut(c, a);
        const int first = std::max(0, int(std::ceil(left - 0.5f)));
        const int end = std::min(size, int(std::ceil(right - 0.5f)));
        if (first >= end) continue;
        std::fill_n(&covered[std::size_t(row + reach) * stride + std::size_t(first + reach)],
                    end - first, 1u);
        box.left = std::min(box.left, first);
        box.right = std::max(box.right, end);
        box.bottom = std::min(box.bottom, row);
        box.top = std::max(box.top, row + 1);
    }
}

void GroundShadow::add(const SurfaceGeometry& geometry, const ToTexel& m) {
    const std::size_t numVertices = std::size_t(geometry.numVertices());
    places.resize(2 * numVertices);
    const float* p = geometry.vertices.data();
    for (std::size_t i = 0; i < numVertices; ++i, p += SurfaceGeometry::floatsPerVertex)
        for (std::size_t k = 0; k < 2; ++k)
            places[2 * i + k] = m[k] * p[0] + m[2 + k] * p[1] + m[4 + k] * p[2] + m[6 + k];
    for (std::size_t t = 0; t + 2 < geometry.triangles.size(); t += 3) {
        const float *a = &places[2 * geometry.triangles[t]],
                    *b = &places[2 * geometry.triangles[t + 1]],
                    *c = &places[2 * geometry.triangles[t + 2]];
        const float area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (geometry.isClosed ? area > 0 : area != 0) fill(a, b, c);
    }
}

void GroundShadow::blur() {
    texels.assign(std::size_t(size) * size, 0);
    if (box.isEmpty()) return;
    box.left = std::max(0, box.left - reach);
    box.right = std::min(size, box.right + reach);
    const std::size_t width = std::size_t(box.right - box.left);
    blurred.assign(std::size_t(stride) * stride, 0);
    for (int row = box.bottom; row < box.top; ++row) {
        const std::size_t begin = std::size_t(row + reach) * stride + std::size_t(box.left + reach);
        const std::uint32_t* const from = &covered[begin];
        std::uint32_t* const to = &blurred[begin];
        for (std::size_t x = 0; x < width; ++x) to[x] = shadowWeights[0] * from[x];
        for (int k = 1; k <= reach; ++k)
            for (std::size_t x = 0; x < width; ++x)
                to[x] += shadowWeights[k] * (*(from + x - k) + *(from + x + k));
    }
    box.bottom = std::max(0, box.bottom - reach);
    box.top = std::min(size, box.top + reach);
    std::vector<std::uint32_t> sums(width);
    for (int row = box.bottom; row < box.top; ++row) {
        const std::uint32_t* const from =
            &blurred[std::size_t(row + reach) * stride + std::size_t(box.left + reach)];
        for (std::size_t x = 0; x < width; ++x) sums[x] = shadowWeights[0] * from[x];
        for (int k = 1; k <= reach; ++k)
            for (std::size_t x = 0; x < width; ++x)
                sums[x] += shadowWeights[k] * (*(from + x - k * stride) + *(from + x + k * stride));
        std::uint8_t* const to = &texels[std::size_t(row) * size + std::size_t(box.left)];
        for (std::size_t x = 0; x < width; ++x)
            to[x] = std::uint8_t((255 * sums[x] + (1u << 23)) >> 24);
    }
}

}  // namespace simflex
