#include "simflex/base/DisplayUnit.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

struct Prefix {
    int exponent;  // power of ten
    double from;   // smallest value written with this prefix
};
struct Row {
    const char* unit;
    int zero;                      // exponent of the prefix for zero
    std::vector<Prefix> prefixes;  // from large to small; the last takes all remaining values
};

constexpr double whole = 0.9995, tenths = 0.0995;

/** `tenths` keeps a unit down to 0.1 where the next smaller one is unusual: 0.4 mm instead of 400
µm, but 500 mm instead of 0.5 m. **/
const std::vector<Row>& getRows() {
    static const std::vector<Row> rows = {
        {"m/s", 0, {{3, 2}, {0, tenths}, {-3, tenths}, {-6, 0}}},
        {"m", -3, {{3, whole}, {0, whole}, {-3, tenths}, {-6, tenths}, {-9, 0}}},
        {"s", 0, {{0, tenths}, {-3, whole}, {-6, whole}, {-9, 0}}},
        {"Pa", 6, {{9, 9.995}, {6, tenths}, {3, tenths}, {0, tenths}, {-3, 0}}},
        {"N", 0, {{6, whole}, {3, whole}, {0, tenths}, {-3, tenths}, {-6, 0}}},
        {"J", 0, {{9, whole}, {6, whole}, {3, tenths}, {0, tenths}, {-3, whole}, {-6, 0}}},
        {"W", 0, {{9, whole}, {6, whole}, {3, whole}, {0, tenths}, {-3, whole}, {-6, 0}}}};
    return rows;
}

/** Returns the row of the first factor of a unit, null if it is a power: 1000 mm² are not 1 m². **/
const Row* findRow(const std::string& unit) {
    for (const Row& row : getRows()) {
        const std::string first = row.unit;
        if (unit == first) return &row;
        if (unit.compare(0, first.size(), first) != 0) continue;
        const char next = unit[first.size()];
        if (next == ' ' || next == '/' || next == '*' || (next == '^' && first == "m/s"))
            return &row;
    }
    return nullptr;
}

/** Converts "m/s^2" to "m/s²". **/
std::string beautify(std::string unit) {
    for (const auto& [plain, nice] : {std::pair<const char*, const char*>{"^2", "²"}, {"^3", "³"}})
        for (size_t at = unit.find(plain); at != std::string::npos; at = unit.find(plain))
            unit.replace(at, 2, nice);
    return unit;
}

}  // namespace

std::string formatPowerOfTen(int exponent) {
    static const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text = exponent < 0 ? "10⁻" : "10";
    for (const char digit : std::to_string(std::abs(exponent))) text += digits[digit - '0'];
    return text;
}

DisplayUnit chooseDisplayUnit(const std::string& unit, double largest) {
    static const std::map<int, std::string> names = {{-9, "n"}, {-6, "µ"}, {-3, "m"}, {0, ""},
                                                     {3, "k"},  {6, "M"},  {9, "G"}};
    const Row* const row = findRow(unit);
    if (!row) return {beautify(unit), 1};
    const double size = std::abs(largest);
    int exponent = row->zero;
    if (size > 0 && std::isfinite(size))
        for (auto prefix = row->prefixes.rbegin(); prefix != row->prefixes.rend(); ++prefix)
            if (prefix->from == 0 || size >= prefix->from * std::pow(10, prefix->exponent))
                exponent = prefix->exponent;
    return {names.at(exponent) + beautify(unit), std::pow(10.0, exponent)};
}

DisplayUnit chooseScaledUnit(const std::string& unit, double largest) {
    const DisplayUnit chosen = chooseDisplayUnit(unit, largest);
    const double number = std::abs(largest) / chosen.size;
    if (!(number > 0) || !std::isfinite(number) || (number >= 0.00995 && number < 1e5))
        return chosen;
    const int exponent = 3 * int(std::floor(std::log10(number) / 3 + 1e-9));
    return {formatPowerOfTen(exponent) + " " + chosen.name, chosen.size * std::pow(10.0, exponent)};
}

std::string formatQuantity(double value, const std::string& unit) {
    const DisplayUnit written = chooseScaledUnit(unit, value);
    const double number = value / written.size;
    return (std::abs(number) >= 999.5 ? writeFixed(number, 0) : writeGeneral(number, 3)) + " " +
           written.name;
}

std::string makeAxisLabel(const std::string& name, const std::string& unit) {
    if (unit.empty()) return name;
    return name + (name.empty() ? "[" : " [") + unit + "]";
}

}  // namespace simflex
