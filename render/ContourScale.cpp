#include "ContourScale.h"

#include <algorithm>

#include "Overlay.h"

namespace simflex {

namespace {

constexpr double lengthOfNothing = 1e-3;  // end of the colour bar when nothing deforms [m]

}  // namespace

void Extremes::include(const Extremes& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
}

SimTK::Vec2 calcContourRange(const ContourSettings& settings, const Extremes& frame,
                             const Extremes& run) {
    if (settings.isRangeFixed) return {settings.fixedLow, settings.fixedHigh};
    const bool isPerFrame = settings.range == ContourRange::PerFrame;
    const double largest = isPerFrame ? frame.high : run.high;
    if (!(largest > 0)) return {0, lengthOfNothing};
    return {0, isPerFrame ? largest : roundUpToRange(largest)};
}

}  // namespace simflex
