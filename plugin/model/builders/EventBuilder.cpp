#include "simflex/model/builders/EventBuilder.h"

#include "simflex/body/Assembly.h"
#include "simflex/model/builders/HeldStates.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** What an event does to a State; true: the run ends. **/
using Action = std::function<bool(State& state)>;

/** Of a condition's margin: less is round-off, of what is welded, say. **/
constexpr Real LeastMargin = 1e-9;
/** Events at one time, each set off by another. **/
constexpr int LongestCascade = 1000;

class ModelEvent;
using ModelEvents = std::vector<const ModelEvent*>;

/** Waits for its condition to hold, and once it has happened for it to end, so that round-off about
the margin makes no second event. **/
class ModelEvent : public TriggeredEventHandler {
public:
    ModelEvent(const ModelSystem& system, std::shared_ptr<ModelEvents> all, const std::string& name,
               const Signal& margin, int count, bool isOnce, std::vector<Action> actions)
        : TriggeredEventHandler(Stage::Velocity),
          m_system(system),
          m_all(std::move(all)),
          m_name(name),
          m_margin(margin),
          m_count(count),
          m_isOnce(isOnce),
          m_actions(std::move(actions)) {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
        m_all->push_back(this);
    }

    /** Never 0, which Simbody would not see the end of. **/
    Real getValue(const State& state) const override {
        if (m_isOnce && !isWaiting(state)) return -1;
        const Real margin = m_margin.calcValue(m_system.flexible, state);
        const Real value = (isWaiting(state) ? margin : -margin) - LeastMargin;
        return value == 0 ? -LeastMargin : value;
    }

    void handleEvent(State& state, Real, bool& shouldTerminate) const override {
        changeWithTriggers(m_system, state, shouldTerminate, [&] {
            ModelEvents happened;
            happen(state, shouldTerminate, happened);
        });
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
    void waitAgain(State& state) const { set(state, EventState::Waiting, 1); }

    void happen(State& state, bool& shouldTerminate, ModelEvents& happened) const {
        if (!isWaiting(state)) return waitAgain(state);
        happened.push_back(this);
        if (int(happened.size()) > LongestCascade)
            throw std::runtime_error(
                "events set each other off without end at t = " + std::to_string(state.getTime()) +
                " s: '" + happened[happened.size() - 2]->m_name + "', then '" + m_name + "'");
        std::vector<Real> before;
        for (const ModelEvent* other : *m_all) before.push_back(other->getValue(state));
        set(state, EventState::Waiting, 0);
        set(state, EventState::Count, get(state, EventState::Count) + 1);
        for (const Action& action : m_actions) {
            m_system.system.realize(state, Stage::Velocity);
            shouldTerminate |= action(state);
        }
        m_system.occurrences->push_back({m_name, state.getTime()});
        m_system.system.realize(state, Stage::Velocity);
        // What it has done may end what some of them, and begin what others wait for; that was
        // not so before, or their own turn comes.
        const auto isDue = [&](size_t i, bool isWaiting) {
            const ModelEvent& other = *(*m_all)[i];
            return (&other == this || before[i] < 0) && other.isWaiting(state) == isWaiting &&
                   other.getValue(state) > 0;
        };
        for (size_t i = 0; i < m_all->size(); ++i)
            if (isDue(i, false)) (*m_all)[i]->waitAgain(state);
        for (size_t i = 0; i < m_all->size(); ++i)
            if (isDue(i, true)) (*m_all)[i]->happen(state, shouldTerminate, happened);
    }

    const ModelSystem& m_system;
    std::shared_ptr<ModelEvents> m_all;
    std::string m_name;
    Signal m_margin;
    int m_count;
    bool m_isOnce;
    std::vector<Action> m_actions;
};

/** A joint or a motion. **/
const Joint& findHeld(const ModelValue& name, const ModelSystem& system) {
    std::vector<std::string> known;
    for (const Model::JointEntry& entry : system.joints) {
        if (entry.name == name.getText()) return entry.joint;
        known.push_back(entry.name);
    }
    for (const Model::MotionEntry& entry : system.motions) {
        if (entry.name == name.getText()) return entry.joint;
        known.push_back(entry.name);
    }
    name.failUnknown("joint or motion", name.getText(), known);
}

/** How far a joint may be open when it is engaged, and how far it is then [m, rad]. **/
constexpr Real ClosedJoint = 1e-3, ClosedTolerance = 1e-10;

Action makeAction(const ModelValue& value, SignalBuilder& signals, const ModelSystem& system) {
    if (value.has("stop")) {
        if (!value.get("stop").getBool()) value.get("stop").fail("leave it out to go on");
        return [](State&) { return true; };
    }
    if (value.has("set")) {
        const int state = signals.findState(value.get("set"));
        if (!value.has("to")) value.fail("say to what: to: 0");
        const Signal to = signals.make(value.get("to"));
        return [&system, state, to](State& now) {
            system.flexible.setStateValue(now, state, to.calcValue(system.flexible, now));
            return false;
        };
    }
    const bool releases = value.has("release");
    const Joint joint = findHeld(value.get(releases ? "release" : "engage"), system);
    return [&system, joint, releases](State& now) {
        const Constraint& constraint = system.matter.getConstraint(joint.getConstraintIndex());
        if (releases) {
            constraint.disable(now);
            return false;
        }
        const Vector errors = joint.calcPositionErrors(now);
        if (!(errors.normInf() <= ClosedJoint))
            throw std::runtime_error("joint '" + joint.getName() + "' cannot be engaged: it is " +
                                     std::to_string(errors.normInf()) +
                                     " m or rad open; let the event happen where it is closed");
        constraint.enable(now);
        // Speeds as after an impact, for the events that wait for them.
        assemble(system.system, now, ClosedTolerance);
        return false;
    };
}

}  // namespace

void addEventCounts(const ModelValue& file, SignalBuilder& signals) {
    const ModelValue events = file.get("events");
    for (const std::string& name : events.getKeys()) signals.addEventStates(events.get(name));
}

void addEvents(const ModelValue& file, SignalBuilder& signals, ModelSystem& system) {
    const ModelValue events = file.get("events");
    const auto all = std::make_shared<ModelEvents>();
    for (const std::string& name : events.getKeys()) {
        const ModelValue value = events.get(name), list = value.get("do");
        std::vector<Action> actions;
        for (int i = 0; list.isGiven() && i < list.getSize(); ++i)
            actions.push_back(makeAction(list.at(i), signals, system));
        const Signal margin = signals.makeMargin(value.get("when"));
        const int count = signals.findState(value);
        system.events.push_back({name, margin, count + int(SignalBuilder::EventState::Waiting)});
        auto* event = new ModelEvent(system, all, name, margin, count, value.get("once").getBool(),
                                     std::move(actions));
        system.triggers.push_back(event);
        system.system.addEventHandler(event);
    }
}

}  // namespace model
}  // namespace simflex
