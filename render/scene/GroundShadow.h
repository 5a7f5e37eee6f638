#pragma once
/** @file
The soft shadow cast along the light onto a plane. Internal to the renderer.

Triangles are filled into a square picture of the plane, which is then blurred by a Gaussian, in
integer arithmetic: for such a small picture this is faster than a general rasterizer.

    shadow.clear();
    shadow.add(geometry, toTexel);
    shadow.blur();  **/

#include <array>
#include <cstdint>
#include <vector>

#include "SurfaceGeometry.h"

namespace simflex {

class GroundShadow {
public:
    static constexpr int size = 256;  ///< texels on a side
    static constexpr int reach = 8;   ///< radius of the blur, standard deviation 2.5 [texels]

    /** Affine map from a geometry's coordinates to texels: x, y of the images of its axes, then of
    its origin. **/
    using ToTexel = std::array<float, 8>;

    void clear();
    /** Fills the triangles' texels; one side of a closed surface is enough. O(triangles). **/
    void add(const SurfaceGeometry& geometry, const ToTexel& toTexel);
    void blur();

    /** Returns size² values 0 … 255, lowest row first. **/
    const std::vector<std::uint8_t>& getTexels() const { return texels; }

    /** Bounds of the non-zero texels; right and top are exclusive. **/
    struct Box {
        int left = size, bottom = size, right = 0, top = 0;
        bool isEmpty() const { return left >= right || bottom >= top; }
    };
    const Box& getBox() const { return box; }

private:
    void fill(const float* a, const float* b, const float* c);

    // Rows and the picture are padded on both sides for the blur.
    static constexpr int stride = size + 2 * reach;
    std::vector<std::uint32_t> covered, blurred;
    std::vector<float> places;  // of vertices
    std::vector<std::uint8_t> texels;
    Box box;
};

}  // namespace simflex
