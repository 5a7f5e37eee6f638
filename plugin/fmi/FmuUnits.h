#pragma once
/** @file
Units by their names in terms of SI's base units, as FMI wants them. Internal. **/

#include <array>
#include <optional>
#include <string>

namespace simflex {

/** A quantity in the unit, times the factor, is one in kg, m, s, A, K, mol, cd, rad to these
powers. **/
struct BaseUnit {
    std::array<int, 8> powers{};
    double factor = 1;
};
extern const char* const BaseUnitNames[8];

/** Of "N m", "kg m^2/s", "rad/s", "MPa"; nothing if it is not known. **/
std::optional<BaseUnit> findBaseUnit(const std::string& unit);

}  // namespace simflex
