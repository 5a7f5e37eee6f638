#pragma once
/** @file
A flexible part for the renderer: the part and functions that read its frame, its modal coordinates
and, for velocities, their rates from a State.

@code
    viz.addDeformableMesh({part, "rod",
        [&](const SimTK::State& s) { return rod.getFramePose(s); },
        [&](const SimTK::State& s) { return rod.getModalCoordinates(s); }});
@endcode **/

#include <functional>
#include <memory>
#include <string>

#include "SimTKcommon.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

struct DeformableMesh {
    std::shared_ptr<const ReducedBody> part;
    std::string name;  ///< of the body, for messages; empty: the part's name

    /** Pose X_GB of the part's mean-axis frame; the State is realized to Stage::Position. **/
    std::function<SimTK::Transform(const SimTK::State&)> getFramePose;

    /** Modal coordinates ξ, size n_f; must require no more than Stage::Model. **/
    std::function<SimTK::Vector(const SimTK::State&)> getModalCoordinates;

    /** Velocity V_GB = (ω, v) of the frame and modal speeds ξ̇, for contours of velocity; the State
    is realized to Stage::Velocity. **/
    std::function<SimTK::SpatialVec(const SimTK::State&)> getFrameVelocity = nullptr;
    std::function<SimTK::Vector(const SimTK::State&)> getModalSpeeds = nullptr;
};

}  // namespace simflex
