#pragma once
/** @file
Eigenfrequencies over operating speed, each mode followed from speed to speed by its shape (modal
assurance criterion),

    MAC = |x₁ᴴ M x₂|² / (x₁ᴴMx₁ · x₂ᴴMx₂)      M between them: that of the later one

or by the conjugate of it, with the sign of its whirl: in axes that turn, ω − Ω goes through zero.

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
    /** At each speed; NaN where there are no modes. **/
    struct Branch {
        std::vector<SimTK::Real> frequency;  ///< |λ|/2π [Hz]
        std::vector<SimTK::Real> dampingRatio;
        std::vector<SimTK::Real> modalAssurance;  ///< with the mode at the speed before; first: 1
    };
    std::vector<SimTK::Real> speeds;    ///< as given
    std::vector<std::string> failures;  ///< at each speed: why it has no modes; empty if it has
    std::vector<Branch> branches;       ///< by frequency at the first speed that has modes
};

/** @param numModes  lowest modes to follow; rigid motions are left out
@param calcModes  the modes about the operating point at a speed, at least the `count` slowest ones
    if there are as many; rigid motions do not matter. A std::exception that it throws is the
    failure of this speed, as are fewer modes than are followed; others are calculated.
@throws std::invalid_argument if there is no speed; std::runtime_error with the first failure if
    all speeds fail. **/
CampbellDiagram calcCampbellDiagram(
    const std::vector<SimTK::Real>& speeds, int numModes,
    const std::function<std::vector<Eigenmode>(SimTK::Real speed, int count)>& calcModes);

/** A line for each speed: speed, then frequency [Hz] and damping ratio of each branch, empty where
it failed.
@throws std::runtime_error if the file cannot be written. **/
void writeCampbellDiagram(const std::string& csvFile, const CampbellDiagram& diagram);

}  // namespace simflex
