#pragma once
/** @file
Light on points of surfaces, many at a time: what shaders::lighting has in GLSL. Internal to the
rasterizer. **/

#include <cstdint>

#include <Eigen/Core>

#include "simflex/render/scene/Camera.h"
#include "simflex/render/scene/FrameStyle.h"

namespace simflex {
namespace raster {

/** In camera frame. **/
struct Light {
    float up[3], key[3];

    Light(const Camera& camera, const FrameStyle& style);
};

/** Red, green, blue, alpha as bytes from the lowest. **/
inline std::uint32_t packColor(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t a) {
    return r | g << 8 | b << 16 | a << 24;
}

class LitPoints {
public:
    static constexpr int most = 64;
    using Lanes = Eigen::Array<float, most, 1>;

    Lanes normal[3];  ///< towards the viewer's side, of any length
    Lanes view[3];    ///< towards the viewer, of any length
    Lanes base[3];    ///< colour
    Lanes opacity;    ///< of ghosts
    std::uint32_t colors[most];

    LitPoints();

    /** Fills `colors` of the first `number`, opaque. **/
    void lightSurfaces(const Light& light, int number);
    /** With alpha, colours not multiplied by it. **/
    void lightGhosts(int number);

private:
    void normalize();
    void pack(const Lanes* color, const Lanes& alpha, int number);
};

}  // namespace raster
}  // namespace simflex
