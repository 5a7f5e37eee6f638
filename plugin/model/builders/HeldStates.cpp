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
            next = std::min(next, calcNextTime(state, sampling.number, sampling.period));
        for (const ControllerSampling& sampling : m_system.controllers)
            next = std::min(next, calcNextTime(state, sampling.number, sampling.period));
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
            if (!isDue(state, sampling.number, sampling.period)) continue;
            due.push_back(&sampling);
            values.push_back(sampling.input.calcValue(m_system.flexible, state));
        }
        std::vector<std::pair<const ControllerSampling*, Controller::Moment>> told;
        for (const ControllerSampling& sampling : m_system.controllers) {
            if (!isDue(state, sampling.number, sampling.period)) continue;
            std::vector<Real> inputs;
            for (const Signal& input : sampling.inputs)
                inputs.push_back(input.calcValue(m_system.flexible, state));
            told.emplace_back(&sampling, sampling.controller->goOn(sampling.memory->get(state),
                                                                   state.getTime(), inputs));
        }
        for (size_t i = 0; i < due.size(); ++i) {
            m_system.flexible.setStateValue(state, due[i]->value, values[i]);
            m_system.flexible.setStateValue(state, due[i]->number,
                                            countSamples(state.getTime(), due[i]->period));
        }
        for (const auto& [sampling, moment] : told) {
            sampling->show(moment, m_system.flexible, state);
            m_system.flexible.setStateValue(state, sampling->number,
                                            countSamples(state.getTime(), sampling->period));
        }
    }

    bool isDue(const State& state, int number, Real period) const {
        const Real last = m_system.flexible.getStateValue(state, number);
        return countSamples(state.getTime(), period) > std::round(last);
    }

    Real calcNextTime(const State& state, int number, Real period) const {
        const Real last = std::round(m_system.flexible.getStateValue(state, number));
        return (std::min(last, countSamples(state.getTime(), period)) + 1) * period;
    }

    const ModelSystem& m_system;
    std::vector<Sampling> m_samplings;
};

class RelayTrigger : public ModelTrigger {
public:
    RelayTrigger(const ModelSystem& system, const Relay& relay)
        : ModelTrigger(system, relay.name), m_relay(relay) {}

    /** Never 0, which has no sign. **/
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
    // Sample times are exact only up to round-off.
    const bool isOne =
        std::abs(nearest * period - time) <= 1e-12 * std::max(period, std::abs(time));
    return isOne ? nearest : std::floor(time / period);
}

void addSamplings(const std::vector<Sampling>& samplings, ModelSystem& system) {
    if (!samplings.empty() || !system.controllers.empty())
        system.system.addEventHandler(new SamplingHandler(system, samplings));
}

void addRelay(const Relay& relay, ModelSystem& system) {
    addTrigger(new RelayTrigger(system, relay), system);
}

}  // namespace model
}  // namespace simflex
