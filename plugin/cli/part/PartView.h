#pragma once
/** @file
How a part by itself is looked at: its longest direction across the picture, from a little above.
**/

#include "Simbody.h"
#include "simflex/part/ReducedBody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace cli {

/** A system with nothing in it, for pictures of what does not move. **/
struct EmptySystem {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::State state;

    EmptySystem() {
        matter.setShowDefaultGeometry(false);
        state = system.realizeTopology();
    }
};

/** Sets up direction and view for a part in its own frame B. @returns the axis that points up. **/
SimTK::CoordinateAxis choosePartView(OffscreenVisualizer& visualizer, const ReducedBody& part);

}  // namespace cli
}  // namespace simflex
