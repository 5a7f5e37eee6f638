#include "Ticks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace simflex {

double chooseTickStep(double low, double high) {
    const double span = high - low;
    if (!(span > 0) || !std::isfinite(span)) return 1;
    const double decade = std::pow(10, std::floor(std::log10(span / 6)));
    const auto endsOnTick = [](double end, double step) {
        return std::abs(end / step - std::round(end / step)) < 1e-6;
    };
    double best = decade, bestScore = std::numeric_limits<double>::infinity();
    for (const double factor : {0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 10.0, 20.0}) {
        const double step = factor * decade, intervals = span / step;
        if (intervals < 3.5 || intervals > 10.5) continue;
        double score = std::abs(intervals - 6) / 6;
        if (!endsOnTick(low, step)) score += 1;
        if (!endsOnTick(high, step)) score += 1;
        if (factor == 2.5 || factor == 4) score += 0.4;
        if (score < bestScore) {
            bestScore = score;
            best = step;
        }
    }
    return best;
}

int countDecimals(double step) {
    for (int decimals = std::max(0, -int(std::floor(std::log10(step) + 1e-9)));; ++decimals) {
        const double shifted = step * std::pow(10, decimals);
        if (std::abs(shifted - std::round(shifted)) < 1e-6 * shifted || decimals > 12)
            return decimals;
    }
}

}  // namespace simflex
