#include "simflex/model/analyses/LinearPorts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/body/StateCopy.h"
#include "simflex/body/StressRecovery.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/file/ModelError.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/probes/ProbeKinds.h"
#include "simflex/model/session/Quantities.h"

namespace simflex {
namespace model {

using SimTK::Complex;
using SimTK::Matrix;
using SimTK::Matrix_;
using SimTK::State;
using SimTK::Vector;

namespace {

constexpr const char* PortAxes = "xyz";
/** Step of a number relative to itself, or to 1 if it is 0. **/
constexpr double NumberStep = 1e-3;
/** Part of that step so small that it contains no kink unless the number is at one, and a multiple
of it for comparison; relative difference of slopes above which there is a kink. **/
constexpr double NearStep = 1.0 / 4096, CoarserStep = 16, NumberKink = 1e-3;
/** Round-off of differences over a step of size 1. **/
constexpr double DrivenSpeed = 1e-9;
/** Largest relative change of a response after a rotation by a radian. **/
constexpr double SteadyResponse = 1e-3;
/** Part of the largest possible response that is round-off of the differences behind it. **/
constexpr double SteadyRoundOff = 1e-8;
/** Part of an output's response that is round-off if it is due to an input's speed or
acceleration. **/
constexpr double SmallRatePart = 1e-9;
/** Part of the direct effect of an input on an output that may be nonlinear over a step; part of
the output's value that is round-off. **/
constexpr double SmoothInput = 0.5, SameObserved = 1e-12;
/** Largest speed of a system at rest [m/s, rad/s]. **/
constexpr double SlowestSpeed = 1e-9;
/** Largest change of a response between neighbouring frequencies, relative to itself (the finer one
if its square is integrated) or to the part SmallResponse of its largest value; smallest relative
distance of frequencies that are refined, and largest number of frequencies added. **/
constexpr double CoarseChord = 0.2, FineChord = 0.05, SmallResponse = 1e-3, FinestStep = 2e-5;
constexpr size_t MostAdded = 2000;
/** Part of the bound of a response that is round-off, see ModelResponse::calcBounds(). **/
constexpr double ResponseRoundOff = 1e-13;

std::string getUnit(const std::vector<std::string>& parts) {
    for (const auto& [key, unit] : {std::pair("force", "N"), std::pair("torque", "N m"),
                                    std::pair("pressure", "Pa"), std::pair("gravity", "m/s^2")})
        if (std::find(parts.begin(), parts.end(), key) != parts.end()) return unit;
    return "";
}

Vector getColumn(const Matrix& matrix, int column) {
    Vector result(matrix.nrow());
    for (int i = 0; i < matrix.nrow(); ++i) result[i] = matrix(i, column);
    return result;
}

Vector getRow(const Matrix& matrix, int row) {
    Vector result(matrix.ncol());
    for (int j = 0; j < matrix.ncol(); ++j) result[j] = matrix(row, j);
    return result;
}

bool isSamePart(const ReducedBody& a, const ReducedBody& b) {
    return a.mass == b.mass && a.centerOfMass == b.centerOfMass && a.inertia == b.inertia &&
           a.omegaSquared == b.omegaSquared && a.I1 == b.I1 && a.Phi == b.Phi && a.N == b.N;
}

/** The same State for a model with other numbers.
@throws std::runtime_error if its structure or parts differ. **/
State transferState(const Model& model, const Model& other, const State& state) {
    State moved = other.makeInitialState();
    if (moved.getNQ() != state.getNQ() || moved.getNU() != state.getNU() ||
        moved.getNZ() != state.getNZ() || model.getBodies().size() != other.getBodies().size())
        throw std::runtime_error("it changes what the model consists of");
    for (size_t b = 0; b < model.getBodies().size(); ++b) {
        const auto &mine = model.getBodies()[b].flexible, &its = other.getBodies()[b].flexible;
        if (!mine) continue;
        if (!isSamePart(mine->getPart(), its->getPart()))
            throw std::runtime_error(
                "it changes the part of body '" + model.getBodies()[b].name +
                "' and with it its modes: only what acts on parts can be an input");
        if (mine->isRigid(state))
            its->setRigid(moved);
        else
            its->setFlexible(moved);
    }
    other.getFlexibleBodies().setHolding(moved, model.getFlexibleBodies().getHolding(state));
    other.getSystem().realizeModel(moved);
    moved.setTime(state.getTime());
    moved.updQ() = state.getQ();
    moved.updU() = state.getU();
    moved.updZ() = state.getZ();
    other.getSystem().realize(moved, SimTK::Stage::Velocity);
    return moved;
}

}  // namespace

//-------------------------------------------------------------------------------------------------
// outputs

namespace {

/** The six components behind a probe of von Mises stress at a node; empty for other probes. **/
std::optional<Probe> findComponents(const std::shared_ptr<const Model>& model, const Probe& probe) {
    const ModelValue probes = model->getFile().get("probes");
    if (!probes.isMap() || !probes.has(probe.name)) return {};
    const ModelValue entry = probes.get(probe.name);
    if (!entry.isMap() || !entry.has("stress")) return {};
    const ModelValue stress = entry.get("stress");
    if (stress.get("what").getText() != "von_mises" || !stress.get("node").isGiven()) return {};
    const auto recovery =
        std::make_shared<StressRecovery>(findFlexible(*model, stress.get("body")),
                                         std::vector<int>{stress.get("node").getInteger()});
    Probe components;
    components.name = probe.name;
    components.unit = probe.unit;
    components.columns = {"xx", "yy", "zz", "xy", "yz", "zx"};
    components.calc = [model, recovery](const Moment& moment, double* values) {
        SimTK::Array_<SimTK::SymMat33> tensors;
        recovery->calcStress(moment.state, tensors);
        constexpr int Places[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 0}, {2, 1}, {2, 0}};
        for (int k = 0; k < 6; ++k) values[k] = tensors[0](Places[k][0], Places[k][1]);
    };
    return components;
}

}  // namespace

namespace {

std::string describeKinks(const std::vector<std::string>& names) {
    return "'" + joinNames(names, "', '") + (names.size() > 1 ? "' have" : "' has") +
           " no derivative here, as the size of something that is zero has none: it grows "
           "whichever "
           "way that moves; observe components instead (component: x of a vector, what: xx of a "
           "stress)";
}

}  // namespace

OutputKinks::OutputKinks(std::vector<std::string> kinks, std::vector<std::string> others)
    : std::runtime_error(describeKinks(kinks)), names(std::move(kinks)), rest(std::move(others)) {}

LinearOutputPorts::LinearOutputPorts(std::shared_ptr<const Model> model, const Probes& probes,
                                     const std::vector<std::string>& names,
                                     EffectiveStress effectiveStress)
    : m_model(std::move(model)), m_probes(probes), m_effectiveStress(effectiveStress) {
    choose(names);
}

void LinearOutputPorts::choose(const std::vector<std::string>& names) {
    m_choices.clear();
    m_ports.clear();
    m_names.clear();
    m_stresses.clear();
    const auto add = [&](const std::string& port, const Probe& probe, const std::string& name) {
        m_ports.push_back({port, probe.unit});
        m_names.push_back(name);
    };
    std::vector<std::string> wanted = names;
    if (wanted.empty()) wanted = getNames(m_probes.getProbes());
    for (const std::string& name : wanted) {
        Choice choice;
        std::vector<std::string> known;
        for (const Probe& probe : m_probes.getProbes()) {
            known.push_back(probe.name);
            if (name == probe.name && m_effectiveStress == EffectiveStress::ByComponents)
                if (const auto components = findComponents(m_model, probe)) {
                    m_stresses.emplace_back(name, int(m_ports.size()));
                    choice.probe = *components;
                    for (int k = 0; k < 6; ++k) {
                        choice.columns.push_back(k);
                        add(name + '.' + components->columns[size_t(k)], *components, name);
                    }
                    break;
                }
            for (int k = 0; k < int(probe.columns.size()); ++k) {
                const std::string& column = probe.columns[size_t(k)];
                const std::string full = column.empty() ? probe.name : probe.name + '.' + column;
                if (full != probe.name) known.push_back(full);
                if (name != probe.name && name != full) continue;
                choice.probe = probe;
                choice.columns.push_back(k);
                add(full, probe, full);
            }
        }
        if (choice.columns.empty()) throw ModelError(describeUnknown("probe", name, known));
        m_choices.push_back(std::move(choice));
    }
}

LinearOutputs LinearOutputPorts::differentiate(const OperatingPoint& point,
                                               const std::function<void()>& observer) const {
    const FlexibleBodySubsystem& flexible = m_model->getFlexibleBodies();
    const bool isAtRest = point.state.getU().norm() == 0;
    std::vector<std::optional<Signal::Slopes>> exact;
    std::vector<Choice> others;
    std::vector<int> numbers;  // ports of their columns
    for (const Choice& choice : m_choices) {
        Choice rest{choice.probe, {}};
        for (const int column : choice.columns) {
            const std::vector<Signal>& signals = choice.probe.signals;
            exact.emplace_back();
            if (isAtRest && !signals.empty())
                exact.back() = signals[size_t(column)].calcSlopes(flexible, point.state);
            if (exact.back()) continue;
            rest.columns.push_back(column);
            numbers.push_back(int(exact.size()) - 1);
        }
        if (!rest.columns.empty()) others.push_back(std::move(rest));
    }
    LinearOutputs differences;
    try {
        differences = differentiateOutputs(
            m_model->getSystem(), point,
            [&](const State& state, const Vector& uDot, const Vector& multipliers) {
                if (observer) observer();
                return calcChoices(others, {state, uDot, multipliers, 0});
            });
    } catch (const NoDerivative& error) {
        std::set<int> kinked;
        for (const int k : error.outputs) kinked.insert(numbers[size_t(k)]);
        std::vector<std::string> kinks, rest;
        for (size_t k = 0; k < m_ports.size(); ++k)
            if (kinked.count(int(k)))
                kinks.push_back(m_ports[k].name);
            else if (rest.empty() || rest.back() != m_names[k])
                rest.push_back(m_names[k]);
        throw OutputKinks(kinks, rest);
    }
    LinearOutputs outputs;
    const std::pair<Matrix*, const Matrix*> pairs[] = {
        {&outputs.byQ, &differences.byQ},
        {&outputs.byU, &differences.byU},
        {&outputs.byUDot, &differences.byUDot},
        {&outputs.byMultipliers, &differences.byMultipliers},
        {&outputs.byStates, &differences.byStates}};
    for (const auto& [all, own] : pairs) {
        all->resize(int(m_ports.size()), own->ncol());
        all->setToZero();
        for (int k = 0; k < own->nrow(); ++k) (*all)[numbers[size_t(k)]] = (*own)[k];
    }
    for (int k = 0; k < int(exact.size()); ++k)
        if (exact[size_t(k)]) {
            outputs.byQ[k] = ~exact[size_t(k)]->byQ;
            outputs.byU[k] = ~exact[size_t(k)]->byU;
        }
    return outputs;
}

std::vector<double> LinearOutputPorts::calc(const State& state, const Vector& uDot,
                                            const Vector& multipliers) const {
    return calcChoices(m_choices, {state, uDot, multipliers, 0});
}

std::vector<double> LinearOutputPorts::calcChoices(const std::vector<Choice>& choices,
                                                   const Moment& moment) {
    std::vector<double> values, own;
    for (const Choice& choice : choices) {
        own.resize(choice.probe.columns.size());
        choice.probe.calc(moment, own.data());
        for (const int column : choice.columns) values.push_back(own[size_t(column)]);
    }
    return values;
}

//-------------------------------------------------------------------------------------------------
// inputs

LinearInputPorts::LinearInputPorts(const ModelText& text, const ModelOptions& options,
                                   const Model& model, const std::vector<std::string>& paths)
    : m_text(text), m_options(options), m_model(model) {
    m_options.listener = {};
    for (const std::string& path : paths) {
        const std::vector<std::string> parts = splitAt(normalizePath(path), '.');
        if (addInputs(parts)) continue;
        ModelValue value = model.getFile();
        std::string place, setting;
        for (const std::string& part : parts) {
            std::vector<std::string> known;
            std::string key = part;
            if (value.isMap()) known = value.getKeys();
            if (value.isList())
                for (int i = 0; i < value.getSize(); ++i) {
                    known.push_back(i < 3 ? std::string(1, PortAxes[i]) : std::to_string(i));
                    if (part == known.back() || part == std::to_string(i)) {
                        key = std::to_string(i);
                        known.back() = part;
                    }
                }
            if (std::find(known.begin(), known.end(), part) == known.end())
                throw ModelError(
                    "input '" + path + "': " +
                    describeUnknown("number in '" + (place.empty() ? "the model" : place) + "'",
                                    part, known));
            value = value.isMap() ? value.get(part) : value.at(std::stoi(key));
            place += (place.empty() ? "" : ".") + part;
            setting += (setting.empty() ? "" : ".") + key;
        }
        const size_t before = m_ports.size();
        add(value, place, setting, 0);
        if (m_ports.size() == before)
            throw ModelError("input '" + path + "': there is no number in it");
        for (size_t k = before; k < m_ports.size(); ++k) refuseTwin(k);
    }
}

void LinearInputPorts::refuseTwin(size_t port) const {
    for (size_t k = 0; k < port; ++k)
        if (m_ports[k].name == m_ports[port].name)
            throw ModelError("input '" + m_ports[k].name + "' is given twice");
}

bool LinearInputPorts::addInputs(const std::vector<std::string>& path) {
    const bool isNamed = path.front() == "inputs";
    bool isFound = false;
    for (const Model::InputEntry& input : m_model.getInputs()) {
        const bool isMeant = isNamed ? path.size() == 1 || path[1] == input.name
                                     : path.size() == 1 && path[0] == input.name;
        if (!isMeant) continue;
        isFound = true;
        m_ports.push_back({input.name, input.unit});
        m_sources.push_back({"", "", SimTK::NaN, input.state});
        refuseTwin(m_ports.size() - 1);
    }
    return isFound;
}

void LinearInputPorts::add(const ModelValue& value, const std::string& path,
                           const std::string& setting, double time) {
    if (value.isMap())
        for (const std::string& key : value.getKeys())
            add(value.get(key), path + '.' + key, setting + '.' + key, time);
    if (value.isList())
        for (int i = 0; i < value.getSize(); ++i)
            add(value.at(i), path + '.' + (i < 3 ? std::string(1, PortAxes[i]) : std::to_string(i)),
                setting + '.' + std::to_string(i), time);
    if (!value.isScalar()) return;
    double now = SimTK::NaN;
    try {
        if (!value.isLaw()) now = value.getExpression().calcValue(time);
    } catch (const ModelError&) {
        return;  // not a number
    }
    m_ports.push_back({path, getUnit(splitAt(path, '.'))});
    m_sources.push_back({setting, value.getText(), now});
}

LinearInputs LinearInputPorts::differentiate(const OperatingPoint& point,
                                             const LinearOutputPorts& observed,
                                             const std::vector<std::string>& outputs,
                                             const std::function<void()>& observer) const {
    const int n = point.uDot.size(), m = point.multipliers.size(), count = int(m_ports.size());
    LinearInputs inputs{Matrix(n, count), Matrix(m, count), Matrix(), Matrix()};
    // Subtracted below, so that unchanged terms cancel without round-off.
    const EquationErrors before =
        calcEquationErrors(m_model.getSystem(), point.state, point.uDot, point.multipliers);
    const int numStates = before.rates.size();
    inputs.states.resize(numStates, count);
    const std::vector<double> observedBefore =
        observed.calc(point.state, point.uDot, point.multipliers);
    for (int k = 0; k < count; ++k) {
        const Source& source = m_sources[size_t(k)];
        const bool isInput = source.input >= 0;
        const FlexibleBodySubsystem& flexible = m_model.getFlexibleBodies();
        const double value =
            isInput ? flexible.getStateValue(point.state, source.input) : source.value;
        const double size = std::isfinite(value) && value != 0 ? std::abs(value) : 1;
        // Loads enter the equations linearly.
        const bool isLinear =
            source.setting.rfind("loads.", 0) == 0 || source.setting.rfind("gravity", 0) == 0;
        const double step = isLinear ? std::max(1.0, size) : NumberStep * size;
        /** Changes of the equations' errors and of outputs (`seen`) by a change of the number. **/
        struct Effect {
            Vector residual, positions, velocities, rates, seen;

            void add(double weight, const Effect& other) {
                residual += weight * other.residual;
                positions += weight * other.positions;
                velocities += weight * other.velocities;
                if (rates.size() > 0) rates += weight * other.rates;
                if (seen.size() > 0) seen += weight * other.seen;
            }
        };
        const auto calcEffect = [&](double change) {
            if (observer) observer();
            const auto compare = [&](const EquationErrors& errors, const std::vector<double>& now) {
                Effect effect{errors.residual - before.residual,
                              errors.positions - before.positions,
                              errors.velocities - before.velocities, Vector(numStates),
                              Vector(int(now.size()))};
                for (int i = 0; i < numStates; ++i)
                    effect.rates[i] = errors.rates[i] - before.rates[i];
                for (int i = 0; i < effect.seen.size(); ++i)
                    effect.seen[i] = now[size_t(i)] - observedBefore[size_t(i)];
                return effect;
            };
            if (isInput) {
                State state = copyState(point.state);
                flexible.setStateValue(state, source.input, value + change);
                m_model.getSystem().realize(state, SimTK::Stage::Velocity);
                return compare(
                    calcEquationErrors(m_model.getSystem(), state, point.uDot, point.multipliers),
                    observed.calc(state, point.uDot, point.multipliers));
            }
            ModelText changed = m_text;
            std::string text;
            for (const char letter : source.text)
                text += letter == '\'' ? std::string("''") : std::string(1, letter);
            changed.settings.push_back(source.setting + "='(" + text + ")+(" +
                                       writeGeneral(change) + ")'");
            try {
                const auto other = std::make_shared<const Model>(readModel(changed), m_options);
                const State state = transferState(m_model, *other, point.state);
                const EquationErrors errors =
                    calcEquationErrors(other->getSystem(), state, point.uDot, point.multipliers);
                return compare(errors, LinearOutputPorts(other, Probes::make(other), outputs,
                                                         observed.getEffectiveStress())
                                           .calc(state, point.uDot, point.multipliers));
            } catch (const std::exception& error) {
                throw std::runtime_error("input '" + m_ports[size_t(k)].name +
                                         "': " + error.what());
            }
        };
        const Effect behind = calcEffect(-step), after = calcEffect(step);
        const Effect none{Vector(n, 0.0), Vector(m, 0.0), Vector(m, 0.0), Vector(numStates, 0.0),
                          Vector(after.seen.size(), 0.0)};
        Effect slope = none;
        if (isLinear) {
            slope.add(0.5 / step, after);
            slope.add(-0.5 / step, behind);
        } else {
            slope.add(8.0 / 12 / step, after);
            slope.add(-8.0 / 12 / step, behind);
            slope.add(-1.0 / 12 / step, calcEffect(2 * step));
            slope.add(1.0 / 12 / step, calcEffect(-2 * step));
            // Close to the number, in case a kink is within the step, and on both sides of it.
            const auto calcNear = [&](double little) {
                const Effect above = calcEffect(little), below = calcEffect(-little);
                std::pair<Effect, Effect> near{none, none};  // slope; half its change
                near.first.add(0.5 / little, above);
                near.first.add(-0.5 / little, below);
                near.second.add(0.5 / little, above);
                near.second.add(0.5 / little, below);
                return near;
            };
            const auto differ = [](const Effect& one, const Effect& other, double allowed) {
                const auto isLarge = [&](const Vector& a, const Vector& b) {
                    return a.size() > 0 && (a - b).normInf() > allowed * a.normInf();
                };
                return isLarge(one.residual, other.residual) ||
                       isLarge(one.positions, other.positions) || isLarge(one.rates, other.rates);
            };
            const auto [near, bend] = calcNear(NearStep * step);
            Effect bent = near;
            bent.add(1, bend);
            const bool bends = differ(near, bent, NumberKink);
            if (bends || differ(near, slope, NumberKink)) {
                // The change at a kink does not depend on the step; round-off and curvature do.
                const auto [coarser, coarserBend] = calcNear(CoarserStep * NearStep * step);
                if (bends && !differ(bend, coarserBend, 0.5))
                    throw std::runtime_error(
                        "input '" + m_ports[size_t(k)].name +
                        "': more of it does not change what less of it does, as a force has a kink "
                        "exactly here: no linear equations hold for small changes");
                if (!bends && !differ(near, coarser, 10 * NumberKink)) slope = near;
            }
        }
        for (size_t i = 0; i < observedBefore.size(); ++i) {
            const double rise = after.seen[int(i)], fall = -behind.seen[int(i)],
                         change = std::max(std::abs(rise), std::abs(fall));
            if (std::abs(rise - fall) <=
                SmoothInput * change + SameObserved * std::abs(observedBefore[i] + rise))
                continue;
            // Beyond a kink the output goes on linearly; a parabola does not.
            if (std::abs(calcEffect(2 * step).seen[int(i)] - 2 * rise) < SmoothInput * change)
                throw OutputKinks({observed.getPorts()[i].name}, {});
        }
        const Vector &residual = slope.residual, &positions = slope.positions,
                     &velocities = slope.velocities, &rates = slope.rates, &direct = slope.seen;
        const std::string name = "input '" + m_ports[size_t(k)].name + "' ";
        if (velocities.normInf() > DrivenSpeed)
            throw std::runtime_error(name +
                                     "changes the speed of a motion: the system would leave this "
                                     "State for good; vary it in an analysis of its own");
        if (residual.normInf() == 0 && positions.normInf() == 0 && direct.normInf() == 0 &&
            (numStates == 0 || rates.normInf() == 0))
            throw std::runtime_error(name + "changes nothing about this State");
        if (k == 0) inputs.direct.resize(direct.size(), count);
        for (int i = 0; i < n; ++i) inputs.forces(i, k) = -residual[i];
        for (int i = 0; i < m; ++i) inputs.drives(i, k) = -positions[i];
        for (int i = 0; i < numStates; ++i) inputs.states(i, k) = rates[i];
        for (int i = 0; i < direct.size(); ++i) inputs.direct(i, k) = direct[i];
    }
    return inputs;
}

//-------------------------------------------------------------------------------------------------
// linear systems and responses

namespace {

/** Outputs a radian later, by the present displacements, which the motion carries there. **/
LinearOutputs bringBack(const Linearization& now, const Linearization& later,
                        const LinearOutputs& outputs) {
    const Matrix byQ = (outputs.byQ + outputs.byU * later.speedsByQ +
                        outputs.byUDot * later.accelerationsByQ) *
                       now.carried,
                 byU = (outputs.byU + outputs.byUDot * later.accelerationsByU) * now.carried;
    LinearOutputs back = outputs;
    back.byUDot = outputs.byUDot * now.carried;
    back.byU = byU - back.byUDot * now.accelerationsByU;
    back.byQ = byQ - back.byU * now.speedsByQ - back.byUDot * now.accelerationsByQ;
    return back;
}

LinearInputs bringBack(const Linearization& now, LinearInputs inputs) {
    inputs.forces = ~now.carried * inputs.forces;
    return inputs;
}

/** All displacements as outputs, for the same system. **/
LinearOutputs observeDisplacements(const LinearOutputs& outputs) {
    const int n = outputs.byQ.ncol();
    LinearOutputs all;
    all.byQ.resize(n, n);
    all.byQ = 1;  // on the diagonal
    for (SimTK::Matrix* none : {&all.byU, &all.byUDot}) none->resize(n, n), *none = 0;
    all.byMultipliers.resize(n, outputs.byMultipliers.ncol());
    all.byMultipliers = 0;
    all.byStates.resize(n, outputs.byStates.ncol());
    all.byStates = 0;
    return all;
}

/** Returns bounds of the responses at s, for each output and input: the response if the states'
motion were all along the output's row of C. **/
Matrix calcLargestResponses(const StateSpace& space, Complex s) {
    StateSpace states = space;
    const int size = space.A.nrow(), inputs = space.B.ncol();
    states.C.resize(size, size);
    states.C = 1;  // on the diagonal
    for (Matrix* none : {&states.D, &states.D1, &states.D2})
        none->resize(size, inputs), none->setToZero();
    const auto moved = states.calcTransfer(s);
    Matrix bounds(space.C.nrow(), inputs);
    for (int k = 0; k < inputs; ++k) {
        double motion = 0;
        for (int j = 0; j < size; ++j) motion += std::norm(moved(j, k));
        for (int i = 0; i < bounds.nrow(); ++i)
            bounds(i, k) = space.C[i].norm() * std::sqrt(motion);
    }
    return bounds;
}

/** Returns the number of a port whose responses in `a` and `b` differ by more than the tolerances;
−1 if there is none. **/
int findDifference(const StateSpace& a, const StateSpace& b, double rate, bool isOfInputs) {
    for (const double factor : {0.31, 1.7}) {
        const Complex s(0.1 * factor * rate, factor * rate);
        const auto one = a.calcTransfer(s), other = b.calcTransfer(s);
        const Matrix bounds = calcLargestResponses(a, s);
        for (int i = 0; i < one.nrow(); ++i) {
            double largest = 0;
            for (int j = 0; j < one.ncol(); ++j) largest = std::max(largest, std::abs(one(i, j)));
            for (int k = 0; k < one.ncol(); ++k)
                if (!(std::abs(one(i, k) - other(i, k)) <=
                      SteadyResponse * largest + SteadyRoundOff * bounds(i, k)))
                    return isOfInputs ? k : i;
        }
    }
    return -1;
}

/** Common start of linear systems and frequency responses. **/
struct ModelLinearization {
    LinearInputPorts inputs;
    LinearOutputPorts outputs;
    std::vector<std::string> outputNames;
    const Model& model;
    std::function<void()> observer;
    std::vector<std::string> leftOut = {};

    /** If all outputs are wanted, leaves out those without a derivative. To be called before
    drive(). **/
    LinearOutputs observe(const OperatingPoint& point) {
        try {
            return outputs.differentiate(point, observer);
        } catch (const OutputKinks& kinks) {
            if (!outputNames.empty() || kinks.rest.empty()) throw;
            leftOut = kinks.names;
            outputNames = kinks.rest;
        }
        outputs.choose(outputNames);
        return outputs.differentiate(point, observer);
    }
    LinearInputs drive(const OperatingPoint& point) const {
        return inputs.differentiate(point, outputs, outputNames, observer);
    }
    Linearization linearize(const State& about) const {
        Linearization linear = calcLinearization(model.getSystem(), about, observer);
        if (!linear.unsteady.empty())
            throw std::runtime_error("this is not a steady motion: " + linear.unsteady);
        if (!linear.later) requireBalance(describeImbalance(model.getSystem(), linear));
        return linear;
    }
    void requireBalance(const std::string& imbalance) const {
        if (!imbalance.empty())
            throw std::runtime_error("this is not an equilibrium: " + imbalance +
                                     "; linearise about one (about: static)");
    }
    StateSpace makeSpace(const Linearization& linear) {
        const LinearOutputs observed = observe(linear);
        return makeSpace(linear, drive(linear), observed);
    }
    StateSpace makeSpace(const Linearization& linear, const LinearInputs& driven,
                         const LinearOutputs& observed) {
        const StateSpace space = calcStateSpace(linear, driven, observed);
        if (space.A.nrow() == 0) throw std::runtime_error("nothing in the model is free to move");
        if (!linear.later) return space;
        // The motion carries displacements along; inputs and outputs must be the same there.
        const Linearization later = calcLinearization(model.getSystem(), *linear.later, observer);
        const double rate = linear.state.getU().normInf();
        const auto refuse = [](const LinearSystem::Port& port, const char* what, const char* cure) {
            throw std::runtime_error("'" + port.name + "' is another " + what +
                                     " when the system has rotated by a radian: displacements of "
                                     "rotating bodies are given in axes that rotate with them: " +
                                     cure +
                                     " a body that does not rotate, such as a hub or housing that "
                                     "carries the rotor, or use axes that rotate with it");
        };
        const int output = findDifference(
            space, calcStateSpace(linear, driven, bringBack(linear, later, observe(later))), rate,
            false);
        if (output >= 0) refuse(outputs.getPorts()[size_t(output)], "output", "observe");
        const int input = findDifference(
            space, calcStateSpace(linear, bringBack(linear, drive(later)), observed), rate, true);
        if (input >= 0) refuse(inputs.getPorts()[size_t(input)], "input", "load");
        return space;
    }
};

ModelLinearization beginLinearization(const ModelText& text, const ModelOptions& options,
                                      const std::shared_ptr<const Model>& model,
                                      const Probes& probes, const std::vector<std::string>& inputs,
                                      const std::vector<std::string>& outputs,
                                      EffectiveStress effectiveStress,
                                      const std::function<void()>& observer) {
    if (inputs.empty())
        throw ModelError(
            "a linear model needs an input: the path of a number, such as loads.NAME.force.x");
    return {LinearInputPorts(text, options, *model, inputs),
            LinearOutputPorts(model, probes, outputs, effectiveStress), outputs, *model, observer};
}

}  // namespace

LinearSystem linearizeModel(const ModelText& text, const ModelOptions& options,
                            const std::shared_ptr<const Model>& model, const Probes& probes,
                            const State& about, const std::vector<std::string>& inputs,
                            const std::vector<std::string>& outputs, const ModalForm& form,
                            const std::function<void()>& observer) {
    ModelLinearization ports = beginLinearization(text, options, model, probes, inputs, outputs,
                                                  EffectiveStress::AsItIs, observer);
    const StateSpace space = ports.makeSpace(ports.linearize(about));
    LinearSystem result;
    result.inputs = ports.inputs.getPorts();
    result.outputs = ports.outputs.getPorts();
    result.leftOut = ports.leftOut;
    result.time = about.getTime();
    for (int i = 0; i < space.D1.nrow(); ++i)
        for (int k = 0; k < space.D1.ncol(); ++k) {
            const double rest =
                std::abs(space.D(i, k)) + getRow(space.C, i).norm() * getColumn(space.B, k).norm();
            if (std::abs(space.D1(i, k)) + std::abs(space.D2(i, k)) <= SmallRatePart * rest)
                continue;
            throw std::runtime_error("'" + result.outputs[size_t(i)].name +
                                     "' follows the speed or acceleration of input '" +
                                     result.inputs[size_t(k)].name +
                                     "', which matrices A, B, C, D cannot tell: observe positions, "
                                     "or drive by a force");
        }
    const StateSpace own = calcModalForm(space, form);
    result.A = own.A;
    result.B = own.B;
    result.C = own.C;
    result.D = own.D;
    result.numStates = space.A.nrow();
    return result;
}

ModelResponse::ModelResponse(const ModelText& text, const ModelOptions& options,
                             const std::shared_ptr<const Model>& model, const Probes& probes,
                             const State& about, const std::vector<std::string>& inputs,
                             const std::vector<std::string>& outputs,
                             const std::optional<Unbalance>& unbalance,
                             EffectiveStress effectiveStress, const std::function<void()>& observer)
    : m_model(model), m_state(about), m_unbalance(unbalance) {
    ModelText ownText = text;
    Probes ownProbes = probes;
    State state = copyState(about);
    std::vector<std::string> paths = inputs;
    if (unbalance) {
        std::string load = "unbalance";
        while (model->getFile().get("loads").has(load)) load += '_';
        ownText.settings.push_back("loads." + load + "={on: " + unbalance->on +
                                   ", force: [0, 0, 0]}");
        ModelOptions quiet = options;
        quiet.listener = {};
        m_model = std::make_shared<const Model>(readModel(ownText), quiet);
        ownProbes = Probes::make(m_model);
        state = transferState(*model, *m_model, about);
        for (const int turn : {1, 2})
            paths.push_back("loads." + load + ".force." + PortAxes[(unbalance->axis + turn) % 3]);
    }
    ModelLinearization ports = beginLinearization(ownText, options, m_model, ownProbes, paths,
                                                  outputs, effectiveStress, observer);
    m_inputs = ports.inputs.getPorts();
    if (unbalance) {
        m_inputs.resize(m_inputs.size() - 2);
        m_inputs.push_back({"unbalance", ""});
    }
    if (state.getNZ() > 0 || state.getU().normInf() > SlowestSpeed) {
        const Linearization linear = ports.linearize(state);
        m_outputEffects = ports.observe(linear);
        m_inputEffects = ports.drive(linear);
        m_space = ports.makeSpace(linear, m_inputEffects, m_outputEffects);
        LinearInputs moving = m_inputEffects;
        moving.direct.resize(m_outputEffects.byQ.ncol(), moving.forces.ncol());
        moving.direct = 0;
        m_motions = calcStateSpace(linear, moving, observeDisplacements(m_outputEffects));
    } else {
        state.updU() = 0;
        m_blocks.emplace(m_model->getSystem(), state, observer);
        ports.requireBalance(m_blocks->describeImbalance());
        m_outputEffects = ports.observe(m_blocks->getPoint());
        m_inputEffects = ports.drive(m_blocks->getPoint());
    }
    m_stresses = ports.outputs.getStresses();
    m_outputs = ports.outputs.getPorts();
    m_outputNames = ports.outputNames;
    m_leftOut = ports.leftOut;
}

/** Replaces the responses to the two forces of the unbalance by the one to their sum. **/
Matrix_<Complex> ModelResponse::combine(const Matrix_<Complex>& responses, double omega) const {
    if (!m_unbalance) return responses;
    const int last = responses.ncol() - 2;
    Matrix_<Complex> combined = responses(0, 0, responses.nrow(), last + 1);
    for (int i = 0; i < combined.nrow(); ++i)
        combined(i, last) = m_unbalance->moment * omega * omega *
                            (responses(i, last) - Complex(0, 1) * responses(i, last + 1));
    return combined;
}

std::vector<Matrix_<Complex>> ModelResponse::calcTransfers(
    const std::vector<double>& frequencies,
    const std::function<void(size_t done)>& observer) const {
    std::vector<double> omegas;
    for (const double frequency : frequencies) omegas.push_back(2 * SimTK::Pi * frequency);
    std::vector<Matrix_<Complex>> transfers;
    if (m_blocks) {
        transfers = m_blocks->calcTransfers(omegas, m_inputEffects, m_outputEffects, 0, observer);
        for (size_t k = 0; k < omegas.size(); ++k)
            transfers[k] = combine(Matrix_<Complex>(transfers[k]), omegas[k]);
        return transfers;
    }
    for (const double omega : omegas) {
        transfers.push_back(combine(m_space->calcTransfer(Complex(0, omega)), omega));
        if (observer) observer(transfers.size());
    }
    return transfers;
}

Matrix_<Complex> ModelResponse::calcMotions(double frequency) const {
    if (!m_blocks)
        throw std::runtime_error(
            "shapes can be drawn only of systems at rest that have no states of their own");
    const double omega = 2 * SimTK::Pi * frequency;
    return combine(m_blocks->calcMotions(omega, m_inputEffects), omega);
}

Matrix ModelResponse::calcBounds(double frequency) const {
    const double omega = 2 * SimTK::Pi * frequency;
    const Matrix_<Complex> motions = m_blocks ? m_blocks->calcMotions(omega, m_inputEffects)
                                              : m_motions->calcTransfer(Complex(0, omega));
    // Norms with the mass matrix have the same unit for all motions.
    const SimTK::SimbodyMatterSubsystem& matter = m_model->getSystem().getMatterSubsystem();
    State state = copyState(m_state);
    m_model->getSystem().realize(state, SimTK::Stage::Velocity);
    const auto measure = [&](const Vector& v, bool isMotion) {
        Vector product;
        if (isMotion)
            matter.multiplyByM(state, v, product);
        else
            matter.multiplyByMInv(state, v, product);
        return std::sqrt(std::max(0.0, ~v * product));
    };
    Matrix bounds(m_outputEffects.byQ.nrow(), motions.ncol(), 0.0);
    for (int k = 0; k < motions.ncol(); ++k) {
        Vector real(motions.nrow()), imaginary(motions.nrow());
        for (int j = 0; j < motions.nrow(); ++j)
            real[j] = motions(j, k).real(), imaginary[j] = motions(j, k).imag();
        const double size = std::hypot(measure(real, true), measure(imaginary, true));
        for (int i = 0; i < bounds.nrow(); ++i)
            bounds(i, k) =
                size * (measure(getRow(m_outputEffects.byQ, i), false) +
                        omega * measure(getRow(m_outputEffects.byU, i), false) +
                        omega * omega * measure(getRow(m_outputEffects.byUDot, i), false));
    }
    if (!m_unbalance) return bounds;
    const int last = bounds.ncol() - 2;
    Matrix combined = bounds(0, 0, bounds.nrow(), last + 1);
    for (int i = 0; i < bounds.nrow(); ++i)
        combined(i, last) = std::abs(m_unbalance->moment) * omega * omega *
                            std::hypot(bounds(i, last), bounds(i, last + 1));
    return combined;
}

std::vector<std::vector<bool>> findRoundOff(const std::vector<Matrix_<Complex>>& transfers,
                                            const std::vector<Matrix>& bounds) {
    const int numOutputs = transfers.at(0).nrow(), numInputs = transfers.at(0).ncol();
    std::vector<std::vector<bool>> isRoundOff(size_t(numOutputs),
                                              std::vector<bool>(size_t(numInputs), true));
    for (size_t f = 0; f < transfers.size(); ++f)
        for (int i = 0; i < numOutputs; ++i)
            for (int k = 0; k < numInputs; ++k)
                if (!(std::abs(transfers[f](i, k)) <= ResponseRoundOff * bounds[f](i, k)))
                    isRoundOff[size_t(i)][size_t(k)] = false;
    return isRoundOff;
}

//-------------------------------------------------------------------------------------------------
// frequencies

namespace {

/** True if a response changes so much between two frequencies that peaks may be missed. **/
bool isCoarse(const Matrix_<Complex>& a, const Matrix_<Complex>& b, const SimTK::Matrix& largest,
              double chord) {
    for (int i = 0; i < a.nrow(); ++i)
        for (int k = 0; k < a.ncol(); ++k) {
            const double size =
                std::max({std::abs(a(i, k)), std::abs(b(i, k)), SmallResponse * largest(i, k)});
            if (std::abs(a(i, k) - b(i, k)) > chord * size) return true;
        }
    return false;
}

}  // namespace

void calcHarmonicResponse(const TransferFunction& calcTransfers,
                          const std::vector<double>& frequencies, Refinement refinement,
                          const std::function<void(double fraction)>& observer,
                          HarmonicResponse& response) {
    const double chord = refinement == Refinement::ForIntegrals ? FineChord : CoarseChord;
    std::map<double, Matrix_<Complex>> found;
    std::vector<double> wanted = frequencies;
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    const size_t most = wanted.size() + MostAdded;
    for (int pass = 0; !wanted.empty(); ++pass) {
        const auto transfers = calcTransfers(wanted, [&](size_t done) {
            // The number of passes is unknown: each counts as half of what is left.
            const double left = refinement == Refinement::None ? 0 : std::pow(0.5, pass + 1);
            const double before = pass == 0 ? 0 : 1 - std::pow(0.5, pass);
            if (observer)
                observer(before + (1 - left - before) * double(done) / double(wanted.size()));
        });
        for (size_t k = 0; k < wanted.size(); ++k) found[wanted[k]] = transfers[k];
        wanted.clear();
        if (refinement == Refinement::None) break;
        SimTK::Matrix largest(found.begin()->second.nrow(), found.begin()->second.ncol(), 0.0);
        for (const auto& entry : found)
            for (int i = 0; i < largest.nrow(); ++i)
                for (int k = 0; k < largest.ncol(); ++k)
                    largest(i, k) = std::max(largest(i, k), std::abs(entry.second(i, k)));
        for (auto next = std::next(found.begin()); next != found.end(); ++next) {
            const auto before = std::prev(next);
            if (next->first - before->first > FinestStep * next->first &&
                isCoarse(before->second, next->second, largest, chord) &&
                found.size() + wanted.size() < most)
                wanted.push_back(0.5 * (before->first + next->first));
        }
    }
    response.frequencies.clear();
    response.transfers.clear();
    for (const auto& [frequency, transfer] : found) {
        response.frequencies.push_back(frequency);
        response.transfers.push_back(transfer);
    }
}

//-------------------------------------------------------------------------------------------------
// spectra

namespace {

/** Exponent of the power law between two points of a density; NaN if f1, s1 or s2 is 0. **/
double calcSlope(double f1, double s1, double f2, double s2) {
    return f1 > 0 && s1 > 0 && s2 > 0 ? std::log(s2 / s1) / std::log(f2 / f1) : SimTK::NaN;
}

}  // namespace

double Spectrum::calcDensity(double frequency) const {
    if (frequencies.empty()) return densities.at(0);
    if (frequency < frequencies.front() || frequency > frequencies.back()) return 0;
    const auto upper = std::lower_bound(frequencies.begin(), frequencies.end(), frequency);
    const size_t k = size_t(upper - frequencies.begin());
    if (frequencies[k] == frequency) return densities[k];
    const double f1 = frequencies[k - 1], f2 = frequencies[k], s1 = densities[k - 1],
                 s2 = densities[k], slope = calcSlope(f1, s1, f2, s2);
    return std::isnan(slope) ? s1 + (s2 - s1) * (frequency - f1) / (f2 - f1)
                             : s1 * std::pow(frequency / f1, slope);
}

double integrateSpectrum(const std::vector<double>& frequencies,
                         const std::vector<double>& densities) {
    double sum = 0;
    for (size_t k = 1; k < frequencies.size(); ++k) {
        const double f1 = frequencies[k - 1], f2 = frequencies[k], s1 = densities[k - 1],
                     s2 = densities[k], slope = calcSlope(f1, s1, f2, s2);
        if (std::isnan(slope))
            sum += 0.5 * (s1 + s2) * (f2 - f1);
        else if (std::abs(slope + 1) < 1e-6)
            sum += s1 * f1 * std::log(f2 / f1);
        else
            sum += (s2 * f2 - s1 * f1) / (slope + 1);
    }
    return sum;
}

}  // namespace model
}  // namespace simflex
