#pragma once
/** @file
Units in terms of SI base units, as required by FMI. Internal. **/

#include <array>
#include <optional>
#include <string>

namespace simflex {

/** Powers of kg, m, s, A, K, mol, cd, rad; a quantity in the unit times `factor` is in these base
units. **/
struct BaseUnit {
    std::array<int, 8> powers{};
    double factor = 1;
};
extern const char* const BaseUnitNames[8];

/** Parses "N m", "kg m^2/s", "rad/s", "MPa"; nothing if the unit is unknown. **/
std::optional<BaseUnit> findBaseUnit(const std::string& unit);

}  // namespace simflex
