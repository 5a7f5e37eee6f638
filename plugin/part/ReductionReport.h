#pragma once
/** @file
Accuracy of a reduction, shown by `simflex info`. Standard types only. **/

#include <array>
#include <string>
#include <vector>

namespace simflex {

/** Error of the part's static deflection under a load. **/
struct StaticError {
    std::string load;  ///< "force x on interface 'pin'"
    double error = 0;  ///< relative error of the compliance fᵀu against the full model; not
                       ///< negative
};

struct ReductionReport {
    int numConstraintModes = 0;  ///< one per boundary degree of freedom
    int numAttachmentModes = 0;  ///< shapes of load points, inertia relief and frequencies
    /** Normal modes with all interfaces held (free-free if there are none), ascending [Hz]. **/
    std::vector<double> normalFrequencies;
    /** Effective modal masses of the normal modes, 6×modes: translations along x, y, z [kg] and
    rotations about axes through the centre of mass [kg m²], deck axes. Summed over all modes of the
    mesh they are the mass (inertia) that does not move with the interfaces. Empty for a part
    without interfaces. **/
    std::vector<double> effectiveMasses;
    /** Total mass (three times) and moments of inertia about x, y, z: the reference values of
    effectiveMasses. **/
    std::array<double, 6> rigidMasses{};

    double massOrthogonality = 0;       ///< largest |ΦᵀMΦ − 1|
    double stiffnessOrthogonality = 0;  ///< largest |ΦᵀKΦ − Ω²| over the largest Ω²
    double rigidResidual = 0;           ///< largest |RᵀMΦ|, R of unit modal mass
    double rigidEnergy = 0;             ///< largest ω² of a rigid motion over the lowest Ω²
    double conditionNumber = 0;  ///< estimate, ‖K‖₁‖K⁻¹‖₁ of the factored matrix

    /** Lowest free-free frequencies of the full model with tied interfaces, without the six rigid
    modes [Hz], in the order of the part's own. Empty if not requested. **/
    std::vector<double> fullFrequencies;
    /** Errors for the free part, accelerated by the load: under rotation (six products of angular
    velocities), unit forces and moments on each interface, and unit forces at each load point. For
    interfaces and load points the compliance is the deflection there. Empty if not requested. **/
    std::vector<StaticError> staticErrors;
};

}  // namespace simflex
