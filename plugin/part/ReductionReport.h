#pragma once
/** @file
How good a reduction is: what `simflex info` shows beside the part itself. Standard types only. **/

#include <array>
#include <string>
#include <vector>

namespace simflex {

/** What is left out of the part's static deflection under a load. **/
struct StaticError {
    std::string load;  ///< "force x on interface 'pin'"
    double error = 0;  ///< share of the compliance, fᵀu, of the full model; not below 0
};

struct ReductionReport {
    int numConstraintModes = 0;  ///< one per boundary degree of freedom
    int numAttachmentModes = 0;  ///< shapes of load points, inertia relief and frequencies
    /** Normal modes with every interface held (free-free ones of a part without), ascending [Hz].
     **/
    std::vector<double> normalFrequencies;
    /** Effective modal masses of the normal modes, 6×modes: translations along x, y, z [kg] and
    rotations about axes through the centre of mass [kg m²], deck axes. Their sum over all modes of
    the mesh is the mass (inertia) that does not move with the interfaces. Empty for a part without
    interfaces. **/
    std::vector<double> effectiveMasses;
    /** Total mass (three times) and moments of inertia about x, y, z: what effectiveMasses are
    parts of. **/
    std::array<double, 6> rigidMasses{};

    double massOrthogonality = 0;       ///< largest |ΦᵀMΦ − 1|
    double stiffnessOrthogonality = 0;  ///< largest |ΦᵀKΦ − Ω²| over the largest Ω²
    double rigidResidual = 0;           ///< largest |RᵀMΦ|, R of unit modal mass
    double rigidEnergy = 0;             ///< largest ω² of a rigid motion over the lowest Ω²
    double conditionNumber = 0;  ///< estimate, ‖K‖₁‖K⁻¹‖₁ of the factored matrix

    /** Lowest free-free frequencies of the full model with its interfaces tied, the six rigid ones
    left out [Hz]; to be compared with those of the part one by one. Empty if not asked for. **/
    std::vector<double> fullFrequencies;
    /** Of the free part, which the load accelerates: under its turning (six products of angular
    velocities), unit forces and moments on each interface, and unit forces at each load point; at
    interfaces and load points the compliance is the deflection there. Empty if not asked for. **/
    std::vector<StaticError> staticErrors;
};

}  // namespace simflex
