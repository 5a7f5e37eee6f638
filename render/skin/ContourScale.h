#pragma once
/** @file
What a contour is called, and the ends of its colour bar. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/Contour.h"

namespace simflex {

/** What there is to know of a contour besides its values. **/
struct ContourTraits {
    const char* name;  ///< "von Mises stress"
    const char* unit;  ///< SI: "m/s"
    bool isSigned;
    bool needsVelocity, needsStress;
};

const ContourTraits& getTraits(Contour contour);

/** Smallest and largest value in a frame or a run; empty until something is included. **/
struct Extremes {
    double low = SimTK::Infinity, high = -SimTK::Infinity;

    bool isEmpty() const { return low > high; }
    void include(const Extremes& other);
};

struct ContourSettings {
    Contour contour = Contour::Displacement;
    ColorMap colorMap = ColorMap::Viridis;
    bool isColorMapFixed = false;  ///< else it suits the contour
    ContourRange range = ContourRange::PerRun;
    bool isRangeFixed = false;
    double fixedLow = 0, fixedHigh = 1;

    ColorMap getColorMap() const;
};

/** Ends of the bar of a frame, given the values in it and those of the run up to it: from zero, or
even on both sides of zero where values have a sign. **/
SimTK::Vec2 calcContourRange(const ContourSettings& settings, const Extremes& frame,
                             const Extremes& run);

}  // namespace simflex
