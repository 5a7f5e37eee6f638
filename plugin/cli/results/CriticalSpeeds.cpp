#include "simflex/cli/results/CriticalSpeeds.h"

#include <cmath>

namespace simflex {
namespace cli {

std::vector<double> findCriticalSpeeds(const ResultData::Analysis& campbell) {
    constexpr double kTwoPi = 6.28318530717958647692;
    const std::vector<double>& speeds = campbell.speeds;
    std::vector<double> critical(campbell.frequency.empty() ? 0 : campbell.frequency[0].size(),
                                 NAN);
    for (size_t branch = 0; branch < critical.size(); ++branch) {
        const auto calcGap = [&](size_t k) {
            return kTwoPi * campbell.frequency[k][branch] - std::abs(speeds[k]);
        };
        for (size_t k = 1; k < speeds.size() && std::isnan(critical[branch]); ++k) {
            const double before = calcGap(k - 1), after = calcGap(k);
            const bool isAtRest = before == 0 && speeds[k - 1] == 0;
            if ((before > 0) == (after > 0) || isAtRest) continue;
            critical[branch] =
                speeds[k - 1] + before / (before - after) * (speeds[k] - speeds[k - 1]);
        }
    }
    return critical;
}

}  // namespace cli
}  // namespace simflex
