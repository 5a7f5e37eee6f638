#pragma once
/** @file
Automatic differentiation in forward mode (Griewank & Walther, Evaluating Derivatives, ch. 13), and
the functions of formulas for three number types:

- `double`: values alone;
- `Jet<double>`: value, first and second derivative along one direction. Seed the time with (t, 1,
0); among several inputs, seed the one to differentiate by with (x, 1, 0);
- `Jet<Interval>`: bounds of all three over an interval.

At a kink, derivatives are those of the side ahead: |x| at 0 has the slope |x'|. Derivatives that do
not exist are not finite. **/

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "simflex/model/formula/Interval.h"
#include "simflex/model/formula/OwnFunction.h"
#include "simflex/model/formula/SurfaceTable.h"
#include "simflex/model/formula/Table.h"

namespace simflex {
namespace formula {

template <class T>
struct Jet {
    T value = 0, first = 0, second = 0;
    bool isConstant = true;  ///< independent of all inputs, so derivatives are 0

    Jet() = default;
    Jet(double constant) : value(constant) {}
    Jet(T v, T d, T dd) : value(v), first(d), second(dd), isConstant(false) {}
    static Jet makeVariable(T v) { return {v, T(1), T(0)}; }
};

/** Truth of a statement; Unknown for NaN, and for bounds that allow both. **/
enum class Truth { No, Yes, Unknown };

const double NoNumber = std::numeric_limits<double>::quiet_NaN();

//-------------------------------------------------------------------------------------------------
// Arithmetic

template <class T>
Jet<T> operator+(const Jet<T>& a, const Jet<T>& b) {
    Jet<T> sum(a.value + b.value, a.first + b.first, a.second + b.second);
    sum.isConstant = a.isConstant && b.isConstant;
    return sum;
}
template <class T>
Jet<T> operator-(const Jet<T>& a) {
    Jet<T> result(-a.value, -a.first, -a.second);
    result.isConstant = a.isConstant;
    return result;
}
template <class T>
Jet<T> operator-(const Jet<T>& a, const Jet<T>& b) {
    Jet<T> difference(a.value - b.value, a.first - b.first, a.second - b.second);
    difference.isConstant = a.isConstant && b.isConstant;
    return difference;
}
template <class T>
Jet<T> operator*(const Jet<T>& a, const Jet<T>& b) {
    if (a.isConstant) {
        Jet<T> product(a.value * b.value, a.value * b.first, a.value * b.second);
        product.isConstant = b.isConstant;
        return product;
    }
    if (b.isConstant) return b * a;
    return {a.value * b.value, a.first * b.value + a.value * b.first,
            a.second * b.value + 2 * (a.first * b.first) + a.value * b.second};
}

inline double divide(double a, double b) {
    return b == 0 ? NoNumber : a / b;  // an infinity could later become finite
}
inline Interval divide(const Interval& a, const Interval& b) {
    return a / b;
}
/** NaN outside the domain; a NaN has no power, not even the zeroth. **/
inline double logarithm(double x) {
    return x > 0 ? std::log(x) : NoNumber;
}
inline Interval logarithm(const Interval& x) {
    return log(x);
}
inline double power(double x, double p) {
    if (p == 2) return x * x;  // same value, without a call
    return std::isnan(x) || std::isnan(p) || (x == 0 && p < 0) ? NoNumber : std::pow(x, p);
}
inline Interval power(const Interval& x, double p) {
    return pow(x, p);
}
template <class T>
Jet<T> divide(const Jet<T>& a, const Jet<T>& b) {
    const T value = divide(a.value, b.value);
    if (b.isConstant) {
        Jet<T> quotient(value, divide(a.first, b.value), divide(a.second, b.value));
        quotient.isConstant = a.isConstant;
        return quotient;
    }
    const T first = divide(a.first - value * b.first, b.value);
    return {value, first, divide(a.second - 2 * (first * b.first) - value * b.second, b.value)};
}

//-------------------------------------------------------------------------------------------------
// Functions of one argument: f(x) from f, f' and f'' at x; derivatives are computed only if needed

template <class F, class D, class DD>
double chain(double x, F f, D, DD) {
    return f(x);
}
template <class T, class F, class D, class DD>
Jet<T> chain(const Jet<T>& x, F f, D df, DD ddf) {
    Jet<T> result;
    result.value = f(x.value);
    if (x.isConstant) return result;
    const T slope = df(x.value);
    result.first = slope * x.first;
    result.second = ddf(x.value) * (x.first * x.first) + slope * x.second;
    result.isConstant = false;
    return result;
}

/** Piecewise constant functions. **/
template <class F>
double applySteps(double x, F f) {
    return f(x);
}
template <class F>
Jet<double> applySteps(const Jet<double>& x, F f) {
    return f(x.value);
}
template <class F>
Jet<Interval> applySteps(const Jet<Interval>& x, F f) {
    const Interval value = f(x.value);
    const Interval slope = value.isPoint() ? Interval(0) : Interval::makeWhole();
    Jet<Interval> result(value, slope, slope);
    result.isConstant = x.isConstant;
    return result;
}

//-------------------------------------------------------------------------------------------------
// Functions that depend on the sign of a number

/** The sign of x just ahead: 1, 0 or −1. At x = 0 the derivatives decide. NaN for NaN. **/
inline double signAfter(double x) {
    return x > 0 ? 1 : x < 0 ? -1 : x;
}
inline double signAfter(const Jet<double>& x) {
    return x.value != 0   ? signAfter(x.value)
           : x.first != 0 ? signAfter(x.first)
                          : signAfter(x.second);
}

template <class S>
S absolute(const S& x) {
    return signAfter(x) < 0 ? -x : x;
}
template <class S>
S minimum(const S& a, const S& b) {
    const double sign = signAfter(a - b);
    return sign < 0 ? a : sign >= 0 ? b : a + b;  // NaN, like the sum
}
template <class S>
S maximum(const S& a, const S& b) {
    const double sign = signAfter(b - a);
    return sign < 0 ? a : sign >= 0 ? b : a + b;
}

inline double minimum(double a, double b) {
    const double least = a < b ? a : b;  // compiles without a branch
    return a == a ? least : a;
}
inline double maximum(double a, double b) {
    const double most = a > b ? a : b;
    return a == a ? most : a;
}

/** Either of two functions. **/
inline Jet<Interval> hull(const Jet<Interval>& a, const Jet<Interval>& b) {
    return {hull(a.value, b.value), Interval::makeWhole(), Interval::makeWhole()};
}
/** Either of two functions that meet where they switch, so that slopes are bounded. **/
inline Jet<Interval> joined(const Interval& value, const Jet<Interval>& a, const Jet<Interval>& b) {
    return {value, hull(a.first, b.first), Interval::makeWhole()};
}
inline Jet<Interval> absolute(const Jet<Interval>& x) {
    if (x.value.low >= 0) return x;
    if (x.value.high <= 0) return -x;
    return joined(abs(x.value), x, -x);
}
inline Jet<Interval> minimum(const Jet<Interval>& a, const Jet<Interval>& b) {
    if (a.value.high <= b.value.low) return a;
    if (b.value.high <= a.value.low) return b;
    return joined({std::min(a.value.low, b.value.low), std::min(a.value.high, b.value.high)}, a, b);
}
inline Jet<Interval> maximum(const Jet<Interval>& a, const Jet<Interval>& b) {
    return -minimum(-a, -b);
}

/** Truth of a number: nonzero is true, NaN unknown. **/
inline Truth truthOf(double x) {
    return std::isnan(x) ? Truth::Unknown : x != 0 ? Truth::Yes : Truth::No;
}
inline Truth truthOf(const Jet<double>& x) {
    return truthOf(x.value);
}
inline Truth truthOf(const Jet<Interval>& x) {
    if (!x.value.contains(0)) return Truth::Yes;
    return x.value.isPoint() ? Truth::No : Truth::Unknown;
}

/** Truth of `x < 0`. **/
inline Truth isBelow(double x) {
    return std::isnan(x) ? Truth::Unknown : x < 0 ? Truth::Yes : Truth::No;
}
inline Truth isBelow(const Jet<double>& x) {
    return isBelow(x.value);
}
inline Truth isBelow(const Jet<Interval>& x) {
    return x.value.high < 0 ? Truth::Yes : x.value.low >= 0 ? Truth::No : Truth::Unknown;
}
inline Truth negate(Truth truth) {
    return truth == Truth::Yes ? Truth::No : truth == Truth::No ? Truth::Yes : truth;
}

/** 1, 0, or if unknown NaN or the whole range between them. **/
template <class S>
S makeTruth(Truth truth) {
    const double number = truth == Truth::Unknown ? NoNumber : truth == Truth::Yes ? 1 : 0;
    if constexpr (std::is_same<S, double>::value) {
        return number;
    } else if constexpr (std::is_same<S, Jet<double>>::value) {
        return number;
    } else {
        const bool isKnown = truth != Truth::Unknown;
        const Interval slope = isKnown ? Interval(0) : Interval::makeWhole();
        return {isKnown ? Interval(number) : Interval(0, 1), slope, slope};
    }
}

//-------------------------------------------------------------------------------------------------
// Tables: NaN, or no bounds, where they refuse extrapolation

inline double lookUp(const Table& table, double x) {
    return table.covers(x) ? table.calc(x) : NoNumber;
}
inline Jet<double> lookUp(const Table& table, const Jet<double>& x) {
    if (!table.covers(x.value)) return NoNumber;
    const Table::Side side =
        signAfter(Jet<double>(x.first, x.second, 0)) < 0 ? Table::Side::Left : Table::Side::Right;
    return chain(
        x, [&](double at) { return table.calc(at); },
        [&](double at) { return table.calc(at, 1, side); },
        [&](double at) { return table.calc(at, 2, side); });
}
inline Jet<Interval> lookUp(const Table& table, const Jet<Interval>& x) {
    const auto bound = [&](int order) {
        return [&table, order](const Interval& at) {
            if (at.isEmpty()) return at;
            return table.covers(at.low) && table.covers(at.high) ? table.calcBounds(at, order)
                                                                 : Interval::makeWhole();
        };
    };
    return chain(x, bound(0), bound(1), bound(2));
}

inline double lookUp(const SurfaceTable& table, double x, double y) {
    return table.covers(x, y) ? table.calc(x, y) : NoNumber;
}
/** f(x, y) by the chain rule.
@param f  f(i, j): ∂^(i+j) f/∂x^i ∂y^j **/
template <class T, class F>
Jet<T> chainTwo(const Jet<T>& x, const Jet<T>& y, const F& f) {
    Jet<T> result;
    result.value = f(0, 0);
    if (x.isConstant && y.isConstant) return result;
    const T fx = f(1, 0), fy = f(0, 1);
    result.first = fx * x.first + fy * y.first;
    result.second = f(2, 0) * (x.first * x.first) + T(2) * (f(1, 1) * (x.first * y.first)) +
                    f(0, 2) * (y.first * y.first) + fx * x.second + fy * y.second;
    result.isConstant = false;
    return result;
}
inline Jet<double> lookUp(const SurfaceTable& table, const Jet<double>& x, const Jet<double>& y) {
    if (!table.covers(x.value, y.value)) return NoNumber;
    const auto findSide = [](const Jet<double>& z) {
        return signAfter(Jet<double>(z.first, z.second, 0)) < 0 ? Table::Side::Left
                                                                : Table::Side::Right;
    };
    const SurfaceTable::Sides sides{findSide(x), findSide(y)};
    return chainTwo(x, y, [&](int i, int j) { return table.calc(x.value, y.value, i, j, sides); });
}
inline Jet<Interval> lookUp(const SurfaceTable& table, const Jet<Interval>& x,
                            const Jet<Interval>& y) {
    const bool isKnown = !x.value.isEmpty() && !y.value.isEmpty() &&
                         table.covers(x.value.low, y.value.low) &&
                         table.covers(x.value.high, y.value.high);
    return chainTwo(x, y, [&](int i, int j) {
        if (x.value.isEmpty() || y.value.isEmpty()) return Interval::makeEmpty();
        return isKnown ? table.calcBounds(x.value, y.value, i, j) : Interval::makeWhole();
    });
}

//-------------------------------------------------------------------------------------------------
// User-defined functions: slopes by central differences, no second derivatives

inline double call(const OwnFunction& function, const double* x, int count) {
    for (int i = 0; i < count; ++i)
        if (std::isnan(x[i])) return NoNumber;
    return function.calc(x, count);
}
/** Slope by s of x(s) = x + s·direction. **/
inline double callSlope(const OwnFunction& function, const double* x, const double* direction,
                        int count) {
    double size = 1, length = 0;
    for (int i = 0; i < count; ++i) {
        if (direction[i] != 0) size = std::max(size, std::abs(x[i]));
        length = std::max(length, std::abs(direction[i]));
    }
    if (length == 0) return 0;
    const double step = 1e-6 * size / length;
    std::vector<double> sides(static_cast<std::size_t>(2 * count));
    double* const above = sides.data() + count;
    for (int i = 0; i < count; ++i) {
        sides[static_cast<std::size_t>(i)] = x[i] - step * direction[i];
        above[i] = x[i] + step * direction[i];
    }
    return (call(function, above, count) - call(function, sides.data(), count)) / (2 * step);
}
inline Jet<double> call(const OwnFunction& function, const Jet<double>* x, int count) {
    std::vector<double> values, direction;
    bool isConstant = true;
    for (int i = 0; i < count; ++i) {
        values.push_back(x[i].value);
        direction.push_back(x[i].first);
        isConstant &= x[i].isConstant;
    }
    const double value = call(function, values.data(), count);
    if (isConstant) return value;
    return {value, callSlope(function, values.data(), direction.data(), count), NoNumber};
}
inline Jet<Interval> call(const OwnFunction&, const Jet<Interval>*, int) {
    return {Interval::makeWhole(), Interval::makeWhole(), Interval::makeWhole()};
}

}  // namespace formula
}  // namespace simflex
