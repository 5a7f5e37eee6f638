#pragma once
/** @file
Interval arithmetic: the result contains every value of the function on the set, and may be larger
(Moore, Interval Analysis, ch. 3). It is empty where the function is undefined everywhere, and has
infinite bounds where the function is unbounded.

Bounds are rounded to nearest: sufficient for finding candidates, but no proof. **/

#include <algorithm>
#include <cmath>
#include <limits>

namespace simflex {
namespace formula {

struct Interval {
    double low = 0, high = 0;

    Interval() = default;
    Interval(double value) : low(value), high(value) {}
    Interval(double first, double last) : low(first), high(last) {
        if (std::isnan(first) || std::isnan(last)) *this = makeWhole();
    }
    static Interval makeWhole() {
        const double infinity = std::numeric_limits<double>::infinity();
        return {-infinity, infinity};
    }

    static Interval makeEmpty() {
        Interval empty;
        empty.low = std::numeric_limits<double>::infinity();
        empty.high = -empty.low;
        return empty;
    }

    bool isEmpty() const { return low > high; }
    bool contains(double value) const { return low <= value && value <= high; }
    bool isPoint() const { return low == high; }
};

inline Interval hull(const Interval& a, const Interval& b) {
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

inline Interval operator-(const Interval& a) {
    return {-a.high, -a.low};
}
inline Interval operator+(const Interval& a, const Interval& b) {
    if (a.isEmpty() || b.isEmpty()) return Interval::makeEmpty();
    return {a.low + b.low, a.high + b.high};
}
inline Interval operator-(const Interval& a, const Interval& b) {
    return a + -b;
}
inline Interval operator*(const Interval& a, const Interval& b) {
    if (a.isEmpty() || b.isEmpty()) return Interval::makeEmpty();
    if ((a.isPoint() && a.low == 0) || (b.isPoint() && b.low == 0)) return 0;
    // 0·∞ stands for products of numbers nearby, which are unbounded.
    const double products[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
    for (double product : products)
        if (std::isnan(product)) return Interval::makeWhole();
    return {*std::min_element(products, products + 4), *std::max_element(products, products + 4)};
}
inline Interval operator/(const Interval& a, const Interval& b) {
    if (a.isEmpty() || b.isEmpty()) return Interval::makeEmpty();
    if (b.contains(0)) return Interval::makeWhole();
    return a * Interval(1 / b.high, 1 / b.low);
}

/** For a nondecreasing function defined on [low, high]. **/
template <class Function>
Interval mapRising(const Interval& x, double low, double high, Function function) {
    const double first = std::max(x.low, low), last = std::min(x.high, high);
    if (!(first <= last)) return Interval::makeEmpty();
    return {function(first), function(last)};
}

inline Interval exp(const Interval& x) {
    return {std::exp(x.low), std::exp(x.high)};
}
inline Interval sinh(const Interval& x) {
    return {std::sinh(x.low), std::sinh(x.high)};
}
inline Interval tanh(const Interval& x) {
    return {std::tanh(x.low), std::tanh(x.high)};
}
inline Interval atan(const Interval& x) {
    return {std::atan(x.low), std::atan(x.high)};
}
inline Interval log(const Interval& x) {
    return mapRising(x, 0, HUGE_VAL, [](double y) { return std::log(y); });
}
inline Interval log10(const Interval& x) {
    return mapRising(x, 0, HUGE_VAL, [](double y) { return std::log10(y); });
}
inline Interval sqrt(const Interval& x) {
    return mapRising(x, 0, HUGE_VAL, [](double y) { return std::sqrt(y); });
}
inline Interval asin(const Interval& x) {
    return mapRising(x, -1, 1, [](double y) { return std::asin(y); });
}
inline Interval acos(const Interval& x) {
    return -mapRising(x, -1, 1, [](double y) { return -std::acos(y); });
}
inline Interval abs(const Interval& x) {
    if (x.low >= 0) return x;
    if (x.high <= 0) return -x;
    return {0, std::max(-x.low, x.high)};
}
inline Interval cosh(const Interval& x) {
    const Interval size = abs(x);
    return {std::cosh(size.low), std::cosh(size.high)};
}
inline Interval floor(const Interval& x) {
    return {std::floor(x.low), std::floor(x.high)};
}
inline Interval ceil(const Interval& x) {
    return {std::ceil(x.low), std::ceil(x.high)};
}

/** True if phase + 2πk lies in x for a whole number k. **/
inline bool meets(const Interval& x, double phase) {
    const double turn = 2 * std::acos(-1.0);
    return std::ceil((x.low - phase) / turn) <= std::floor((x.high - phase) / turn);
}
inline Interval cos(const Interval& x) {
    if (x.isEmpty()) return x;
    if (!(x.high - x.low < 6) || std::abs(x.low) > 1e12) return {-1, 1};
    const double low = std::cos(x.low), high = std::cos(x.high);
    return {meets(x, std::acos(-1.0)) ? -1 : std::min(low, high),
            meets(x, 0) ? 1 : std::max(low, high)};
}
inline Interval sin(const Interval& x) {
    if (x.isEmpty()) return x;
    if (!(x.high - x.low < 6) || std::abs(x.low) > 1e12) return {-1, 1};
    const double low = std::sin(x.low), high = std::sin(x.high), quarter = std::acos(0.0);
    return {meets(x, -quarter) ? -1 : std::min(low, high),
            meets(x, quarter) ? 1 : std::max(low, high)};
}

/** x^p for a single number p. **/
inline Interval pow(const Interval& x, double p) {
    const bool isWhole = p == std::floor(p), isEven = isWhole && std::fmod(p, 2) == 0;
    if (p == 0) return 1;
    if (p < 0) return 1 / pow(x, -p);
    if (!isWhole) return mapRising(x, 0, HUGE_VAL, [p](double y) { return std::pow(y, p); });
    const Interval y = isEven ? abs(x) : x;
    return {std::pow(y.low, p), std::pow(y.high, p)};
}

}  // namespace formula
}  // namespace simflex
