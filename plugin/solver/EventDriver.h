#pragma once
/** @file
Calls the system's event reporters and handlers as SimTK::TimeStepper does (private header). **/

#include "Simbody.h"

namespace simflex {

class EventDriver {
public:
    explicit EventDriver(const SimTK::MultibodySystem& system) : m_system(system) {}

    /** Reads trigger information; forgets past events.
    @throws std::invalid_argument if a trigger needs Stage::Acceleration. **/
    void initialize(const SimTK::State& state);

    /** Next scheduled times at or after the State's time, events already handled at this time left
     * out. **/
    SimTK::Real calcNextReportTime(const SimTK::State& state);
    SimTK::Real calcNextEventTime(const SimTK::State& state);

    /** Calls the reporters found by the last calcNextReportTime(). **/
    void report(const SimTK::State& state);

    /** What the handlers of one event did. **/
    struct Outcome {
        bool shouldTerminate = false;
        bool hasChangedState = false;
    };

    /** Calls the handlers found by the last calcNextEventTime(). **/
    Outcome handleScheduled(SimTK::State& state, SimTK::Real accuracy);

    bool hasTriggers() const { return m_triggers.size() > 0; }

    /** Values of the trigger functions; realizes the State as far as they need. **/
    SimTK::Vector calcTriggers(const SimTK::State& state) const;

    /** True if a trigger's sign changes between the two sets of values in a way it asks for. **/
    bool isTriggered(const SimTK::Vector& before, const SimTK::Vector& after) const;

    /** Calls the handlers triggered between the two sets of values. **/
    Outcome handleTriggered(SimTK::State& state, const SimTK::Vector& before,
                            const SimTK::Vector& after, SimTK::Real accuracy);

private:
    Outcome handle(SimTK::State& state, SimTK::Event::Cause cause,
                   const SimTK::Array_<SimTK::EventId>& ids, SimTK::Real accuracy) const;
    SimTK::Event::Trigger transitionOf(int trigger, const SimTK::Vector& before,
                                       const SimTK::Vector& after) const;

    const SimTK::MultibodySystem& m_system;
    SimTK::Array_<SimTK::EventTriggerInfo> m_triggers;
    SimTK::Stage m_triggerStage = SimTK::Stage::Time;
    SimTK::Array_<SimTK::EventId> m_reports, m_events;
    SimTK::Real m_lastReport = SimTK::NaN, m_lastEvent = SimTK::NaN;
};

}  // namespace simflex
