/** @file
The analyses without time: static, eigen, campbell. **/

#include <algorithm>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/model/analyses/Beginning.h"
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

}  // namespace model
}  // namespace simflex
