#pragma once
/** @file
Units as people write them: millimetres for what is measured in millimetres. **/

#include <string>

namespace simflex {
namespace model {

struct UnitScale {
    std::string unit;  ///< "mm", "kN m", "m/s²"; "" for none
    double size = 1;   ///< in the SI unit: 1e-3 for mm
};

/** The unit with the prefix that suits values up to `largest`. Units that take none (rad, Hz, kg)
stay as they are. **/
UnitScale chooseUnitScale(const std::string& unit, double largest);

/** "name [unit]", or the name alone. **/
std::string makeAxisLabel(const std::string& name, const std::string& unit);

}  // namespace model
}  // namespace simflex
