#pragma once
/** @file
Derivatives of the reduced stiffness and mass with respect to the parameters of a model (see
DesignParameter.h). Internal to reduction.

    d(ΦᵀKΦ)/dp = d/dp Σ v (BU)ᵀ D (BU),    U(p): the modes at the nodes of an element

U is constant except at tied nodes. There it is the motion closest to Φ that constraints and rigid
interfaces allow at the changed value, with the masters' positions and motions unchanged. **/

#include <vector>

#include "MeanAxis.h"

namespace simflex {

std::vector<ReducedBody::Derivative> calcDerivatives(const FeModel& model, const RigidMotion& rigid,
                                                     const InterfaceTies& ties,
                                                     const MeanAxisModes& modes,
                                                     const ProgressCallback& progress);

}  // namespace simflex
