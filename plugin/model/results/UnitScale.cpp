#include "simflex/model/results/UnitScale.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace simflex {
namespace model {
namespace {

/** Exponents of ten between which prefixes of a unit are usual. **/
std::pair<int, int> getPrefixRange(const std::string& unit) {
    const std::string first = unit.substr(0, unit.find_first_of(" /^*"));
    const bool isPower = unit.size() > first.size() && unit[first.size()] == '^';
    if (isPower) return {0, 0};  // 1000 mm^2 are not 1 m^2
    if (first == "m") return {-9, 0};
    if (first == "s" && unit == "s") return {-9, 0};
    if (first == "N" || first == "J" || first == "W") return {-6, 9};
    if (first == "Pa") return {-3, 9};
    return {0, 0};
}

const std::map<int, std::string> UnitPrefixes = {{-9, "n"}, {-6, "µ"}, {-3, "m"}, {0, ""},
                                                 {3, "k"},  {6, "M"},  {9, "G"}};

/** "m/s^2" as "m/s²". **/
std::string beautify(std::string unit) {
    for (const auto& [plain, nice] : {std::pair<const char*, const char*>{"^2", "²"}, {"^3", "³"}})
        for (size_t at = unit.find(plain); at != std::string::npos; at = unit.find(plain))
            unit.replace(at, 2, nice);
    return unit;
}

}  // namespace

UnitScale chooseUnitScale(const std::string& unit, double largest) {
    if (!(largest > 0) || !std::isfinite(largest)) return {beautify(unit), 1};
    int exponent = 3 * int(std::floor(std::log10(largest * (1 + 1e-9)) / 3));
    if (exponent == -3 && largest >= 0.1) exponent = 0;  // 0.3 m rather than 300 mm
    const auto [lowest, highest] = getPrefixRange(unit);
    exponent = std::clamp(exponent, lowest, highest);
    return {UnitPrefixes.at(exponent) + beautify(unit), std::pow(10.0, exponent)};
}

std::string makeAxisLabel(const std::string& name, const std::string& unit) {
    if (unit.empty()) return name;
    return name + (name.empty() ? "[" : " [") + unit + "]";
}

}  // namespace model
}  // namespace simflex
