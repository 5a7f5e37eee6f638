#pragma once
/** @file
How the reduced stiffness and mass change with the numbers that a model was read with (see
DesignParameter.h). Internal to reduction.

    d(ΦᵀKΦ)/dp = d/dp Σ v (BU)ᵀ D (BU),    U(p): the modes at the nodes of an element

U is what it is at p, but where nodes are tied: there it is the motion nearest to Φ that constraints
and rigid interfaces allow at that value, with their masters where they were, moving as they did.
**/

#include <vector>

#include "MeanAxis.h"

namespace simflex {

std::vector<ReducedBody::Derivative> calcDerivatives(const FeModel& model, const RigidMotion& rigid,
                                                     const InterfaceTies& ties,
                                                     const MeanAxisModes& modes,
                                                     const ProgressCallback& progress);

}  // namespace simflex
