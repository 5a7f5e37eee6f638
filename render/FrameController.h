#pragma once
/** @file
Moves the camera or adds geometry just before each frame, as SimTK::Visualizer::FrameController
does, which requires a window. **/

#include "Simbody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

class OffscreenVisualizer::FrameController {
public:
    virtual ~FrameController() = default;

    /** Called once per frame with its State, realized at least to Stage::Position. Geometry
    appended to `geometry` is drawn; the visualizer's const methods may be called. **/
    virtual void generateControls(const OffscreenVisualizer& visualizer, const SimTK::State& state,
                                  SimTK::Array_<SimTK::DecorativeGeometry>& geometry) = 0;
};

/** Keeps the camera at an offset from a station on a body, pointed at it. **/
class OffscreenVisualizer::BodyFollower : public OffscreenVisualizer::FrameController {
public:
    /** `offset` [m] from the station to the camera, in Ground; NaN: (1, 1, 1) plus the height of
    the ground along the up direction. `upDirection` of the picture; NaN: the system's.
    @throws std::invalid_argument if the offset has zero length. **/
    explicit BodyFollower(const SimTK::MobilizedBody& body,
                          const SimTK::Vec3& station_B = SimTK::Vec3(0),
                          const SimTK::Vec3& offset = SimTK::Vec3(SimTK::NaN),
                          const SimTK::UnitVec3& upDirection = SimTK::UnitVec3());

    void generateControls(const OffscreenVisualizer& visualizer, const SimTK::State& state,
                          SimTK::Array_<SimTK::DecorativeGeometry>& geometry) override;

private:
    SimTK::MobilizedBody mobod;  // a handle
    SimTK::Vec3 station;
    SimTK::Vec3 cameraOffset;
    SimTK::UnitVec3 up;
};

}  // namespace simflex
