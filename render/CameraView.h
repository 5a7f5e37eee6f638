#pragma once
/** @file
One camera of an OffscreenVisualizer: where it stands, how it moves, what part of the frame it gets.

@code
    viz.addView(simflex::CameraView("pin").setFollowedBody(crank.getFrame(), 0.05));
    viz.addView(simflex::CameraView("from above").setDirection(0, Pi / 2).setOrthographic());
@endcode

Frame C: x right, y up, looking along −z. Until a place is given, the camera stands where all of the
motion given to OffscreenVisualizer::fitToMotion(), or of the first frame, just fits into its
picture.
**/

#include <optional>
#include <string>

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"
#include "simflex/body/Attachment.h"

namespace simflex {

class CameraView {
public:
    enum class Projection { Perspective, Orthographic };
    /** How a camera goes along with a body: keeping its orientation, or turning with the body. **/
    enum class Follow { Position, Pose };

    CameraView() = default;
    /** With a caption in the upper left corner of its picture. **/
    explicit CameraView(const std::string& text) : caption(text) {}

    /** Direction from which the scene is seen, fitted: azimuth from the front to the right and
    elevation above the horizon [rad]. Default: 25 and 16 degrees. **/
    CameraView& setDirection(SimTK::Real azimuth, SimTK::Real elevation);
    /** A fixed place. With a followed body, the place at the first frame. **/
    CameraView& setTransform(const SimTK::Transform& X_GC);
    /** Lets the camera circle about the scene with time [rad/s of simulation]; 0 stops it. **/
    CameraView& setOrbit(SimTK::Real rate);
    /** Goes along with a body.
    @param size height of what is seen at the body's distance [m]; 0: all of the scene, as it lies
        about the body during the motion, just fits.
    @throws std::invalid_argument unless size is finite and not negative. **/
    CameraView& setFollowedBody(SimTK::MobilizedBodyIndex body, SimTK::Real size = 0,
                                Follow follow = Follow::Position);
    /** The same with an attachment frame, on a flexible part as it is drawn, exaggerated: its
    origin stays at one place of the picture. **/
    CameraView& setFollowedFrame(const Attachment& frame, SimTK::Real size = 0,
                                 Follow follow = Follow::Position);
    /** Default: perspective. **/
    CameraView& setProjection(Projection projection);
    CameraView& setOrthographic() { return setProjection(Projection::Orthographic); }
    /** Vertical field of view of a perspective [rad]; default 30 degrees, but 45 degrees, as in
    Simbody's own window, from a fixed place. For the orthographic
    view of a fixed camera, the height of what is seen is that at the scene's distance.
    @throws std::invalid_argument unless between 0 and pi. **/
    CameraView& setFieldOfView(SimTK::Real fov);
    /** @throws std::invalid_argument unless 0 < near < far. **/
    CameraView& setClippingPlanes(SimTK::Real nearPlane, SimTK::Real farPlane);
    /** Makes what a fitted camera sees this many times larger than what just fits; default 1.
    @throws std::invalid_argument unless positive. **/
    CameraView& setZoom(SimTK::Real zoom);
    CameraView& setCaption(const std::string& text);
    /** Its part of the frame, as fractions of width and height from the upper left corner. Without
    it, the views share the frame evenly: two side by side, three with the first one large, more in
    a grid.
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
    std::optional<Attachment> followedFrame;  // instead of the body
    Follow follow = Follow::Position;
    SimTK::Real followedSize = 0;
    Projection projection = Projection::Perspective;
    SimTK::Real fieldOfView = 0;  // 0: as the placement has it
    bool areClippingPlanesFixed = false;
    SimTK::Real nearPlane = 0.01, farPlane = 100;
    SimTK::Real zoom = 1;
    std::string caption;
    bool hasRectangle = false;
    SimTK::Vec4 rectangle{0, 0, 1, 1};  // left, top, width, height
};

}  // namespace simflex
