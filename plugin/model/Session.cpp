#include "simflex/model/Session.h"
#include "simflex/base/NumberText.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/Archive.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/Progress.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/LinearPorts.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/file/KnownTimes.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/probes/ProbeKinds.h"
#include "simflex/model/session/KeptState.h"
#include "simflex/model/session/Quantities.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {

using namespace model;
using SimTK::Stage;
using SimTK::State;

namespace {

constexpr size_t MostSamples = 100000;
constexpr size_t MostPathStates = 64;
constexpr int StepsBetweenLooks = 20;  // between checks for cancellation, approximately

template <class T>
void dropEverySecond(std::vector<T>& items) {
    size_t kept = 0;
    for (size_t i = 0; i < items.size(); i += 2) items[kept++] = std::move(items[i]);
    items.resize(kept);
}

/** True if a key affects only the computation or display, not the motion. **/
bool isBesideMotion(const std::string& key) {
    const std::string section = key.substr(0, key.find('.'));
    const std::string sections[] = {"title",    "description", "pictures", "output",
                                    "analyses", "probes",      "solver"};
    const std::string color = ".color";
    return std::find(std::begin(sections), std::end(sections), section) != std::end(sections) ||
           (section == "bodies" && key.size() > color.size() &&
            key.compare(key.size() - color.size(), color.size(), color) == 0);
}

}  // namespace

void ProbeRecord::add(double now, std::vector<double> values) {
    if (time.size() >= MostSamples) {
        dropEverySecond(time);
        dropEverySecond(rows);
    }
    time.push_back(now);
    rows.push_back(std::move(values));
}

Session::Session(const ModelText& text, const ModelOptions& options)
    : m_text(text),
      m_options(options),
      m_model(std::make_shared<const Model>(text, options)),
      m_probes(Probes::make(m_model)) {
    EquilibriumNotes notes;
    m_start = findStart(*m_model, notes);
    for (const std::string& warning : notes.warnings)
        m_options.listener.tellWarning("where the model begins, " + warning);
    reset();
    if (m_model->getFile().get("initial").get("start").getText() != "static") return;
    for (const std::string& loss : describeLosses(*m_model))
        m_options.listener.tellWarning("the model " + loss);
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

std::string Session::getTitle() const {
    return getModelTitle(m_model->getFile());
}

double Session::calcEnergy() const {
    return m_model->getFlexibleBodies().calcEnergy(getState());
}

//-------------------------------------------------------------------------------------------------
// State

State Session::makeFresh(const State& state) const {
    State fresh = m_model->makeInitialState();
    if (state.getSystemStage() < Stage::Model || state.getNQ() != fresh.getNQ() ||
        state.getNU() != fresh.getNU() || state.getNZ() != fresh.getNZ())
        throw std::invalid_argument("the State is empty, or of another model");
    for (const Model::BodyEntry& body : m_model->getBodies()) {
        if (!body.flexible) continue;
        if (body.flexible->isRigid(state))
            body.flexible->setRigid(fresh);
        else
            body.flexible->setFlexible(fresh);
    }
    // Keep locks and releases made by events.
    const FlexibleBodySubsystem& flexible = m_model->getFlexibleBodies();
    flexible.setHolding(fresh, flexible.getHolding(state));
    m_model->getSystem().realizeModel(fresh);
    fresh.setTime(state.getTime());
    fresh.updQ() = state.getQ();
    fresh.updU() = state.getU();
    fresh.updZ() = state.getZ();
    m_model->copyMemories(state, fresh);
    m_model->getSystem().realize(fresh, Stage::Velocity);
    return fresh;
}

void Session::start(const State& state, Joints joints) {
    std::unique_ptr<ImplicitIntegrator> integrator = makeIntegrator(*m_model);
    const State begun = makeFresh(state);
    integrator->setProjectInitialState(joints == Joints::ToBeClosed);
    integrator->initialize(begun);
    // The joints were closed for the earlier parameters.
    if (joints == Joints::Closed &&
        integrator->getLargestConstraintError() > integrator->getConstraintToleranceInUse())
        return start(state, Joints::ToBeClosed);
    m_integrator = std::move(integrator);
    m_begun = begun;
    m_energyBefore = calcEnergy();
}

void Session::reset() {
    start(m_start);
    m_warnings = std::make_unique<MotionWarnings>(
        *m_model, m_probes,
        [listener = m_options.listener](const std::string& text) { listener.tellWarning(text); });
    m_record = {};
    m_path.clear();
    m_pathStride = 1;
    m_pathCount = 0;
    recordRow();
}

void Session::setState(const State& state) {
    start(state);
    recordRow();
}

std::string Session::describeWhatMoves() const {
    std::string description = m_text.text;
    for (const std::string& setting : m_text.settings)
        if (!isBesideMotion(setting.substr(0, setting.find('=')))) description += '\n' + setting;
    return description;
}

SavedState Session::save() const {
    std::ostringstream text;
    m_integrator->writeCheckpoint(text);
    return {describeWhatMoves(), m_begun, text.str(), m_warnings->save(), m_energyBefore};
}

void Session::restore(const SavedState& saved) {
    if (saved.model != describeWhatMoves())
        throw std::invalid_argument(
            "restore() takes what save() returned for the same model; this is of another model, or "
            "from before a change()");
    std::unique_ptr<ImplicitIntegrator> integrator = makeIntegrator(*m_model);
    std::istringstream text(saved.integrator);
    const State begun = makeFresh(saved.begun);
    integrator->readCheckpoint(text, begun);
    m_integrator = std::move(integrator);
    m_begun = begun;
    m_warnings->restore(saved.warnings);
    m_energyBefore = saved.energyBefore;
    forgetFrom(getTime());
    recordRow();
}

std::string Session::pack(SavedState saved) const {
    Archive archive;
    visitSaved(archive, *m_model, saved);
    return archive.getBytes();
}

SavedState Session::unpack(const std::string& bytes) const {
    Archive archive(bytes);
    SavedState saved;
    saved.model = describeWhatMoves();
    saved.begun = m_model->makeInitialState();
    visitSaved(archive, *m_model, saved);
    archive.requireEnd();
    return saved;
}

void Session::keepState(const std::string& path) const {
    writeKeptState(path, *m_model, getState());
}

void Session::restoreState(const std::string& path) {
    start(readKeptState(path, *m_model), Joints::Closed);
    forgetFrom(getTime());
    recordRow();
}

void Session::forgetFrom(double time) {
    while (!m_record.time.empty() && m_record.time.back() >= time) {
        m_record.time.pop_back();
        m_record.rows.pop_back();
    }
    while (!m_path.empty() && m_path.back().getTime() >= time) m_path.pop_back();
}

void Session::goOnFrom(const Session& other) {
    start(other.getState());
    const auto isSame = [](const Probe& a, const Probe& b) {
        return a.name == b.name && a.unit == b.unit && a.columns == b.columns;
    };
    const std::vector<Probe>&mine = getProbes(), &others = other.getProbes();
    m_path.clear();
    m_record = {};
    if (!std::equal(mine.begin(), mine.end(), others.begin(), others.end(), isSame))
        return recordRow();
    m_warnings->restore(other.m_warnings->save());
    m_record = other.m_record;
    m_uDot = m_integrator->getUDot();
    m_multipliers = m_integrator->getMultipliers();
}

//-------------------------------------------------------------------------------------------------
// Motion

void Session::recordRow() {
    m_uDot = m_integrator->getUDot();
    m_multipliers = m_integrator->getMultipliers();
    const std::vector<double> values =
        m_probes.calc({getState(), m_uDot, m_multipliers, double(m_integrator->getWork())});
    m_record.add(getTime(), values);
    m_warnings->check(getState(), values);
    if (m_pathCount++ % m_pathStride) return;
    if (m_path.size() == MostPathStates) {
        dropEverySecond(m_path);
        m_pathStride *= 2;
    }
    m_path.push_back(getState());
}

Session::Outcome Session::step(int numSteps, const Progress& progress) {
    if (numSteps < 0)
        throw std::invalid_argument("step() goes forward, not by " + std::to_string(numSteps) +
                                    " steps");
    endStepsAt(SimTK::Infinity);
    for (int i = 0; i < numSteps; ++i) {
        const double before = getTime();
        ImplicitIntegrator::StepStatus status;
        doWithLaws(*m_model, [&] { status = m_integrator->stepOnce(); });
        checkMotions(m_model->getFile(), before, getTime());
        recordRow();
        if (status == ImplicitIntegrator::StepStatus::Terminated) return Outcome::Terminated;
        if (progress && !progress(double(i + 1) / numSteps)) return Outcome::Stopped;
    }
    return Outcome::ReachedTime;
}

void Session::endStepsAt(double time) {
    if (m_model->getInputs().empty()) return;
    // The last step may already have passed this time.
    m_integrator->setFinalTime(m_integrator->isStateInterpolated() ? SimTK::Infinity : time);
}

Session::Outcome Session::runTo(double time, double interval, const Progress& progress) {
    const double begin = getTime(), span = time - begin;
    if (!(span > 0) || !std::isfinite(span) || !(interval > 0))
        throw std::invalid_argument("runTo() from t = " + writeGeneral(begin, 6) + " s to " +
                                    writeGeneral(time, 6) + " s by " + writeGeneral(interval, 6) +
                                    " s: it needs a later time and a positive interval");
    checkMotions(m_model->getFile(), begin, time);
    endStepsAt(time);
    const auto numRows = std::max(1L, std::lround(std::ceil(span / interval * (1 - 1e-12))));
    for (long row = 1; row <= numRows; ++row) {
        const double next = row == numRows ? time : begin + double(row) * interval;
        while (getTime() < next) {
            // Reports between steps are interpolated, so they do not affect the motion.
            const double h = m_integrator->getLastStepSize();  // 0 before the first step
            const double look = getTime() + (h > 0 ? StepsBetweenLooks * h : 1e-6 * span);
            ImplicitIntegrator::StepStatus status;
            doWithLaws(*m_model, [&] {
                status = m_integrator->stepTo(look > getTime() ? std::min(next, look) : next);
            });
            const bool goesOn = !progress || progress((getTime() - begin) / span);
            if (status == ImplicitIntegrator::StepStatus::Terminated || !goesOn) {
                recordRow();
                return goesOn ? Outcome::Terminated : Outcome::Stopped;
            }
        }
        recordRow();
    }
    return Outcome::ReachedTime;
}

Session::Equilibrium Session::settle(const std::function<bool()>& goesOn) {
    StaticEquilibrium equilibrium(m_model->getSystem());
    equilibrium.setObserver([&] {
        if (goesOn && !goesOn()) throw Cancelled("nothing has changed");
    });
    doWithLaws(*m_model, [&] { equilibrium.solve(copyState()); });
    State state = equilibrium.getState();
    state.updU() = 0;
    setState(state);
    Equilibrium found{equilibrium.getNumIterations(),
                      {},
                      {},
                      equilibrium.isByDampedMotion(),
                      equilibrium.describeBranch()};
    for (const std::string& motion : equilibrium.getFreeMotions())
        found.freeMotions.push_back(motion);
    for (const std::string& motion : equilibrium.getUnstableMotions())
        found.unstableMotions.push_back(motion);
    return found;
}

LinearSystem Session::linearize(const std::vector<std::string>& inputs,
                                const std::vector<std::string>& outputs,
                                const std::function<bool()>& goesOn, const ModalForm& form) const {
    const auto observe = [&] {
        if (goesOn && !goesOn()) throw Cancelled("nothing has changed");
    };
    return linearizeModel(m_text, m_options, m_model, m_probes,
                          findEquilibriumNearby(m_model->getSystem(), copyState(), observe), inputs,
                          outputs, form, observe);
}

//-------------------------------------------------------------------------------------------------
// Quantities

std::vector<double> Session::calcProbe(const Probe& probe) const {
    std::vector<double> values(probe.columns.size());
    probe.calc({getState(), m_uDot, m_multipliers, double(m_integrator->getWork())}, values.data());
    return values;
}

double Session::calcFormula(const std::string& formula) const {
    std::string unused = "formula", quoted;
    while (seekNamed(getProbes(), unused)) unused += '_';
    for (const char letter : formula)
        quoted += letter == '\'' ? std::string("''") : std::string(1, letter);
    ModelText text = m_text;
    text.set("probes." + unused, "{expression: '" + quoted + "'}");
    try {
        const ModelValue entry = readModel(text).get("probes").get(unused);
        const auto find = [&](const ModelValue& law, const std::string& name) {
            if (const Probe* const probe = seekNamed(getProbes(), name)) return *probe;
            law.failUnknown("probe", name, getNames(getProbes()));
        };
        return calcProbe(makeExpressionProbe({m_model, entry}, find))[0];
    } catch (const ModelError& error) {
        // Omit the place, which is in a formula that no user has written.
        for (const ModelError::Mistake& mistake : error.getMistakes())
            if (mistake.key == "probes." + unused + ".expression")
                throw std::invalid_argument(mistake.message);
        throw std::invalid_argument(error.what());
    }
}

std::vector<double> Session::get(const std::string& path) const {
    if (const Probe* probe = seekNamed(getProbes(), path)) return calcProbe(*probe);
    if (const auto quantity = findQuantity(path)) return quantity->get();
    std::vector<std::string> known = listQuantities();
    for (const Probe& probe : getProbes()) known.push_back(probe.name);
    const ModelValue parameters = m_model->getFile().get("parameters");
    for (const std::string& name : parameters.getKeys()) {
        const std::string full = "parameters." + name;
        if (full == normalizePath(path)) return {parameters.get(name).getNumber()};
        known.push_back(full);
    }
    throw std::runtime_error(describeUnknown("quantity", path, known));
}

void Session::set(const std::string& path, const std::vector<double>& values) {
    const auto quantity = findQuantity(path);
    if (!quantity) {
        if (seekNamed(getProbes(), path))
            throw std::runtime_error("'" + path + "' is a probe: it can be read, not set");
        if (path.compare(0, 11, "parameters.") == 0)
            throw std::runtime_error("'" + path + "' is a key of the model: use change()");
        throw std::runtime_error(describeUnknown("quantity", path, listQuantities()));
    }
    for (const double value : values)
        if (!std::isfinite(value))
            throw std::runtime_error("'" + path + "' cannot be set to " + writeGeneral(value));
    if (!quantity->calcStateWith) throw std::runtime_error("'" + path + "' cannot be set");
    const size_t wanted = quantity->get().size();
    if (wanted != values.size())
        throw std::runtime_error("'" + quantity->path + "' has " + std::to_string(wanted) +
                                 (wanted == 1 ? " value" : " values, as in [1, 2, 3]") + ", not " +
                                 std::to_string(values.size()));
    const std::vector<std::string> parts = splitAt(quantity->path, '.');
    if (parts[0] != "inputs") return setState(quantity->calcStateWith(values));
    if (parts.size() == 2) return setInputs({{parts[1], values[0]}});
    const int number = m_model->findInput(parts[1])->state;
    setInputs(
        {{parts[1], m_model->getFlexibleBodies().getStateValue(getState(), number), values[0]}});
}

void Session::setInputs(const std::vector<Input>& inputs) {
    const FlexibleBodySubsystem& flexible = m_model->getFlexibleBodies();
    for (const Input& input : inputs) {
        if (!m_model->findInput(input.name)) {
            std::vector<std::string> known;
            for (const Model::InputEntry& entry : m_model->getInputs()) known.push_back(entry.name);
            throw std::runtime_error(describeUnknown("input", input.name, known));
        }
        if (!std::isfinite(input.value) || !std::isfinite(input.rate))
            throw std::runtime_error("input '" + input.name + "' cannot be set to " +
                                     writeGeneral(input.value) + ", with the rate " +
                                     writeGeneral(input.rate));
    }
    const auto change = [&](State& state) {
        for (const Input& input : inputs) {
            const int number = m_model->findInput(input.name)->state;
            flexible.setStateValue(state, number, input.value);
            flexible.setStateValue(state, number + 1, input.rate);
        }
    };
    if (m_integrator->isStateInterpolated()) {
        State state = copyState();
        change(state);
        return setState(state);
    }
    m_integrator->handle(
        [&](State& state) { return m_model->changeWithEvents(state, [&] { change(state); }); });
    recordRow();
}

bool Session::change(const std::string& key, const std::string& value, Restart restart) {
    ModelText text = m_text;
    text.set(key, value);
    const bool goesOn = restart == Restart::Never || isBesideMotion(key);
    Session changed(text, m_options);
    if (goesOn) changed.goOnFrom(*this);
    *this = std::move(changed);
    return !goesOn;
}

//-------------------------------------------------------------------------------------------------
// Pictures

std::vector<State> Session::getPath() const {
    std::vector<State> path = m_path;
    path.push_back(getState());
    return path;
}

std::unique_ptr<OffscreenVisualizer> Session::makeVisualizer() const {
    std::unique_ptr<OffscreenVisualizer> visualizer = model::makeVisualizer(*m_model);
    visualizer->fitToMotion(getPath());
    return visualizer;
}

}  // namespace simflex
