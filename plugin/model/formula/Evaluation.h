#pragma once
/** @file
Evaluation of a tree with any of the number types of Jet.h.

    evaluate<double>(tree, tree.getRoot(), &time);
    const Jet<double> now = Jet<double>::makeVariable(time);
    evaluate(tree, tree.getRoot(), &now);     // with derivatives

A result that does not exist is NaN, and so is everything computed from it. **/

#include <optional>
#include <vector>

#include "simflex/model/formula/Jet.h"
#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

/** 1, −1 or 0. **/
inline double signOf(double x) {
    return signAfter(x);
}
inline Interval signOf(const Interval& x) {
    return {signAfter(x.low), signAfter(x.high)};
}

/** y0 before t0, y1 from t1 on, and y0 + (y1 − y0)·shape(s), s = 0…1, in between. **/
template <class S, class Shape>
S rise(const S* t, Shape shape) {
    const S &at = t[0], &t0 = t[1], &y0 = t[2], &t1 = t[3], &y1 = t[4];
    const Truth isRise = isBelow(t0 - t1), isOver = negate(isBelow(at - t1));
    if (isOver == Truth::Yes) return y1;
    if (isRise == Truth::No && isOver == Truth::No) return y0;
    if (isRise == Truth::Yes && isBelow(at - t0) == Truth::Yes) return y0;
    const S s = isRise == Truth::Yes ? maximum(minimum(divide(at - t0, t1 - t0), S(1)), S(0))
                                     : makeTruth<S>(Truth::Unknown);
    return y0 + (y1 - y0) * shape(s);
}

/** x^p. **/
template <class S>
S raise(const S& x, const S& p, double value, bool isConstant) {
    using std::exp;
    if (isConstant)
        return chain(
            x, [&](auto y) { return power(y, value); },
            [&](auto y) { return value == 0 ? decltype(y)(0) : value * power(y, value - 1); },
            [&](auto y) {
                const double factor = value * (value - 1);
                return factor == 0 ? decltype(y)(0) : factor * power(y, value - 2);
            });
    const S exponent = p * chain(
                               x, [](auto y) { return logarithm(y); },
                               [](auto y) { return divide(decltype(y)(1), y); },
                               [](auto y) { return divide(decltype(y)(-1), y * y); });
    return chain(
        exponent, [](auto y) { return exp(y); }, [](auto y) { return exp(y); },
        [](auto y) { return exp(y); });
}

/** Applies one operation to its operands.
@tparam Operands  `S operator()(std::size_t i)` evaluates operand i, and is called only for operands
    in use; `findNumber(i)` points to it if it is a Number  **/
template <class S, class Operands>
class Application {
public:
    explicit Application(const Operands& operands) : operand(operands) {}

    /** For all operations except Number, Variable and Call. **/
    S calc(Operation operation, const Table* table, const SurfaceTable* surface) const {
        using std::acos;
        using std::asin;
        using std::atan;
        using std::ceil;
        using std::cos;
        using std::cosh;
        using std::exp;
        using std::floor;
        using std::sin;
        using std::sinh;
        using std::sqrt;
        using std::tan;
        using std::tanh;
        switch (operation) {
            case Operation::Number:
            case Operation::Variable:
            case Operation::Call:
                break;
            case Operation::Lookup:
                return lookUp(*table, operand(0));
            case Operation::LookupTwo:
                return lookUp(*surface, operand(0), operand(1));
            case Operation::Negate:
                return -operand(0);
            case Operation::Add:
                return operand(0) + operand(1);
            case Operation::Subtract:
                return operand(0) - operand(1);
            case Operation::Multiply:
                return operand(0) * operand(1);
            case Operation::Divide:
                return divide(operand(0), operand(1));
            case Operation::Power:
                return calcPower();
            case Operation::Less:
                return makeTruth<S>(isBelow(operand(0) - operand(1)));
            case Operation::LessOrEqual:
                return makeTruth<S>(negate(isBelow(operand(1) - operand(0))));
            case Operation::Equal:
                return makeTruth<S>(negate(truthOf(operand(0) - operand(1))));
            case Operation::NotEqual:
                return makeTruth<S>(truthOf(operand(0) - operand(1)));
            case Operation::And:
                return calcAnd();
            case Operation::Or:
                return calcOr();
            case Operation::If:
                return calcIf();
            case Operation::Sin:
                return chain(
                    operand(0), [](auto x) { return sin(x); }, [](auto x) { return cos(x); },
                    [](auto x) { return -sin(x); });
            case Operation::Cos:
                return chain(
                    operand(0), [](auto x) { return cos(x); }, [](auto x) { return -sin(x); },
                    [](auto x) { return -cos(x); });
            case Operation::Tan:
                return chain(
                    operand(0), [](auto x) { return calcTangent(x); },
                    [](auto x) { return 1 + squareOf(calcTangent(x)); },
                    [](auto x) {
                        const auto y = calcTangent(x);
                        return 2 * y * (1 + squareOf(y));
                    });
            case Operation::Asin:
                return chain(
                    operand(0), [](auto x) { return asin(x); },
                    [](auto x) { return calcArcSlope(x); },
                    [](auto x) { return x * cubeOf(calcArcSlope(x)); });
            case Operation::Acos:
                return chain(
                    operand(0), [](auto x) { return acos(x); },
                    [](auto x) { return -calcArcSlope(x); },
                    [](auto x) { return -x * cubeOf(calcArcSlope(x)); });
            case Operation::Atan:
                return calcAtan(operand(0));
            case Operation::Sinh:
                return chain(
                    operand(0), [](auto x) { return sinh(x); }, [](auto x) { return cosh(x); },
                    [](auto x) { return sinh(x); });
            case Operation::Cosh:
                return chain(
                    operand(0), [](auto x) { return cosh(x); }, [](auto x) { return sinh(x); },
                    [](auto x) { return cosh(x); });
            case Operation::Tanh:
                return chain(
                    operand(0), [](auto x) { return tanh(x); },
                    [](auto x) { return 1 - squareOf(tanh(x)); },
                    [](auto x) {
                        const auto y = tanh(x);
                        return -2 * y * (1 - squareOf(y));
                    });
            case Operation::Exp:
                return chain(
                    operand(0), [](auto x) { return exp(x); }, [](auto x) { return exp(x); },
                    [](auto x) { return exp(x); });
            case Operation::Ln:
                return chain(
                    operand(0), [](auto x) { return logarithm(x); },
                    [](auto x) { return divide(decltype(x)(1), x); },
                    [](auto x) { return divide(decltype(x)(-1), x * x); });
            case Operation::Log10: {
                const double scale = 1 / std::log(10.0);
                return chain(
                    operand(0), [](auto x) { return decimalLogarithm(x); },
                    [scale](auto x) { return divide(decltype(x)(scale), x); },
                    [scale](auto x) { return divide(decltype(x)(-scale), x * x); });
            }
            case Operation::Sqrt:
                return calcRoot(operand(0));
            case Operation::Abs:
                return absolute(operand(0));
            case Operation::Sign:
                return applySteps(operand(0), [](auto x) { return signOf(x); });
            case Operation::Floor:
                return applySteps(operand(0), [](auto x) { return floor(x); });
            case Operation::Ceil:
                return applySteps(operand(0), [](auto x) { return ceil(x); });
            case Operation::Mod: {
                const S a = operand(0), b = operand(1);
                return a - b * applySteps(divide(a, b), [](auto x) { return floor(x); });
            }
            case Operation::Atan2:
                return calcAtan2(operand(0), operand(1));
            case Operation::Hypot:
                return calcHypot(operand(0), operand(1));
            case Operation::Min:
                return minimum(operand(0), operand(1));
            case Operation::Max:
                return maximum(operand(0), operand(1));
            case Operation::Step:
            case Operation::Ramp: {
                const S t[] = {operand(0), operand(1), operand(2), operand(3), operand(4)};
                for (const S& x : t)
                    if (hasNoValue(x)) return S(NoNumber);
                if (descends(t[1], t[3])) return S(NoNumber);
                if (operation == Operation::Ramp) return rise(t, [](const S& s) { return s; });
                return rise(t, [](const S& s) {
                    return chain(
                        s, [](auto x) { return x * x * x * (10 + x * (6 * x - 15)); },
                        [](auto x) { return 30 * squareOf(x) * squareOf(1 - x); },
                        [](auto x) { return 60 * x * (1 - x) * (1 - 2 * x); });
                });
            }
            case Operation::Pulse: {
                const S t = operand(0), begin = operand(1), end = operand(2);
                if (descends(begin, end)) return S(NoNumber);
                return makeTruth<S>(both(negate(isBelow(t - begin)), isBelow(t - end)));
            }
        }
        return S(NoNumber);
    }

private:
    const Operands& operand;

    template <class T>
    static T squareOf(const T& x) {
        return x * x;
    }
    static Interval squareOf(const Interval& x) { return pow(x, 2); }
    template <class T>
    static T cubeOf(const T& x) {
        return x * x * x;
    }
    static double decimalLogarithm(double x) { return x > 0 ? std::log10(x) : NoNumber; }
    static Interval decimalLogarithm(const Interval& x) { return log10(x); }
    static double calcTangent(double x) { return std::tan(x); }
    static Interval calcTangent(const Interval& x) { return sin(x) / cos(x); }
    /** Derivative of asin. **/
    template <class T>
    static T calcArcSlope(const T& x) {
        using std::sqrt;
        return divide(T(1), sqrt((1 - x) * (1 + x)));
    }

    static bool hasNoValue(double x) { return std::isnan(x); }
    static bool hasNoValue(const Jet<double>& x) { return std::isnan(x.value); }
    static bool hasNoValue(const Jet<Interval>&) { return false; }

    /** True if the times of a step, ramp or pulse are in the wrong order. **/
    static bool descends(double begin, double end) { return begin > end; }
    static bool descends(const Jet<double>& begin, const Jet<double>& end) {
        return begin.value > end.value;
    }
    static bool descends(const Jet<Interval>&, const Jet<Interval>&) { return false; }

    static constexpr bool isOfBounds = std::is_same<S, Jet<Interval>>::value;

    /** Logical and. NaN makes the result unknown; with bounds, No decides even if the other is
    unknown. **/
    static Truth both(Truth a, Truth b) {
        if (!isOfBounds && (a == Truth::Unknown || b == Truth::Unknown)) return Truth::Unknown;
        if (a == Truth::No || b == Truth::No) return Truth::No;
        return a == Truth::Yes ? b : a;
    }

    S calcPower() const {
        const S base = operand(0);
        if (const double* exponent = operand.findNumber(1))
            return raise(base, S(*exponent), *exponent, true);
        return raiseToVariable(base, operand(1));
    }
    static double raiseToVariable(double x, double p) { return power(x, p); }
    static Jet<double> raiseToVariable(const Jet<double>& x, const Jet<double>& p) {
        Jet<double> result = p.isConstant ? raise(x, p, p.value, true) : raise(x, p, 0, false);
        result.value = power(x.value, p.value);
        return result;
    }
    static Jet<Interval> raiseToVariable(const Jet<Interval>& x, const Jet<Interval>& p) {
        return raise(x, p, 0, false);
    }

    S calcAnd() const {
        const Truth first = truthOf(operand(0));
        if (first == Truth::No) return makeTruth<S>(Truth::No);
        return makeTruth<S>(both(first, truthOf(operand(1))));
    }
    S calcOr() const {
        const Truth first = truthOf(operand(0));
        if (first == Truth::Yes) return makeTruth<S>(Truth::Yes);
        return makeTruth<S>(negate(both(negate(first), negate(truthOf(operand(1))))));
    }
    S calcIf() const {
        const Truth truth = truthOf(operand(0));
        if (truth == Truth::Unknown) return calcEither();
        return operand(truth == Truth::Yes ? 1 : 2);
    }
    S calcEither() const {
        if constexpr (isOfBounds)
            return hull(operand(1), operand(2));
        else
            return S(NoNumber);
    }

    static S calcAtan(const S& x) {
        using std::atan;
        return chain(
            x, [](auto y) { return atan(y); },
            [](auto y) { return divide(decltype(y)(1), 1 + squareOf(y)); },
            [](auto y) { return divide(-2 * y, squareOf(1 + squareOf(y))); });
    }
    static S calcRoot(const S& x) {
        using std::sqrt;
        return chain(
            x, [](auto y) { return sqrt(y); },
            [](auto y) { return divide(decltype(y)(0.5), sqrt(y)); },
            [](auto y) { return divide(decltype(y)(-0.25), y * sqrt(y)); });
    }

    static double calcAtan2(double y, double x) { return std::atan2(y, x); }
    /** The derivatives are those of atan(y/x), or of −atan(x/y). **/
    static Jet<double> calcAtan2(const Jet<double>& y, const Jet<double>& x) {
        Jet<double> result = std::abs(x.value) >= std::abs(y.value)
                                 ? Application::calcAtan(divide(y, x))
                                 : -Application::calcAtan(divide(x, y));
        result.value = std::atan2(y.value, x.value);
        return result;
    }
    static Jet<Interval> calcAtan2(const Jet<Interval>& y, const Jet<Interval>& x) {
        const double pi = std::acos(-1.0);
        if (x.value.low > 0) return Application::calcAtan(divide(y, x));
        if (!y.value.contains(0)) {
            const Jet<Interval> quarter(y.value.low > 0 ? pi / 2 : -pi / 2);
            return quarter - Application::calcAtan(divide(x, y));
        }
        return {{-pi, pi}, Interval::makeWhole(), Interval::makeWhole()};
    }

    static double calcHypot(double x, double y) { return std::hypot(x, y); }
    template <class T>
    static Jet<T> calcHypot(const Jet<T>& x, const Jet<T>& y) {
        const auto square = [](const Jet<T>& z) {
            return chain(
                z, [](auto v) { return squareOf(v); }, [](auto v) { return 2 * v; },
                [](auto v) { return decltype(v)(2); });
        };
        Jet<T> result = Application::calcRoot(square(x) + square(y));
        if constexpr (std::is_same<T, double>::value) result.value = std::hypot(x.value, y.value);
        return result;
    }
};

/** One evaluation of a tree; shared nodes are evaluated once. **/
template <class S>
class TreeEvaluation {
public:
    TreeEvaluation(const Tree& tree, const S* inputs) : m_tree(tree), m_inputs(inputs) {
        if (tree.isShared) m_known.resize(tree.nodes.size());
    }

    S calc(int number) {
        if (m_known.empty()) return calcNode(number);
        std::optional<S>& known = m_known[static_cast<std::size_t>(number)];
        if (!known) known = calcNode(number);
        return *known;
    }

private:
    S calcNode(int number) {
        const Node& node = m_tree[number];
        if (node.operation == Operation::Number) return S(node.number);
        if (node.operation == Operation::Variable) return m_inputs[node.variable];
        if (node.operation == Operation::Call) {
            std::vector<S> arguments;
            for (const int operand : node.operands) arguments.push_back(calc(operand));
            return call(*node.function, arguments.data(), static_cast<int>(arguments.size()));
        }
        struct Operands {
            TreeEvaluation& evaluation;
            const Node& node;
            S operator()(std::size_t i) const { return evaluation.calc(node.operands[i]); }
            const double* findNumber(std::size_t i) const {
                const Node& operand = evaluation.m_tree[node.operands[i]];
                return operand.operation == Operation::Number ? &operand.number : nullptr;
            }
        };
        const Operands operands{*this, node};
        return Application<S, Operands>(operands).calc(node.operation, node.table.get(),
                                                       node.surface.get());
    }

    const Tree& m_tree;
    const S* m_inputs;
    std::vector<std::optional<S>> m_known;
};

template <class S>
S evaluate(const Tree& tree, int number, const S* inputs) {
    return TreeEvaluation<S>(tree, inputs).calc(number);
}

}  // namespace formula
}  // namespace simflex
