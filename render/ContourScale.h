#pragma once
/** @file
The ends of a colour bar. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/Contour.h"

namespace simflex {

/** Smallest and largest value in a frame or a run; empty until something is included. **/
struct Extremes {
    double low = SimTK::Infinity, high = -SimTK::Infinity;

    bool isEmpty() const { return low > high; }
    void include(const Extremes& other);
};

struct ContourSettings {
    Contour contour = Contour::Displacement;
    ColorMap colorMap = ColorMap::Viridis;
    ContourRange range = ContourRange::PerRun;
    bool isRangeFixed = false;
    double fixedLow = 0, fixedHigh = 1;
};

/** Ends of the bar of a frame, given the values in it and those of the run up to it. **/
SimTK::Vec2 calcContourRange(const ContourSettings& settings, const Extremes& frame,
                             const Extremes& run);

}  // namespace simflex
