#pragma once
/** @file
Two reduced bricks welded into an L standing on its clamped end, and one CalculiX model of the whole
with the same rigid ties. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "validation/BrickParts.h"

namespace simflex::test {

struct WeldedParts {
    simflex::testing::Brick footBrick, uprightBrick;
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody foot, upright;
    Joint::Weld clamp, corner;

    /** @param numModes  Craig–Bampton modes of each part **/
    explicit WeldedParts(int numModes);

    /** Undeformed. **/
    SimTK::State makeState();

    /** Returns CalculiX's lowest frequencies [Hz]. **/
    std::vector<double> calcCalculixFrequencies(int numFrequencies) const;
};

}  // namespace simflex::test
