#pragma once
/** @file
What the renderer needs to know of a part that bends: the part, and how to read its frame and its
modal coordinates from a State, and where velocities are shown their rates.

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
    std::string name;  ///< of the body, for messages; the part's name when empty

    /** Pose X_GB of the part's mean-axis frame; the State is realized to Stage::Position. **/
    std::function<SimTK::Transform(const SimTK::State&)> getFramePose;

    /** Modal coordinates ξ, size n_f; Stage::Model must suffice. **/
    std::function<SimTK::Vector(const SimTK::State&)> getModalCoordinates;

    /** Velocity V_GB = (ω, v) of the frame and modal speeds ξ̇, for contours of velocity; the State
    is realized to Stage::Velocity. **/
    std::function<SimTK::SpatialVec(const SimTK::State&)> getFrameVelocity = nullptr;
    std::function<SimTK::Vector(const SimTK::State&)> getModalSpeeds = nullptr;
};

}  // namespace simflex
