/** @file
The analyses without time: static, eigen, campbell, linear, frequency_response. **/

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/LinearPorts.h"
#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/analyses/StateNumbers.h"
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

/** With joints met and speeds consistent. **/
State assembleState(const Model& model, const State& state) {
    const auto integrator = makeIntegrator(model);
    integrator->initialize(state);
    return integrator->getState();
}

/** Each text once, with its number, in the order of the first. **/
std::vector<std::pair<std::string, int>> countEqual(const std::vector<std::string>& texts) {
    std::vector<std::pair<std::string, int>> counts;
    for (const std::string& text : texts) {
        const auto found = std::find_if(counts.begin(), counts.end(),
                                        [&](const auto& entry) { return entry.first == text; });
        if (found == counts.end())
            counts.emplace_back(text, 1);
        else
            ++found->second;
    }
    return counts;
}

std::vector<std::vector<double>> listRows(const SimTK::Matrix& matrix) {
    std::vector<std::vector<double>> rows(size_t(matrix.nrow()));
    for (int i = 0; i < matrix.nrow(); ++i)
        for (int j = 0; j < matrix.ncol(); ++j) rows[size_t(i)].push_back(matrix(i, j));
    return rows;
}

constexpr int UsualModes = 10, UsualBranches = 6;

/** The model again, with another value of a parameter, in steady motion. **/
Linearization linearizeAt(const ModelText& text, const ModelOptions& options,
                          const std::string& parameter, Real value,
                          const std::function<void()>& observer) {
    ModelText changed = text;
    changed.settings.push_back("parameters." + parameter + "=" + writeGeneral(value));
    const Model model(readModel(changed), options);
    if (model.getFile().get("initial").get("start").getText() != "as_placed")
        return calcLinearization(model.getSystem(), findStart(model, observer), observer);
    StaticEquilibrium equilibrium(model.getSystem());
    equilibrium.setObserver(observer);
    equilibrium.solveSteadyMotion(model.makeInitialState());
    return calcLinearization(model.getSystem(), equilibrium.getState(), observer);
}

}  // namespace

void ModelRun::runStatic(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const Equilibrium& equilibrium = obtainEquilibrium(analysis);
    const Vector atRest;
    const Moment moment{equilibrium.state, atRest, equilibrium.multipliers, 0};
    const std::vector<double> values = m_probes.calc(moment);
    MotionWarnings(*m_model, m_probes, [&](const std::string& message) {
        warn(name, message);
    }).checkFinite(equilibrium.state.getTime(), values);
    Results::Analysis results = makeComplete(name, "static");
    auto at = values.begin();
    for (const ResultColumn& column : makeColumns()) {
        const auto end = at + std::ptrdiff_t(column.columns.size());
        results.probes.push_back({column, {{at, end}}});
        at = end;
    }
    results.q = {toNumbers(equilibrium.state.getQ())};
    results.statistics["iterations"] = equilibrium.numIterations;
    m_writer->add(results);
    const std::string rubbing = nameRubbingJoints(*m_model);
    if (!rubbing.empty()) warn(name, "is found without the friction of " + rubbing);
    for (const auto& [motion, count] : countEqual(equilibrium.unstableMotions))
        warn(name, "the equilibrium is unstable: " + nameBodies(*m_model, motion) +
                       (count > 1 ? " in " + std::to_string(count) + " ways" : "") +
                       " at the least push; begin elsewhere, or let a damped motion lead to one "
                       "that lasts");
    for (const auto& [motion, count] : countEqual(equilibrium.freeMotions))
        m_remarks[name].push_back(nameBodies(*m_model, motion) +
                                  (count > 1 ? " in " + std::to_string(count) + " ways" : "") +
                                  ": nothing holds it");
}

void ModelRun::runEigen(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const ModelValue wanted = analysis.get("count");
    const int count = wanted.isGiven() ? wanted.getInteger() : UsualModes;
    const State about = assembleState(*m_model, findNamedState(analysis.get("about"), name));
    const Linearization linear =
        calcLinearization(m_model->getSystem(), about, [this] { stopIfAsked(); });
    std::vector<Eigenmode> modes = calcEigenmodes(linear);
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
    if (isDrawn)
        m_remarks[name].push_back(
            drawModes(*m_model, linear, modes, name, getUsualFolder(), m_options.listener));
    m_writer->add(results);
    const std::string rubbing = nameRubbingJoints(*m_model);
    if (!rubbing.empty()) m_remarks[name].push_back("what rubs sticks and is held: " + rubbing);
}

void ModelRun::runCampbell(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const ModelValue wanted = analysis.get("count");
    const int count = wanted.isGiven() ? wanted.getInteger() : UsualBranches;
    const std::vector<double> speeds = analysis.get("speeds").getNumbers();
    const std::string parameter = analysis.get("parameter").getText();
    const std::vector<std::string> known = m_model->getFile().get("parameters").getKeys();
    if (std::find(known.begin(), known.end(), parameter) == known.end())
        analysis.get("parameter").failUnknown("parameter", parameter, known);
    int done = 0;
    CampbellDiagram diagram;
    try {
        diagram = calcCampbellDiagram({speeds.begin(), speeds.end()}, count, [&](Real speed) {
            m_fraction = double(done++) / double(speeds.size());
            stopIfAsked();
            return linearizeAt(m_text, m_modelOptions, parameter, speed, [this] { stopIfAsked(); });
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
             << nameBodies(*m_model, diagram.failures[k]);
        warn(name, text.str());
    }
    if (numFailures > 0)
        m_failures.push_back("analysis '" + name + "' has no modes at " +
                             std::to_string(numFailures) + " of its " +
                             std::to_string(speeds.size()) + " speeds");
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
        if (!(frequency >= 0)) wanted.fail("a frequency is not negative");
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

void ModelRun::runLinear(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const State about = assembleState(*m_model, findNamedState(analysis.get("about"), name));
    LinearSystem linear;
    try {
        linear = linearizeModel(m_text, m_modelOptions, m_model, m_probes, about,
                                analysis.get("inputs").getTexts(),
                                getTextsIfGiven(analysis, "outputs"), [this] { stopIfAsked(); });
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what());
    }
    Results::Analysis results = makeComplete(name, "linear");
    putPorts(linear.inputs, linear.outputs, results);
    results.matrices = {{"A", listRows(linear.A)},
                        {"B", listRows(linear.B)},
                        {"C", listRows(linear.C)},
                        {"D", listRows(linear.D)}};
    m_writer->add(results);
    const std::string path =
        std::filesystem::path(m_resultPath).replace_extension("." + name + ".mat").string();
    linear.writeMat(path);
    m_remarks[name].push_back("for MATLAB, Octave and Python: " + path);
}

void ModelRun::runFrequencyResponse(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const std::vector<double> frequencies = listFrequencies(analysis);
    const State about = assembleState(*m_model, findNamedState(analysis.get("about"), name));
    std::optional<ModelResponse> model;
    HarmonicResponse response;
    try {
        model.emplace(m_text, m_modelOptions, m_model, m_probes, about,
                      analysis.get("inputs").getTexts(), getTextsIfGiven(analysis, "outputs"),
                      [this] { stopIfAsked(); });
        response = calcHarmonicResponse(
            *model, frequencies,
            analysis.get("adaptive").getBool() ? Refinement::AtResonances : Refinement::None,
            [this](double fraction) {
                m_fraction = fraction;
                stopIfAsked();
            });
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        if (isRigidTwin()) return leaveOut(name, error.what());
        throw std::runtime_error("analysis '" + name + "': " + error.what());
    }
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
