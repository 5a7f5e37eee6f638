#include "simflex/solver/integration/TriggerSearch.h"

#include <algorithm>
#include <cmath>

namespace simflex {

using SimTK::Vector;

TriggerSearch::TriggerSearch(const EventDriver& events, double tLow, const Vector& low,
                             double tHigh, const Vector& high, double windowUnit)
    : m_events(events),
      m_tLow(tLow),
      m_tHigh(tHigh),
      m_windowUnit(windowUnit),
      m_low(low),
      m_high(high),
      m_referenceWidth(tHigh - tLow) {}

double TriggerSearch::calcWindow() const {
    double window = SimTK::Infinity;
    for (int k = 0; k < m_low.size(); ++k)
        if (m_events.isTriggered(k, m_low, m_high))
            window = std::min(window, m_windowUnit * m_events.getWindow(k));
    return std::max(window, 4e-16 * std::max(1.0, std::abs(m_tHigh)));
}

bool TriggerSearch::isDone() const {
    return m_tHigh - m_tLow <= calcWindow();
}

double TriggerSearch::calcTrialTime() {
    const double width = m_tHigh - m_tLow, window = calcWindow();
    const double middle = m_tLow + 0.5 * width;
    if (++m_trials % 3 == 0) {
        const bool isSlow = width > 0.5 * m_referenceWidth;
        m_referenceWidth = width;
        if (isSlow) return middle;
    }
    double earliest = m_tHigh;
    for (int k = 0; k < m_low.size(); ++k) {
        if (!m_events.isTriggered(k, m_low, m_high)) continue;
        const double low = m_lowWeight * m_low[k], high = m_highWeight * m_high[k];
        const double fraction = low == high ? 0.5 : low / (low - high);
        earliest = std::min(earliest, m_tLow + std::clamp(fraction, 0.0, 1.0) * width);
    }
    const double margin = 0.5 * std::min(window, width);
    const double trial = std::clamp(earliest, m_tLow + margin, m_tHigh - margin);
    return trial > m_tLow && trial < m_tHigh ? trial : middle;
}

void TriggerSearch::take(double t, const Vector& values) {
    const bool isHigh = m_events.isTriggered(m_low, values);
    const int side = isHigh ? 1 : -1;
    if (isHigh) {
        m_tHigh = t;
        m_high = values;
        m_highWeight = 1;
        m_lowWeight = m_lastSide == side ? 0.5 * m_lowWeight : 1;
    } else {
        m_tLow = t;
        m_low = values;
        m_lowWeight = 1;
        m_highWeight = m_lastSide == side ? 0.5 * m_highWeight : 1;
    }
    m_lastSide = side;
}

}  // namespace simflex
