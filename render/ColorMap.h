#pragma once
/** @file
Perceptual colour maps from [0, 1] to red, green, blue.

The sequential maps have uniformly increasing lightness, so that a contour reads the same in print
and for colour-blind readers: Viridis, Plasma, Inferno, Magma, Cividis (the published tables, see
ColorTables.h) and Gray. The diverging maps, for signed fields, are equally dark at both ends and
lightest in the middle: CoolWarm (K. Moreland, "Diverging Color Maps for Scientific Visualization",
ISVC 2009) and BlueWhiteRed. **/

#include "SimTKcommon.h"

namespace simflex {

enum class ColorMap { Viridis, Plasma, Inferno, Magma, Cividis, Gray, CoolWarm, BlueWhiteRed };

/** Returns the colour at `fraction`, each component in 0…1 as stored in a picture (sRGB). A
fraction outside [0, 1] is clamped. **/
SimTK::Vec3 calcColor(ColorMap map, double fraction);

/** Returns whether the middle of the map represents zero. **/
bool isDiverging(ColorMap map);

}  // namespace simflex
