#pragma once
/** @file
Perceptual colour maps from [0, 1] to red, green, blue.

The sequential ones have lightness that grows evenly, so that a contour reads the same in print and
to colour-blind eyes: Viridis, Plasma, Inferno, Magma, Cividis (the published tables, see
ColorTables.h) and Gray. The diverging ones, for signed fields, are equally dark at both ends and
lightest in the middle: CoolWarm (K. Moreland, "Diverging Color Maps for Scientific Visualization",
ISVC 2009) and BlueWhiteRed. **/

#include "SimTKcommon.h"

namespace simflex {

enum class ColorMap { Viridis, Plasma, Inferno, Magma, Cividis, Gray, CoolWarm, BlueWhiteRed };

/** Colour at `fraction`, each component in 0…1 as stored in a picture (sRGB).
A fraction outside [0, 1] takes the colour of the nearer end. **/
SimTK::Vec3 calcColor(ColorMap map, double fraction);

/** True if the map has a middle that stands for zero. **/
bool isDiverging(ColorMap map);

}  // namespace simflex
