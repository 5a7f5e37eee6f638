#pragma once
/** @file
Units for display: millimetres for lengths of millimetres.

    const DisplayUnit unit = chooseDisplayUnit("m", 0.02);   // {"mm", 1e-3}
    label = makeAxisLabel("slider.x", unit.name);            // "slider.x [mm]"  **/

#include <string>

namespace simflex {

struct DisplayUnit {
    std::string name;  ///< "mm", "kN m", "m/s²"; "" if dimensionless
    double size = 1;   ///< in SI units: 1e-3 for mm
};

/** Chooses the prefix that suits numbers up to |largest| (SI). Units without prefixes (rad, Hz, kg)
are returned unchanged. **/
DisplayUnit chooseDisplayUnit(const std::string& unit, double largest);

/** As chooseDisplayUnit(), with a power of ten where no prefix fits: "10⁶ GPa". **/
DisplayUnit chooseScaledUnit(const std::string& unit, double largest);

/** Formats a value (SI) with three digits and its display unit: "12.5 kN". **/
std::string formatQuantity(double value, const std::string& unit);

/** Returns "name [unit]", or the name alone if the unit is empty. **/
std::string makeAxisLabel(const std::string& name, const std::string& unit);

/** Returns "10⁻⁹" for −9. **/
std::string formatPowerOfTen(int exponent);

}  // namespace simflex
