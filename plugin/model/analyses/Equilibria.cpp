/** @file
Analyses without time: static, eigen, campbell, linear, frequency_response. **/

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/LinearPorts.h"
#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/analyses/StateRows.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/solver/CampbellDiagram.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace model {

using SimTK::Real;
using SimTK::State;
using SimTK::Vector;

namespace {

Results::Analysis makeComplete(const std::string& name, const char* type) {
    Results::Analysis results;
    results.name = name;
    results.type = type;
    results.isComplete = true;
    return results;
}

/** The State to linearise about: joints assembled, speeds consistent, and bodies at rest deformed
by their loads. **/
State assembleState(const Model& model, const State& state, const std::function<void()>& observer) {
    const auto integrator = makeIntegrator(model);
    integrator->initialize(state);
    return findEquilibriumNearby(model.getSystem(), integrator->getState(), observer);
}

std::vector<std::vector<double>> listRows(const SimTK::Matrix& matrix) {
    std::vector<std::vector<double>> rows(size_t(matrix.nrow()));
    for (int i = 0; i < matrix.nrow(); ++i)
        for (int j = 0; j < matrix.ncol(); ++j) rows[size_t(i)].push_back(matrix(i, j));
    return rows;
}

/** Adds the effective masses of each mode for base excitation along x, y and z. **/
void addParticipation(const Model& model, const State& state, const std::vector<Eigenmode>& modes,
                      Results::Analysis& results) {
    const SimTK::SimbodyMatterSubsystem& matter = model.getMatter();
    model.getSystem().realize(state, SimTK::Stage::Velocity);
    Vector along[3];
    double mass = 0;
    for (int a = 0; a < 3; ++a) {
        SimTK::Vector_<SimTK::SpatialVec> forces(matter.getNumBodies(),
                                                 SimTK::SpatialVec(SimTK::Vec3(0), SimTK::Vec3(0)));
        SimTK::Vec3 direction(0);
        direction[a] = 1;
        mass = 0;
        for (SimTK::MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
            const SimTK::MobilizedBody& body = matter.getMobilizedBody(i);
            const double own = body.getBodyMass(state);
            mass += own;
            matter.addInStationForce(state, i, body.getBodyMassCenterStation(state),
                                     own * direction, forces);
        }
        matter.multiplyBySystemJacobianTranspose(state, forces, along[a]);
    }
    auto& rows = results.matrices["effective_mass"];
    for (const Eigenmode& mode : modes) {
        rows.emplace_back();
        for (const Vector& force : along) {
            SimTK::Complex sum = 0;
            for (int i = 0; i < force.size(); ++i) sum += force[i] * mode.shape[i];
            rows.back().push_back(std::norm(sum));
        }
    }
    results.statistics["mass"] = mass;
}

/** Adds the displacements of probes in each mode, the largest scaled to 1. **/
void addShapes(const std::shared_ptr<const Model>& model, const Probes& probes,
               const std::vector<std::string>& outputs, const Linearization& linear,
               const std::vector<Eigenmode>& modes, Results::Analysis& results,
               const std::function<void()>& observer) {
    const LinearOutputPorts ports(model, probes, outputs);
    const LinearOutputs observed = ports.differentiate(linear, observer);
    for (const LinearSystem::Port& port : ports.getPorts()) {
        results.outputs.push_back(port.name);
        results.outputUnits.push_back(port.unit);
    }
    auto &re = results.matrices["shape_real"], &im = results.matrices["shape_imaginary"];
    for (const Eigenmode& mode : modes) {
        std::vector<SimTK::Complex> shape;
        SimTK::Complex largest = 0;
        for (int k = 0; k < observed.byQ.nrow(); ++k) {
            shape.emplace_back(0);
            for (int i = 0; i < mode.shape.size(); ++i)
                shape.back() += observed.byQ(k, i) * mode.shape[i];
            if (std::abs(shape.back()) > 1.0001 * std::abs(largest)) largest = shape.back();
        }
        re.emplace_back();
        im.emplace_back();
        for (const SimTK::Complex& value : shape) {
            const SimTK::Complex own = largest == 0.0 ? 0.0 : value / largest;
            re.back().push_back(own.real());
            im.back().push_back(own.imag());
        }
    }
}

/** Adds the modes unscaled: displacements in the directions of Simbody's speeds. **/
void addModes(const std::vector<Eigenmode>& modes, Results::Analysis& results) {
    auto &re = results.matrices["mode_real"], &im = results.matrices["mode_imaginary"];
    for (const Eigenmode& mode : modes) {
        re.emplace_back();
        im.emplace_back();
        for (int i = 0; i < mode.shape.size(); ++i) {
            re.back().push_back(mode.shape[i].real());
            im.back().push_back(mode.shape[i].imag());
        }
    }
}

constexpr int UsualModes = 10, UsualBranches = 6;

/** The State at which the model starts, or the steady motion next to the placed State. **/
State findSteadyState(const Model& model, EquilibriumNotes& notes,
                      const std::function<void()>& observer) {
    if (model.getFile().get("initial").get("start").getText() != "as_placed")
        return findStart(model, notes, observer);
    StaticEquilibrium equilibrium(model.getSystem());
    equilibrium.setObserver(observer);
    equilibrium.solveSteadyMotion(model.makeInitialState());
    notes = describeEquilibrium(equilibrium);
    State state = equilibrium.getState();
    model.getSystem().realize(state, SimTK::Stage::Velocity);
    return state;
}

/** Notes on equilibria at several speeds, each sentence once. **/
class NotesAtSpeeds {
public:
    void add(double speed, const EquilibriumNotes& notes, const Model& model, const State& state) {
        for (const std::string& warning : notes.warnings) m_speeds[warning].insert(speed);
        for (const std::string& warning : m_ranges.describe(model, state))
            m_speeds[warning].insert(speed);
    }
    template <class Warn>
    void tell(const std::string& parameter, const Warn& warn) const {
        for (const auto& [warning, speeds] : m_speeds)
            warn("at " + parameter + " = " + writeGeneral(*speeds.begin(), 6) +
                 (speeds.size() > 1 ? " and " + std::to_string(speeds.size() - 1) + " more, "
                                    : std::string(", ")) +
                 warning);
    }

private:
    std::map<std::string, std::set<double>> m_speeds;
    RangeWarnings m_ranges;
};

/** The lowest modes of the model in steady motion, with another value of a parameter. **/
std::vector<Eigenmode> calcModesAt(const ModelText& text, const ModelOptions& options,
                                   const std::string& parameter, Real value, int count,
                                   NotesAtSpeeds& notes, const std::function<void()>& observer) {
    ModelText changed = text;
    changed.settings.push_back("parameters." + parameter + "=" + writeGeneral(value));
    const Model model(readModel(changed), options);
    EquilibriumNotes own;
    const State state = findSteadyState(model, own, observer);
    notes.add(value, own, model, state);
    return calcSlowestEigenmodes(model.getSystem(), state, count, EigenMethod::Automatic, observer);
}

/** Speeds at which followed modes are unstable, and the least stable mode; empty if none.
 **/
std::string describeInstability(const CampbellDiagram& diagram, const std::string& parameter) {
    constexpr double LeastGrowth = 1e-5;  // damping ratio; smaller values are round-off
    std::set<double> speeds;
    double most = 0, frequency = 0;
    bool oscillates = false;
    for (size_t k = 0; k < diagram.speeds.size(); ++k)
        for (const CampbellDiagram::Branch& branch : diagram.branches) {
            const double damping = branch.dampingRatio[k];
            if (!(damping < -LeastGrowth)) continue;
            speeds.insert(diagram.speeds[k]);
            const double growth = -damping * 2 * Pi * branch.frequency[k];
            if (!(growth > most)) continue;
            most = growth;
            frequency = branch.frequency[k];
            oscillates = damping > -Eigenmode::Aperiodic;
        }
    if (speeds.empty()) return "";
    return "the motion is unstable at " + parameter + " = " + writeGeneral(*speeds.begin(), 6) +
           (speeds.size() > 1 ? " and " + std::to_string(speeds.size() - 1) + " other speeds"
                              : std::string()) +
           ": " +
           (oscillates ? "a vibration of " + writeGeneral(frequency, 4) + " Hz"
                       : std::string("a motion that does not oscillate")) +
           " grows by a factor of e in " + writeGeneral(1 / most, 3) + " s";
}

}  // namespace

bool ModelRun::keepsStates() const {
    return m_model->getFile().get("output").get("states").getText() != "none";
}

bool ModelRun::drawsEquilibrium(const ModelValue& analysis) const {
    if (!m_options.drawsPictures) return false;
    if (analysis.get("pictures").isGiven()) return analysis.get("pictures").getBool();
    return drawsEquilibria(*m_model);
}

void ModelRun::runStatic(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const Equilibrium& equilibrium = obtainEquilibrium(analysis);
    Results::Analysis results = makeComplete(name, "static");
    for (const ResultColumn& column : makeColumns()) results.probes.push_back({column, {}});
    const StateRows states(*m_model);
    MotionWarnings warnings(*m_model, m_probes,
                            [&](const std::string& message) { warn(name, message); });
    const auto keep = [&](const State& state, const Vector& multipliers) {
        const Vector atRest;
        const std::vector<double> values = m_probes.calc({state, atRest, multipliers, 0});
        warnings.checkFinite(state.getTime(), values);
        auto at = values.begin();
        for (Results::Series& series : results.probes) {
            const auto end = at + std::ptrdiff_t(series.column.columns.size());
            series.rows.emplace_back(at, end);
            at = end;
        }
        const Vector resting(state.getNU(), 0.0);
        if (keepsStates()) states.keepMoment({state, resting, multipliers, 0}, results);
    };
    if (equilibrium.path.empty()) keep(equilibrium.state, equilibrium.multipliers);
    for (const StaticEquilibrium::PathPoint& point : equilibrium.path) {
        keep(point.state, point.multipliers);
        results.matrices["path"].push_back(
            {point.fraction, double(point.numUnstable), double(point.kind)});
    }
    results.statistics["iterations"] = equilibrium.numIterations;
    m_writer->add(results);
    describePath(name, equilibrium.path);
    if (drawsEquilibrium(analysis))
        m_remarks[name].push_back(drawState(*m_model, equilibrium.state, name, getUsualFolder()));
    const std::string rubbing = nameRubbingJoints(*m_model);
    if (!rubbing.empty()) warn(name, "is found without the friction of " + rubbing);
    for (const std::string& warning : equilibrium.notes.warnings) warn(name, warning);
    for (const std::string& remark : equilibrium.notes.remarks) m_remarks[name].push_back(remark);
}

void ModelRun::describePath(const std::string& name,
                            const std::vector<StaticEquilibrium::PathPoint>& path) {
    if (path.empty()) return;
    using Kind = StaticEquilibrium::PathPoint::Kind;
    const auto percent = [](double fraction) { return writeGeneral(100 * fraction, 6) + " %"; };
    std::vector<std::string>& remarks = m_remarks[name];
    for (const StaticEquilibrium::PathPoint& point : path) {
        if (point.kind == Kind::Limit)
            remarks.push_back("limit point: the path turns at " + percent(point.fraction) +
                              " of the loads");
        if (point.kind == Kind::Bifurcation)
            remarks.push_back("bifurcation: another path crosses at " + percent(point.fraction) +
                              " of the loads, and stability changes" +
                              (point.numChanging > 1
                                   ? " in " + std::to_string(point.numChanging) + " motions"
                                   : std::string()) +
                              "; only this one is followed");
    }
    const double last = path.back().fraction;
    if (last != 1)
        warn(name, "the path ends after " + std::to_string(path.size()) + " points, at " +
                       percent(last) +
                       " of the loads: this is where its results are; path.points " +
                       "says how many there may be");
}

void ModelRun::runEigen(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const ModelValue wanted = analysis.get("count");
    const int count = wanted.isGiven() ? wanted.getInteger() : UsualModes;
    const auto observer = [this] { stopIfAsked(); };
    const State about =
        assembleState(*m_model, findNamedState(analysis.get("about"), name), observer);
    const bool keepsMatrices = analysis.get("matrices").getBool();
    std::optional<Linearization> linear;  // only if it is kept, or outputs need its accelerations
    std::vector<Eigenmode> modes;
    try {
        if (analysis.has("outputs") || keepsMatrices) {
            linear = calcLinearization(m_model->getSystem(), about, observer);
            requireEquilibrium(m_model->getSystem(), *linear);
            modes = calcEigenmodes(*linear);
        } else {
            modes = calcSlowestEigenmodes(m_model->getSystem(), about, count,
                                          EigenMethod::Automatic, observer);
        }
    } catch (const NoEquilibrium& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what() +
                                 " (about: static, or the name of a static analysis)");
    } catch (const NoLinearForces& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what());
    }
    warnOfUnevenDamping(name, about);
    checkRanges(name, {about});
    stopIfAsked();
    const auto firstElastic = std::find_if(
        modes.begin(), modes.end(), [](const Eigenmode& mode) { return !mode.isRigidMotion(); });
    const auto numRigid = firstElastic - modes.begin();
    const double resolution = modes.empty() ? 0 : double(modes.back().resolution);
    modes.erase(modes.begin(), firstElastic);
    if (int(modes.size()) > count) modes.resize(size_t(count));
    const bool isDrawn = analysis.get("pictures").getBool() && m_options.drawsPictures;
    if (modes.empty() && isRigidTwin()) return leaveOut(name, "nothing in it vibrates");
    if (modes.empty()) {
        m_failures.push_back("analysis '" + name + "': the model has no natural frequencies" +
                             (numRigid == 0 ? ", as nothing in it is free to move" : ""));
        return;
    }
    Results::Analysis results = makeComplete(name, "eigen");
    results.frequency.resize(1);
    results.dampingRatio.resize(1);
    for (const Eigenmode& mode : modes) {
        results.frequency[0].push_back(mode.frequency);
        results.dampingRatio[0].push_back(mode.dampingRatio);
    }
    results.statistics = {{"rigid_motions", double(numRigid)}, {"resolution", resolution}};
    if (analysis.get("participation").getBool()) addParticipation(*m_model, about, modes, results);
    if (keepsStates()) {
        StateRows(*m_model).keepState(about, results);
        addModes(modes, results);
    }
    if (keepsMatrices) {
        results.matrices.insert(
            {{"M", listRows(linear->M)}, {"D", listRows(linear->D)}, {"K", listRows(linear->K)}});
        if (linear->G.nrow() > 0) results.matrices["G"] = listRows(linear->G);
    }
    if (analysis.has("outputs")) try {
            addShapes(m_model, m_probes, analysis.get("outputs").getTexts(), *linear, modes,
                      results, observer);
        } catch (const OutputKinks& kinks) {
            throw std::runtime_error("analysis '" + name + "': " + kinks.what());
        }
    if (isDrawn)
        m_remarks[name].push_back(
            drawModes(*m_model, about, modes, name, getUsualFolder(), m_options.listener));
    m_writer->add(results);
    const std::string rubbing = nameRubbingJoints(*m_model);
    if (!rubbing.empty())
        m_remarks[name].push_back("contacts with friction are taken as sticking: " + rubbing);
}

void ModelRun::runCampbell(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const ModelValue wanted = analysis.get("count");
    const std::vector<double> speeds = analysis.get("speeds").getNumbers();
    const std::string parameter = analysis.get("parameter").getText();
    const std::vector<std::string> known = m_model->getFile().get("parameters").getKeys();
    if (std::find(known.begin(), known.end(), parameter) == known.end())
        analysis.get("parameter").failUnknown("parameter", parameter, known);
    int done = 0;
    CampbellDiagram diagram;
    bool isSeenTurning = false;
    NotesAtSpeeds notes;
    const auto calcModes = [&](Real speed, int considered) {
        m_fraction = double(done++) / double(speeds.size());
        stopIfAsked();
        std::vector<Eigenmode> modes = calcModesAt(m_text, m_modelOptions, parameter, speed,
                                                   considered, notes, [this] { stopIfAsked(); });
        for (const Eigenmode& mode : modes) isSeenTurning |= mode.isSeenTurning;
        return modes;
    };
    try {
        // As many branches as there are: a rotor on two springs has two.
        std::vector<std::vector<Eigenmode>> all;
        std::vector<std::exception_ptr> failures(speeds.size());
        int count = wanted.isGiven() ? wanted.getInteger() : UsualBranches;
        const int numConsidered = 3 * count + 6;  // those that may continue a branch, too
        for (size_t k = 0; k < speeds.size(); ++k) {
            all.emplace_back();
            try {
                all[k] = calcModes(speeds[k], numConsidered);
                const auto numElastic =
                    std::count_if(all[k].begin(), all[k].end(),
                                  [](const Eigenmode& mode) { return !mode.isRigidMotion(); });
                if (numElastic > 0) count = std::min(count, int(numElastic));
            } catch (const Cancelled&) {
                throw;
            } catch (const std::exception&) {
                failures[k] = std::current_exception();
            }
        }
        if (wanted.isGiven() && count < wanted.getInteger())
            m_remarks[name].push_back("count: " + std::to_string(wanted.getInteger()) +
                                      " branches are asked for, there are " +
                                      std::to_string(count));
        size_t next = 0;
        diagram = calcCampbellDiagram({speeds.begin(), speeds.end()}, count, [&](Real, int) {
            const size_t k = next++;
            if (failures[k]) std::rethrow_exception(failures[k]);
            return std::move(all[k]);
        });
    } catch (const std::exception& error) {
        stopIfAsked();
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw;
    }
    stopIfAsked();
    int numFailures = 0;
    for (size_t k = 0; k < speeds.size(); ++k) {
        if (diagram.failures[k].empty()) continue;
        ++numFailures;
        std::ostringstream text;
        text << "no modes at " << parameter << " = " << speeds[k] << ": "
             << explainFailure(*m_model, diagram.failures[k]);
        warn(name, text.str());
    }
    const std::string instability = describeInstability(diagram, parameter);
    if (!instability.empty()) warn(name, instability);
    notes.tell(parameter, [&](const std::string& message) { warn(name, message); });
    if (numFailures > 0)
        m_failures.push_back("analysis '" + name + "' has no modes at " +
                             std::to_string(numFailures) + " of its " +
                             std::to_string(speeds.size()) + " speeds");
    if (isSeenTurning)
        m_remarks[name].push_back(
            "frequencies are those in the rotating frame: a force fixed in space, such as weight, "
            "excites once a revolution, and an unbalance where a frequency is zero (a hub or "
            "housing that does not rotate makes them those in the fixed frame)");
    Results::Analysis results = makeComplete(name, "campbell");
    results.speeds = speeds;
    results.frequency.resize(speeds.size());
    results.dampingRatio.resize(speeds.size());
    for (size_t k = 0; k < speeds.size(); ++k)
        for (const CampbellDiagram::Branch& branch : diagram.branches) {
            results.frequency[k].push_back(branch.frequency[k]);
            results.dampingRatio[k].push_back(branch.dampingRatio[k]);
        }
    m_writer->add(results);
}

namespace {

void putPorts(const std::vector<LinearSystem::Port>& inputs,
              const std::vector<LinearSystem::Port>& outputs, Results::Analysis& results) {
    for (const LinearSystem::Port& port : inputs) {
        results.inputs.push_back(port.name);
        results.inputUnits.push_back(port.unit);
    }
    for (const LinearSystem::Port& port : outputs) {
        results.outputs.push_back(port.name);
        results.outputUnits.push_back(port.unit);
    }
}

std::vector<std::string> getTextsIfGiven(const ModelValue& map, const char* key) {
    return map.has(key) ? map.get(key).getTexts() : std::vector<std::string>();
}

std::vector<double> listFrequencies(const ModelValue& analysis) {
    const ModelValue wanted = analysis.get("frequencies");
    std::vector<double> frequencies = wanted.getNumbers();
    for (const double frequency : frequencies)
        if (!(frequency >= 0)) wanted.fail("a frequency must not be negative");
    if (!wanted.isMap() || analysis.get("spacing").getText() != "logarithmic") return frequencies;
    const double from = frequencies.front(), to = frequencies.back();
    if (!(from > 0) || !(to > 0))
        wanted.fail(
            "a logarithmic range cannot begin or end at 0; begin above it, or give "
            "spacing: linear");
    const double last = double(std::max<size_t>(2, frequencies.size()) - 1);
    for (size_t k = 1; k + 1 < frequencies.size(); ++k)
        frequencies[k] = from * std::pow(to / from, double(k) / last);
    return frequencies;
}

}  // namespace

namespace {

ModalForm readModalForm(const ModelValue& analysis) {
    const std::string kind = analysis.get("form").getText();
    if (kind == "full") {
        for (const char* key : {"modes", "up_to"})
            if (analysis.has(key))
                analysis.get(key).fail("the full form has all modes: choose form: modal");
        return {};
    }
    ModalForm form{kind == "modal" ? ModalForm::Kind::Modal : ModalForm::Kind::Minimal};
    if (analysis.has("modes")) form.modes = analysis.get("modes").getInteger();
    if (analysis.has("up_to")) form.highest = 2 * SimTK::Pi * analysis.get("up_to").getNumber();
    return form;
}

}  // namespace

void ModelRun::warnOfKinks(const std::string& analysis, const std::vector<std::string>& leftOut) {
    if (!leftOut.empty())
        warn(analysis, "is without " + joinNames(leftOut, ", ") +
                           ": the size of something that is zero has no derivative; observe its "
                           "components");
}

void ModelRun::warnOfUnevenDamping(const std::string& analysis, const State& about) {
    if (about.getU().normInf() > 0) return;
    for (const std::string& damper : listUnevenDamping(m_model->getSystem(), about))
        warn(analysis, damper + " damps by the mean of both, as in a small vibration");
}

void ModelRun::runLinear(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const ModalForm form = readModalForm(analysis);
    const State about = assembleState(*m_model, findNamedState(analysis.get("about"), name),
                                      [this] { stopIfAsked(); });
    checkRanges(name, {about});
    LinearSystem linear;
    try {
        linear = linearizeModel(
            m_text, m_modelOptions, m_model, m_probes, about, analysis.get("inputs").getTexts(),
            getTextsIfGiven(analysis, "outputs"), form, [this] { stopIfAsked(); });
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what());
    }
    warnOfKinks(name, linear.leftOut);
    warnOfUnevenDamping(name, about);
    Results::Analysis results = makeComplete(name, "linear");
    putPorts(linear.inputs, linear.outputs, results);
    results.matrices = {{"A", listRows(linear.A)},
                        {"B", listRows(linear.B)},
                        {"C", listRows(linear.C)},
                        {"D", listRows(linear.D)}};
    m_writer->add(results);
    const std::string path = makePathBeside(m_resultPath, "." + name + ".mat");
    linear.writeMat(path);
    if (linear.A.nrow() < linear.numStates)
        m_remarks[name].push_back(std::to_string(linear.numStates) + " states before" +
                                  (form.modes > 0 || form.highest > 0
                                       ? "; modes that are left out answer as springs do"
                                       : ""));
    m_remarks[name].push_back("for MATLAB, Octave and Python: " + path);
}

namespace {

/** Writes a value in YAML's flow style. **/
std::string writeFlow(const ModelValue& value) {
    std::string text;
    if (value.isMap()) {
        for (const std::string& key : value.getKeys())
            text += (text.empty() ? "" : ", ") + key + ": " + writeFlow(value.get(key));
        return "{" + text + "}";
    }
    if (value.isList()) {
        for (int i = 0; i < value.getSize(); ++i)
            text += (i > 0 ? ", " : "") + writeFlow(value.at(i));
        return "[" + text + "]";
    }
    return '"' + value.getText() + '"';
}

std::optional<Unbalance> readUnbalance(const ModelValue& analysis) {
    const ModelValue value = analysis.get("unbalance");
    if (!value.isGiven()) return {};
    return Unbalance{writeFlow(value.get("on")), value.get("moment").getNumber(),
                     int(std::string("xyz").find(value.get("axis").getText()))};
}

Spectrum readSpectrum(const ModelValue& value) {
    if (value.isScalar()) return {{}, {value.getNumber()}};
    const Spectrum spectrum{value.get("frequencies").getNumbers(),
                            value.get("densities").getNumbers()};
    const std::vector<double>& frequencies = spectrum.frequencies;
    if (frequencies.size() != spectrum.densities.size() || frequencies.size() < 2)
        value.fail("it has " + std::to_string(frequencies.size()) + " frequencies and " +
                   std::to_string(spectrum.densities.size()) +
                   " densities: give as many of each, at least two");
    for (size_t k = 0; k < frequencies.size(); ++k) {
        if (k > 0 && !(frequencies[k] > frequencies[k - 1]))
            value.get("frequencies").fail("frequencies ascend");
        if (!(spectrum.densities[k] >= 0))
            value.get("densities").fail("a density must not be negative");
    }
    return spectrum;
}

/** A spectral density for each input. **/
std::vector<Spectrum> readSpectra(const ModelValue& analysis,
                                  const std::vector<LinearSystem::Port>& inputs) {
    std::vector<Spectrum> spectra(inputs.size(), Spectrum{{}, {0}});
    const ModelValue given = analysis.get("spectra");
    for (const std::string& name : given.getKeys()) {
        const auto found = std::find_if(inputs.begin(), inputs.end(),
                                        [&](const auto& port) { return port.name == name; });
        if (found == inputs.end()) {
            std::vector<std::string> known;
            for (const LinearSystem::Port& port : inputs) known.push_back(port.name);
            given.failUnknown("input", name, known);
        }
        spectra[size_t(found - inputs.begin())] = readSpectrum(given.get(name));
    }
    return spectra;
}

/** Share of an output's mean square in intervals over which its response changes strongly. **/
double calcUnseenPart(const HarmonicResponse& response, const std::vector<double>& densities,
                      int output) {
    constexpr double LargestChange = 0.2;
    double unseen = 0;
    for (size_t n = 1; n < response.frequencies.size(); ++n) {
        const auto &before = response.transfers[n - 1], &after = response.transfers[n];
        bool isCoarse = false;
        for (int k = 0; k < after.ncol(); ++k) {
            const SimTK::Complex a = before(output, k), b = after(output, k);
            isCoarse |= std::abs(b - a) > LargestChange * std::max(std::abs(a), std::abs(b));
        }
        if (isCoarse)
            unseen += integrateSpectrum({response.frequencies[n - 1], response.frequencies[n]},
                                        {densities[n - 1], densities[n]});
    }
    const double all = integrateSpectrum(response.frequencies, densities);
    return all > 0 ? unseen / all : 0;
}

/** Adds densities of outputs, with their rms values among the statistics.
@returns outputs whose integrals depend on few frequencies **/
std::vector<std::string> addDensities(const HarmonicResponse& response,
                                      const std::vector<Spectrum>& spectra,
                                      const std::vector<std::pair<std::string, int>>& stresses,
                                      Results::Analysis& results) {
    constexpr double LargestUnseen = 0.05;
    std::vector<std::string> coarse;
    auto& rows = results.matrices["density"];
    for (size_t n = 0; n < response.frequencies.size(); ++n) {
        const auto& transfer = response.transfers[n];
        rows.emplace_back(size_t(transfer.nrow()), 0.0);
        for (int i = 0; i < transfer.nrow(); ++i)
            for (int k = 0; k < transfer.ncol(); ++k)
                rows.back()[size_t(i)] += std::norm(transfer(i, k)) *
                                          spectra[size_t(k)].calcDensity(response.frequencies[n]);
    }
    for (size_t i = 0; i < response.outputs.size(); ++i) {
        std::vector<double> densities;
        for (const auto& row : rows) densities.push_back(row[i]);
        if (calcUnseenPart(response, densities, int(i)) > LargestUnseen)
            coarse.push_back(response.outputs[i].name);
        results.statistics["rms of " + response.outputs[i].name] =
            std::sqrt(integrateSpectrum(response.frequencies, densities));
    }
    // The mean square of the von Mises stress follows from a quadratic form of the stress
    // components.
    for (const auto& [name, first] : stresses) {
        std::vector<double> densities;
        for (size_t n = 0; n < response.frequencies.size(); ++n) {
            densities.push_back(0);
            for (int k = 0; k < response.transfers[n].ncol(); ++k) {
                SimTK::Complex s[6];
                for (int i = 0; i < 6; ++i) s[i] = response.transfers[n](first + i, k);
                double square = 0;
                for (int i = 0; i < 3; ++i)
                    square += 0.5 * std::norm(s[i] - s[(i + 1) % 3]) + 3 * std::norm(s[3 + i]);
                densities.back() +=
                    square * spectra[size_t(k)].calcDensity(response.frequencies[n]);
            }
        }
        results.statistics["rms of " + name] =
            std::sqrt(integrateSpectrum(response.frequencies, densities));
    }
    return coarse;
}

/** Probes that no input affects. **/
std::vector<std::string> listDeaf(const HarmonicResponse& response) {
    std::map<std::string, bool> isDeaf;
    for (size_t i = 0; i < response.outputs.size(); ++i) {
        const auto isZero = [&](const SimTK::Matrix_<SimTK::Complex>& transfer) {
            for (int k = 0; k < transfer.ncol(); ++k)
                if (std::abs(transfer(int(i), k)) > 0) return false;
            return true;
        };
        // A probe counts as affected if any of its components is.
        const std::string& name = response.outputs[i].name;
        const auto own = isDeaf.emplace(name.substr(0, name.find('.')), true).first;
        own->second &= std::all_of(response.transfers.begin(), response.transfers.end(), isZero);
    }
    std::vector<std::string> deaf;
    for (const auto& [name, isSo] : isDeaf)
        if (isSo) deaf.push_back(name);
    return deaf;
}

/** Compares the range of a spectrum with the analysis' frequencies.
@returns the part not covered, in words **/
std::string checkReach(const ModelValue& value, const Spectrum& spectrum,
                       const std::vector<double>& frequencies) {
    if (spectrum.frequencies.empty()) return {};
    const double first = spectrum.frequencies.front(), last = spectrum.frequencies.back();
    const std::string own =
        writeGeneral(frequencies.front(), 5) + " to " + writeGeneral(frequencies.back(), 5) + " Hz";
    if (last <= frequencies.front() || first >= frequencies.back())
        value.fail("none of it lies within the frequencies of the analysis, " + own);
    if (first >= frequencies.front() && last <= frequencies.back()) return {};
    return "the spectrum of '" + value.getName() + "' is cut to " + own +
           ", the frequencies of the analysis";
}

}  // namespace

void ModelRun::runFrequencyResponse(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const std::vector<double> frequencies = listFrequencies(analysis);
    const std::vector<std::string> inputs = getTextsIfGiven(analysis, "inputs");
    std::vector<std::string> outputs = getTextsIfGiven(analysis, "outputs");
    const std::optional<Unbalance> unbalance = readUnbalance(analysis);
    const bool isRandom = analysis.has("spectra");
    const EffectiveStress effectiveStress =
        isRandom ? EffectiveStress::ByComponents : EffectiveStress::AsItIs;
    const auto observe = [this] { stopIfAsked(); };
    // The model at one speed, or at the speed of each frequency.
    NotesAtSpeeds notes;
    const auto makeAt = [&](double frequency) {
        const std::string parameter = analysis.get("speed").getText();
        ModelText text = m_text;
        text.settings.push_back("parameters." + parameter + "=" +
                                writeGeneral(2 * SimTK::Pi * frequency));
        const auto model = std::make_shared<const Model>(readModel(text), m_modelOptions);
        EquilibriumNotes own;
        const State state = findSteadyState(*model, own, observe);
        notes.add(2 * SimTK::Pi * frequency, own, *model, state);
        return ModelResponse(text, m_modelOptions, model, Probes::make(model), state, inputs,
                             outputs, unbalance, effectiveStress, observe);
    };
    HarmonicResponse response;
    std::optional<ModelResponse> model;
    int numUnstable = 0;
    try {
        TransferFunction calcTransfers;
        if (analysis.has("speed")) {
            const ModelValue parameters = m_model->getFile().get("parameters");
            if (!parameters.has(analysis.get("speed").getText()))
                analysis.get("speed").failUnknown("parameter", analysis.get("speed").getText(),
                                                  parameters.getKeys());
            model.emplace(makeAt(frequencies.front()));
            if (!model->getLeftOut().empty()) outputs = model->getOutputNames();
            calcTransfers = [&](const std::vector<double>& wanted, const auto& tell) {
                std::vector<SimTK::Matrix_<SimTK::Complex>> transfers;
                for (const double frequency : wanted) {
                    const ModelResponse now = makeAt(frequency);
                    numUnstable = std::max(numUnstable, now.countUnstable());
                    transfers.push_back(now.calcTransfers({frequency}, {})[0]);
                    tell(transfers.size());
                }
                return transfers;
            };
        } else {
            const State about =
                assembleState(*m_model, findNamedState(analysis.get("about"), name), observe);
            checkRanges(name, {about});
            model.emplace(m_text, m_modelOptions, m_model, m_probes, about, inputs, outputs,
                          unbalance, effectiveStress, observe);
            calcTransfers = [&](const std::vector<double>& wanted, const auto& tell) {
                return model->calcTransfers(wanted, tell);
            };
        }
        // Exclude round-off, from which neither frequencies nor curves must be computed.
        std::vector<SimTK::Matrix_<SimTK::Complex>> samples;
        std::vector<SimTK::Matrix> bounds;
        for (const double frequency :
             {frequencies.front(), frequencies[frequencies.size() / 2], frequencies.back()}) {
            if (analysis.has("speed")) model.emplace(makeAt(frequency));
            samples.push_back(model->calcTransfers({frequency}, {})[0]);
            bounds.push_back(model->calcBounds(frequency));
        }
        const auto isRoundOff = findRoundOff(samples, bounds);
        const TransferFunction calcClean = [&](const std::vector<double>& wanted,
                                               const auto& tell) {
            auto transfers = calcTransfers(wanted, tell);
            for (auto& transfer : transfers)
                for (int i = 0; i < transfer.nrow(); ++i)
                    for (int k = 0; k < transfer.ncol(); ++k)
                        if (isRoundOff[size_t(i)][size_t(k)]) transfer(i, k) = 0;
            return transfers;
        };
        numUnstable = model->countUnstable();
        if (numUnstable > 0 && isRandom)
            throw std::runtime_error("the model is unstable where it is linearised (" +
                                     std::to_string(numUnstable) +
                                     (numUnstable == 1 ? " motion grows" : " motions grow") +
                                     " by itself): random loads have no effective values");
        response.inputs = model->getInputs();
        response.outputs = model->getOutputs();
        warnOfKinks(name, model->getLeftOut());
        if (!analysis.has("speed")) warnOfUnevenDamping(name, model->getState());
        calcHarmonicResponse(
            calcClean, frequencies,
            !analysis.get("adaptive").getBool() ? Refinement::None
            : isRandom                          ? Refinement::ForIntegrals
                                                : Refinement::AtResonances,
            [this](double fraction) {
                m_fraction = fraction;
                stopIfAsked();
            },
            response);
    } catch (const Cancelled&) {
        throw;
    } catch (const ModelError&) {
        throw;
    } catch (const std::runtime_error& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what());
    }
    if (analysis.has("speed"))
        notes.tell(analysis.get("speed").getText(),
                   [&](const std::string& message) { warn(name, message); });
    if (numUnstable > 0)
        warn(name, "the model is unstable where it is linearised (" + std::to_string(numUnstable) +
                       (numUnstable == 1 ? " motion grows" : " motions grow") +
                       " by itself): it never vibrates in this way");
    for (const std::string& output : listDeaf(response))
        warn(name, "no input changes '" + output +
                       "', as far as linear models see: squares, such as energies at rest, they "
                       "do not");
    Results::Analysis results = makeComplete(name, "frequency_response");
    putPorts(response.inputs, response.outputs, results);
    results.frequency = {response.frequencies};
    auto &magnitude = results.matrices["magnitude"], &phase = results.matrices["phase"];
    for (const auto& transfer : response.transfers) {
        magnitude.emplace_back();
        phase.emplace_back();
        for (int i = 0; i < transfer.nrow(); ++i)
            for (int k = 0; k < transfer.ncol(); ++k) {
                magnitude.back().push_back(std::abs(transfer(i, k)));
                phase.back().push_back(std::arg(transfer(i, k)) * 180 / SimTK::Pi);
            }
    }
    if (isRandom) {
        const std::vector<Spectrum> spectra = readSpectra(analysis, response.inputs);
        for (size_t k = 0; k < spectra.size(); ++k) {
            const ModelValue given = analysis.get("spectra");
            const std::string input = response.inputs[k].name;
            if (!given.has(input)) continue;
            const std::string cut = checkReach(given.get(input), spectra[k], response.frequencies);
            if (!cut.empty()) warn(name, cut);
        }
        const auto coarse = addDensities(response, spectra, model->getStresses(), results);
        if (!coarse.empty())
            warn(name, "effective values of " + joinNames(coarse) +
                           " are not to be trusted: they hang on few frequencies; give more of "
                           "them" +
                           (analysis.get("adaptive").getBool() ? "" : ", or `adaptive: true`") +
                           "; without damping there are none");
    }
    if (m_options.drawsPictures && analysis.has("shapes")) {
        std::vector<Eigenmode> shapes;
        std::vector<std::string> titles;
        for (const double frequency : analysis.get("shapes").getNumbers()) {
            const auto motions = model->calcMotions(frequency);
            for (int k = 0; k < motions.ncol(); ++k) {
                shapes.emplace_back();
                shapes.back().frequency = frequency;
                shapes.back().shape = motions(k);
                titles.push_back(response.inputs[size_t(k)].name + " at " +
                                 writeGeneral(frequency, 5) + " Hz");
            }
        }
        m_remarks[name].push_back(drawShapes(*m_model, model->getState(), shapes, titles, name,
                                             getUsualFolder(), m_options.listener));
    }
    m_writer->add(results);
}

}  // namespace model
}  // namespace simflex
