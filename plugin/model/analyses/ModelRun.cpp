#include "simflex/model/analyses/ModelRun.h"

#include <algorithm>
#include <filesystem>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/StateCopy.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/EarlierResults.h"
#include "simflex/model/analyses/LinearPorts.h"
#include "simflex/model/analyses/StateRows.h"
#include "simflex/model/analyses/TransientRun.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;
using SimTK::State;
using SimTK::Vector;

namespace {

/** The path from the options or the model file, or one from the model's name in the current folder.
 **/
std::string chooseResultPath(const ModelText& text, const ModelValue& model,
                             const RunOptions& options, ModelOptions::Bodies bodies) {
    const ModelValue file = model.get("output").get("file");
    fs::path path =
        !options.output.empty() ? fs::path(options.output)
        : file.isGiven()
            ? fs::path(file.getText())
            : fs::path((text.path.empty() ? "model" : fs::path(text.path).stem().string()) +
                       ".results.h5");
    if (bodies != ModelOptions::Bodies::AsGiven)
        path.replace_extension((bodies == ModelOptions::Bodies::Rigid ? ".rigid" : ".finer") +
                               path.extension().string());
    return path.string();
}

/** Number of the first line in which two texts differ. **/
int findDifference(const std::string& a, const std::string& b) {
    int line = 1;
    for (size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i) line += a[i] == '\n';
    return line;
}

/** @throws ModelError if a key such as `from` names an analysis that does not stand above this one.
 **/
void checkNamedState(const ModelValue& name, const ModelValue& analyses,
                     const std::string& forAnalysis) {
    const std::string wanted = name.getText();
    if (wanted == "start" || wanted == "placed" || wanted == "static") return;
    std::vector<std::string> earlier{"start", "static"};
    bool isBelow = false;
    for (const std::string& other : analyses.getKeys()) {
        isBelow |= other == forAnalysis;
        const std::string type = analyses.get(other).get("type").getText();
        if (type != "static" && type != "transient") continue;
        if (other == wanted && !isBelow) return;
        if (other == wanted)
            name.fail("analysis '" + wanted + "' is not above '" + forAnalysis +
                      "': analyses are done in the order of the file, so move it up");
        if (!isBelow) earlier.push_back(other);
    }
    name.fail("'" + wanted + "' is not a static or transient analysis above '" + forAnalysis +
              "'; " + proposeName(wanted, earlier));
}

}  // namespace

ModelRun::ModelRun(const ModelText& text, ModelOptions::Bodies bodies, const RunOptions& options)
    : m_text(text), m_options(options) {
    m_modelOptions.bodies = bodies;
    m_modelOptions.code = options.code;
    if (options.onlyChecks) m_modelOptions.code.fmus = AllowedCode::Fmus::Described;
    // Pictures would overwrite those of the model as given.
    if (bodies != ModelOptions::Bodies::AsGiven) {
        m_options.drawsPictures = false;
        m_options.animation.clear();
    }
    m_modelOptions.listener = options.listener;
    m_modelOptions.listener.warn = [this](const std::string& warning) {
        m_options.listener.tellWarning(warning);
        m_modelWarnings.push_back(warning);
    };
    const ModelValue file = readModel(text);
    const ModelValue analyses = file.get("analyses");
    if (!analyses.isGiven() || analyses.getKeys().empty())
        throw ModelError(text.path +
                         ": there is nothing to do: add what to simulate, for example\n"
                         "analyses:\n"
                         "  run: {type: transient, duration: 1}");
    m_resultPath = chooseResultPath(text, file, options, bodies);
    // Reducing parts may take minutes.
    checkWishes(file);
    if (!options.onlyChecks) readEarlier();
    m_model = std::make_shared<const Model>(file, m_modelOptions);
    m_modelOptions.listener = {};
    m_inputs = calcInputChecksums(*m_model);
    takeUpEarlier();
    m_probes = Probes::make(m_model);
    if (!isRigidTwin()) checkPorts();
    // Refuse pictures that cannot be drawn before hours of simulation.
    if (m_options.drawsPictures && file.get("pictures").isGiven()) checkPictures(*m_model);
}

ModelRun::~ModelRun() = default;

void ModelRun::warn(const std::string& analysis, const std::string& message) {
    m_options.listener.tellWarning(analysis + ": " + message);
    if (m_writer) m_writer->addWarning(analysis, message);
}

void ModelRun::leaveOut(const std::string& analysis, const std::string& reason) {
    m_options.listener.tellNote("analysis '" + analysis +
                                "' is left out of the rigid model: " + reason);
}

void ModelRun::checkRanges(const std::string& analysis, const std::vector<State>& states) {
    RangeWarnings ranges;
    for (const State& state : states)
        for (const std::string& message : ranges.describe(*m_model, state)) warn(analysis, message);
}

bool ModelRun::canBend() const {
    const State state = m_model->makeInitialState();
    const auto& bodies = m_model->getBodies();
    return std::any_of(bodies.begin(), bodies.end(), [&](const Model::BodyEntry& body) {
        return body.flexible && !body.flexible->isRigid(state);
    });
}

bool ModelRun::isWanted(const std::string& analysis) const {
    return m_options.only.empty() || std::find(m_options.only.begin(), m_options.only.end(),
                                               analysis) != m_options.only.end();
}

std::string ModelRun::getUsualFolder() const {
    return fs::path(m_text.path).stem().string() + ".frames";
}

bool ModelRun::isComplete(const std::string& analysis) const {
    const auto* done = m_earlier ? seekNamed(m_earlier->analyses, analysis) : nullptr;
    return done && done->isComplete;
}

//-------------------------------------------------------------------------------------------------
// Files

std::string ModelRun::findChange(const ResultHeader& earlier) const {
    if (earlier.modelText != m_text.text)
        return "the model file '" + m_text.path + "' has changed since, first in line " +
               std::to_string(findDifference(earlier.modelText, m_text.text));
    const auto list = [](const std::vector<std::string>& settings) {
        return settings.empty() ? "none" : joinNames(settings, " ");
    };
    if (earlier.settings != m_text.settings)
        return "it was run with other settings (then: " + list(earlier.settings) +
               "; now: " + list(m_text.settings) + ")";
    if (earlier.version != SIMFLEX_VERSION)
        return "it was written by simflex " + earlier.version + ", this is " SIMFLEX_VERSION;
    if (earlier.isRigid != isRigidTwin())
        return earlier.isRigid ? "its bodies are all rigid" : "its bodies are flexible";
    return "";
}

void ModelRun::checkWishes(const ModelValue& file) const {
    const ModelValue analyses = file.get("analyses");
    const std::vector<std::string> known = analyses.getKeys();
    for (const std::string& name : m_options.only)
        if (std::find(known.begin(), known.end(), name) == known.end())
            analyses.failUnknown("analysis", name, known);
    for (const std::string& name : known)
        for (const char* key : {"from", "about"})
            if (analyses.get(name).has(key))
                checkNamedState(analyses.get(name).get(key), analyses, name);
    // Refuse to replace good results by empty ones.
    const auto isSweep = [&](const std::string& name) {
        return analyses.get(name).get("type").getText() == "sweep";
    };
    const std::vector<std::string>& wanted = m_options.only.empty() ? known : m_options.only;
    if (std::all_of(wanted.begin(), wanted.end(), isSweep))
        analyses.get(wanted.front())
            .fail("this is a sweep: run it with 'simflex sweep " + m_text.path + "'");
    checkWritable(m_resultPath);
    if (!m_options.animation.empty()) {
        checkAnimationName(m_options.animation);
        const ModelValue states = file.get("output").get("states");
        if (states.getText() == "none")
            states.fail(
                "an animation is made of States, which output.states: none does not keep: leave "
                "that out");
    }
    for (const char* other : {".csv", ".txt", ".json", ".yaml", ".png", ".mp4"})
        if (fs::path(m_resultPath).extension() == other)
            throw std::runtime_error("the result file '" + m_resultPath +
                                     "' is HDF5: name it .h5; --csv writes tables as well");
}

void ModelRun::checkPorts() const {
    const ModelValue analyses = m_model->getFile().get("analyses");
    for (const std::string& name : analyses.getKeys()) {
        if (!isWanted(name)) continue;
        const ModelValue analysis = analyses.get(name);
        const auto check = [&](const char* key, const auto& make) {
            if (!analysis.has(key)) return;
            try {
                make(analysis.get(key).getTexts());
            } catch (const ModelError& error) {
                analysis.get(key).fail(error.what());
            }
        };
        const std::string type = analysis.get("type").getText();
        if (type == "linear" || type == "frequency_response")
            check("inputs", [&](const auto& paths) {
                LinearInputPorts(m_text, m_modelOptions, *m_model, paths);
            });
        if (type == "linear" || type == "frequency_response" || type == "eigen" ||
            type == "campbell")
            check("outputs",
                  [&](const auto& names) { LinearOutputPorts(m_model, m_probes, names); });
    }
}

void ModelRun::readEarlier() {
    // A journal without this file is empty: both are written from the start.
    if (!fs::exists(m_resultPath)) return;
    Results data;
    try {
        data = readResults(m_resultPath, m_options.resumes ? ReadStates::No : ReadStates::Yes);
    } catch (const std::exception& error) {
        throw std::runtime_error(
            "'" + m_resultPath +
            "' exists and cannot be read as a result file of simflex, so it is not replaced: " +
            error.what() + "; choose another name with -o or remove it");
    }
    m_change = findChange(data.header);
    m_earlierInputs = data.header.inputs;
    if (m_options.resumes)
        m_earlier = std::move(data);
    else if (!m_options.only.empty())
        for (Results::Analysis& analysis : data.analyses)
            if (!isWanted(analysis.name)) m_kept.push_back(std::move(analysis));
}

void ModelRun::takeUpEarlier() {
    const auto& earlier = m_earlier ? m_earlier->analyses : m_kept;
    if (m_change.empty()) m_change = findChangedInput(m_earlierInputs, m_inputs);
    if (!m_change.empty()) {
        for (const Results::Analysis& analysis : earlier) m_outdated.push_back(analysis.name);
        m_earlier.reset();
        m_kept.clear();
    }
    const ModelValue analyses = m_model->getFile().get("analyses");
    for (size_t k = 0; k < m_options.only.size(); ++k)
        for (const char* key : {"from", "about"}) {
            const ModelValue analysis = analyses.get(m_options.only[k]);
            const std::string name = analysis.has(key) ? analysis.get(key).getText() : "";
            if (!analyses.has(name) || isWanted(name)) continue;
            const auto* held = seekNamed(m_earlier ? m_earlier->analyses : m_kept, name);
            // Equilibria are found again wherever they are needed.
            const bool isNeeded =
                analyses.get(name).get("type").getText() == "transient"
                    ? !held || !held->isComplete
                    : std::find(m_outdated.begin(), m_outdated.end(), name) != m_outdated.end();
            if (!isNeeded) continue;
            m_options.listener.tellNote("analysis '" + name + "' is done as well: '" +
                                        m_options.only[k] + "' begins from it");
            m_options.only.push_back(name);
        }
}

void ModelRun::openResults() {
    if (m_earlier) {
        m_writer = std::make_unique<ResultWriter>(m_resultPath);
        return;
    }
    if (!m_outdated.empty()) {
        std::vector<std::string> redone;
        for (const std::string& name : m_outdated)
            if (isWanted(name)) redone.push_back(name);
        m_options.listener.tellWarning("the results of " + joinNames(m_outdated) + " in '" +
                                       m_resultPath + "' are out of date: " + m_change +
                                       ". They stay in '" + keepAside(m_resultPath) +
                                       "' until they have been done anew; this run does " +
                                       (redone.empty()                       ? "none of them"
                                        : redone.size() == m_outdated.size() ? "all of them"
                                                                             : joinNames(redone)));
    } else if (m_options.resumes) {
        m_options.listener.tellNote("'" + m_resultPath +
                                    "' has nothing to continue: the run begins anew");
    }
    removeRunCheckpoint(getCheckpointPath());
    ResultHeader header;
    header.title = getModelTitle(m_model->getFile());
    header.modelPath = m_text.path;
    header.modelText = m_text.text;
    header.settings = m_text.settings;
    header.isRigid = isRigidTwin();
    header.version = SIMFLEX_VERSION;
    header.inputs = m_inputs;
    m_writer = std::make_unique<ResultWriter>(m_resultPath, header, m_kept);
    m_kept.clear();
}

std::vector<ResultColumn> ModelRun::makeColumns() const {
    std::vector<ResultColumn> columns;
    for (const Probe& probe : m_probes.getProbes())
        columns.push_back({probe.name, probe.unit, probe.columns});
    return columns;
}

FmuCost ModelRun::takeFmuCost() {
    const FmuCost before = m_fmuCost;
    m_fmuCost = m_model->getFmuCost();
    return {m_fmuCost.exchanges - before.exchanges, m_fmuCost.seconds - before.seconds,
            m_fmuCost.librarySeconds - before.librarySeconds};
}

//-------------------------------------------------------------------------------------------------
// Analyses

void ModelRun::stopIfAsked() const {
    if (m_options.listener.tellProgress(m_work, m_fraction)) return;
    throw Cancelled("what is complete is in '" + m_resultPath +
                    "'; continue with: " + m_options.resumeCommand);
}

void ModelRun::beginWork(const std::string& name) {
    m_work = name;
    m_fraction = 0;
    stopIfAsked();
}

void ModelRun::perform() {
    openResults();
    m_hasResults = true;
    try {
        performAll();
    } catch (...) {
        m_writer.reset();
        throw;
    }
}

void ModelRun::performAll() {
    for (const std::string& warning : m_modelWarnings) m_writer->addWarning("", warning);
    const std::map<std::string, void (ModelRun::*)(const ModelValue&)> ways{
        {"transient", &ModelRun::runTransient},
        {"static", &ModelRun::runStatic},
        {"eigen", &ModelRun::runEigen},
        {"campbell", &ModelRun::runCampbell},
        {"linear", &ModelRun::runLinear},
        {"frequency_response", &ModelRun::runFrequencyResponse}};
    const ModelValue analyses = m_model->getFile().get("analyses");
    for (const std::string& name : analyses.getKeys()) {
        const ModelValue analysis = analyses.get(name);
        if (!isWanted(name) || isComplete(name)) continue;
        const auto way = ways.find(analysis.get("type").getText());
        if (way == ways.end()) {
            m_options.listener.tellNote("analysis '" + name + "' is left to 'simflex sweep'");
            continue;
        }
        beginWork(name);
        (this->*way->second)(analysis);
        for (const ModelValue& value : analysis.findUnread())
            warn(name, value.getPath() + " has had no effect");
    }
    m_writer.reset();
    removeReplaced(m_resultPath);
    if (!m_options.animation.empty())
        for (const Results::Analysis& analysis : readResults(m_resultPath).analyses)
            if (isWanted(analysis.name) && analysis.type == "transient" && !analysis.q.empty())
                m_remarks[analysis.name].push_back(
                    writeAnimation(*m_model, analysis, m_options.animation));
    writeTables();
}

void ModelRun::writeTables() const {
    if (!m_options.writesCsv && !m_model->getFile().get("output").get("csv").getBool()) return;
    for (const Results::Analysis& analysis : readResults(m_resultPath, ReadStates::No).analyses) {
        if (!isWanted(analysis.name)) continue;
        writeResultCsv(makePathBeside(m_resultPath, "." + analysis.name + ".csv"), analysis);
    }
}

void ModelRun::runTransient(const ModelValue& analysis) {
    const std::string name = analysis.getName();
    const State start = findNamedState(analysis.get("from"), name);
    if (beginsAtRest(analysis))
        for (const std::string& loss : describeLosses(*m_model)) warn(name, loss);
    TransientRun run(*this, analysis);
    const auto* begun = m_earlier ? seekNamed(m_earlier->analyses, name) : nullptr;
    if (begun && fs::exists(getCheckpointPath())) {
        const RunCheckpoint checkpoint = readRunCheckpoint(getCheckpointPath());
        if (checkpoint.analysis == name && size_t(checkpoint.numRows) > begun->time.size()) {
            m_options.listener.tellWarning("analysis '" + name + "' begins anew: of " +
                                           std::to_string(checkpoint.numRows) + " rows '" +
                                           m_resultPath + "' has lost all but " +
                                           std::to_string(begun->time.size()));
        } else if (checkpoint.analysis == name) {
            run.resume(start, checkpoint);
            m_writer->resumeTransient(name, checkpoint.numRows);
            run.perform();
            return;
        }
    }
    refuseForgottenControllers(analysis);
    run.start(start);
    m_writer->beginTransient(name, makeColumns(), run.getStateColumns());
    run.perform();
}

void ModelRun::refuseForgottenControllers(const ModelValue& analysis) const {
    const ModelValue file = m_model->getFile();
    const std::string from = analysis.get("from").getText();
    const std::vector<std::string> controllers = file.get("controllers").getKeys();
    if (controllers.empty() || !file.get("analyses").has(from) || m_ends.count(from)) return;
    throw std::runtime_error("analysis '" + analysis.getName() + "' cannot begin at the end of '" +
                             from + "': the result file does not have what controller '" +
                             controllers.front() +
                             "' remembers; run both together, without --only and --resume");
}

const State& ModelRun::getStart() {
    if (!m_start) m_start = findStart(*m_model, m_startNotes, [this] { stopIfAsked(); });
    return *m_start;
}

const ModelRun::Equilibrium& ModelRun::obtainEquilibrium(const ModelValue& analysis) {
    const auto found = m_equilibria.find(analysis.getName());
    if (found != m_equilibria.end()) return found->second;
    StaticEquilibrium solver(m_model->getSystem());
    solver.setObserver([this] { stopIfAsked(); });
    std::vector<StaticEquilibrium::PathPoint> path;
    try {
        const State from = findNamedState(analysis.get("from"), analysis.getName());
        doWithLaws(*m_model, [&] {
            if (!analysis.has("path")) return solver.solve(from);
            const ModelValue wanted = analysis.get("path");
            if (!m_model->getLawLoads().empty())
                wanted.fail("load '" + m_model->getLawLoads().begin()->first +
                            "' depends on the motion: it acts in full from the beginning and does "
                            "not grow with the others, so that no path of equilibria is followed");
            StaticEquilibrium::PathSettings settings;
            if (wanted.get("step").isGiven()) settings.step = wanted.get("step").getNumber();
            if (wanted.get("points").isGiven())
                settings.mostPoints = wanted.get("points").getInteger();
            path = solver.followPath(from, settings);
        });
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception& error) {
        throw std::runtime_error("analysis '" + analysis.getName() + "': " + error.what());
    }
    Equilibrium& equilibrium = m_equilibria[analysis.getName()];
    equilibrium = {copyState(solver.getState()), solver.getMultipliers(), solver.getNumIterations(),
                   describeEquilibrium(solver), std::move(path)};
    m_model->getSystem().realize(equilibrium.state, SimTK::Stage::Velocity);
    std::vector<State> states{equilibrium.state};
    for (const StaticEquilibrium::PathPoint& point : equilibrium.path)
        states.push_back(point.state);
    checkRanges(analysis.getName(), states);
    return equilibrium;
}

State ModelRun::findEnd(const std::string& name) const {
    const auto found = m_ends.find(name);
    if (found != m_ends.end()) return found->second;
    // Look in the run that is continued.
    const Results results = readResults(m_resultPath);
    const auto* analysis = seekNamed(results.analyses, name);
    if (analysis && analysis->isComplete && !analysis->q.empty()) {
        return StateRows(*m_model).unpackState(*analysis, analysis->time.size() - 1);
    }
    throw std::runtime_error("the end of analysis '" + name +
                             "' is not known: it was left out, or its states were not kept");
}

bool ModelRun::beginsAtRest(const ModelValue& analysis) const {
    const std::string from = analysis.get("from").getText();
    const ModelValue file = m_model->getFile(), analyses = file.get("analyses");
    if (analyses.has(from)) return analyses.get(from).get("type").getText() == "static";
    return from == "static" || file.get("initial").get("start").getText() == "static";
}

void ModelRun::warnOfStart(const std::string& analysis, const EquilibriumNotes& notes) {
    for (const std::string& warning : notes.warnings) warn(analysis, "where it begins, " + warning);
}

State ModelRun::findNamedState(const ModelValue& name, const std::string& forAnalysis) {
    const std::string wanted = name.getText();
    if (wanted == "start" || wanted == "placed") {
        const State& start = getStart();
        warnOfStart(forAnalysis, m_startNotes);
        return start;
    }
    const ModelValue analyses = m_model->getFile().get("analyses");
    checkNamedState(name, analyses, forAnalysis);
    const std::string type =
        analyses.has(wanted) ? analyses.get(wanted).get("type").getText() : std::string();
    if (type == "static") {
        const Equilibrium& equilibrium = obtainEquilibrium(analyses.get(wanted));
        // Those found by this run have given their warnings.
        if (!isWanted(wanted)) warnOfStart(forAnalysis, equilibrium.notes);
        return equilibrium.state;
    }
    if (type == "transient") return findEnd(wanted);
    if (wanted == "static") {
        StaticEquilibrium solver(m_model->getSystem());
        solver.setObserver([this] { stopIfAsked(); });
        solver.solve(getStart());
        warnOfStart(forAnalysis, describeEquilibrium(solver));
        return solver.getState();
    }
    throw std::logic_error("a state was not checked");
}

//-------------------------------------------------------------------------------------------------
// Messages

void ModelRun::refuseFailures() const {
    if (!m_failures.empty()) throw std::runtime_error(joinNames(m_failures, "; "));
}

std::vector<std::string> ModelRun::getRemarks(const std::string& analysis) const {
    const auto found = m_remarks.find(analysis);
    return found != m_remarks.end() ? found->second : std::vector<std::string>();
}

ModelRun::Assembly ModelRun::assemble() {
    constexpr double Moved = 1e-6;  // [m, rad]
    const auto integrator = makeIntegrator(*m_model);
    integrator->initialize(getStart());
    Assembly assembly{integrator->getState(), {}, {}, {}, integrator->getLargestConstraintError()};
    m_model->getSystem().realize(assembly.state, SimTK::Stage::Velocity);
    State placed = m_model->makePlacedState();
    m_model->getSystem().realize(placed, SimTK::Stage::Velocity);
    const bool isAsPlaced = m_model->getFile().get("initial").get("start").getText() == "as_placed";
    for (const Model::BodyEntry& body : m_model->getBodies()) {
        if (!isAsPlaced) break;
        const SimTK::Transform from = body.mobod.getBodyTransform(placed) * body.X_BP,
                               to = body.mobod.getBodyTransform(assembly.state) * body.X_BP;
        const double way = (to.p() - from.p()).norm(),
                     angle = std::abs((~from.R() * to.R()).convertRotationToAngleAxis()[0]);
        if (way + angle > Moved)
            assembly.moved.push_back("body " + body.name + ", by " + writeGeneral(way, 3) +
                                     " m and " + writeGeneral(angle * 180 / SimTK::Pi, 3) +
                                     " degrees");
    }
    for (const std::string& line : integrator->getRedundantConstraints())
        assembly.redundant.push_back(line);
    LinearRangeReporter(m_model->getFlexibleBodies(), 1, [&](const std::string& message) {
        assembly.warnings.push_back(message + " " + MotionWarnings::getAdviceAtStart());
    }).handleEvent(integrator->getState());
    return assembly;
}

}  // namespace model
}  // namespace simflex
