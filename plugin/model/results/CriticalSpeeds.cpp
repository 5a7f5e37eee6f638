#include "simflex/model/results/CriticalSpeeds.h"

#include <cmath>
#include <utility>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace model {

std::vector<double> findCriticalSpeeds(const Results::Analysis& campbell) {
    constexpr double TwoPi = 6.28318530717958647692;
    const std::vector<double>& speeds = campbell.speeds;
    std::vector<double> critical(campbell.frequency.empty() ? 0 : campbell.frequency[0].size(),
                                 NAN);
    for (size_t branch = 0; branch < critical.size(); ++branch) {
        const auto calcGap = [&](size_t k) {
            if (!campbell.dampingRatio.empty() &&
                std::abs(campbell.dampingRatio[k][branch]) >= Eigenmode::Aperiodic)
                return double(NAN);
            return TwoPi * campbell.frequency[k][branch] - std::abs(speeds[k]);
        };
        size_t last = speeds.size();  // index of the last speed with modes
        for (size_t k = 0; k < speeds.size() && std::isnan(critical[branch]); ++k) {
            const double after = calcGap(k);
            if (std::isnan(after)) continue;
            const size_t first = std::exchange(last, k);
            if (first == speeds.size()) continue;
            const double before = calcGap(first);
            const bool isAtRest = before == 0 && speeds[first] == 0;
            if ((before > 0) == (after > 0) || isAtRest) continue;
            critical[branch] =
                speeds[first] + before / (before - after) * (speeds[k] - speeds[first]);
        }
    }
    return critical;
}

}  // namespace model
}  // namespace simflex
