#pragma once
/** @file
Names of contours and ends of their colour bars. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/Contour.h"

namespace simflex {

/** Properties of a contour. **/
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
    bool isColorMapFixed = false;  ///< default: chosen for the contour
    ContourRange range = ContourRange::PerRun;
    bool isRangeFixed = false;
    double fixedLow = 0, fixedHigh = 1;

    ColorMap getColorMap() const;
};

/** Returns the ends of a frame's colour bar, given the values in the frame and in the run so far:
from zero, or symmetric about zero for signed values. **/
SimTK::Vec2 calcContourRange(const ContourSettings& settings, const Extremes& frame,
                             const Extremes& run);

}  // namespace simflex
