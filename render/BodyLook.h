#pragma once
/** @file
How one body is drawn, see OffscreenVisualizer::setBodyLook(). **/

#include "SimTKcommon.h"

namespace simflex {

struct BodyLook {
    bool isVisible = true;  ///< a hidden one counts for no range of colours and no view either
    double opacity = 1;     ///< from 0 to 1
    SimTK::Vec3 color{-1};  ///< red, green, blue from 0 to 1; negative: its own
    /** Whether a contour, where there is one, takes the place of a flexible body's colour. **/
    bool hasContour = true;

    bool hasColor() const { return color[0] >= 0; }
};

}  // namespace simflex
