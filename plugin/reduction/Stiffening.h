#pragma once
/** @file
Geometric stiffness of a part for the loads that stiffen it (see ReducedBody::Stiffening). Internal
to reduction.

A load f is equilibrated by the inertia of the free part, f ← f − MR(RᵀMR)⁻¹Rᵀf, and by the forces c
of rigid interfaces on their nodes: K u = f + c. Under that prestress

    K = ΦᵀK_gΦ + Σ_J Ψ_JᵀB_JΨ_J,    B_J = S_J − tr(S_J)1,    S_J = sym Σ c rᵀ

The second term arises because a node at r from the master of a rigid interface J that rotates by θ
= Ψ_Jξ moves by ½ θ×(θ×r) to second order. The load of a distributing interface is distributed over
its nodes, and these forces rotate with it likewise. Then f·u₂ = −½ ξᵀKξ for the second-order
displacement u₂ caused by modes, as rotations shorten a beam. **/

#include "MeanAxis.h"

namespace simflex {

/** @throws as calcGeometricStiffness(). **/
ReducedBody::Stiffening calcStiffening(const FeModel& model, const FeProducts& products,
                                       const RigidMotion& rigid, const InterfaceTies& ties,
                                       const ModeBasis& basis, const MeanAxisModes& modes,
                                       const ProgressCallback& progress);

}  // namespace simflex
