#include "simflex/model/formula/Switches.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "simflex/model/formula/Evaluation.h"

namespace simflex {
namespace formula {

namespace {

const double Never = std::numeric_limits<double>::infinity();
/** Closest crossings that are resolved, relative to the interval between two other switches. **/
const double Resolution = 1e-9;
/** Largest number of intervals in a search; the remaining ones are treated as monotone. **/
const long MostIntervals = 2000000;

/** Times closer than this are equal. **/
double calcRoundOff(double time) {
    return 1e-14 * std::max(1.0, std::abs(time));
}

/** Neighbourhood of a switch; functions that may vanish here vanish at the switch. **/
Interval makeNeighbourhood(double time) {
    const double distance = 1e-9 * std::max(1.0, std::abs(time));
    return {time - distance, time + distance};
}

/** The levels that an argument may cross. **/
class Levels {
public:
    static Levels zero() { return Levels(Kind::Zero, nullptr); }
    static Levels wholeNumbers() { return Levels(Kind::Whole, nullptr); }
    static Levels pointsOf(const std::vector<double>& points) {
        return Levels(Kind::Points, &points);
    }

    /** Rises by 1 on reaching a level, and by 1 above it. **/
    double count(double x) const {
        if (std::isnan(x)) return -Never;  // the argument's domain begins and ends at a switch
        switch (m_kind) {
            case Kind::Zero:
                return x < 0 ? 0 : x > 0 ? 2 : 1;
            case Kind::Whole:
                return std::floor(x) + std::ceil(x);
            case Kind::Points:
                break;
        }
        return double(std::lower_bound(m_points->begin(), m_points->end(), x) - m_points->begin()) +
               double(std::upper_bound(m_points->begin(), m_points->end(), x) - m_points->begin());
    }
    bool areIn(const Interval& x) const {
        if (x.isEmpty()) return false;
        const double low = count(x.low), high = count(x.high);
        return low != high || std::fmod(low, 2) != 0;
    }

private:
    enum class Kind { Zero, Whole, Points };
    Levels(Kind kind, const std::vector<double>* points) : m_kind(kind), m_points(points) {}

    Kind m_kind;
    const std::vector<double>* m_points;
};

void unite(std::vector<double>& times) {
    std::sort(times.begin(), times.end());
    const auto isSame = [](double a, double b) { return b - a <= calcRoundOff(a); };
    times.erase(std::unique(times.begin(), times.end(), isSame), times.end());
}

class Search {
public:
    explicit Search(const Tree& tree) : m_tree(tree) {}

    /** Switches of a node and those below it, in (from, to]. **/
    std::vector<double> find(int number, double from, double to) {
        if (!m_tree.isShared) return findAnew(number, from, to);
        const auto key = std::make_tuple(number, from, to);
        const auto known = m_known.find(key);
        if (known != m_known.end()) return known->second;
        return m_known[key] = findAnew(number, from, to);
    }

private:
    std::vector<double> findAnew(int number, double from, double to) {
        const Node& node = m_tree[number];
        if (node.operation == Operation::If) return findInChoice(node, from, to);
        std::vector<double> times;
        for (int operand : node.operands) {
            const std::vector<double> inner = find(operand, from, to);
            times.insert(times.end(), inner.begin(), inner.end());
        }
        unite(times);
        std::vector<double> all = times;
        for (const Argument& argument : listArguments(node))
            findPassings(argument, times, from, to, all);
        for (const double level : listTurningLevels(node))
            findTurns(node.operands[0], level, times, from, to, all);
        if (node.operation == Operation::Hypot) findCommonZeros(node, times, from, to, all);
        unite(all);
        return all;
    }

    /** a − b; a if there is no b; a/b for a quotient. **/
    struct Argument {
        int a, b;
        Levels levels;
        bool isQuotient = false;
    };

    const Tree& m_tree;
    long m_numIntervals = 0;
    std::map<std::tuple<int, double, double>, std::vector<double>> m_known;  ///< results of find()

    /** Arguments whose level crossings are switches of a node. **/
    std::vector<Argument> listArguments(const Node& node) const {
        const auto operand = [&](std::size_t i) { return node.operands[i]; };
        std::vector<Argument> arguments;
        switch (node.operation) {
            case Operation::Less:
            case Operation::LessOrEqual:
            case Operation::Equal:
            case Operation::NotEqual:
            case Operation::Min:
            case Operation::Max:
                return {{operand(0), operand(1), Levels::zero()}};
            case Operation::And:
            case Operation::Or:
                for (int part : node.operands)
                    if (!isTruth(part)) arguments.push_back({part, -1, Levels::zero()});
                return arguments;
            case Operation::Abs:
            case Operation::Sign:
            case Operation::Atan2:
                return {{operand(0), -1, Levels::zero()}};
            case Operation::Floor:
            case Operation::Ceil:
                return {{operand(0), -1, Levels::wholeNumbers()}};
            case Operation::Mod:
                return {{operand(0), operand(1), Levels::wholeNumbers(), true}};
            case Operation::Step:
            case Operation::Ramp:
                return {{operand(0), operand(1), Levels::zero()},
                        {operand(0), operand(3), Levels::zero()}};
            case Operation::Pulse:
                return {{operand(0), operand(1), Levels::zero()},
                        {operand(0), operand(2), Levels::zero()}};
            case Operation::Lookup:
                return {{operand(0), -1, Levels::pointsOf(node.table->getPoints())}};
            case Operation::LookupTwo:
                return {{operand(0), -1, Levels::pointsOf(node.surface->getPoints(0))},
                        {operand(1), -1, Levels::pointsOf(node.surface->getPoints(1))}};
            default:
                return {};
        }
    }

    /** Levels at which turning points of the first operand are kinks of the node: √x² = |x|. **/
    std::vector<double> listTurningLevels(const Node& node) const {
        switch (node.operation) {
            case Operation::Sqrt:
                return {0};
            case Operation::Power: {
                const Node& exponent = m_tree[node.operands[1]];
                const bool isRoot = exponent.operation == Operation::Number &&
                                    exponent.number > 0 &&
                                    exponent.number != std::floor(exponent.number);
                return isRoot ? std::vector<double>{0} : std::vector<double>();
            }
            case Operation::Asin:
            case Operation::Acos:
                return {-1, 1};
            default:
                return {};
        }
    }

    /** True if a node's value is 0 or 1. **/
    bool isTruth(int number) const {
        switch (m_tree[number].operation) {
            case Operation::Less:
            case Operation::LessOrEqual:
            case Operation::Equal:
            case Operation::NotEqual:
            case Operation::And:
            case Operation::Or:
            case Operation::Pulse:
                return true;
            default:
                return false;
        }
    }

    /** Switches of the condition, and between them those of the branch taken. **/
    std::vector<double> findInChoice(const Node& choice, double from, double to) {
        const int condition = choice.operands[0];
        const std::vector<double> inner = find(condition, from, to);
        std::vector<double> times = inner;
        if (!isTruth(condition))
            findPassings({condition, -1, Levels::zero()}, inner, from, to, times);
        unite(times);
        std::vector<double> all = times;
        double begin = from;
        for (std::size_t i = 0; i <= times.size(); ++i) {
            const double next = i < times.size() ? times[i] : Never;
            const double end = std::min(to, std::nextafter(next, -Never));
            const double middle = begin + (end - begin) / 2;
            const bool isTrue = evaluate<double>(m_tree, condition, &middle) != 0;
            if (begin < end) {
                const std::vector<double> taken = find(choice.operands[isTrue ? 1 : 2], begin, end);
                all.insert(all.end(), taken.begin(), taken.end());
            }
            begin = next;
        }
        unite(all);
        return all;
    }

    template <class S>
    S calc(const Argument& argument, const S& time) const {
        const S a = evaluate(m_tree, argument.a, &time);
        if (argument.b < 0) return a;
        const S b = evaluate(m_tree, argument.b, &time);
        return argument.isQuotient ? divide(a, b) : a - b;
    }

    /** Calls work(begin, end) between `breaks`, where formulas do not change course. **/
    template <class Work>
    static void forEachStretch(const std::vector<double>& breaks, double from, double to,
                               const Work& work) {
        double begin = from;
        for (std::size_t i = 0; i <= breaks.size(); ++i) {
            const double next = i < breaks.size() ? breaks[i] : Never;
            const double end = std::min(to, std::nextafter(next, -Never));
            if (begin < end) work(begin, end);
            begin = next;
        }
    }

    void findPassings(const Argument& argument, const std::vector<double>& breaks, double from,
                      double to, std::vector<double>& times) {
        forEachStretch(breaks, from, to, [&](double begin, double end) {
            search(argument, begin, end, Resolution * (end - begin), times);
        });
    }

    void findTurns(int number, double level, const std::vector<double>& breaks, double from,
                   double to, std::vector<double>& times) {
        forEachStretch(breaks, from, to, [&](double begin, double end) {
            searchTurn(number, level, begin, end, Resolution * (end - begin), times);
        });
    }

    /** Zeros of √(a² + b²): one operand crosses zero while the other is zero. **/
    void findCommonZeros(const Node& node, const std::vector<double>& breaks, double from,
                         double to, std::vector<double>& times) {
        for (int i : {0, 1}) {
            const int other = node.operands[std::size_t(1 - i)];
            std::vector<double> zeros;
            findPassings({node.operands[std::size_t(i)], -1, Levels::zero()}, breaks, from, to,
                         zeros);
            for (const double time : zeros)
                if (calcBounds(other, makeNeighbourhood(time)).value.contains(0))
                    times.push_back(time);
        }
    }

    Jet<Interval> calcBounds(int number, const Interval& time) const {
        const auto variable = Jet<Interval>::makeVariable(time);
        return evaluate(m_tree, number, &variable);
    }

    void searchTurn(int number, double level, double low, double high, double resolution,
                    std::vector<double>& times) {
        const Jet<Interval> bounds = calcBounds(number, {low, high});
        if (!bounds.value.contains(level) || !bounds.first.contains(0)) return;
        const bool isSlopeMonotone = bounds.second.low >= 0 || bounds.second.high <= 0;
        if (isSlopeMonotone || high - low <= resolution || ++m_numIntervals > MostIntervals) {
            const auto count = [&](double time) {
                const auto variable = Jet<double>::makeVariable(time);
                return Levels::zero().count(evaluate(m_tree, number, &variable).first);
            };
            std::vector<double> turns;
            bracket(count, low, count(low), high, count(high), turns);
            for (const double time : turns)
                if (calcBounds(number, makeNeighbourhood(time)).value.contains(level))
                    times.push_back(time);
            return;
        }
        const double middle = low + (high - low) / 2;
        searchTurn(number, level, low, middle, resolution, times);
        searchTurn(number, level, middle, high, resolution, times);
    }

    void search(const Argument& argument, double low, double high, double resolution,
                std::vector<double>& times) {
        const Jet<Interval> bounds =
            calc(argument, Jet<Interval>::makeVariable(Interval(low, high)));
        if (!argument.levels.areIn(bounds.value)) return;
        const bool isMonotone = bounds.first.low >= 0 || bounds.first.high <= 0;
        if (isMonotone || high - low <= resolution || ++m_numIntervals > MostIntervals) {
            const auto count = [&](double time) {
                return argument.levels.count(calc(argument, time));
            };
            bracket(count, low, count(low), high, count(high), times);
            return;
        }
        const double middle = low + (high - low) / 2;
        search(argument, low, middle, resolution, times);
        search(argument, middle, high, resolution, times);
    }

    /** The first time of each count between those at both ends. **/
    template <class Count>
    void bracket(const Count& count, double low, double countLow, double high, double countHigh,
                 std::vector<double>& times) const {
        if (countLow == countHigh) return;
        const double middle = low + (high - low) / 2;
        if (!(low < middle && middle < high) || high - low < 1e-3 * calcRoundOff(0)) {
            times.push_back(high);
            return;
        }
        const double countMiddle = count(middle);
        bracket(count, low, countLow, middle, countMiddle, times);
        bracket(count, middle, countMiddle, high, countHigh, times);
    }
};

}  // namespace

std::vector<double> findSwitches(const Tree& tree, double from, double to) {
    std::vector<double> times = Search(tree).find(tree.getRoot(), from, to);
    const auto isAfter = [from](double time) { return time - from > calcRoundOff(from); };
    times.erase(times.begin(), std::find_if(times.begin(), times.end(), isAfter));
    return times;
}

}  // namespace formula
}  // namespace simflex
