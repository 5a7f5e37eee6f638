#pragma once
/** @file
Camera, style and pixel range of a picture or a band of its rows. Internal to the renderer. **/

#include <array>
#include <vector>

#include "simflex/render/scene/Camera.h"
#include "simflex/render/scene/FrameStyle.h"

namespace simflex {

struct GlView {
    /** Rows are counted from the bottom of the picture, as in OpenGL. **/
    GlView(const Camera& camera, const FrameStyle& style, int width, int height, int bottom,
           int rows);

    const Camera& camera;
    const FrameStyle& style;
    int width, height;                 ///< of the whole picture [pixel]
    int bottom, rows;                  ///< the band that is drawn
    std::array<float, 16> projection;  ///< camera frame to band
    bool isPerspective;

    /** Returns the pixel size at distance 1 of a perspective, and at any distance of a parallel
    projection; the other is 0 [m]. **/
    SimTK::Vec2 calcPixelSize() const;

    /** Returns a factor and an offset in z that move a point towards the viewer by this many pixel
    sizes, at the same position in the picture. **/
    SimTK::Vec2 calcShift(double numPixels) const;

    double getAspect() const { return double(width) / height; }

    /** Restricts a projection of the whole picture to the band. **/
    std::array<float, 16> cut(std::array<float, 16> wholeProjection) const;

    SimTK::Transform toCamera(const SimTK::Transform& X_GM) const { return ~camera.X_GC * X_GM; }
    SimTK::Vec3 toCamera(const SimTK::Vec3& p_G) const { return camera.toCamera(p_G); }
};

/** Part of a band [pixel, from its lower left corner]. **/
struct GlRectangle {
    int left = 0, bottom = 0, right = 0, top = 0;

    bool isEmpty() const { return left >= right || bottom >= top; }
    bool overlaps(const GlRectangle& other) const;
    void include(const GlRectangle& other);
};

/** Returns the rectangle in the band covered by the convex hull of the points, plus `padding`
pixels; the whole band if a point is not in front of the camera. **/
GlRectangle calcCoveredRectangle(const GlView& view, const std::vector<SimTK::Vec3>& points_G,
                                 int padding);

/** Returns the column-major matrix of a pose after scaling along the axes. **/
std::array<float, 16> calcModelView(const SimTK::Transform& X, const SimTK::Vec3& scale);

/** Returns the matrix that transforms normals: the cofactors of rotation and scale, in the range of
floats. **/
std::array<float, 9> calcNormalMatrix(const SimTK::Rotation& R, const SimTK::Vec3& scale);

}  // namespace simflex
