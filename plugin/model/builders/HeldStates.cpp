#include "simflex/model/builders/HeldStates.h"

#include <cmath>
#include <limits>

#include "simflex/model/builders/ModelTrigger.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

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

class RelayTrigger : public ModelTrigger {
public:
    RelayTrigger(const ModelSystem& system, const Relay& relay)
        : ModelTrigger(system, relay.name), m_relay(relay) {}

    /** Never 0, which is no sign. **/
    Real getValue(const State& state) const override {
        const Real input = m_relay.input.calcValue(m_system.flexible, state);
        const Real beyond = isOn(state) ? m_relay.lower - input : input - m_relay.upper;
        return beyond == 0 ? -std::numeric_limits<Real>::min() : beyond;
    }

    void act(State& state, bool&) const override {
        m_system.flexible.setStateValue(state, m_relay.value, isOn(state) ? 0 : 1);
    }

private:
    bool isOn(const State& state) const {
        return m_system.flexible.getStateValue(state, m_relay.value) > 0.5;
    }

    Relay m_relay;
};

}  // namespace

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
    addTrigger(new RelayTrigger(system, relay), system);
}

}  // namespace model
}  // namespace simflex
