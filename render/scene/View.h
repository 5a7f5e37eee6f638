#pragma once
/** @file
A CameraView fitted to a scene. Internal to the renderer. **/

#include <functional>
#include <vector>

#include "Camera.h"
#include "simflex/render/CameraView.h"

namespace simflex {

/** Bounding sphere of a motion, with its up and front directions. **/
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
    /** Returns the poses of mobilized bodies at one time. **/
    using BodyPose = std::function<SimTK::Transform(int body)>;
    /** Returns the drawn poses of attachment frames. **/
    using FramePose = std::function<SimTK::Transform(const Attachment& frame)>;

    View() = default;
    explicit View(const CameraView& settings) : view(settings) {}

    CameraView& updSettings() { return view; }
    const std::string& getCaption() const { return view.caption; }
    bool isFollowing() const { return view.followedBody.isValid(); }
    bool isOrthographic() const { return view.projection == CameraView::Projection::Orthographic; }
    /** Returns whether the camera is placed so that everything is visible: neither fixed nor
    following. **/
    bool keepsSceneInPicture() const {
        return view.placement != CameraView::Placement::Fixed && !isFollowing();
    }
    bool fitsClippingPlanes() const { return !view.areClippingPlanesFixed; }

    /** Returns the view's part of the frame: left, top, width, height as fractions; by default that
    of view `index` of `numViews`. **/
    SimTK::Vec4 calcRectangle(int index, int numViews) const;
    bool hasRectangle() const { return view.hasRectangle; }

    /** Returns the pose of the frame that the camera follows, without its rotation for
    Follow::Position; Ground's if it follows nothing. **/
    SimTK::Transform calcFollowedPose(const BodyPose& bodyPose, const FramePose& framePose) const;

    /** Places the camera for a motion, given the bounds and calcFollowedPose() of each frame. **/
    void fit(const SceneExtent& scene, const std::vector<std::vector<SimTK::Vec3>>& bounds_G,
             const std::vector<SimTK::Transform>& X_GF, double aspect, const Margins& margins);

    /** Returns the camera of a frame, with the followed body at X_GF. **/
    Camera calcCamera(double time, const SimTK::Transform& X_GF) const;

    /** Returns the camera of the first frame. **/
    const Camera& getCamera() const { return camera; }

    /** Sets the camera's pose without fitting it again. **/
    void setTransform(const SimTK::Transform& X_GC);
    /** Rotates the camera at its position, which becomes fixed. **/
    void pointAt(const SimTK::Vec3& point_G, const SimTK::Vec3& up_G);
    /** Keeps the camera's orientation and lets its position be fitted. **/
    void keepRotationOnly();

private:
    double calcFieldOfView() const;

    CameraView view;
    Camera camera;                 // at the first frame
    SimTK::Transform X_GF0, X_FC;  // pose of the followed frame, and camera pose in it
    SimTK::Vec3 center_G{0};
    SimTK::UnitVec3 up{SimTK::YAxis};
};

}  // namespace simflex
