#include "simflex/solver/integration/BreakTimes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simflex/base/Checkpoint.h"

namespace simflex {

namespace {

constexpr double Infinity = std::numeric_limits<double>::infinity();

/** Times closer together than this are one. **/
double calcRoundOff(double time) {
    return 1e-13 * std::max(1.0, std::abs(time));
}

/** How far from a break the equations are evaluated: more than a formula's own round-off. **/
double calcMargin(double time) {
    return 0.1 * calcRoundOff(time);
}

}  // namespace

bool isLater(double a, double b) {
    return b - a > calcRoundOff(a);
}

BreakTimes::BreakTimes() : m_first(-Infinity), m_last(Infinity), m_end(Infinity) {}

void BreakTimes::add(std::vector<double> times) {
    std::sort(times.begin(), times.end());
    add([times = std::move(times)](double time) {
        const auto next = std::upper_bound(times.begin(), times.end(), time);
        return next == times.end() ? Infinity : *next;
    });
}

double BreakTimes::findNext(double time) const {
    double next = Infinity;
    for (const Next& source : m_sources) next = std::min(next, source(time));
    return next;
}

void BreakTimes::moveTo(double time) {
    const double near = calcRoundOff(time);
    const bool isBreak = findNext(time - near) <= time + near;
    m_first = isBreak ? time + calcMargin(time) : -Infinity;
    m_end = findNext(time + near);
    m_last = m_end < Infinity ? m_end - calcMargin(m_end) : Infinity;
}

void BreakTimes::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_first, m_last, m_end);
}

}  // namespace simflex
