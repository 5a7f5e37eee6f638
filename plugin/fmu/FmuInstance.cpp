#include "simflex/fmu/FmuInstance.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "simflex/base/Archive.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace fmu {

namespace {

constexpr double SameTime = 1e-9;  ///< relative to the larger time, or absolute [s]

}  // namespace

FmuInstance::FmuInstance(const std::string& resources, const std::string& token, Log log)
    : m_folder(resources),
      m_manifest(Manifest::read(readInputFile(resources + '/' + Manifest::FileName))),
      m_log(std::move(log)) {
    if (token != m_manifest.token)
        throw std::runtime_error("the token '" + token + "' is not that of the unit in '" +
                                 resources + "'");
}

void FmuInstance::setStartTime(double time) {
    if (!std::isfinite(time)) throw std::runtime_error("the start time is not finite");
    m_startTime = time;
    m_session.reset();
}

void FmuInstance::enterInitialization() {
    m_phase = Initialization;
}

void FmuInstance::exitInitialization() {
    updSession();
    m_phase = Stepping;
}

void FmuInstance::reset() {
    m_session.reset();
    m_settings.clear();
    m_pending.clear();
    m_phase = Instantiated;
    m_startTime = 0;
    m_isTerminated = false;
}

Session& FmuInstance::updSession() {
    if (!m_session) {
        ModelText text = loadModelText(m_folder + '/' + m_manifest.model, m_manifest.settings);
        text.settings.insert(text.settings.end(), m_settings.begin(), m_settings.end());
        ModelOptions options;
        // The exporter has allowed them.
        options.code.fmus = AllowedCode::Fmus::ThisProcess;
        options.listener.warn = [this](const std::string& warning) {
            m_log(Level::Warning, warning);
        };
        m_session = std::make_unique<Session>(text, options);
        if (listOutputs(m_session->getProbes()) != m_manifest.outputs)
            throw std::runtime_error("the model in '" + m_folder + "' has other probes");
        if (m_startTime != 0) {
            SimTK::State state = m_session->copyState();
            state.setTime(m_startTime);
            m_session->setState(state);
        }
    }
    if (!m_pending.empty()) m_session->setInputs(std::exchange(m_pending, {}));
    return *m_session;
}

double FmuInstance::getTime() {
    return m_session ? m_session->getTime() : m_startTime;
}

double FmuInstance::get(unsigned reference) {
    if (reference == 0) return getTime();
    const Manifest& m = m_manifest;
    size_t index = reference - 1;
    if (index < m.parameters.size())
        return updSession().get("parameters." + m.parameters[index])[0];
    index -= m.parameters.size();
    if (index < m.inputs.size()) return updSession().get("inputs." + m.inputs[index])[0];
    index -= m.inputs.size();
    for (const model::Probe& probe : updSession().getProbes()) {
        if (index < probe.columns.size()) return m_session->calcProbe(probe)[index];
        index -= probe.columns.size();
    }
    throw std::runtime_error("there is no variable with the reference " +
                             std::to_string(reference));
}

void FmuInstance::set(unsigned reference, double value) {
    const Manifest& m = m_manifest;
    const size_t index = size_t(reference) - 1;
    const bool isParameter = index < m.parameters.size();
    if (reference == 0 || index >= m.parameters.size() + m.inputs.size())
        throw std::runtime_error("the variable with the reference " + std::to_string(reference) +
                                 " cannot be set");
    const std::string& name =
        isParameter ? m.parameters[index] : m.inputs[index - m.parameters.size()];
    if (!std::isfinite(value))
        throw std::runtime_error("'" + name + "' is not set to a finite number");
    if (m_phase == Stepping) {
        if (isParameter)
            throw std::runtime_error("parameter '" + name + "' is fixed once the unit has begun");
        for (Session::Input& input : m_pending)
            if (input.name == name) {
                input.value = value;
                return;
            }
        m_pending.push_back({name, value});
        return;
    }
    const auto isSame = [&](const Session::Input& input) { return input.name == name; };
    if (!isParameter)
        m_pending.erase(std::remove_if(m_pending.begin(), m_pending.end(), isSame),
                        m_pending.end());
    const std::string key = (isParameter ? "parameters." : "inputs.") + name + '=';
    m_settings.erase(std::remove_if(m_settings.begin(), m_settings.end(),
                                    [&](const std::string& setting) {
                                        return setting.compare(0, key.size(), key) == 0;
                                    }),
                     m_settings.end());
    m_settings.push_back(key + writeGeneral(value));
    m_session.reset();
}

const std::string& FmuInstance::findInput(unsigned reference) const {
    const size_t first = m_manifest.parameters.size(), index = size_t(reference) - 1;
    if (reference == 0 || index < first || index >= first + m_manifest.inputs.size())
        throw std::runtime_error("the variable with the reference " + std::to_string(reference) +
                                 " is not an input");
    return m_manifest.inputs[index - first];
}

std::vector<double> FmuInstance::calcDirectionalDerivative(const std::vector<unsigned>& outputs,
                                                           const std::vector<unsigned>& inputs,
                                                           const std::vector<double>& seeds) {
    constexpr double Step = 1e-3;  // relative to an input, or to 1
    if (m_phase == Instantiated)
        throw std::runtime_error("a derivative before the unit is initialized");
    const size_t first = 1 + m_manifest.parameters.size() + m_manifest.inputs.size();
    for (const unsigned output : outputs)
        if (output < first)
            throw std::runtime_error("the variable with the reference " + std::to_string(output) +
                                     " is not an output");
    Session& session = updSession();
    std::vector<Session::Input> now;
    double largest = 0;
    for (size_t i = 0; i < inputs.size(); ++i) {
        const std::string& name = findInput(inputs[i]);
        const double value = session.get("inputs." + name)[0];
        now.push_back({name, value, session.get("inputs." + name + ".rate")[0]});
        largest = std::max(largest, std::abs(seeds[i]) / std::max(1., std::abs(value)));
    }
    std::vector<double> derivative(outputs.size(), 0);
    if (largest == 0) return derivative;
    const double step = Step / largest;
    const SavedState before = session.save();
    const auto addDifference = [&](double place, double weight) {
        std::vector<Session::Input> moved = now;
        for (size_t i = 0; i < moved.size(); ++i) moved[i].value += place * step * seeds[i];
        session.setInputs(moved);
        for (size_t i = 0; i < outputs.size(); ++i)
            derivative[i] += weight / step * get(outputs[i]);
        session.restore(before);
    };
    try {
        for (const auto& [place, weight] :
             {std::make_pair(-2., 1. / 12), {-1., -8. / 12}, {1., 8. / 12}, {2., -1. / 12}})
            addDifference(place, weight);
    } catch (...) {
        session.restore(before);
        throw;
    }
    return derivative;
}

void FmuInstance::setRate(unsigned reference, double rate) {
    const std::string& name = findInput(reference);
    if (!std::isfinite(rate)) throw std::runtime_error("the rate of an input is not finite");
    for (Session::Input& input : m_pending)
        if (input.name == name) {
            input.rate = rate;
            return;
        }
    m_pending.push_back({name, updSession().get("inputs." + name)[0], rate});
}

FmuInstance::Outcome FmuInstance::doStep(double time, double length) {
    if (m_phase != Stepping) throw std::runtime_error("a step before the unit is initialized");
    if (m_isTerminated) throw std::runtime_error("a step after the model has ended its motion");
    Session& session = updSession();
    const double now = session.getTime(), end = time + length;
    if (!(std::abs(now - time) <= SameTime * std::max(1., std::abs(time))))
        throw std::runtime_error("a step from t = " + writeGeneral(time) +
                                 " s, but the unit is at t = " + writeGeneral(now) + " s");
    if (!(length >= 0)) throw std::runtime_error("a step of " + writeGeneral(length) + " s");
    if (!(end > now)) return Outcome::Done;
    m_isTerminated = session.runTo(end, end - now) == Session::Outcome::Terminated;
    // Rates are valid for one step only.
    for (const Model::InputEntry& input : session.getModel().getInputs())
        if (session.get("inputs." + input.name + ".rate")[0] != 0)
            m_pending.push_back({input.name, session.get("inputs." + input.name)[0]});
    return m_isTerminated ? Outcome::Terminated : Outcome::Done;
}

FmuInstance::Kept FmuInstance::keep() {
    Kept kept{m_phase, m_startTime, m_isTerminated, m_settings, m_pending, {}};
    if (m_phase == Stepping) kept.state = m_session->save();
    return kept;
}

void FmuInstance::restore(const Kept& kept) {
    if (kept.settings != m_settings || kept.startTime != m_startTime || !kept.state)
        m_session.reset();
    m_settings = kept.settings;
    m_startTime = kept.startTime;
    m_pending.clear();
    if (kept.state) updSession().restore(*kept.state);
    m_phase = Phase(kept.phase);
    m_isTerminated = kept.isTerminated;
    m_pending = kept.pending;
}

void FmuInstance::visit(Archive& archive, Kept& kept, std::string& state) const {
    std::string token = m_manifest.token;
    archive.visit(token);
    if (token != m_manifest.token)
        throw std::runtime_error("the state is one of another unit: '" + token + "'");
    archive.visitWithin(kept.phase, Instantiated, Stepping, "the phase");
    archive.visit(kept.startTime, kept.isTerminated, kept.settings);
    std::vector<std::string> names;
    std::vector<double> values, rates;
    for (const Session::Input& input : kept.pending) {
        names.push_back(input.name);
        values.push_back(input.value);
        rates.push_back(input.rate);
    }
    archive.visit(names, values, rates, state);
    if (values.size() != names.size() || rates.size() != names.size())
        throw std::runtime_error("the state is damaged");
    kept.pending.clear();
    for (size_t i = 0; i < names.size(); ++i)
        kept.pending.push_back({names[i], values[i], rates[i]});
}

std::string FmuInstance::pack(const Kept& kept) {
    Kept packed = kept;
    std::string state = kept.state ? updSession().pack(*kept.state) : "";
    Archive archive;
    visit(archive, packed, state);
    return archive.getBytes();
}

FmuInstance::Kept FmuInstance::unpack(const std::string& bytes) {
    Archive archive(bytes);
    Kept kept{};
    std::string state;
    visit(archive, kept, state);
    archive.requireEnd();
    if (kept.phase != Stepping) return kept;
    // Unpacking needs a model with the same settings.
    if (kept.settings == m_settings) {
        kept.state = updSession().unpack(state);
        return kept;
    }
    const Kept own = keep();
    m_settings = kept.settings;
    m_session.reset();
    m_pending.clear();
    kept.state = updSession().unpack(state);
    restore(own);
    return kept;
}

}  // namespace fmu
}  // namespace simflex
