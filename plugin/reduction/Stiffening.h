#pragma once
/** @file
Geometric stiffness of a part for the loads that stiffen it (see ReducedBody::Stiffening). Internal
to reduction.

A load f is put in equilibrium with the inertia of the free part, f ← f − MR(RᵀMR)⁻¹Rᵀf, and with
the forces c by which rigid interfaces hold their nodes: K u = f + c. Under that prestress

    K = ΦᵀK_gΦ + Σ_J Ψ_JᵀB_JΨ_J,    B_J = S_J − tr(S_J)1,    S_J = sym Σ c rᵀ

the second term because a node at r from the master of a rigid interface J that turns by θ = Ψ_Jξ
moves by ½ θ×(θ×r) to second order. The load of a distributing interface is shared out among its
nodes, and those forces turn with it likewise. Then f·u₂ = −½ ξᵀKξ for the displacement u₂ that
modes cause to second order, as rotations shorten a beam. **/

#include "MeanAxis.h"

namespace simflex {

/** @throws as calcGeometricStiffness(). **/
ReducedBody::Stiffening calcStiffening(const FeModel& model, const FeProducts& products,
                                       const RigidMotion& rigid, const InterfaceTies& ties,
                                       const ModeBasis& basis, const MeanAxisModes& modes,
                                       const ProgressCallback& progress);

}  // namespace simflex
