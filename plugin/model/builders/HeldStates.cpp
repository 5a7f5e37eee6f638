#include "simflex/model/builders/HeldStates.h"

#include <cmath>
#include <limits>

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Changes within changes. **/
constexpr int LongestChain = 300;

class SamplingHandler : public ScheduledEventHandler {
public:
    SamplingHandler(const ModelSystem& system, const std::vector<Sampling>& samplings)
        : m_system(system), m_samplings(samplings) {}

    Real getNextEventTime(const State& state, bool) const override {
        Real next = Infinity;
        for (const Sampling& sampling : m_samplings)
            next = std::min(next, calcNextTime(state, sampling));
        return next;
    }

    void handleEvent(State& state, Real, bool& shouldTerminate) const override {
        changeWithTriggers(m_system, state, shouldTerminate, [&] { sample(state); });
    }

private:
    void sample(State& state) const {
        std::vector<const Sampling*> due;
        std::vector<Real> values;
        for (const Sampling& sampling : m_samplings) {
            const Real last = m_system.flexible.getStateValue(state, sampling.number);
            if (countSamples(state.getTime(), sampling.period) <= std::round(last)) continue;
            due.push_back(&sampling);
            values.push_back(sampling.input.calcValue(m_system.flexible, state));
        }
        for (size_t i = 0; i < due.size(); ++i) {
            m_system.flexible.setStateValue(state, due[i]->value, values[i]);
            m_system.flexible.setStateValue(state, due[i]->number,
                                            countSamples(state.getTime(), due[i]->period));
        }
    }

    Real calcNextTime(const State& state, const Sampling& sampling) const {
        const Real last = std::round(m_system.flexible.getStateValue(state, sampling.number));
        return (std::min(last, countSamples(state.getTime(), sampling.period)) + 1) *
               sampling.period;
    }

    const ModelSystem& m_system;
    std::vector<Sampling> m_samplings;
};

class RelayHandler : public TriggeredEventHandler {
public:
    RelayHandler(const ModelSystem& system, const Relay& relay)
        : TriggeredEventHandler(Stage::Velocity), m_system(system), m_relay(relay) {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
    }

    /** Never 0, which is no sign. **/
    Real getValue(const State& state) const override {
        const Real input = m_relay.input.calcValue(m_system.flexible, state);
        const Real beyond = isOn(state) ? m_relay.lower - input : input - m_relay.upper;
        return beyond == 0 ? -std::numeric_limits<Real>::min() : beyond;
    }

    void handleEvent(State& state, Real, bool& shouldTerminate) const override {
        changeWithTriggers(
            m_system, state, shouldTerminate,
            [&] { m_system.flexible.setStateValue(state, m_relay.value, isOn(state) ? 0 : 1); },
            this);
    }

private:
    bool isOn(const State& state) const {
        return m_system.flexible.getStateValue(state, m_relay.value) > 0.5;
    }

    const ModelSystem& m_system;
    Relay m_relay;
};

}  // namespace

void changeWithTriggers(const ModelSystem& system, State& state, bool& shouldTerminate,
                        const std::function<void()>& change, const TriggeredEventHandler* own) {
    thread_local int depth = 0;
    struct Link {
        Link() { ++depth; }
        ~Link() { --depth; }
    } link;
    if (depth > LongestChain)
        throw std::runtime_error("relays and events set each other off without end at t = " +
                                 std::to_string(state.getTime()) + " s");
    system.system.realize(state, Stage::Velocity);
    std::vector<Real> before;
    for (const TriggeredEventHandler* trigger : system.triggers)
        before.push_back(trigger == own ? -1 : trigger->getValue(state));
    change();
    system.system.realize(state, Stage::Velocity);
    for (size_t i = 0; i < before.size(); ++i)
        if (before[i] < 0 && system.triggers[i]->getValue(state) > 0) {
            system.triggers[i]->handleEvent(state, 0, shouldTerminate);
            system.system.realize(state, Stage::Velocity);
        }
}

double countSamples(double time, double period) {
    const double nearest = std::round(time / period);
    // A time that is meant to be one of a sample is so to round-off.
    const bool isOne =
        std::abs(nearest * period - time) <= 1e-12 * std::max(period, std::abs(time));
    return isOne ? nearest : std::floor(time / period);
}

void addSamplings(const std::vector<Sampling>& samplings, ModelSystem& system) {
    if (!samplings.empty()) system.system.addEventHandler(new SamplingHandler(system, samplings));
}

void addRelay(const Relay& relay, ModelSystem& system) {
    auto* handler = new RelayHandler(system, relay);
    system.triggers.push_back(handler);
    system.system.addEventHandler(handler);
}

}  // namespace model
}  // namespace simflex
