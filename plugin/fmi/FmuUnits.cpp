#include "simflex/fmi/FmuUnits.h"

#include <cmath>
#include <utility>

namespace simflex {

const char* const BaseUnitNames[8] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

namespace {

constexpr double Pi = 3.14159265358979323846;

/** Symbols without prefixes: powers of kg, m, s, A, K, mol, cd, rad. **/
const std::pair<const char*, BaseUnit> Symbols[] = {
    {"1", {}},
    {"%", {{}, 0.01}},
    {"kg", {{1}, 1}},
    {"g", {{1}, 1e-3}},
    {"m", {{0, 1}, 1}},
    {"s", {{0, 0, 1}, 1}},
    {"min", {{0, 0, 1}, 60}},
    {"h", {{0, 0, 1}, 3600}},
    {"A", {{0, 0, 0, 1}, 1}},
    {"K", {{0, 0, 0, 0, 1}, 1}},
    {"rad", {{0, 0, 0, 0, 0, 0, 0, 1}, 1}},
    {"deg", {{0, 0, 0, 0, 0, 0, 0, 1}, Pi / 180}},
    {"rpm", {{0, 0, -1, 0, 0, 0, 0, 1}, Pi / 30}},
    {"Hz", {{0, 0, -1}, 1}},
    {"N", {{1, 1, -2}, 1}},
    {"Pa", {{1, -1, -2}, 1}},
    {"bar", {{1, -1, -2}, 1e5}},
    {"J", {{1, 2, -2}, 1}},
    {"W", {{1, 2, -3}, 1}},
    {"V", {{1, 2, -3, -1}, 1}},
};
const std::pair<const char*, double> Prefixes[] = {
    {"G", 1e9}, {"M", 1e6}, {"k", 1e3}, {"c", 1e-2}, {"m", 1e-3}, {"u", 1e-6}, {"µ", 1e-6}};

std::optional<BaseUnit> findSymbol(const std::string& symbol) {
    for (const auto& [name, unit] : Symbols)
        if (symbol == name) return unit;
    for (const auto& [prefix, factor] : Prefixes) {
        const std::string text = prefix;
        if (symbol.size() <= text.size() || symbol.compare(0, text.size(), text) != 0) continue;
        for (const auto& [name, unit] : Symbols)
            if (symbol.substr(text.size()) == name)
                return BaseUnit{unit.powers, unit.factor * factor};
    }
    return {};
}

}  // namespace

std::optional<BaseUnit> findBaseUnit(const std::string& unit) {
    BaseUnit whole;
    int sign = 1;
    for (std::size_t i = 0; i < unit.size();) {
        if (unit[i] == ' ' || unit[i] == '*') {
            ++i;
        } else if (unit[i] == '/') {
            if (sign < 0) return {};
            sign = -1;
            ++i;
        } else {
            const std::size_t end = std::min(unit.find_first_of(" */^", i), unit.size());
            const std::optional<BaseUnit> factor = findSymbol(unit.substr(i, end - i));
            if (!factor) return {};
            int power = sign;
            i = end;
            if (i < unit.size() && unit[i] == '^') {
                if (i + 1 >= unit.size() || unit[i + 1] < '1' || unit[i + 1] > '9') return {};
                power *= unit[i + 1] - '0';
                i += 2;
            }
            for (std::size_t k = 0; k < whole.powers.size(); ++k)
                whole.powers[k] += power * factor->powers[k];
            whole.factor *= std::pow(factor->factor, power);
        }
    }
    return whole;
}

}  // namespace simflex
