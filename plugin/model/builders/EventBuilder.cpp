#include "simflex/model/builders/EventBuilder.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** What an event does to a State; true: the run ends. **/
using Action = std::function<bool(State& state)>;

class ModelEvent : public TriggeredEventHandler {
public:
    ModelEvent(const ModelSystem& system, const std::string& name, const Signal& margin, int count,
               bool isOnce, std::vector<Action> actions)
        : TriggeredEventHandler(Stage::Velocity),
          m_system(system),
          m_name(name),
          m_margin(margin),
          m_count(count),
          m_isOnce(isOnce),
          m_actions(std::move(actions)) {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
    }

    Real getValue(const State& state) const override {
        return m_margin.calcValue(m_system.flexible, state);
    }

    void handleEvent(State& state, Real, bool& shouldTerminate) const override {
        const Real count = m_system.flexible.getStateValue(state, m_count);
        if (m_isOnce && count > 0) return;
        m_system.flexible.setStateValue(state, m_count, count + 1);
        for (const Action& action : m_actions) {
            m_system.system.realize(state, Stage::Velocity);
            shouldTerminate |= action(state);
        }
        m_system.occurrences->push_back({m_name, state.getTime()});
    }

private:
    const ModelSystem& m_system;
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

/** How far a joint may be open when it is engaged [m, 1]. **/
constexpr Real ClosedJoint = 1e-3;

Action makeAction(const ModelValue& value, SignalBuilder& signals, const ModelSystem& system) {
    if (value.has("stop")) {
        const bool stops = value.get("stop").getBool();
        return [stops](State&) { return stops; };
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
        return false;
    };
}

}  // namespace

void addEventCounts(const ModelValue& file, SignalBuilder& signals) {
    const ModelValue events = file.get("events");
    for (const std::string& name : events.getKeys()) signals.addCount(events.get(name));
}

void addEvents(const ModelValue& file, SignalBuilder& signals, ModelSystem& system) {
    const ModelValue events = file.get("events");
    for (const std::string& name : events.getKeys()) {
        const ModelValue value = events.get(name), list = value.get("do");
        std::vector<Action> actions;
        for (int i = 0; list.isGiven() && i < list.getSize(); ++i)
            actions.push_back(makeAction(list.at(i), signals, system));
        system.system.addEventHandler(new ModelEvent(
            system, name, signals.makeMargin(value.get("when")), signals.findState(value),
            value.get("once").getBool(), std::move(actions)));
    }
}

}  // namespace model
}  // namespace simflex
