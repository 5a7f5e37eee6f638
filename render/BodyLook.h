#pragma once
/** @file
Appearance of one body, see OffscreenVisualizer::setBodyLook(). **/

#include "SimTKcommon.h"

namespace simflex {

struct BodyLook {
    bool isVisible = true;  ///< hidden bodies do not affect colour ranges and views
    double opacity = 1;     ///< from 0 to 1
    SimTK::Vec3 color{-1};  ///< red, green, blue from 0 to 1; negative: the default
    /** Whether a contour, if there is one, replaces a flexible body's colour. **/
    bool hasContour = true;

    bool hasColor() const { return color[0] >= 0; }
};

}  // namespace simflex
