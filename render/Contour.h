#pragma once
/** @file
What the colours of a flexible part show, and over which range.

Displacements are elastic, Φξ, along the axes of the part's frame B; velocities are those of the
moving and bending part in Ground, along Ground's axes. Stress and strain are nodal: the tensors are
averaged over the elements at a node (by `simflex reduce --stress`), invariants are taken of the
averages. Between nodes values are interpolated. Nodes without stress are drawn grey. **/

namespace simflex {

enum class Contour {
    None,
    Displacement,  ///< |Φξ| [m]
    DisplacementX,
    DisplacementY,
    DisplacementZ,
    Speed,  ///< |v| in Ground [m/s]
    VelocityX,
    VelocityY,
    VelocityZ,
    StrainEnergyDensity,     ///< ½ σ:ε [J/m³]
    VonMises,                ///< [Pa]
    SignedVonMises,          ///< with the sign of the principal stress that is largest in size [Pa]
    LargestPrincipalStress,  ///< tension is positive [Pa]
    SmallestPrincipalStress
};

/** Ends of the colour bar found from what is drawn: over the whole run, or over each frame anew.
 **/
enum class ContourRange { PerRun, PerFrame };

}  // namespace simflex
