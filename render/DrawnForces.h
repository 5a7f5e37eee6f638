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
    SpringDamper,   ///< a spring around a damper
    TorsionSpring,  ///< a spiral about the z axis of F
    Bushing,        ///< a ring of rubber about a sleeve
    Stop            ///< the plate z = 0 of F, and a knob at M
};

struct DrawnConnector {
    ConnectorKind kind = ConnectorKind::Spring;
    Attachment F, M;
    /** Unloaded length of a spring or damper [m], which scales its symbol. 0: the current
    length. **/
    SimTK::Real freeLength = 0;
};

/** A force as a straight arrow, a torque as a circular one. **/
struct DrawnLoad {
    enum class Axes { Ground, Attachment };
    Attachment frame;
    std::function<SimTK::SpatialVec(const SimTK::State&)> force;  ///< (torque [N m], force [N])
    Axes axes = Axes::Ground;
};

/** A load distributed over a flexible body, drawn as the arrow of its resultant. **/
struct DrawnSpreadLoad {
    FlexibleBody body;
    SimTK::Vec3 center_B;  ///< undeformed point of application
    SimTK::Vec3 force_B;   ///< at a scale of 1 [N]
    SimTK::Vector modal;   ///< modal forces at a scale of 1, which determine the displacement of
                           ///< the point of application
    std::function<SimTK::Real(SimTK::Real time)> scale;
};

}  // namespace simflex
