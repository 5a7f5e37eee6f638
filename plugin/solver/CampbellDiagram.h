#pragma once
/** @file
Eigenfrequencies over operating speed, each mode followed from speed to speed by its shape (modal
assurance criterion),

    MAC = |x₁ᴴ M x₂|² / (x₁ᴴMx₁ · x₂ᴴMx₂)

    const CampbellDiagram diagram = calcCampbellDiagram(speeds, 6, [&](Real speed) {
        matter.getMobilizedBody(rotor).setOneU(state, 0, speed);
        return calcLinearization(system, state);
    });
    writeCampbellDiagram("campbell.csv", diagram);   **/

#include <functional>
#include <string>
#include <vector>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

struct CampbellDiagram {
    struct Branch {
        std::vector<SimTK::Real> frequency;       ///< |λ|/2π at each speed [Hz]
        std::vector<SimTK::Real> dampingRatio;    ///< at each speed
        std::vector<SimTK::Real> modalAssurance;  ///< with the mode at the speed before; first: 1
    };
    std::vector<SimTK::Real> speeds;  ///< as given
    std::vector<Branch> branches;     ///< by frequency at the first speed
};

/** @param numModes  lowest modes to follow; rigid motions are left out
@param linearize  the system about its operating point at a speed
@throws std::invalid_argument if there is no speed, or fewer modes at one of them. **/
CampbellDiagram calcCampbellDiagram(
    const std::vector<SimTK::Real>& speeds, int numModes,
    const std::function<Linearization(SimTK::Real speed)>& linearize);

/** A line for each speed: speed, then frequency [Hz] and damping ratio of each branch.
@throws std::runtime_error if the file cannot be written. **/
void writeCampbellDiagram(const std::string& csvFile, const CampbellDiagram& diagram);

}  // namespace simflex
