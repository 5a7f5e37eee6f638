#pragma once
/** @file
Connectors and loads that an OffscreenVisualizer draws, as in drawings of mechanisms.

@code
    viz.addConnector({ConnectorKind::Spring, ground, boom.interface("tip"), 0.8});
    viz.addLoad({boom.interface("tip"),
                 [](const State& s) { return SpatialVec(Vec3(0), Vec3(0, -s.getTime(), 0)); }});
@endcode **/

#include <functional>
#include <string>

#include "Simbody.h"
#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBody.h"

namespace simflex {

enum class ConnectorKind {
    Spring,         ///< a coil
    Damper,         ///< a cylinder and a rod
    SpringDamper,   ///< one in the other
    TorsionSpring,  ///< a spiral about the z axis of F
    Bushing,        ///< a ring of rubber about a sleeve
    Stop            ///< the plate z = 0 of F, and a knob at M
};

struct DrawnConnector {
    ConnectorKind kind = ConnectorKind::Spring;
    Attachment F, M;
    /** Of a spring or damper, without force [m]: its symbol's size follows it. 0: the length found.
     * **/
    SimTK::Real freeLength = 0;
};

/** A force as a straight arrow, a torque as a circular one. **/
struct DrawnLoad {
    enum class Axes { Ground, Attachment };
    Attachment frame;
    std::function<SimTK::SpatialVec(const SimTK::State&)> force;  ///< (torque [N m], force [N])
    Axes axes = Axes::Ground;
};

/** A load spread over a flexible body: the arrow of its resultant. **/
struct DrawnSpreadLoad {
    FlexibleBody body;
    SimTK::Vec3 center_B;  ///< middle of where it acts, undeformed
    SimTK::Vec3 force_B;   ///< for a scale of 1 [N]
    SimTK::Vector modal;   ///< modal forces for a scale of 1: the middle moves as they say
    std::function<SimTK::Real(SimTK::Real time)> scale;
};

}  // namespace simflex
