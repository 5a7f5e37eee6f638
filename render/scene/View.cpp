#include "View.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simflex {

using SimTK::Real;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;
using SimTK::Vec4;

CameraView& CameraView::setDirection(Real azimuthAngle, Real elevationAngle) {
    azimuth = azimuthAngle;
    elevation = elevationAngle;
    placement = Placement::Direction;
    return *this;
}

CameraView& CameraView::setTransform(const Transform& pose_G) {
    X_GC = pose_G;
    placement = Placement::Fixed;
    return *this;
}

CameraView& CameraView::setOrbit(Real rate) {
    orbitRate = rate;
    return *this;
}

CameraView& CameraView::setFollowedBody(SimTK::MobilizedBodyIndex body, Real size, Follow how) {
    if (!(size >= 0) || !std::isfinite(size))
        throw std::invalid_argument("setFollowedBody: size " + std::to_string(size) +
                                    " is not a finite length >= 0");
    followedFrame.reset();
    followedBody = body;
    followedSize = size;
    follow = how;
    return *this;
}

CameraView& CameraView::setFollowedFrame(const Attachment& frame, Real size, Follow how) {
    setFollowedBody(frame.getMobilizedBodyIndex(), size, how);
    followedFrame = frame;
    return *this;
}

CameraView& CameraView::setProjection(Projection kind) {
    projection = kind;
    return *this;
}

CameraView& CameraView::setFieldOfView(Real fov) {
    if (!(fov > 0 && fov < SimTK::Pi))
        throw std::invalid_argument("setCameraFieldOfView: " + std::to_string(fov) +
                                    " is not between 0 and pi");
    fieldOfView = fov;
    return *this;
}

CameraView& CameraView::setClippingPlanes(Real nearDistance, Real farDistance) {
    if (!(nearDistance > 0 && farDistance > nearDistance))
        throw std::invalid_argument("setCameraClippingPlanes: need 0 < near < far, not " +
                                    std::to_string(nearDistance) + " and " +
                                    std::to_string(farDistance));
    nearPlane = nearDistance;
    farPlane = farDistance;
    areClippingPlanesFixed = true;
    return *this;
}

CameraView& CameraView::setZoom(Real factor) {
    if (!(factor > 0) || !std::isfinite(factor))
        throw std::invalid_argument("setZoom: " + std::to_string(factor) + " is not positive");
    zoom = factor;
    return *this;
}

CameraView& CameraView::setCaption(const std::string& text) {
    caption = text;
    return *this;
}

CameraView& CameraView::setRectangle(Real left, Real top, Real width, Real height) {
    constexpr Real tolerance = 1e-6;
    if (!(left >= 0 && top >= 0 && width > 0 && height > 0 && left + width <= 1 + tolerance &&
          top + height <= 1 + tolerance))
        throw std::invalid_argument("setRectangle: " + Vec4(left, top, width, height).toString() +
                                    " is not inside the frame, (0, 0, 1, 1)");
    rectangle = Vec4(left, top, width, height);
    hasRectangle = true;
    return *this;
}

SceneExtent calcSceneExtent(const std::vector<Vec3>& bounds_G, const UnitVec3& up,
                            const UnitVec3& front) {
    SceneExtent scene;
    scene.up = up;
    scene.front = front;
    if (bounds_G.empty()) return scene;
    Vec3 lower = bounds_G[0], upper = bounds_G[0];
    scene.lowest = SimTK::Infinity;
    for (const Vec3& p : bounds_G) {
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k]);
            upper[k] = std::max(upper[k], p[k]);
        }
        scene.lowest = std::min(scene.lowest, SimTK::dot(Vec3(up), p));
    }
    scene.center_G = 0.5 * (lower + upper);
    scene.radius = 0.5 * (upper - lower).norm();
    if (!(scene.radius > 0)) scene.radius = std::max(1e-3, 0.1 * scene.center_G.norm());
    return scene;
}

Vec4 View::calcRectangle(int index, int numViews) const {
    if (view.hasRectangle) return view.rectangle;
    if (numViews <= 1) return Vec4(0, 0, 1, 1);
    if (numViews == 3) {
        constexpr Real large = 0.64;
        if (index == 0) return Vec4(0, 0, large, 1);
        return Vec4(large, index == 1 ? 0 : 0.5, 1 - large, 0.5);
    }
    const int columns = int(std::ceil(std::sqrt(double(numViews))));
    const int rows = (numViews + columns - 1) / columns;
    return Vec4(Real(index % columns) / columns, Real(index / columns) / rows, 1.0 / columns,
                1.0 / rows);
}

Transform View::calcFollowedPose(const BodyPose& bodyPose, const FramePose& framePose) const {
    if (!isFollowing()) return Transform();
    const Transform X_GF =
        view.followedFrame ? framePose(*view.followedFrame) : bodyPose(view.followedBody);
    return view.follow == CameraView::Follow::Pose ? X_GF : Transform(X_GF.p());
}

double View::calcFieldOfView() const {
    if (view.fieldOfView > 0) return view.fieldOfView;
    return (view.placement == CameraView::Placement::Fixed ? 45 : 30) * SimTK::Pi / 180;
}

void View::fit(const SceneExtent& scene, const std::vector<std::vector<Vec3>>& bounds_G,
               const std::vector<Transform>& X_GF, double aspect, const Margins& margins) {
    using Placement = CameraView::Placement;
    center_G = scene.center_G;
    up = scene.up;
    camera.fieldOfView = calcFieldOfView();
    camera.isOrthographic = isOrthographic();
    if (view.placement == Placement::Direction)
        camera.X_GC.updR() = calcViewRotation(scene.up, scene.front, view.azimuth, view.elevation);
    else if (view.placement == Placement::FixedRotation)
        camera.X_GC.updR() = view.X_GC.R();
    else
        camera.X_GC = view.X_GC;

    X_GF0 = X_GF.empty() ? Transform() : X_GF.front();
    if (view.placement == Placement::Fixed) {
        const double distance = std::max(-camera.toCamera(scene.center_G)[2], 1e-3 * scene.radius);
        camera.viewHeight = 2 * distance * std::tan(camera.fieldOfView / 2);
    } else if (isFollowing() && view.followedSize > 0) {
        const double size = view.followedSize / view.zoom;
        camera.viewHeight = size;
        const double distance = camera.isOrthographic
                                    ? 2 * scene.radius
                                    : 0.5 * size / std::tan(camera.fieldOfView / 2);
        camera.X_GC.updP() = X_GF0.p() + distance * Vec3(camera.X_GC.R().z());
    } else {
        // A following camera is fitted to the scene relative to the body; a moving one must keep
        // the scene in its picture from all sides.
        std::vector<Vec3> points;
        for (std::size_t frame = 0; frame < bounds_G.size(); ++frame)
            for (const Vec3& p : bounds_G[frame])
                points.push_back(isFollowing() ? X_GF0 * (~X_GF[frame] * p) : p);
        if (points.empty() || view.orbitRate != 0) {
            const Vec3 front(scene.front), right = SimTK::cross(Vec3(up), front);
            for (int i = 0; i < 24; ++i)
                for (const double level : {-0.7, 0.0, 0.7}) {
                    const double angle = 2 * SimTK::Pi * i / 24;
                    points.push_back(center_G + scene.radius * (level * Vec3(up) +
                                                                std::sqrt(1 - level * level) *
                                                                    (std::cos(angle) * front +
                                                                     std::sin(angle) * right)));
                }
        }
        camera.fit(points, aspect, margins, view.zoom);
    }
    X_FC = ~X_GF0 * camera.X_GC;
}

Camera View::calcCamera(double time, const Transform& X_GF) const {
    Camera result = camera;
    result.nearPlane = view.nearPlane;
    result.farPlane = view.farPlane;
    if (isFollowing()) result.X_GC = X_GF * X_FC;
    if (view.orbitRate != 0) {
        const Rotation turn(view.orbitRate * time, up);
        const Vec3 middle = isFollowing() ? X_GF.p() : center_G;
        result.X_GC = Transform(turn * result.X_GC.R(), middle + turn * (result.X_GC.p() - middle));
    }
    return result;
}

void View::setTransform(const Transform& X_GC) {
    view.setTransform(X_GC);
    camera.X_GC = X_GC;
    camera.fieldOfView = calcFieldOfView();
    X_FC = ~X_GF0 * X_GC;
}

void View::pointAt(const Vec3& point_G, const Vec3& up_G) {
    camera.pointAt(point_G, up_G);
    setTransform(camera.X_GC);
}

void View::keepRotationOnly() {
    if (view.placement == CameraView::Placement::Fixed)
        view.placement = CameraView::Placement::FixedRotation;
}

}  // namespace simflex
