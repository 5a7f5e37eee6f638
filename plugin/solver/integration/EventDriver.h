#pragma once
/** @file
Calls the system's event reporters and handlers as SimTK::TimeStepper and SimTK::Integrator do, and
updates its auto-update variables (private header). **/

#include <vector>

#include "Simbody.h"

namespace simflex {

class Checkpoint;

class EventDriver {
public:
    /** Effect of the handlers of one event. **/
    struct Outcome {
        bool shouldTerminate = false;
        bool hasChangedState = false;
        SimTK::Stage lowestChange = SimTK::Stage::Infinity;  ///< lowest stage they invalidated
    };

    explicit EventDriver(const SimTK::MultibodySystem& system) : m_system(system) {}

    /** Handles the Initialization event (Measures and subsystems set their own variables).
    @throws std::runtime_error if a handler asks for termination. **/
    Outcome handleInitialization(SimTK::State& state, SimTK::Real accuracy);

    /** Reads trigger information, finds auto-update variables; forgets past events. **/
    void initialize(const SimTK::State& state);

    /** Next scheduled times at or after the State's time, except events already handled at this
    time. **/
    SimTK::Real calcNextReportTime(const SimTK::State& state);
    SimTK::Real calcNextEventTime(const SimTK::State& state);

    /** Calls the reporters found by the last calcNextReportTime(). **/
    void report(const SimTK::State& state);

    /** Time of the last scheduled handlers, which calcNextEventTime() skips at that time. **/
    SimTK::Real getLastEventTime() const { return m_lastEvent; }
    void setLastEventTime(SimTK::Real time) { m_lastEvent = time; }

    /** Calls the handlers found by the last calcNextEventTime(). **/
    Outcome handleScheduled(SimTK::State& state, SimTK::Real accuracy);

    bool hasTimeAdvancedEvents() const { return m_system.hasTimeAdvancedEvents(); }
    Outcome handleTimeAdvanced(SimTK::State& state, SimTK::Real accuracy);
    void handleTermination(SimTK::State& state, SimTK::Real accuracy);

    bool hasTriggers() const { return m_triggers.size() > 0; }
    int getNumTriggers() const { return int(m_triggers.size()); }

    /** Values of the trigger functions; realizes the State as far as they need. **/
    void calcTriggers(const SimTK::State& state, SimTK::Vector& values) const;

    /** True if a trigger changes sign between the two sets of values in a direction it
    monitors. **/
    bool isTriggered(const SimTK::Vector& before, const SimTK::Vector& after) const;
    bool isTriggered(int trigger, const SimTK::Vector& before, const SimTK::Vector& after) const;

    SimTK::EventId getEventId(int trigger) const {
        return m_triggers[unsigned(trigger)].getEventId();
    }
    /** The transition, among those that a trigger monitors. **/
    SimTK::Event::Trigger getTransition(int trigger, const SimTK::Vector& before,
                                        const SimTK::Vector& after) const;

    /** Required localization window of a trigger, a multiple of accuracy·timescale. **/
    SimTK::Real getWindow(int trigger) const {
        return m_triggers[unsigned(trigger)].getRequiredLocalizationTimeWindow();
    }

    /** Calls the handlers triggered between the two sets of values. **/
    Outcome handleTriggered(SimTK::State& state, const SimTK::Vector& before,
                            const SimTK::Vector& after, SimTK::Real accuracy);

    /** True if variables are updated at the end of every step, as by Measures. **/
    bool hasAutoUpdates() const { return !m_autoUpdates.empty(); }
    const std::vector<SimTK::DiscreteVarKey>& getAutoUpdates() const { return m_autoUpdates; }

    /** Swaps in the auto-update variables' new values; realizes the State to Stage::Acceleration
    first. **/
    void updateDiscreteVariables(SimTK::State& state) const;

    void visit(Checkpoint& checkpoint);

private:
    Outcome handle(SimTK::State& state, SimTK::Event::Cause cause,
                   const SimTK::Array_<SimTK::EventId>& ids, SimTK::Real accuracy) const;
    void findNextReport(const SimTK::State& state);

    const SimTK::MultibodySystem& m_system;
    SimTK::Array_<SimTK::EventTriggerInfo> m_triggers;
    SimTK::Stage m_triggerStage = SimTK::Stage::Time;
    /** Stage to which the State is realized for handlers: that of SimTK::Integrator, or velocities
    only with flexible bodies, whose accelerations are expensive. **/
    SimTK::Stage m_handlerStage = SimTK::Stage::Velocity;
    SimTK::Array_<SimTK::EventId> m_reports, m_events;
    SimTK::Real m_reportTime = SimTK::NaN;  ///< of m_reports
    SimTK::Real m_lastReport = SimTK::NaN, m_lastEvent = SimTK::NaN;
    std::vector<SimTK::DiscreteVarKey> m_autoUpdates;
};

}  // namespace simflex
