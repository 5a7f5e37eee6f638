#pragma once
/** @file
The colour bar of a contour. Internal to the renderer. **/

#include <string>

#include "Font.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/render/scene/FrameStyle.h"

namespace simflex {

struct ColorBar {
    std::string quantity;      ///< "von Mises stress"
    std::string reference;     ///< "from crank.shaft": origin of the displacements, or empty
    std::string unit = "m";    ///< SI
    double low = 0, high = 1;  ///< [SI]
    ColorMap colorMap = ColorMap::Viridis;
    bool hasBelow = false, hasAbove = false;  ///< draws tips for values beyond the ends
    double top = 0.27, bottom = 0.73;         ///< of the bar, relative to the picture's height
    bool hasGaps = false;                     ///< parts of the surface have no value: grey
};

/** Colour of surfaces without values. **/
const SimTK::Vec3 gapColor(0.62, 0.62, 0.62);

/** Draws the bar at the right edge of the picture.
@param unit  base of all sizes [pixel], 1/720 of a frame's height **/
void drawColorBar(Image& image, const ColorBar& bar, const Palette& palette, double unit,
                  Font& regular, Font& bold);

}  // namespace simflex
