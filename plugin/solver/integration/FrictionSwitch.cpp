// Location of switches of joint contacts: between sticking and sliding, or a reversal.

#include <algorithm>
#include <cmath>

#include "simflex/solver/integration/Stepper.h"

namespace simflex {

namespace {

/** First zero of a margin that is negative at `high`, by the Illinois method; infinite if it is not
negative there. If no sample is positive, as for a contact at rest at `low`, the zero is assumed
shortly after `low`. **/
double findSwitch(const std::function<double(double)>& calcMargin, double low, double high) {
    constexpr double Window = 1e-9, Soon = 1e-3;  // relative to the step
    constexpr int Samples = 8, MostTrials = 100;
    double atHigh = calcMargin(high), atLow = 0;
    if (!(atHigh < 0)) return SimTK::Infinity;
    const double start = low, length = high - low;
    for (int k = 0; k < Samples && !(atLow > 0); ++k) {
        low = start + k * length / Samples;
        atLow = calcMargin(low);
    }
    if (!(atLow > 0)) return start + Soon * length;
    int lastSide = 0;
    for (int trial = 1; trial < MostTrials && high - low > Window * length; ++trial) {
        double t = low + (high - low) * atLow / (atLow - atHigh);
        if (!(t > low && t < high) || trial % 8 == 0) t = low + 0.5 * (high - low);
        const double margin = calcMargin(t);
        const int side = margin < 0 ? 1 : -1;
        (side > 0 ? high : low) = t;
        (side > 0 ? atHigh : atLow) = margin;
        if (side == lastSide) (side > 0 ? atLow : atHigh) *= 0.5;
        lastSide = side;
    }
    return high;
}

}  // namespace

double Stepper::calcSwitchError(double h) {
    const double phase = std::min(m_equations->getFrictions().calcEndedPhase(),
                                  double(m_system.getDefaultTimeScale()));
    if (m_settings.fixedStep > 0 || phase <= h) return 0;
    // A located switch excites vibrations of flexible bodies, which a method of high order would
    // resolve step by step.
    if (!m_formulas && m_equations->getTopology().hasModes()) return 0;
    // Upper bound: accelerations may jump anywhere in the step.
    std::fill(m_error.q.begin(), m_error.q.end(), 0.0);
    for (size_t i = 0; i < m_error.u.size(); ++i)
        m_error.u[i] = h * (m_new.uDot[i] - m_history[0].uDot[i]);
    return calcErrorSize(phase);
}

void Stepper::endAtSwitch() {
    constexpr double Rest = 1e-4;  // relative to the speed before
    FrictionTerms& frictions = m_equations->updFrictions();
    const double start = getLastStart();
    double end = m_history[0].t;
    const auto calcMarginAt = [&](double t, int contact) {
        calcPoint(t, m_trial);
        if (frictions.wasSticking(contact)) balance(m_trial);
        m_equations->setZ(m_trial.z.data());
        m_equations->realize(t, m_trial.q.data(), m_trial.u.data());
        return frictions.calcMargin(contact, m_trial.lambda.data());
    };
    int first = -1;
    for (int k = 0; k < frictions.size(); ++k) {
        const double t =
            findSwitch([&](double trial) { return calcMarginAt(trial, k); }, start, end);
        if (!(t <= end)) continue;
        end = t;
        first = k;
    }
    if (first < 0) return;
    calcMarginAt(0.5 * (start + end), first);
    const double before = frictions.getSpeed(first);
    cutLastStep(end);
    calcMarginAt(end, first);
    frictions.noteSwitch(
        first, frictions.wasSticking(first) || frictions.getSpeed(first) <= Rest * before);
}

void Stepper::passSwitch() {
    restart();
    m_speedTime = 0;  // no jump inside the following steps
    m_nextLength = chooseFirstLength(m_history[0], m_nextLength);
}

}  // namespace simflex
