#pragma once
/** @file
What an integration cost: counts, and wall time by phase in seconds. **/

#include <string>

namespace simflex {

struct IntegratorStatistics {
    long stepsTaken = 0;
    long stepsAttempted = 0;
    long errorTestFailures = 0;
    long convergenceFailures = 0;
    long newtonIterations = 0;
    long linearSolves = 0;         ///< right-hand sides, projections included
    long factorizations = 0;       ///< Newton matrices formed and factored
    long denseFactorizations = 0;  ///< those with the dense block form
    long projections = 0;
    int redundantConstraints = 0;  ///< found in the last factorization

    double evaluationSeconds = 0;        ///< kinematics, residuals, joints
    double factorSeconds = 0;            ///< blocks: J_b, W_b = J_b⁻¹G_bᵀ
    double schurSeconds = 0;             ///< S formed, factored, solved
    double backSubstitutionSeconds = 0;  ///< z_b, Δu_b
    double simbodySeconds = 0;           ///< asking Simbody for what it alone knows, and events
    double outputSeconds = 0;            ///< reporters
    double totalSeconds = 0;

    /** A table for people, one line per figure. **/
    std::string toString() const;
};

}  // namespace simflex
