#pragma once
/** @file
Units as people write them: millimetres for what is measured in millimetres.

    const DisplayUnit unit = chooseDisplayUnit("m", 0.02);   // {"mm", 1e-3}
    label = makeAxisLabel("slider.x", unit.name);            // "slider.x [mm]" **/

#include <string>

namespace simflex {

struct DisplayUnit {
    std::string name;  ///< "mm", "kN m", "m/s²"; "" for none
    double size = 1;   ///< in the SI unit: 1e-3 for mm
};

/** The unit with the prefix that suits numbers up to `largest` (SI, any sign). Units that take none
(rad, Hz, kg) stay as they are. **/
DisplayUnit chooseDisplayUnit(const std::string& unit, double largest);

/** The same, with a power of ten before units that no prefix makes fit: "10⁶ GPa". **/
DisplayUnit chooseScaledUnit(const std::string& unit, double largest);

/** Three digits and such a unit: "12.5 kN". **/
std::string formatQuantity(double value, const std::string& unit);

/** "name [unit]", or the name alone. **/
std::string makeAxisLabel(const std::string& name, const std::string& unit);

/** "10⁻⁹". **/
std::string formatPowerOfTen(int exponent);

}  // namespace simflex
