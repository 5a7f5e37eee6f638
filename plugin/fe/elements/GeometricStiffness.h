#pragma once
/** @file
Geometric (stress) stiffness of a part under given displacements. Internal to fe and reduction.

    K_σ = k ⊗ 1₃,    k_ij = Σ v G_iᵀ σ G_j,    σ = D B u

Linear in u: changes of K due to displacements, and follower loads, are not included. **/

#include <functional>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** @throws std::invalid_argument if the model was read as matrices, or if it has springs, trusses
or membranes, whose forces are not included in σ. **/
void checkStressesAreKnown(const FeModel& model);

/** Calls `take` with the index of each field and its k (numNodes), in order.
@param fields  3·numNodes×count displacements, column-major [m]
@throws as checkStressesAreKnown().
@throws Cancelled if progress requests it. **/
void calcGeometricStiffness(const FeModel& model, const double* fields, int count,
                            const ProgressCallback& progress,
                            const std::function<void(int, const SymmetricMatrix&)>& take);

}  // namespace simflex
