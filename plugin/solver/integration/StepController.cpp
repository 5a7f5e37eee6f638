#include "simflex/solver/integration/StepController.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/Checkpoint.h"

namespace simflex {

double StepController::calcRatio(double error, int order, double largest) {
    constexpr double SmallestError = 1e-8, SmallestRatio = 0.3;
    const double k = order + 1, e = std::max(error, SmallestError);
    double ratio = 0;
    if (m_hasPast)
        ratio = std::pow(Target / e, 0.25 / k) * std::pow(Target / m_lastError, 0.25 / k) *
                std::pow(m_lastRatio, -0.25);
    else
        ratio = std::pow(Target / e, 1 / k);
    ratio = std::clamp(1 + std::atan(ratio - 1), SmallestRatio, largest);
    m_lastError = e;
    m_lastRatio = ratio;
    m_hasPast = true;
    return ratio;
}

double StepController::calcRatioAfterRejection(double error, int order) {
    m_hasPast = false;
    return std::clamp(std::pow(Target / error, 1.0 / (order + 1)), 0.2, 0.8);
}

void StepController::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_lastError, m_lastRatio, m_hasPast);
}

}  // namespace simflex
