#pragma once
/** @file
Numbers with units that suit their size, as they are written in pictures. Internal. **/

#include <string>

namespace simflex {

enum class Dimension { Length, Velocity, EnergyDensity, Stress, Force, Moment };

struct Unit {
    std::string name;  ///< "mm"
    double size = 1;   ///< in SI units
};

/** The unit for numbers up to `largest` (SI, any sign). **/
Unit chooseUnit(Dimension dimension, double largest);

/** Three digits and a unit, such as "12.5 kN". **/
std::string formatQuantity(double value, Dimension dimension);

/** Step between ticks of an axis from low to high: 1, 2, 2.5, 4 or 5 times a power of ten, of those
that give four to ten intervals one that ends on both ends, if any. **/
double chooseTickStep(double low, double high);

/** Digits after the decimal point that multiples of a step need. **/
int countDecimals(double step);

}  // namespace simflex
