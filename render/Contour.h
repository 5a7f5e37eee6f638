#pragma once
/** @file
Quantity and range of a flexible part's colours.

Displacements are elastic, Φξ, along the axes of the part's frame B; velocities are those of the
moving and deforming part in Ground, along Ground's axes. Stress and strain are nodal: tensors are
averaged over the elements at a node (by `simflex reduce --stress`), and invariants are computed
from the averages. Values are interpolated between nodes. Nodes without stress are grey. **/

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
    SignedVonMises,          ///< with the sign of the principal stress of largest magnitude [Pa]
    LargestPrincipalStress,  ///< tension is positive [Pa]
    SmallestPrincipalStress
};

/** Automatic ends of the colour bar: for the whole run, or for each frame separately. **/
enum class ContourRange { PerRun, PerFrame };

}  // namespace simflex
