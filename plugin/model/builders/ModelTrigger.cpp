#include "simflex/model/builders/ModelTrigger.h"

#include <algorithm>
#include <deque>

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Limit on changes at one time. **/
constexpr int LongestCascade = 1000;
/** Localization window, relative to the accuracy's time scale: near round-off, since repeated
events would accumulate a delay from it. **/
constexpr Real LocalizationWindow = 1e-6;

}  // namespace

ModelTrigger::ModelTrigger(const ModelSystem& system, const std::string& name)
    : TriggeredEventHandler(Stage::Velocity), m_system(system), m_name(name) {
    getTriggerInfo().setTriggerOnFallingSignTransition(false);
    getTriggerInfo().setRequiredLocalizationTimeWindow(LocalizationWindow);
}

void ModelTrigger::handleEvent(State& state, Real, bool& shouldTerminate) const {
    changeWithTriggers(
        m_system, state, shouldTerminate, [&] { act(state, shouldTerminate); }, this);
}

void addTrigger(const ModelTrigger* trigger, ModelSystem& system) {
    system.triggers.push_back(trigger);
    system.system.addEventHandler(const_cast<ModelTrigger*>(trigger));
}

void changeWithTriggers(const ModelSystem& system, State& state, bool& shouldTerminate,
                        const std::function<void()>& change, const ModelTrigger* own) {
    std::deque<const ModelTrigger*> due;
    const auto makeChange = [&](const std::function<void()>& make, const ModelTrigger* maker) {
        std::vector<Real> before;
        system.system.realize(state, Stage::Velocity);
        for (const ModelTrigger* trigger : system.triggers)
            before.push_back(trigger == maker ? -1 : trigger->getValue(state));
        make();
        system.system.realize(state, Stage::Velocity);
        for (size_t i = 0; i < before.size(); ++i)
            if (before[i] < 0 && system.triggers[i]->getValue(state) > 0)
                due.push_back(system.triggers[i]);
    };
    makeChange(change, own);
    for (int count = 1; !due.empty(); ++count) {
        const ModelTrigger* next = due.front();
        due.pop_front();
        if (count > LongestCascade)
            throw std::runtime_error("relays and events set each other off without end at t = " +
                                     std::to_string(state.getTime()) + " s: '" + own->getName() +
                                     "', then '" + next->getName() + "'");
        makeChange([&] { next->act(state, shouldTerminate); }, next);
        own = next;
    }
}

}  // namespace model
}  // namespace simflex
