#pragma once
/** @file
Pose and projection of the camera. Frame C as in Simbody: x right, y up, looking along −z. Internal
to the renderer. **/

#include <array>
#include <vector>

#include "SimTKcommon.h"

namespace simflex {

/** Space between the scene and the edges of the picture, as fractions of its size. **/
struct Margins {
    double left = 0.05, right = 0.05, top = 0.08, bottom = 0.08;
};

struct Camera {
    SimTK::Transform X_GC{SimTK::Vec3(0, 0, 1)};
    bool isOrthographic = false;
    double fieldOfView = SimTK::Pi / 6;  ///< vertical, of a perspective [rad]
    double viewHeight = 1;               ///< visible height of an orthographic camera [m]
    double nearPlane = 0.01;             ///< distances along −z [m]
    double farPlane = 100;

    /** Returns the location in the camera frame; z is negative in front of the camera. **/
    SimTK::Vec3 toCamera(const SimTK::Vec3& p_G) const { return ~X_GC * p_G; }

    /** Returns column, row (from the top, in pixels) and distance along the view direction. **/
    SimTK::Vec3 calcPixel(const SimTK::Vec3& p_G, int width, int height) const;

    /** Returns the size of a pixel at a distance along the view direction [m], in a picture of this
    height. **/
    double calcPixelSize(double distance, int height) const;

    /** Returns the projection matrix, column-major. **/
    std::array<float, 16> calcProjection(double aspect) const;

    /** Moves the camera, without rotating it, so that all points just fit into the picture, or so
    that the picture is `zoom` times larger about the same centre. **/
    void fit(const std::vector<SimTK::Vec3>& points_G, double aspect, const Margins& margins,
             double zoom = 1);

    void fitClippingPlanes(const std::vector<SimTK::Vec3>& points_G);

    /** Rotates the camera at its position to look at a point.
    @throws std::invalid_argument if the point is at the camera. **/
    void pointAt(const SimTK::Vec3& point_G, const SimTK::Vec3& up_G);
};

/** Returns the rotation R_GC of a camera that sees the scene from azimuth (about `up`, from `front`
towards the right) and elevation above the horizon [rad]. **/
SimTK::Rotation calcViewRotation(const SimTK::UnitVec3& up, const SimTK::UnitVec3& front,
                                 double azimuth, double elevation);

}  // namespace simflex
