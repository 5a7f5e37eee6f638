#include "Units.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "simflex/base/NumberText.h"

namespace simflex {

namespace {

struct Entry {
    const char* name;
    double size;
    double from;  // smallest number written in it, in SI units
};

// Tenths of a unit are still written in it where the next smaller one would be unusual: 0.4 mm
// rather than 400 µm, but 500 mm rather than 0.5 m.
const std::vector<Entry>& getUnits(Dimension dimension) {
    static const std::vector<Entry> length = {{"km", 1e3, 1e3},
                                              {"m", 1, 0.9995},
                                              {"mm", 1e-3, 0.0995e-3},
                                              {"µm", 1e-6, 0.0995e-6},
                                              {"nm", 1e-9, 0}};
    static const std::vector<Entry> velocity = {
        {"km/s", 1e3, 2e3}, {"m/s", 1, 0.0995}, {"mm/s", 1e-3, 0.0995e-3}, {"µm/s", 1e-6, 0}};
    static const std::vector<Entry> energyDensity = {
        {"GJ/m³", 1e9, 0.995e9}, {"MJ/m³", 1e6, 0.995e6},   {"kJ/m³", 1e3, 0.0995e3},
        {"J/m³", 1, 0.0995},     {"mJ/m³", 1e-3, 0.995e-3}, {"µJ/m³", 1e-6, 0}};
    static const std::vector<Entry> stress = {{"GPa", 1e9, 9.995e9},
                                              {"MPa", 1e6, 0.0995e6},
                                              {"kPa", 1e3, 0.0995e3},
                                              {"Pa", 1, 0.0995},
                                              {"mPa", 1e-3, 0}};
    static const std::vector<Entry> force = {{"MN", 1e6, 0.9995e6},
                                             {"kN", 1e3, 0.9995e3},
                                             {"N", 1, 0.0995},
                                             {"mN", 1e-3, 0.0995e-3},
                                             {"µN", 1e-6, 0}};
    static const std::vector<Entry> moment = {{"MN m", 1e6, 0.9995e6},
                                              {"kN m", 1e3, 0.9995e3},
                                              {"N m", 1, 0.0995},
                                              {"mN m", 1e-3, 0.0995e-3},
                                              {"µN m", 1e-6, 0}};
    switch (dimension) {
        case Dimension::Length:
            return length;
        case Dimension::Velocity:
            return velocity;
        case Dimension::EnergyDensity:
            return energyDensity;
        case Dimension::Stress:
            return stress;
        case Dimension::Force:
            return force;
        case Dimension::Moment:
            break;
    }
    return moment;
}

// Zero in the middle of what is usual.
const char* getUnitOfZero(Dimension dimension) {
    switch (dimension) {
        case Dimension::Length:
            return "mm";
        case Dimension::Velocity:
            return "m/s";
        case Dimension::EnergyDensity:
            return "J/m³";
        case Dimension::Stress:
            return "MPa";
        case Dimension::Force:
            return "N";
        case Dimension::Moment:
            break;
    }
    return "N m";
}

std::string formatExponent(int exponent) {
    static const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text = exponent < 0 ? "⁻" : "";
    for (const char digit : std::to_string(std::abs(exponent))) text += digits[digit - '0'];
    return text;
}

}  // namespace

Unit chooseUnit(Dimension dimension, double largest) {
    const std::vector<Entry>& units = getUnits(dimension);
    const double size = std::abs(largest);
    if (!(size > 0) || !std::isfinite(size)) {
        for (const Entry& unit : units)
            if (unit.name == std::string(getUnitOfZero(dimension))) return {unit.name, unit.size};
    }
    const Entry* chosen = &units.back();
    for (const Entry& unit : units)
        if (size >= unit.from) {
            chosen = &unit;
            break;
        }
    const double number = size / chosen->size;
    if (number >= 0.00995 && number < 1e5) return {chosen->name, chosen->size};
    const int exponent = 3 * int(std::floor(std::log10(number) / 3 + 1e-9));
    return {"10" + formatExponent(exponent) + " " + chosen->name,
            chosen->size * std::pow(10.0, exponent)};
}

std::string formatQuantity(double value, Dimension dimension) {
    const Unit unit = chooseUnit(dimension, value);
    const double number = value / unit.size;
    return (std::abs(number) >= 999.5 ? writeFixed(number, 0) : writeGeneral(number, 3)) + " " +
           unit.name;
}

double chooseTickStep(double low, double high) {
    const double span = high - low;
    if (!(span > 0) || !std::isfinite(span)) return 1;
    const double decade = std::pow(10, std::floor(std::log10(span / 6)));
    const auto endsOnTick = [](double end, double step) {
        return std::abs(end / step - std::round(end / step)) < 1e-6;
    };
    double best = decade, bestScore = std::numeric_limits<double>::infinity();
    for (const double factor : {0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 10.0, 20.0}) {
        const double step = factor * decade, intervals = span / step;
        if (intervals < 3.5 || intervals > 10.5) continue;
        double score = std::abs(intervals - 6) / 6;
        if (!endsOnTick(low, step)) score += 1;
        if (!endsOnTick(high, step)) score += 1;
        if (factor == 2.5 || factor == 4) score += 0.4;
        if (score < bestScore) {
            bestScore = score;
            best = step;
        }
    }
    return best;
}

int countDecimals(double step) {
    for (int decimals = std::max(0, -int(std::floor(std::log10(step) + 1e-9)));; ++decimals) {
        const double shifted = step * std::pow(10, decimals);
        if (std::abs(shifted - std::round(shifted)) < 1e-6 * shifted || decimals > 12)
            return decimals;
    }
}

}  // namespace simflex
