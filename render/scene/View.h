#pragma once
/** @file
A CameraView that has been fitted to a scene. Internal to the renderer. **/

#include <functional>
#include <vector>

#include "Camera.h"
#include "simflex/render/CameraView.h"

namespace simflex {

/** The ball around all of a motion, and what is up and front. **/
struct SceneExtent {
    SimTK::Vec3 center_G{0};
    double radius = 1;
    double lowest = 0;  ///< smallest coordinate along `up` [m]
    SimTK::UnitVec3 up{SimTK::YAxis}, front{SimTK::ZAxis};
};

SceneExtent calcSceneExtent(const std::vector<SimTK::Vec3>& bounds_G, const SimTK::UnitVec3& up,
                            const SimTK::UnitVec3& front);

class View {
public:
    /** Poses of mobilized bodies at one time. **/
    using BodyPose = std::function<SimTK::Transform(int body)>;
    /** Poses of attachment frames as they are drawn. **/
    using FramePose = std::function<SimTK::Transform(const Attachment& frame)>;

    View() = default;
    explicit View(const CameraView& settings) : view(settings) {}

    CameraView& updSettings() { return view; }
    const std::string& getCaption() const { return view.caption; }
    bool isFollowing() const { return view.followedBody.isValid(); }
    bool isOrthographic() const { return view.projection == CameraView::Projection::Orthographic; }
    /** Neither fixed nor following: its place is found so that all is seen. **/
    bool keepsSceneInPicture() const {
        return view.placement != CameraView::Placement::Fixed && !isFollowing();
    }
    bool fitsClippingPlanes() const { return !view.areClippingPlanesFixed; }

    /** Its part of the frame: left, top, width, height as fractions; that of view `index` of
    `numViews` unless one was given. **/
    SimTK::Vec4 calcRectangle(int index, int numViews) const;
    bool hasRectangle() const { return view.hasRectangle; }

    /** Pose of the frame that the camera goes along with: what is followed, or its origin
    without its rotation; Ground's for a camera that follows nothing. **/
    SimTK::Transform calcFollowedPose(const BodyPose& bodyPose, const FramePose& framePose) const;

    /** Places the camera for a motion: bounds of each frame, and calcFollowedPose() in it. **/
    void fit(const SceneExtent& scene, const std::vector<std::vector<SimTK::Vec3>>& bounds_G,
             const std::vector<SimTK::Transform>& X_GF, double aspect, const Margins& margins);

    /** The camera of a frame, with the followed body where X_GF says. **/
    Camera calcCamera(double time, const SimTK::Transform& X_GF) const;

    /** The camera of the first frame. **/
    const Camera& getCamera() const { return camera; }

    /** Makes this the camera's place, without fitting it again. **/
    void setTransform(const SimTK::Transform& X_GC);
    /** Turns the camera where it stands, which then is its fixed place. **/
    void pointAt(const SimTK::Vec3& point_G, const SimTK::Vec3& up_G);
    /** Keeps the camera's orientation, lets it go where all is seen. **/
    void keepRotationOnly();

private:
    double calcFieldOfView() const;

    CameraView view;
    Camera camera;                 // at the first frame
    SimTK::Transform X_GF0, X_FC;  // of the followed frame, and in it
    SimTK::Vec3 center_G{0};
    SimTK::UnitVec3 up{SimTK::YAxis};
};

}  // namespace simflex
