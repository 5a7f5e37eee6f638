#pragma once
/** @file
Eigenfrequencies over operating speed. Modes are followed from speed to speed by their shapes (modal
assurance criterion),

    MAC = |x₁ᴴ M x₂|² / (x₁ᴴMx₁ · x₂ᴴMx₂)      M between them: that of the later one

or by the conjugate shape, with the sign of the whirl, because ω − Ω passes through zero in
co-rotating axes.

    const CampbellDiagram diagram = calcCampbellDiagram(speeds, 6, [&](Real speed, int count) {
        matter.getMobilizedBody(rotor).setOneU(state, 0, speed);
        return calcSlowestEigenmodes(system, state, count);
    });
    writeCampbellDiagram("campbell.csv", diagram);   **/

#include <functional>
#include <string>
#include <vector>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

struct CampbellDiagram {
    /** A followed mode, at each speed; NaN where there are no modes. **/
    struct Branch {
        std::vector<SimTK::Real> frequency;  ///< |λ|/2π [Hz]
        std::vector<SimTK::Real> dampingRatio;
        std::vector<SimTK::Real> modalAssurance;  ///< with the mode at the previous speed; first: 1
    };
    std::vector<SimTK::Real> speeds;    ///< as given
    std::vector<std::string> failures;  ///< at each speed: why it has no modes; else empty
    std::vector<Branch> branches;       ///< by frequency at the first speed that has modes
};

/** @param numModes  number of lowest modes to follow; rigid motions are left out
@param calcModes  returns the modes about the operating point at a speed, at least the `count`
    slowest ones if there are as many; rigid motions are ignored. A std::exception that it throws,
    or too few modes, is the failure of this speed only.
@throws std::invalid_argument if there is no speed; std::runtime_error with the first failure if
    all speeds fail. **/
CampbellDiagram calcCampbellDiagram(
    const std::vector<SimTK::Real>& speeds, int numModes,
    const std::function<std::vector<Eigenmode>(SimTK::Real speed, int count)>& calcModes);

/** Writes one row per speed: speed, then frequency [Hz] and damping ratio of each branch, empty
where it failed.
@throws std::runtime_error if the file cannot be written. **/
void writeCampbellDiagram(const std::string& csvFile, const CampbellDiagram& diagram);

}  // namespace simflex
