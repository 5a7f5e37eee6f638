#pragma once
/** @file
Linear shells with four and three nodes. Internal to fe.

A shell node has a midpoint m and a director d, the vector through its thickness; the element works
on the expanded nodes m ∓ d/2 (ThinElements.h), with three translations each.

    x = Σ N_k (m_k + ½ζ d_k),    u = Σ N_k (Δm_k + ½ζ Δd_k),    −1 ≤ ζ ≤ 1

The strains are covariant components e_αβ, transformed to the deck's axes:

- Transverse shear: MITC4 on quadrilaterals (Dvorkin and Bathe 1984), MITC3+ with a condensed bubble
  of the director on triangles (Lee, Lee and Bathe 2014), constant through ζ at the tying points.
- Membrane: from the stretch of the lines that connect the nodes in pairs. Quadrilaterals
  interpolate the stretches of edges and diagonals as MITC4+ does (Ko, Lee and Bathe 2017), and have
  four enhanced modes for in-plane bending (Simo and Rifai 1990), condensed. The lines are arcs with
  the curvature of the directors: ℓ·Δℓ + k Δk/12 with k = (a_j − a_i)·ℓ, a = d/|d|. With chords,
  inextensional bending of a curved shell would stretch a skew mesh, which locks.
- Bending: from displacements.

The normal stress through the thickness vanishes: B contains the normal strain required for this,
for any law. A director keeps its length by a separate stiffness, ½ D_nn (d·Δd/d²)²; this stretch is
decoupled from everything else, so it may be held or free. Transverse shear strain is distributed
over the thickness in proportion to q(ζ)/G, where q' = −E (ζ − ζ₀) is equilibrium in bending; this
gives the factor 5/6 and a parabola in a homogeneous shell. In a laminate, E and G are means over
the directions in the plane.

    for (const ElementPoint& p : makeShellPoints(x, {{-1, 1, law, rho}}))
        K += p.volume * p.B.transpose() * D(p) * p.B;  **/

#include <Eigen/Core>
#include <array>
#include <vector>

#include "ElementPoint.h"

namespace simflex {

/** A layer; layers are listed from below and fill −1…1. **/
struct ShellLayer {
    double from = -1, to = 1;  ///< ζ
    ElasticMatrix law{};       ///< in the deck's axes [Pa]
    double density = 0;        ///< [kg/m³]
};

/** Returns the points of an element, in the unknowns of its expanded nodes.
@param x  3×8 or 3×6, positions of the low nodes, then of the top ones in the same order
@throws std::invalid_argument, without the element's number, if the element is folded over. **/
std::vector<ElementPoint> makeShellPoints(const Eigen::Matrix3Xd& x,
                                          const std::vector<ShellLayer>& layers);

/** Returns 6×3n strain matrices at points (ξ, η, ζ) in the deck's axes, for stress σ = D B u with
the law of the layer at ζ; at the boundary of two layers that of the lower one. ξ, η as in C3D8 and
C3D6. **/
std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> calcShellStrainMatrices(
    const Eigen::Matrix3Xd& x, const std::vector<ShellLayer>& layers,
    const std::vector<std::array<double, 3>>& places);

}  // namespace simflex
