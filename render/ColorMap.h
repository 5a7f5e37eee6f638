#pragma once
/** @file
Perceptual colour maps from [0, 1] to red, green, blue.

Viridis and Plasma (van der Walt & Smith, matplotlib, CC0) have lightness that grows evenly, so that
a contour reads the same in print and to colour-blind eyes. BlueWhiteRed is for signed fields. **/

#include "SimTKcommon.h"

namespace simflex {

enum class ColorMap { Viridis, Plasma, BlueWhiteRed };

/** Colour at `fraction`, each component in 0…1 as stored in a picture (sRGB).
A fraction outside [0, 1] takes the colour of the nearer end. **/
SimTK::Vec3 calcColor(ColorMap map, double fraction);

}  // namespace simflex
