#include "simflex/solver/IntegratorStatistics.h"

#include <cstdio>

namespace simflex {

std::string IntegratorStatistics::toString() const {
    std::string text;
    const auto count = [&](const char* label, long value) {
        char line[80];
        std::snprintf(line, sizeof line, "%-26s %10ld\n", label, value);
        text += line;
    };
    const auto seconds = [&](const char* label, double value) {
        char line[80];
        std::snprintf(line, sizeof line, "%-26s %10.3f s %5.1f %%\n", label, value,
                      totalSeconds > 0 ? 100 * value / totalSeconds : 0.0);
        text += line;
    };
    count("steps taken", stepsTaken);
    count("steps attempted", stepsAttempted);
    count("error test failures", errorTestFailures);
    count("convergence failures", convergenceFailures);
    count("Newton iterations", newtonIterations);
    count("linear solves", linearSolves);
    count("factorizations", factorizations);
    count("  with dense blocks", denseFactorizations);
    count("projections", projections);
    if (redundantConstraints > 0) count("redundant constraints", redundantConstraints);
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
