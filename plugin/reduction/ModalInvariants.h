#pragma once
/** @file
Complete second-order invariants of a flexible part in its mean-axis frame. Internal to reduction.

With G_ab = Φ_aᵀ m Φ_b (n_f×n_f; Φ_a: rows of axis a) and r = s + Φξ, the inertia is I(ξ) = ∑m
[(r·r) 1 − r rᵀ] = I₀ + ξᵢ I₁ᵢ + ξᵢξⱼ I₂ᵢⱼ:

    I₁_xx,i = 2 (s_yᵀ m φ_y,i + s_zᵀ m φ_z,i)         I₁_xy,i = −(s_xᵀ m φ_y,i + s_yᵀ m φ_x,i)
    I₂_xx   = G_yy + G_zz                              I₂_xy   = −½ (G_xy + G_xyᵀ)
    N_x     = G_yz − G_yzᵀ   and cyclic                ∑m φ, ∑m s×φ = 0

O(n_f²·nodes); exact for the FE mass matrix of any element. **/

#include "MeanAxis.h"

namespace simflex {

/** Sets mass, centre, inertia, numModes, omegaSquared, I1, I2, N, interface shapes, Phi and mesh of
`body` from its modes.
@throws std::invalid_argument if ∑m s, ∑m φ or ∑m s×φ is not zero to round-off. **/
void setModalInvariants(const FeModel& model, const FeProducts& products, const RigidMotion& rigid,
                        const MeanAxisModes& modes, const InterfaceTies& ties, ReducedBody& body);

}  // namespace simflex
