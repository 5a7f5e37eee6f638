#include "simflex/render/FrameController.h"

#include <cmath>
#include <stdexcept>

namespace simflex {

using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

OffscreenVisualizer::BodyFollower::BodyFollower(const SimTK::MobilizedBody& body,
                                                const Vec3& station_B, const Vec3& offset,
                                                const UnitVec3& upDirection)
    : mobod(body), station(station_B), cameraOffset(offset), up(upDirection) {
    if (offset.norm() == 0)
        throw std::invalid_argument("BodyFollower: the offset of the camera has no length");
}

void OffscreenVisualizer::BodyFollower::generateControls(
    const OffscreenVisualizer& visualizer, const SimTK::State& state,
    SimTK::Array_<SimTK::DecorativeGeometry>&) {
    const UnitVec3 systemUp(visualizer.getSystemUpDirection());
    const double height = visualizer.getGroundHeight();
    const Vec3 offset =
        cameraOffset.isFinite()
            ? cameraOffset
            : Vec3(1, 1, 1) + (std::isfinite(height) ? height : 0.0) * Vec3(systemUp);
    const Vec3 target = mobod.findStationLocationInGround(state, station);
    visualizer.setCameraTransform(Transform(target + offset));
    visualizer.pointCameraAt(target, up.isFinite() ? Vec3(up) : Vec3(systemUp));
}

}  // namespace simflex
