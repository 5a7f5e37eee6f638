#include "simflex/model/builders/SignalBuilder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simflex/model/builders/HeldStates.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/file/VariableFormula.h"
#include "simflex/model/probes/FrameSignals.h"
#include "simflex/model/probes/ProbeColumns.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

constexpr double MostFormulas = 1e5;  // such a law takes some milliseconds to evaluate

/** Leaves out terms whose factor is 0, so that nothing depends on them. **/
Signal makeSum(std::vector<Signal> terms, std::vector<double> factors) {
    for (size_t i = factors.size(); i-- > 0;)
        if (factors[i] == 0) {
            terms.erase(terms.begin() + std::ptrdiff_t(i));
            factors.erase(factors.begin() + std::ptrdiff_t(i));
        }
    if (terms.empty()) return {};
    return Signal::function(terms, [factors](Real, const Real* x, Real* slopes) {
        if (slopes) std::copy(factors.begin(), factors.end(), slopes);
        Real sum = 0;
        for (size_t i = 0; i < factors.size(); ++i) sum += factors[i] * x[i];
        return sum;
    });
}

[[noreturn]] void failNoForceDependsOn(const ModelValue& law, const std::string& name,
                                       const std::string& kind) {
    law.fail("no law can depend on probe '" + name + "', which is of kind '" + kind +
             "': positions, velocities, angular velocities, coordinates, rates, distances, states, "
             "functions of time and expressions of these can be used");
}

/** Fails on names of quantities that only other types of connectors have. **/
void failOwnNameOfOthers(const ModelValue& law, const std::string& name) {
    if (name == "angle" || name == "speed")
        law.fail("only laws of torsion springs and of motors of turning joints know '" + name +
                 "'; springs, actuators and motors of sliding joints know 'length' and 'rate'");
    if (name == "length" || name == "rate")
        law.fail("only laws of springs, actuators and motors of sliding joints know '" + name +
                 "'; torsion springs and motors of turning joints know 'angle' and 'speed'");
}

bool isSameCoordinate(const ModelValue& a, const ModelValue& b) {
    if (a.isMap() && a.has("body")) return false;
    const auto [joint, number] = readJointCoordinate(a);
    const auto [other, otherNumber] = readJointCoordinate(b);
    return joint.getText() == other.getText() && std::max(number, 0) == std::max(otherNumber, 0);
}

}  // namespace

/** Equations and outputs of an entry of `states` or `controllers`, or of an event. **/
class SignalBuilder::StateEntry {
public:
    StateEntry(ModelSystem& system, const ModelOptions& options, const ModelValue& value)
        : m_system(system), m_value(value), m_block(value) {
        for (const char* kind :
             {"rate", "pid", "low_pass", "lead_lag", "transfer_function", "rate_limit",
              "state_space", "sample_and_hold", "hysteresis", "fmu"})
            if (value.has(kind)) m_kind = kind;
        if (m_kind.empty()) {  // an event
            add("", 0);
            add(".waiting", 1);
            return;
        }
        m_block = value.get(m_kind);
        if (m_kind == "rate") {
            add("", value.get("initial").getNumber());
        } else if (m_kind == "pid") {
            m_hasIntegral = m_block.get("integral").getNumber() != 0;
            m_hasDerivative = m_block.get("derivative").getNumber() != 0;
            if (m_hasIntegral) add(".integral");
            if (m_hasDerivative) add(".filter");
        } else if (m_kind == "transfer_function") {
            readTransferFunction();
        } else if (m_kind == "state_space") {
            readStateSpace();
        } else if (m_kind == "fmu") {
            readController(options);
        } else if (m_kind == "sample_and_hold") {
            addHeld("");
            addHeld(".sample");
        } else if (m_kind == "hysteresis") {
            readThresholds();
            addHeld("", m_block.get("initial").getInteger());
        } else {
            add("");
        }
    }

    std::string getName() const { return m_value.getName(); }
    const ModelValue& getValue() const { return m_value; }
    /** Index of the state that an event may set; −1 if there is none. **/
    int getSettable() const { return m_kind.empty() || m_kind == "rate" ? m_indices[0] : -1; }

    /** Names of outputs in laws: its own name, or NAME.OUTPUT if outputs are named. **/
    std::vector<std::string> listOutputs() const {
        if (m_outputs.empty()) return {getName()};
        std::vector<std::string> names;
        for (const std::string& output : m_outputs) names.push_back(getName() + "." + output);
        return names;
    }
    /** @throws ModelError if it depends on itself without a state in between. **/
    const Signal& getOutput(const std::string& name, SignalBuilder& signals) {
        const auto known = m_made.find(name);
        if (known != m_made.end()) return known->second;
        const Signal output = m_kind == "state_space" ? makeSpaceOutput(name, signals)
                              : m_kind == "fmu"       ? m_values[findOutput(name)]
                                                      : makeOutput(signals);
        return m_made.emplace(name, output).first->second;
    }

    /** To be called once all entries exist. **/
    void setRates(SignalBuilder& signals) {
        if (m_kind.empty()) return;
        if (m_kind == "rate") {
            m_states[0]->setRate(signals.make(m_block));
            return;
        }
        if (m_kind == "state_space") {
            setRatesOfStateSpace(signals);
            return;
        }
        if (m_kind == "fmu") {
            addController(signals);
            return;
        }
        const Signal input = makeInput(signals);
        if (m_kind == "pid") {
            if (m_hasIntegral) m_states.front()->setRate(input);
            if (m_hasDerivative) follow(m_block.get("filter").getNumber(), input);
        } else if (m_kind == "transfer_function") {
            setRatesOfTransferFunction(input);
        } else if (m_kind == "rate_limit") {
            limitRate(input);
        } else if (m_kind == "sample_and_hold") {
            const double period = m_block.get("period").getNumber();
            signals.m_samplings.push_back({m_indices[0], m_indices[1], period, input});
            m_system.followers.push_back({m_indices[0], input});
            m_system.followers.push_back(
                {m_indices[1], Signal::function({}, [period](Real time, const Real*, Real*) {
                     return countSamples(time, period);
                 })});
        } else if (m_kind == "hysteresis") {
            addRelayOf(input);
        } else {
            const char* time = m_kind == "low_pass" ? "time_constant" : "lag";
            follow(m_block.get(time).getNumber(), input);
        }
    }

private:
    void add(const std::string& suffix, double initial = 0) {
        const double scale = m_kind.empty() ? 1 : m_value.get("scale").getNumber();
        auto state = std::make_unique<SignalState>(getName() + suffix, initial, scale);
        m_states.push_back(state.get());
        m_values.push_back(Signal::state(m_system.flexible.adoptState(std::move(state))));
        m_indices.push_back(m_system.flexible.getNumStates() - 1);
    }

    void addHeld(const std::string& suffix, double initial = 0) {
        auto state = std::make_unique<HeldState>(getName() + suffix, initial);
        m_values.push_back(Signal::state(m_system.flexible.adoptState(std::move(state))));
        m_indices.push_back(m_system.flexible.getNumStates() - 1);
    }

    Signal makeInput(SignalBuilder& signals) { return signals.make(m_block.get("input")); }

    Signal makeOutput(SignalBuilder& signals) {
        if (m_kind == "hysteresis")  // an integrated state, so 1 only up to round-off
            return Signal::function(m_values, [](Real, const Real* x, Real* slopes) {
                if (slopes) *slopes = 0;
                return x[0] > 0.5 ? 1. : 0.;
            });
        for (const char* own : {"", "rate", "low_pass", "rate_limit", "sample_and_hold"})
            if (m_kind == own) return m_values[0];
        std::vector<Signal> terms{Signal()};
        terms.insert(terms.end(), m_values.begin(), m_values.end());
        std::vector<double> factors;
        if (m_kind == "lead_lag") {
            const double ratio = m_block.get("lead").getNumber() / m_block.get("lag").getNumber();
            factors = {ratio, 1 - ratio};
        } else if (m_kind == "pid") {
            factors = {m_block.get("proportional").getNumber()};
            if (m_hasIntegral) factors.push_back(m_block.get("integral").getNumber());
            if (m_hasDerivative) {
                const double slope =
                    m_block.get("derivative").getNumber() / m_block.get("filter").getNumber();
                factors[0] += slope;
                factors.push_back(-slope);
            }
        } else {
            const size_t n = m_states.size();
            const double through = m_numerator[0] / m_denominator[0];
            factors = {through};
            for (size_t i = 0; i < n; ++i)
                factors.push_back((m_numerator[n - i] - through * m_denominator[n - i]) /
                                  m_denominator[0]);
        }
        if (factors[0] != 0) terms[0] = makeInput(signals);
        return makeSum(terms, factors);
    }

    /** T ẏ = u − y, beginning at y = u. **/
    void follow(double time, const Signal& input) {
        m_states.back()->setRate(makeSum({input, m_values.back()}, {1 / time, -1 / time}));
        m_system.followers.push_back({m_indices.back(), input});
    }

    void readTransferFunction() {
        m_numerator = m_block.get("numerator").getNumbers();
        m_denominator = m_block.get("denominator").getNumbers();
        if (m_denominator[0] == 0) m_block.get("denominator").fail("its first coefficient is zero");
        if (m_numerator.size() > m_denominator.size())
            m_block.get("numerator")
                .fail(
                    "it has more coefficients than the denominator: the output would depend on "
                    "derivatives of the input");
        m_numerator.insert(m_numerator.begin(), m_denominator.size() - m_numerator.size(), 0.0);
        for (size_t i = 1; i < m_denominator.size(); ++i) add("." + std::to_string(i));
    }

    /** Controllable canonical form: ẋ_i = x_{i+1}, ẋ_n = u − Σ a_i x_i. **/
    void setRatesOfTransferFunction(const Signal& input) {
        const size_t n = m_states.size();
        std::vector<Signal> terms{input};
        std::vector<double> factors{1};
        for (size_t i = 0; i < n; ++i) {
            terms.push_back(m_values[i]);
            factors.push_back(-m_denominator[n - i] / m_denominator[0]);
            if (i + 1 < n) m_states[i]->setRate(m_values[i + 1]);
        }
        if (n > 0) m_states[n - 1]->setRate(makeSum(terms, factors));
    }

    /** T ẏ = u − y with limited ẏ. **/
    void limitRate(const Signal& input) {
        const double time = m_block.get("time_constant").getNumber();
        const double rise = m_block.get("rise").getNumber();
        const double fall = m_block.has("fall") ? m_block.get("fall").getNumber() : rise;
        const auto rate = [=](Real, const Real* x, Real* slopes) {
            const Real free = (x[0] - x[1]) / time;
            const bool isFree = free >= -fall && free <= rise;
            if (slopes) slopes[0] = isFree ? 1 / time : 0, slopes[1] = -slopes[0];
            return std::min(std::max(free, -fall), rise);
        };
        m_states[0]->setRate(Signal::function({input, m_values[0]}, rate));
        m_system.followers.push_back({m_indices[0], input});
    }

    std::vector<double> readRow(const ModelValue& row, size_t count, const char* what) const {
        const std::vector<double> numbers = row.getNumbers();
        if (numbers.size() != count)
            row.fail("the row has " + std::to_string(numbers.size()) + " numbers; there are " +
                     std::to_string(count) + " " + what);
        return numbers;
    }
    std::vector<std::vector<double>> readMatrix(const char* key, size_t numRows, const char* rows,
                                                size_t numColumns, const char* columns) const {
        const ModelValue matrix = m_block.get(key);
        if (!matrix.isGiven())
            return std::vector<std::vector<double>>(numRows, std::vector<double>(numColumns, 0));
        if (size_t(matrix.getSize()) != numRows)
            matrix.fail("it has " + std::to_string(matrix.getSize()) + " rows; there are " +
                        std::to_string(numRows) + " " + rows);
        std::vector<std::vector<double>> result;
        for (int i = 0; i < matrix.getSize(); ++i)
            result.push_back(readRow(matrix.at(i), numColumns, columns));
        return result;
    }
    void readStateSpace() {
        const ModelValue outputs = m_block.get("outputs");
        for (int i = 0; i < outputs.getSize(); ++i) {
            const std::string name = outputs.at(i).getText();
            if (std::count(m_outputs.begin(), m_outputs.end(), name) > 0)
                outputs.at(i).fail("there is an output of that name already");
            m_outputs.push_back(name);
        }
        const size_t n = size_t(m_block.get("A").getSize()),
                     inputs = size_t(m_block.get("inputs").getSize());
        m_A = readMatrix("A", n, "states", n, "states: A is square");
        m_B = readMatrix("B", n, "states, as many as A has", inputs, "inputs");
        m_C = readMatrix("C", m_outputs.size(), "outputs", n, "states, as many as A has");
        m_D = readMatrix("D", m_outputs.size(), "outputs", inputs, "inputs");
        const ModelValue initial = m_block.get("initial");
        const std::vector<double> start = initial.isGiven()
                                              ? readRow(initial, n, "states, as many as A has")
                                              : std::vector<double>(n, 0);
        for (size_t i = 0; i < n; ++i) add("." + std::to_string(i + 1), start[i]);
    }
    /** Σ row·states + Σ gains·inputs. Inputs whose gain is 0 are not made. **/
    Signal makeCombination(const std::vector<double>& row, const std::vector<double>& gains,
                           SignalBuilder& signals) {
        std::vector<Signal> terms = m_values;
        std::vector<double> factors = row;
        for (size_t k = 0; k < gains.size(); ++k) {
            if (gains[k] == 0) continue;
            terms.push_back(signals.make(m_block.get("inputs").at(int(k))));
            factors.push_back(gains[k]);
        }
        return makeSum(terms, factors);
    }
    size_t findOutput(const std::string& name) const {
        const std::string own = name.substr(std::min(name.size(), getName().size() + 1));
        return size_t(std::find(m_outputs.begin(), m_outputs.end(), own) - m_outputs.begin());
    }
    Signal makeSpaceOutput(const std::string& name, SignalBuilder& signals) {
        const size_t i = findOutput(name);
        return makeCombination(m_C[i], m_D[i], signals);
    }
    void setRatesOfStateSpace(SignalBuilder& signals) {
        for (size_t i = 0; i < m_A.size(); ++i)
            m_states[i]->setRate(makeCombination(m_A[i], m_B[i], signals));
    }

    void readController(const ModelOptions& options) {
        const auto goesOn = [progress = options.listener.progress,
                             what = "waiting for controller '" + getName() + "'"] {
            return !progress || progress(what, -1, {});
        };
        m_controller = std::make_shared<Controller>(m_value, options.code, goesOn);
        m_outputs = m_controller->getOutputs();
        for (const std::string& output : m_outputs) addHeld('.' + output);
        addHeld(".sample");
    }
    void addController(SignalBuilder& signals) {
        const double period = m_value.get("period").getNumber();
        ControllerSampling sampling{
            m_controller, period, m_indices.back(),
            m_indices,    {},     std::make_shared<const StateText>(m_system.system)};
        sampling.outputs.pop_back();
        for (const std::string& input : m_controller->getInputs())
            sampling.inputs.push_back(signals.make(m_value.get("inputs").get(input)));
        m_system.controllers.push_back(sampling);
        m_system.followers.push_back(
            {sampling.number, Signal::function({}, [period](Real time, const Real*, Real*) {
                 return countSamples(time, period);
             })});
    }

    void readThresholds() {
        m_lower = m_block.get("lower").getNumber();
        m_upper = m_block.get("upper").getNumber();
        if (!(m_lower < m_upper)) m_block.get("lower").fail("it must be less than 'upper'");
    }
    void addRelayOf(const Signal& input) {
        addRelay({getName(), m_indices[0], m_lower, m_upper, input}, m_system);
        const double lower = m_lower, upper = m_upper,
                     initial = m_block.get("initial").getInteger();
        m_system.followers.push_back(
            {m_indices[0], Signal::function({input}, [=](Real, const Real* x, Real*) {
                 return x[0] > upper ? 1. : x[0] < lower ? 0. : initial;
             })});
    }

    ModelSystem& m_system;
    ModelValue m_value, m_block;
    std::string m_kind;
    std::vector<SignalState*> m_states;
    std::vector<Signal> m_values;
    std::vector<int> m_indices;
    bool m_hasIntegral = false, m_hasDerivative = false;
    std::vector<double> m_numerator, m_denominator;  ///< of equal length
    std::vector<std::vector<double>> m_A, m_B, m_C, m_D;
    std::shared_ptr<Controller> m_controller;
    std::vector<std::string> m_outputs;  ///< names; empty: one output with the entry's name
    double m_lower = 0, m_upper = 0;
    std::map<std::string, Signal> m_made;
};

SignalBuilder::SignalBuilder(const ModelValue& file, const ModelFrames& frames,
                             const ModelOptions& options, ModelSystem& system)
    : m_file(file), m_frames(frames), m_options(options), m_system(system) {}

SignalBuilder::~SignalBuilder() = default;

std::pair<ModelValue, int> readJointCoordinate(const ModelValue& value) {
    if (!value.isMap()) return {value, -1};
    const ModelValue number = value.get("coordinate");
    return {value.get("joint"), number.isGiven() ? number.getInteger() : -1};
}

void SignalBuilder::checkNewName(const ModelValue& entry) const {
    const std::string name = entry.getName();
    if (m_file.get("probes").has(name))
        entry.fail("a probe has the name '" + name +
                   "' already, and laws would not know which is meant");
    if (m_system.states.count(name)) entry.fail("an input has the name '" + name + "' already");
    if (m_ofNames.count(name)) entry.fail("a state has the name '" + name + "' already");
}

void SignalBuilder::addEntry(const ModelValue& entry) {
    checkNewName(entry);
    m_states.push_back(std::make_unique<StateEntry>(m_system, m_options, entry));
    m_ofNames[entry.getName()] = m_states.back().get();
    for (const std::string& output : m_states.back()->listOutputs())
        m_ofOutputs.emplace(output, m_states.back().get());
}

void SignalBuilder::addEventStates(const ModelValue& event) {
    addEntry(event);
}

int SignalBuilder::findState(const ModelValue& name) const {
    const std::string wanted = name.isMap() ? name.getName() : name.getText();
    const auto found = m_ofNames.find(wanted);
    if (found != m_ofNames.end() && found->second->getSettable() >= 0)
        return found->second->getSettable();
    std::vector<std::string> known;
    for (const auto& state : m_states)
        if (state->getSettable() >= 0) known.push_back(state->getName());
    name.failUnknown("state with a rate", wanted, known);
}

void SignalBuilder::addInputs() {
    const ModelValue inputs = m_file.get("inputs");
    for (const std::string& name : inputs.getKeys()) {
        const ModelValue input = inputs.get(name);
        checkNewName(input);
        const ModelValue start = input.isMap() ? input.get("start") : input;
        auto value = std::make_unique<InputState>(name, start.getNumber());
        auto rate = std::make_unique<InputState>(name + ".rate", 0);
        InputState& following = *value;
        const int number = m_system.flexible.getNumStates();
        m_system.states[name] = Signal::state(m_system.flexible.adoptState(std::move(value)));
        following.setRate(Signal::state(m_system.flexible.adoptState(std::move(rate))));
        m_system.inputs.push_back({name, input.isMap() ? input.get("unit").getText() : "", number});
    }
}

void SignalBuilder::addStates() {
    const ModelValue states = m_file.get("states");
    for (const std::string& name : states.getKeys()) addEntry(states.get(name));
    const ModelValue controllers = m_file.get("controllers");
    for (const std::string& name : controllers.getKeys()) addEntry(controllers.get(name));
    for (const auto& state : m_states) {
        state->setRates(*this);
        for (const std::string& output : state->listOutputs())
            m_system.states[output] = find(output, state->getValue());
        if (state->getSettable() >= 0)
            m_system.settableStates[state->getName()] = state->getSettable();
    }
    addSamplings(m_samplings, m_system);
}

Attachment SignalBuilder::attach(const ModelValue& frame) {
    const FrameOnBody found = m_frames.find(frame);
    return withPlace(frame, [&] { return m_frames.attach(found, m_system); });
}

Signal SignalBuilder::make(const ModelValue& value, const Locals& locals) {
    if (!value.isGiven()) return {};
    if (!value.isLaw()) {
        const Expression function = value.getExpression();
        if (function.isConstant() && function.calcValue(0) == 0) return {};
        return Signal::function(
            {}, [function](Real time, const Real*, Real*) { return function.calcValue(time); });
    }
    return compile(value, locals);
}

Signal SignalBuilder::makeMargin(const ModelValue& condition) {
    return compile(condition, {}, Value::Margin);
}

Signal SignalBuilder::compile(const ModelValue& value, const Locals& locals, Value what) {
    std::vector<std::string> own;
    for (const auto& local : locals) own.push_back(local.first);
    const VariableFormula formula(value, own);
    noteSharedWords(formula, value, own);
    if (what == Value::Margin && !formula.isComparison())
        value.fail("it must be a comparison, such as 'gap < 0', or several with && and ||");
    std::vector<Signal> arguments;
    std::vector<std::string> units;
    double numFormulas = 1;
    for (size_t i = 0; i < formula.getUsed().size(); ++i) {
        const auto local = locals.find(formula.getUsed()[i]);
        const std::string& name = formula.getQuantities()[i];
        m_numFormulas = 0;
        arguments.push_back(local != locals.end() ? local->second : find(name, value));
        units.push_back(findUnit(name, local != locals.end()));
        numFormulas += m_numFormulas;
    }
    m_numFormulas = numFormulas;
    if (numFormulas > MostFormulas)
        value.fail("it is made of probes that are made of probes, more than " +
                   std::to_string(int(MostFormulas)) +
                   " formulas when each is counted where it is named; name a probe once, or make "
                   "it a state");
    formula.checkUnits(value, units);
    if (what == Value::Margin)
        return Signal::function(arguments, [formula](Real time, const Real* x, Real*) {
            return formula.calcMargin(time, x);
        });
    const std::string place = value.getPlace() + ": " + value.getPath();
    return Signal::function(arguments, [formula, place, failure = m_system.lawFailure](
                                           Real time, const Real* x, Real* slopes) {
        // Newton's method does without slopes that do not exist.
        const double result =
            slopes ? formula.calcSlopes(time, x, slopes) : formula.calcValue(time, x);
        for (size_t i = 0; slopes && i < formula.getUsed().size(); ++i)
            if (!std::isfinite(slopes[i])) slopes[i] = 0;
        // Noted, not thrown: a shorter step may find a value.
        if (!std::isfinite(result))
            *failure = place + " has no finite value: " + formula.explain(time, x);
        return result;
    });
}

std::string SignalBuilder::findUnit(const std::string& name, bool isLocal) const {
    if (isLocal)
        return name == "length" ? "m" : name == "rate" ? "m/s" : name == "angle" ? "rad" : "rad/s";
    const ModelValue probes = m_file.get("probes");
    const std::string owner = name.substr(0, name.find('.'));
    for (const ModelSystem::InputEntry& input : m_system.inputs)
        for (const char* known : {"m", "m/s", "rad", "rad/s"})
            if (input.name == name && input.unit == known) return known;
    if (!probes.has(owner)) return "";
    const ModelValue probe = probes.get(owner);
    if (const FrameSignalKind* kind = findFrameSignalKind(probe)) return kind->unit;
    if (const DistanceSignalKind* kind = findDistanceSignalKind(probe)) return kind->unit;
    for (const char* kind : {"coordinate", "rate"}) {
        if (!probe.has(kind)) continue;
        const ModelValue value = probe.get(kind);
        bool isAngle = false;
        if (value.isMap() && value.has("body")) {
            const std::string body = value.get("body").getText();
            isAngle = MobilizedBody::Pin::isInstanceOf(
                findEntry(m_system.bodies, "body", body, value.get("body")).mobod);
        } else {
            const auto [joint, coordinate] =
                findCoordinateOf(value, int(chooseColumn(probe, name, listColumns(probe))));
            isAngle = withPlace(value, [&, joint = joint, coordinate = coordinate] {
                return findCoordinate(joint, coordinate).coordinate.isAngle();
            });
        }
        return std::string(isAngle ? "rad" : "m") + (kind[0] == 'r' ? "/s" : "");
    }
    return "";
}

bool SignalBuilder::isOfSameCoordinate(const std::string& probeName, const ModelValue& law) const {
    const ModelValue probe = m_file.get("probes").get(probeName);
    if (!probe.isGiven()) return false;
    const std::string path = law.getPath();  // connectors.NAME.law
    const size_t begin = path.find('.') + 1;
    const ModelValue joint =
        m_file.get("connectors").get(path.substr(begin, path.rfind('.') - begin)).get("joint");
    const char* key = probeName == "angle" || probeName == "length" ? "coordinate" : "rate";
    return probe.has(key) && joint.isGiven() && isSameCoordinate(probe.get(key), joint);
}

void SignalBuilder::noteSharedWords(const VariableFormula& formula, const ModelValue& law,
                                    const std::vector<std::string>& own) {
    for (const VariableFormula::SharedWord& shared : formula.getSharedWords()) {
        std::string others;
        for (const std::string& other : shared.others)  // a motor's and a probe's may be the same
            if (other.compare(0, 7, "probes.") != 0 || !isOfSameCoordinate(shared.word, law))
                others += (others.empty() ? "" : " and ") + other;
        if (others.empty()) continue;
        std::string known;
        for (const std::string& name : own) known += (known.empty() ? "'" : " and '") + name + "'";
        m_notes.push_back(
            law.getPlace() + ": " + law.getPath() + ": '" + shared.word + "' is " +
            (shared.isOwn ? "the connector's own; write " + others + " for what else has this name"
                          : others + " here: this connector's own quantities are " + known));
    }
}

Signal SignalBuilder::find(const std::string& name, const ModelValue& law) {
    const size_t dot = name.find('.');
    const std::string owner = name.substr(0, dot);
    const auto failChain = [&](const std::string& mistake) { law.fail(mistake); };
    const auto state = m_ofOutputs.find(name);
    const ModelValue probes = m_file.get("probes");
    const ModelValue inputs = m_file.get("inputs");
    if (inputs.has(name)) return m_system.states.at(name);
    if (state == m_ofOutputs.end() && !probes.has(owner)) {
        std::vector<std::string> known = probes.getKeys();
        for (const std::string& input : inputs.getKeys()) known.push_back(input);
        for (const auto& entry : m_states)
            for (const std::string& output : entry->listOutputs()) known.push_back(output);
        if (law.getPath().compare(0, 11, "connectors.") == 0) failOwnNameOfOthers(law, name);
        law.failUnknown("probe, input or state", name, known);
    }
    const auto known = m_ofProbes.find(name);
    if (known != m_ofProbes.end()) {
        m_chain.repeat(owner, failChain);
        m_numFormulas = known->second.numFormulas;
        return known->second.signal;
    }
    const ReferenceChain::Link link(m_chain, owner, failChain);
    const auto makeOfColumn = [&](const ModelValue& probe) {
        const std::vector<std::string> columns = listColumns(probe);
        return makeOfProbe(probe, columns.empty() ? 0 : int(chooseColumn(law, name, columns)));
    };
    const Signal signal = state != m_ofOutputs.end() ? state->second->getOutput(name, *this)
                                                     : makeOfColumn(probes.get(owner));
    if (state == m_ofOutputs.end()) m_ofProbes[name] = {signal, m_numFormulas};
    return signal;
}

std::vector<std::string> SignalBuilder::listColumns(const ModelValue& probe) const {
    if (findFrameSignalKind(probe) && probe.get("component").getText() == "all")
        return {"x", "y", "z"};
    for (const char* kind : {"coordinate", "rate"}) {
        const ModelValue value = probe.get(kind);
        if (!value.isGiven() || (value.isMap() && value.has("body"))) continue;
        const auto [name, number] = readJointCoordinate(value);
        const int count =
            findEntry(m_system.joints, "joint", name.getText(), name).joint.getNumCoordinates();
        if (number >= 0 || count < 2) continue;
        std::vector<std::string> columns;
        for (int k = 0; k < count; ++k) columns.push_back(std::to_string(k));
        return columns;
    }
    for (const char* kind : {"position", "velocity", "angular_velocity", "coordinate", "rate",
                             "distance", "distance_rate", "state", "function", "expression"})
        if (probe.has(kind)) return {""};
    return {};
}

Signal SignalBuilder::makeOfProbe(const ModelValue& probe, int column) {
    const std::string name = probe.getName();
    if (const FrameSignalKind* kind = findFrameSignalKind(probe)) {
        const ModelValue reference = probe.get("relative_to");
        const Attachment M = attach(probe.get(kind->key)),
                         F = reference.isGiven() ? attach(reference)
                                                 : Attachment(m_system.matter.Ground());
        return makeFrameSignals(*kind, probe, F, M).at(size_t(column));
    }
    if (const DistanceSignalKind* kind = findDistanceSignalKind(probe)) {
        const ModelValue frames = probe.get(kind->key);
        const Attachment from = attach(frames.at(0)), to = attach(frames.at(1));
        return kind->make(from, to);
    }
    if (probe.has("coordinate")) return makeCoordinate(probe.get("coordinate"), column);
    if (probe.has("rate")) return makeCoordinateRate(probe.get("rate"), column);
    if (probe.has("state")) return find(probe.get("state").getText(), probe.get("state"));
    if (probe.has("function")) return make(probe.get("function"));
    if (probe.has("expression")) return compile(probe.get("expression"), {});
    for (const std::string& key : probe.getKeys())
        if (key != "component" && key != "relative_to" && key != "unit")
            failNoForceDependsOn(probe, name, key);
    probe.fail("does not say what to probe");
}

std::pair<Joint, int> SignalBuilder::findCoordinateOf(const ModelValue& value, int column) const {
    const auto [name, given] = readJointCoordinate(value);
    const Joint& joint = findEntry(m_system.joints, "joint", name.getText(), name).joint;
    const int number = given >= 0 ? given : column;
    if (number < 0 && joint.getNumCoordinates() > 1)
        value.fail("joint '" + joint.getName() + "' has " +
                   std::to_string(joint.getNumCoordinates()) +
                   " coordinates; say which: {joint: " + joint.getName() + ", coordinate: 0}");
    return {joint, std::max(number, 0)};
}

Signal SignalBuilder::makeCoordinate(const ModelValue& value, int column) {
    if (value.isMap() && value.has("body")) return makeOfMobilizer(value, false);
    // `initial.joints` sets the turn.
    return withPlace(value, [&, found = findCoordinateOf(value, column)] {
        return Signal::turnedAngle(m_system.flexible, found.first, found.second);
    });
}

Signal SignalBuilder::makeCoordinateRate(const ModelValue& value, int column) {
    if (value.isMap() && value.has("body")) return makeOfMobilizer(value, true);
    return withPlace(value, [&, found = findCoordinateOf(value, column)] {
        return Signal::coordinateRate(found.first, found.second);
    });
}

Signal SignalBuilder::makeOfMobilizer(const ModelValue& map, bool isRate) {
    const Model::BodyEntry& body =
        findEntry(m_system.bodies, "body", map.get("body").getText(), map.get("body"));
    const MobilizedBody& mobod = body.mobod;
    JointCoordinate coordinate;
    if (MobilizedBody::Pin::isInstanceOf(mobod))
        coordinate = JointCoordinate::makeAngleAboutZ();
    else if (MobilizedBody::Slider::isInstanceOf(mobod))
        coordinate = JointCoordinate::makeDisplacement(0);
    else
        map.get("body").fail(
            "laws know the coordinates of mobilizers 'pin' and 'slider' only; "
            "probe a position or an angular velocity of a frame");
    const ModelValue number = map.get("coordinate");
    if (number.isGiven() && number.getInteger() != 0) number.fail("it has one, number 0");
    const Attachment F(mobod.getParentMobilizedBody(), mobod.getDefaultInboardFrame()),
        M(mobod, mobod.getDefaultOutboardFrame());
    if (isRate) return Signal::coordinateRate(coordinate, F, M);
    const ModelValue given = m_file.get("initial").get("bodies").get(body.name).get("coordinates");
    return Signal::turnedAngle(m_system.flexible, coordinate, F, M,
                               "turns of body '" + body.name + "'",
                               given.isGiven() ? given.getNumbers().at(0) : 0);
}

}  // namespace model
}  // namespace simflex
