#include "simflex/solver/IntegratorStatistics.h"

#include <cmath>
#include <cstdio>

namespace simflex {

double IntegratorStatistics::calcMeanStep() const {
    return stepsTaken > 0 ? timeCovered / double(stepsTaken) : 0;
}

double IntegratorStatistics::calcRejectedFraction() const {
    return stepsAttempted > 0 ? double(stepsAttempted - stepsTaken) / double(stepsAttempted) : 0;
}

double IntegratorStatistics::calcStepRatioDeviation() const {
    return stepRatios > 0 ? std::sqrt(sumOfSquaredLogRatios / double(stepRatios)) : 0;
}

std::string IntegratorStatistics::toString() const {
    std::string text;
    char line[100];
    const auto count = [&](const char* label, long value) {
        std::snprintf(line, sizeof line, "%-26s %10ld\n", label, value);
        text += line;
    };
    const auto countIfAny = [&](const char* label, long value) {
        if (value > 0) count(label, value);
    };
    const auto length = [&](const char* label, double value) {
        std::snprintf(line, sizeof line, "%-26s %10.3g s\n", label, value);
        text += line;
    };
    const auto seconds = [&](const char* label, double value) {
        std::snprintf(line, sizeof line, "%-26s %10.3f s %5.1f %%\n", label, value,
                      totalSeconds > 0 ? 100 * value / totalSeconds : 0.0);
        text += line;
    };
    count("steps taken", stepsTaken);
    for (size_t order = 1; order < stepsAtOrder.size(); ++order)
        countIfAny(("  of order " + std::to_string(order)).c_str(), stepsAtOrder[order]);
    count("steps attempted", stepsAttempted);
    countIfAny("  error too large", errorTestFailures);
    countIfAny("  no convergence", convergenceFailures);
    countIfAny("  no projection", projectionFailures);
    countIfAny("  not a number", nonFiniteFailures);
    length("smallest step", smallestStep);
    length("mean step", calcMeanStep());
    length("largest step", largestStep);
    count("Newton iterations", newtonIterations);
    count("linear solves", linearSolves);
    count("factorizations", factorizations);
    countIfAny("  with dense blocks", denseFactorizations);
    count("projections", projections);
    countIfAny("redundant constraints", redundantConstraints);
    count("starts", starts);
    countIfAny("reports", reports);
    countIfAny("scheduled events", scheduledEvents);
    countIfAny("triggered events", triggeredEvents);
    countIfAny("time-advanced events", timeAdvancedEvents);
    seconds("evaluation", evaluationSeconds);
    seconds("factor", factorSeconds);
    seconds("Schur complement", schurSeconds);
    seconds("back-substitution", backSubstitutionSeconds);
    seconds("Simbody", simbodySeconds);
    seconds("output", outputSeconds);
    seconds("total", totalSeconds);
    return text;
}

}  // namespace simflex
