#pragma once
/** @file
Standard view of a single part: its longest direction across the picture, from slightly above. **/

#include "Simbody.h"
#include "simflex/part/ReducedBody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace cli {

/** An empty system, for pictures without motion. **/
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
