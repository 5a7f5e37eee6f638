#pragma once
/** @file
A camera of an OffscreenVisualizer: its position, motion and part of the frame.

@code
    viz.addView(simflex::CameraView("pin").setFollowedBody(crank.getFrame(), 0.05));
    viz.addView(simflex::CameraView("from above").setDirection(0, Pi / 2).setOrthographic());
@endcode

Frame C: x right, y up, looking along −z. Unless a position is set, the camera is placed so that the
whole motion given to OffscreenVisualizer::fitToMotion(), or the first frame, just fits into its
picture. **/

#include <optional>
#include <string>

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"
#include "simflex/body/Attachment.h"

namespace simflex {

class CameraView {
public:
    enum class Projection { Perspective, Orthographic };
    /** How a camera follows a body: keeping its own orientation, or rotating with the body. **/
    enum class Follow { Position, Pose };

    CameraView() = default;
    /** A view with a caption in the upper left corner. **/
    explicit CameraView(const std::string& text) : caption(text) {}

    /** Sets the direction from which the scene is seen, fitted: azimuth from the front to the right
    and elevation above the horizon [rad]. Default: 25 and 16 degrees. **/
    CameraView& setDirection(SimTK::Real azimuth, SimTK::Real elevation);
    /** Sets a fixed pose; with a followed body, the pose at the first frame. **/
    CameraView& setTransform(const SimTK::Transform& X_GC);
    /** Makes the camera circle the scene with time [rad/s of simulation]; 0 stops it. **/
    CameraView& setOrbit(SimTK::Real rate);
    /** Follows a body.
    @param size visible height at the body's distance [m]; 0: the whole scene, in its positions
    relative to the body during the motion, just fits.
    @throws std::invalid_argument unless size is finite and not negative. **/
    CameraView& setFollowedBody(SimTK::MobilizedBodyIndex body, SimTK::Real size = 0,
                                Follow follow = Follow::Position);
    /** Follows an attachment frame, on a flexible part with its drawn (exaggerated) deformation:
    the frame's origin stays at a fixed position in the picture. **/
    CameraView& setFollowedFrame(const Attachment& frame, SimTK::Real size = 0,
                                 Follow follow = Follow::Position);
    /** Default: perspective. **/
    CameraView& setProjection(Projection projection);
    CameraView& setOrthographic() { return setProjection(Projection::Orthographic); }
    /** Sets the vertical field of view of a perspective [rad]. Default: 30 degrees, but 45 degrees
    from a fixed pose, as in Simbody's own window. In the orthographic view of a fixed camera it
    determines the visible height at the scene's distance.
    @throws std::invalid_argument unless between 0 and pi. **/
    CameraView& setFieldOfView(SimTK::Real fov);
    /** @throws std::invalid_argument unless 0 < near < far. **/
    CameraView& setClippingPlanes(SimTK::Real nearPlane, SimTK::Real farPlane);
    /** Magnifies the picture of a fitted camera relative to a just fitting one; default 1.
    @throws std::invalid_argument unless positive. **/
    CameraView& setZoom(SimTK::Real zoom);
    CameraView& setCaption(const std::string& text);
    /** Sets the view's part of the frame, as fractions of width and height from the upper left
    corner. By default the views share the frame evenly: two side by side, three with the first one
    large, more in a grid.
    @throws std::invalid_argument unless inside the frame and not empty. **/
    CameraView& setRectangle(SimTK::Real left, SimTK::Real top, SimTK::Real width,
                             SimTK::Real height);

private:
    friend class View;
    enum class Placement { Direction, Fixed, FixedRotation };

    Placement placement = Placement::Direction;
    SimTK::Transform X_GC{SimTK::Vec3(0, 0, 1)};
    SimTK::Real azimuth = 25 * SimTK::Pi / 180, elevation = 16 * SimTK::Pi / 180;
    SimTK::Real orbitRate = 0;
    SimTK::MobilizedBodyIndex followedBody;
    std::optional<Attachment> followedFrame;  // replaces the body
    Follow follow = Follow::Position;
    SimTK::Real followedSize = 0;
    Projection projection = Projection::Perspective;
    SimTK::Real fieldOfView = 0;  // 0: default of the placement
    bool areClippingPlanesFixed = false;
    SimTK::Real nearPlane = 0.01, farPlane = 100;
    SimTK::Real zoom = 1;
    std::string caption;
    bool hasRectangle = false;
    SimTK::Vec4 rectangle{0, 0, 1, 1};  // left, top, width, height
};

}  // namespace simflex
