#pragma once
/** @file
The bar that says what colours mean. Internal to the renderer. **/

#include <string>

#include "Font.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/render/scene/FrameStyle.h"

namespace simflex {

struct ColorBar {
    std::string quantity;      ///< "von Mises stress"
    std::string reference;     ///< "from crank.shaft": what it is measured from, or empty
    std::string unit = "m";    ///< SI
    double low = 0, high = 1;  ///< [SI]
    ColorMap colorMap = ColorMap::Viridis;
    bool hasBelow = false, hasAbove = false;  ///< values beyond the ends: the bar gets a tip there
    double top = 0.27, bottom = 0.73;         ///< of it, to the picture's height
    bool hasGaps = false;                     ///< some of the surface has no value: grey
};

/** Colour of surfaces where the quantity is not known. **/
const SimTK::Vec3 gapColor(0.62, 0.62, 0.62);

/** Draws it at the right edge of the picture.
@param unit  pixels that the sizes are multiples of, 1/720 of a frame's height **/
void drawColorBar(Image& image, const ColorBar& bar, const Palette& palette, double unit,
                  Font& regular, Font& bold);

}  // namespace simflex
