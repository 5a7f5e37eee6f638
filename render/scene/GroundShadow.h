#pragma once
/** @file
The soft shadow that things cast along the light onto a plane. Internal to the renderer.

A square picture of the plane in which triangles are filled and then blurred by a Gaussian, all in
whole numbers: a small picture costs less so than a rasterizer that is made for large ones.

    shadow.clear();
    shadow.add(geometry, toTexel);
    shadow.blur();
**/

#include <array>
#include <cstdint>
#include <vector>

#include "SurfaceGeometry.h"

namespace simflex {

class GroundShadow {
public:
    static constexpr int size = 256;  ///< texels on a side
    static constexpr int reach = 8;   ///< of the blur, standard deviation 2.5 [texels]

    /** Columns of the affine map from a geometry's coordinates to texels: x, y of the images of its
    axes, then of its origin. **/
    using ToTexel = std::array<float, 8>;

    void clear();
    /** Fills the triangles' texels; of closed surfaces one side is enough. O(triangles). **/
    void add(const SurfaceGeometry& geometry, const ToTexel& toTexel);
    void blur();

    /** 0 … 255, the lowest row first, size² of them. **/
    const std::vector<std::uint8_t>& getTexels() const { return texels; }

    /** Texels outside of it are 0: left, bottom, right, top, the latter two exclusive. **/
    struct Box {
        int left = size, bottom = size, right = 0, top = 0;
        bool isEmpty() const { return left >= right || bottom >= top; }
    };
    const Box& getBox() const { return box; }

private:
    void fill(const float* a, const float* b, const float* c);

    // Rows have room for the blur on both sides, and there are rows before and behind.
    static constexpr int stride = size + 2 * reach;
    std::vector<std::uint32_t> covered, blurred;
    std::vector<float> places;  // of vertices
    std::vector<std::uint8_t> texels;
    Box box;
};

}  // namespace simflex
