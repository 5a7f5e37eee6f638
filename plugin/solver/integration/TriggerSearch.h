#pragma once
/** @file
Narrows the interval in which event triggers change sign (private header) by the Illinois method on
the trigger with the earliest estimated zero, with bisection when that is slow.

    TriggerSearch search(events, tLow, valuesLow, tHigh, valuesHigh, windowUnit);
    while (!search.isDone()) { const double t = search.calcTrialTime(); search.take(t, values(t)); }
**/

#include "simflex/solver/integration/EventDriver.h"

namespace simflex {

class TriggerSearch {
public:
    /** @param windowUnit  accuracy·timescale [s]: unit of a trigger's localization window
    @pre some trigger changes sign from `low` to `high` in a way it asks for. **/
    TriggerSearch(const EventDriver& events, double tLow, const SimTK::Vector& low, double tHigh,
                  const SimTK::Vector& high, double windowUnit);

    /** True if the interval is within the window of every trigger in it. **/
    bool isDone() const;
    double calcTrialTime();
    void take(double t, const SimTK::Vector& values);

    double getLow() const { return m_tLow; }
    double getHigh() const { return m_tHigh; }
    const SimTK::Vector& getValuesAtLow() const { return m_low; }
    const SimTK::Vector& getValuesAtHigh() const { return m_high; }

private:
    double calcWindow() const;

    const EventDriver& m_events;
    double m_tLow, m_tHigh, m_windowUnit;
    SimTK::Vector m_low, m_high;
    double m_lowWeight = 1, m_highWeight = 1;
    int m_lastSide = 0;
    double m_referenceWidth;
    int m_trials = 0;
};

}  // namespace simflex
