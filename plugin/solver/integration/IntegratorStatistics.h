#pragma once
/** @file
Cost and course of an integration: counts since initialize(), and wall time by phase [s]. **/

#include <array>
#include <string>

namespace simflex {

struct IntegratorStatistics {
    /** @name Steps **/
    /**@{**/
    long stepsTaken = 0;
    long stepsAttempted = 0;
    long errorTestFailures = 0;    ///< attempts rejected because the local error was too large
    long convergenceFailures = 0;  ///< because Newton's method did not converge
    long projectionFailures = 0;   ///< because positions could not be projected onto the joints
    long nonFiniteFailures = 0;    ///< because forces or positions were not finite
    std::array<long, 6> stepsAtOrder{};        ///< by order, 1 to 5
    double smallestStep = 0, largestStep = 0;  ///< [s]
    double timeCovered = 0;                    ///< sum of steps [s]
    double sumOfSquaredLogRatios = 0;          ///< Σ ln²(h_{n+1}/h_n) over stepRatios ratios
    long stepRatios = 0;
    /**@}**/

    /** @name Linear algebra **/
    /**@{**/
    long newtonIterations = 0;
    long divergentIterations = 0;  ///< iterations of failed solves
    long linearSolves = 0;         ///< right-hand sides, projections included
    long factorizations = 0;       ///< Newton matrices formed and factored
    long denseFactorizations = 0;  ///< of these, with the dense block form
    long projections = 0;
    int redundantConstraints = 0;  ///< found in the last factorization
    /**@}**/

    /** @name Events **/
    /**@{**/
    long starts = 0;  ///< history starts: initialize(), handlers that changed the State, failures
    long reports = 0;
    long scheduledEvents = 0;
    long triggeredEvents = 0;
    long timeAdvancedEvents = 0;
    /**@}**/

    /** @name Wall time [s] **/
    /**@{**/
    double evaluationSeconds = 0;        ///< kinematics, residuals, joints
    double factorSeconds = 0;            ///< blocks: J_b, W_b = J_b⁻¹G_bᵀ
    double schurSeconds = 0;             ///< S formed, factored, solved
    double backSubstitutionSeconds = 0;  ///< z_b, Δu_b
    double simbodySeconds = 0;           ///< Simbody's own evaluations, and events
    double outputSeconds = 0;            ///< reporters, and interpolation between steps
    double totalSeconds = 0;
    /**@}**/

    double calcMeanStep() const;          ///< [s]
    double calcRejectedFraction() const;  ///< of all attempts
    /** Standard deviation of ln(h_{n+1}/h_n): 0 for constant steps. **/
    double calcStepRatioDeviation() const;

    /** Human-readable table, one line per figure. **/
    std::string toString() const;
};

}  // namespace simflex
