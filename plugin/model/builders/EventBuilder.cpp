#include "simflex/model/builders/EventBuilder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "simflex/body/Assembly.h"
#include "simflex/body/JointEquations.h"
#include "simflex/model/builders/ModelTrigger.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Action of an event on a State; returns true to end the run. **/
using Action = std::function<bool(State& state)>;

/** Margin by which a condition on frame positions must hold: smaller values may be round-off, as
between welded frames. Conditions on time and states need none, which would delay repeated events.
**/
constexpr Real LeastMargin = 1e-9;

/** Waits for its condition to hold by more than round-off, then for it to cease, at once if its own
action ends it. Round-off near the margin causes no second event. **/
class ModelEvent : public ModelTrigger {
public:
    ModelEvent(const ModelSystem& system, const std::string& name, const Signal& margin, int count,
               bool isOnce, std::vector<Action> actions)
        : ModelTrigger(system, name),
          m_margin(margin),
          m_leastMargin(margin.getAttachments().empty() ? 0 : LeastMargin),
          m_count(count),
          m_isOnce(isOnce),
          m_actions(std::move(actions)) {}

    /** Never 0, which would hide a sign transition from Simbody. **/
    Real getValue(const State& state) const override {
        if (m_isOnce && !isWaiting(state)) return -1;
        const Real margin = m_margin.calcValue(m_system.flexible, state);
        constexpr Real Least = std::numeric_limits<Real>::min();
        if (isWaiting(state)) return margin == m_leastMargin ? -Least : margin - m_leastMargin;
        return margin == 0 ? Least : -margin;
    }

    void act(State& state, bool& shouldTerminate) const override {
        const bool happens = isWaiting(state);
        set(state, EventState::Waiting, happens ? 0 : 1);
        if (!happens) return;
        set(state, EventState::Count, get(state, EventState::Count) + 1);
        for (const Action& action : m_actions) {
            m_system.system.realize(state, Stage::Velocity);
            shouldTerminate |= action(state);
        }
        m_system.occurrences->push_back({getName(), state.getTime()});
    }

private:
    using EventState = SignalBuilder::EventState;

    Real get(const State& state, EventState which) const {
        return m_system.flexible.getStateValue(state, m_count + int(which));
    }
    void set(State& state, EventState which, Real value) const {
        m_system.flexible.setStateValue(state, m_count + int(which), value);
    }
    bool isWaiting(const State& state) const { return get(state, EventState::Waiting) > 0.5; }

    Signal m_margin;
    Real m_leastMargin;
    int m_count;
    bool m_isOnce;
    std::vector<Action> m_actions;
};

struct Held {
    Joint joint;
    std::string name;  ///< "joint 'pin'", "motion 'drive'"
};

Held findHeld(const ModelValue& name, const ModelSystem& system) {
    std::vector<std::string> known;
    for (const Model::JointEntry& entry : system.joints) {
        if (entry.name == name.getText()) return {entry.joint, "joint '" + entry.name + "'"};
        known.push_back(entry.name);
    }
    for (const Model::MotionEntry& entry : system.motions) {
        if (entry.name == name.getText()) return {entry.joint, "motion '" + entry.name + "'"};
        known.push_back(entry.name);
    }
    name.failUnknown("joint or motion", name.getText(), known);
}

/** Largest error of a joint to be engaged, relative to the model's size (at most 1 m) or in rad;
the error above which a warning is given; and the tolerance for closing it [m, rad]. **/
constexpr Real ClosedJoint = 1e-3, ToldGap = 1e-6, ClosedTolerance = 1e-10;

/** Makes speeds consistent as after an impact, for events that wait for them. **/
void collide(const ModelSystem& system, State& state) {
    assemble(system.system, state, ClosedTolerance, SpeedJump::Impact);
}

/** Closes a joint that is nearly closed; adds a warning if that has a visible effect. **/
void close(const std::string& event, const Held& held, Real size, const ModelSystem& system,
           State& state) {
    const Joint& joint = held.joint;
    const Vector errors = joint.calcPositionErrors(state);
    Real gap = 0, share = 0;
    for (int i = 0; i < errors.size(); ++i) {
        const bool isLength = joint.getEquations().isLength(i);
        gap = std::max(gap, std::abs(errors[i]));
        share = std::max(share, std::abs(errors[i]) / (isLength ? size : 1.0));
    }
    std::ostringstream open;
    open << "it is " << gap << " m or rad open";
    if (!(share <= ClosedJoint))
        throw std::runtime_error(held.name + " cannot be engaged: " + open.str() +
                                 "; let the event happen where it is closed");
    const Real potential = system.flexible.calcPotentialEnergy(state);
    system.matter.getConstraint(joint.getConstraintIndex()).enable(state);
    collide(system, state);
    if (share <= ToldGap) return;
    std::ostringstream text;
    text << "event '" << event << "' engages " << held.name << " at t = " << state.getTime()
         << " s: " << open.str()
         << ". Closing it moves bodies at once, which changes the potential energy by "
         << system.flexible.calcPotentialEnergy(state) - potential
         << " J and counts as work; let the event happen where it is closed";
    system.eventWarnings->push_back(text.str());
}

/** Locks of a joint's coordinates, created on first use. **/
const std::vector<Joint::Lock>& obtainLocks(const ModelValue& name, ModelSystem& system) {
    const Joint& joint = findEntry(system.joints, "joint", name.getText(), name).joint;
    if (joint.getEquations().isCoupler())
        name.fail("'" + name.getText() + "' is a gear or coupler: name a joint it turns");
    if (joint.getNumCoordinates() == 0)
        name.fail("'" + name.getText() +
                  "' has no coordinates to lock; a joint beside it that is engaged may hold it");
    std::vector<Joint::Lock>& locks = system.locks[name.getText()];
    for (int c = int(locks.size()); c < joint.getNumCoordinates(); ++c)
        locks.emplace_back(system.flexible, Joint::Coordinate(joint, c),
                           "lock of " + name.getText());
    return locks;
}

Action makeLock(const ModelValue& name, ModelSystem& system) {
    const std::vector<Joint::Lock>& locks = obtainLocks(name, system);
    const Joint joint = findEntry(system.joints, "joint", name.getText(), name).joint;
    return [&system, &locks, joint](State& now) {
        if (system.matter.getConstraint(joint.getConstraintIndex()).isDisabled(now))
            throw std::runtime_error("joint '" + joint.getName() +
                                     "' is released and cannot be locked");
        for (const Joint::Lock& lock : locks) {
            system.system.realize(now, Stage::Velocity);
            if (!lock.isLocked(now)) lock.lock(now);
        }
        collide(system, now);
        return false;
    };
}

Action makeAction(const std::string& event, const ModelValue& value, Real size,
                  SignalBuilder& signals, ModelSystem& system) {
    if (value.has("stop")) {
        if (!value.get("stop").getBool()) value.get("stop").fail("leave it out to continue");
        return [](State&) { return true; };
    }
    if (value.has("set")) {
        const int state = signals.findState(value.get("set"));
        const Signal to = signals.make(value.get("to"));
        return [&system, state, to](State& now) {
            system.flexible.setStateValue(now, state, to.calcValue(system.flexible, now));
            return false;
        };
    }
    if (value.has("lock")) return makeLock(value.get("lock"), system);
    if (value.has("unlock")) {
        const auto& locks = obtainLocks(value.get("unlock"), system);
        return [&locks](State& now) {
            for (const Joint::Lock& lock : locks) lock.unlock(now);
            return false;
        };
    }
    const bool releases = value.has("release");
    const Held held = findHeld(value.get(releases ? "release" : "engage"), system);
    return [&system, held, releases, event, size](State& now) {
        if (!releases) {
            close(event, held, size, system, now);
            return false;
        }
        system.matter.getConstraint(held.joint.getConstraintIndex()).disable(now);
        const auto locks = system.locks.find(held.joint.getName());
        if (locks == system.locks.end()) return false;
        for (const Joint::Lock& lock : locks->second) lock.unlock(now);
        return false;
    };
}

}  // namespace

void addEventCounts(const ModelValue& file, SignalBuilder& signals) {
    const ModelValue events = file.get("events");
    for (const std::string& name : events.getKeys()) signals.addEventStates(events.get(name));
}

void addEvents(const ModelValue& file, Real size, SignalBuilder& signals, ModelSystem& system) {
    const ModelValue events = file.get("events");
    for (const std::string& name : events.getKeys()) {
        const ModelValue value = events.get(name), list = value.get("do");
        std::vector<Action> actions;
        for (int i = 0; list.isGiven() && i < list.getSize(); ++i)
            actions.push_back(makeAction(name, list.at(i), size, signals, system));
        const Signal margin = signals.makeMargin(value.get("when"));
        const int count = signals.findState(value);
        system.events.push_back({name, margin, count + int(SignalBuilder::EventState::Waiting)});
        addTrigger(new ModelEvent(system, name, margin, count, value.get("once").getBool(),
                                  std::move(actions)),
                   system);
    }
}

}  // namespace model
}  // namespace simflex
