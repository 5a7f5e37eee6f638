#include "simflex/model/Session.h"
#include "simflex/base/NumberText.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "simflex/base/Progress.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/file/KnownTimes.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/probes/TurnCounter.h"
#include "simflex/model/session/KeptState.h"
#include "simflex/model/session/Quantities.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {

using namespace model;
using SimTK::Stage;
using SimTK::State;

namespace {

constexpr size_t kMostSamples = 100000;
constexpr size_t kMostPathStates = 64;
constexpr int kStepsBetweenLooks = 20;  // at whether to stop, about

template <class T>
void dropEverySecond(std::vector<T>& items) {
    size_t kept = 0;
    for (size_t i = 0; i < items.size(); i += 2) items[kept++] = std::move(items[i]);
    items.resize(kept);
}

/** Whether a key of the model says how it is computed or shown, not what moves. **/
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
    if (time.size() >= kMostSamples) {
        dropEverySecond(time);
        dropEverySecond(rows);
    }
    time.push_back(now);
    rows.push_back(std::move(values));
}

Session::Session(const ModelText& text, const ModelOptions& options)
    : _text(text),
      _options(options),
      _model(std::make_shared<const Model>(text, options)),
      _probes(Probes::make(_model)),
      _start(findStart(*_model)),
      _turns(std::make_unique<TurnCounter>(*_model)) {
    reset();
    if (_model->getFile().get("initial").get("start").getText() != "static") return;
    const std::string lost = describeLostSpeeds(*_model);
    if (!lost.empty()) _options.listener.tellWarning("the model " + lost);
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

std::string Session::getTitle() const {
    const ModelValue title = _model->getFile().get("title");
    return title.isGiven() ? title.getText()
                           : std::filesystem::path(_text.path).filename().string();
}

double Session::calcEnergy() const {
    return _model->getFlexibleBodies().calcEnergy(getState());
}

//-------------------------------------------------------------------------------------------------
// the State

State Session::makeFresh(const State& state) const {
    State fresh = _model->makeInitialState();
    if (state.getSystemStage() < Stage::Model || state.getNQ() != fresh.getNQ() ||
        state.getNU() != fresh.getNU() || state.getNZ() != fresh.getNZ())
        throw std::invalid_argument("the State is empty, or of another model");
    for (const Model::BodyEntry& body : _model->getBodies()) {
        if (!body.flexible) continue;
        if (body.flexible->isRigid(state))
            body.flexible->setRigid(fresh);
        else
            body.flexible->setFlexible(fresh);
    }
    fresh.setTime(state.getTime());
    fresh.updQ() = state.getQ();
    fresh.updU() = state.getU();
    fresh.updZ() = state.getZ();
    _model->getSystem().realize(fresh, Stage::Velocity);
    return fresh;
}

void Session::start(const State& state, Joints joints) {
    std::unique_ptr<ImplicitIntegrator> integrator = makeIntegrator(*_model);
    const State begun = makeFresh(state);
    integrator->setProjectInitialState(joints == Joints::ToBeClosed);
    integrator->initialize(begun);
    // Closed they were for the parameters of then.
    if (joints == Joints::Closed &&
        integrator->getLargestConstraintError() > integrator->getConstraintToleranceInUse())
        return start(state, Joints::ToBeClosed);
    _integrator = std::move(integrator);
    _begun = begun;
    _energyBefore = calcEnergy();
    _turns->reset();
}

void Session::reset() {
    start(_start);
    _warnings = std::make_unique<MotionWarnings>(
        *_model, _probes,
        [listener = _options.listener](const std::string& text) { listener.tellWarning(text); });
    _record = {};
    _path.clear();
    _pathStride = 1;
    _pathCount = 0;
    recordRow();
}

void Session::setState(const State& state) {
    start(state);
    recordRow();
}

std::string Session::describeWhatMoves() const {
    std::string description = _text.path + '\n' + _text.text;
    for (const std::string& setting : _text.settings)
        if (!isBesideMotion(setting.substr(0, setting.find('=')))) description += '\n' + setting;
    return description;
}

SavedState Session::save() const {
    std::ostringstream text;
    _integrator->writeCheckpoint(text);
    return {describeWhatMoves(), _begun,       text.str(), _turns->save(),
            _warnings->save(),   _energyBefore};
}

void Session::restore(const SavedState& saved) {
    if (saved.model != describeWhatMoves())
        throw std::invalid_argument(
            "restore() wants what save() gave of the same model; this is of another one, or of "
            "before a change()");
    std::unique_ptr<ImplicitIntegrator> integrator = makeIntegrator(*_model);
    std::istringstream text(saved.integrator);
    const State begun = makeFresh(saved.begun);
    integrator->readCheckpoint(text, begun);
    _integrator = std::move(integrator);
    _begun = begun;
    _turns->restore(saved.turns);
    _warnings->restore(saved.warnings);
    _energyBefore = saved.energyBefore;
    forgetFrom(getTime());
    recordRow();
}

void Session::keepState(const std::string& path) const {
    writeKeptState(path, *_model, {getState(), _turns->save()});
}

void Session::restoreState(const std::string& path) {
    const KeptState kept = readKeptState(path, *_model);
    start(kept.state, Joints::Closed);
    _turns->restore(kept.turns);
    forgetFrom(getTime());
    recordRow();
}

void Session::forgetFrom(double time) {
    while (!_record.time.empty() && _record.time.back() >= time) {
        _record.time.pop_back();
        _record.rows.pop_back();
    }
    while (!_path.empty() && _path.back().getTime() >= time) _path.pop_back();
}

void Session::goOnFrom(const Session& other) {
    start(other.getState());
    _turns->restore(other._turns->save());
    _warnings->restore(other._warnings->save());
    const auto isSame = [](const Probe& a, const Probe& b) {
        return a.name == b.name && a.unit == b.unit && a.columns == b.columns;
    };
    const std::vector<Probe>&mine = getProbes(), &others = other.getProbes();
    _path.clear();
    _record = {};
    if (!std::equal(mine.begin(), mine.end(), others.begin(), others.end(), isSame))
        return recordRow();
    _record = other._record;
    _uDot = _integrator->getUDot();
    _multipliers = _integrator->getMultipliers();
}

//-------------------------------------------------------------------------------------------------
// motion

void Session::recordRow() {
    _turns->update(getState());
    _uDot = _integrator->getUDot();
    _multipliers = _integrator->getMultipliers();
    const std::vector<double> values = _probes.calc(
        {getState(), _uDot, _multipliers, double(_integrator->getWork()), _turns.get()});
    _record.add(getTime(), values);
    _warnings->check(getState(), values, *_turns);
    if (_pathCount++ % _pathStride) return;
    if (_path.size() == kMostPathStates) {
        dropEverySecond(_path);
        _pathStride *= 2;
    }
    _path.push_back(getState());
}

Session::Outcome Session::step(int numSteps, const Progress& progress) {
    if (numSteps < 0)
        throw std::invalid_argument("step() goes forward, not by " + std::to_string(numSteps) +
                                    " steps");
    for (int i = 0; i < numSteps; ++i) {
        const double before = getTime();
        const auto status = _integrator->stepOnce();
        checkMotions(_model->getFile(), before, getTime());
        recordRow();
        if (status == ImplicitIntegrator::StepStatus::Terminated) return Outcome::Terminated;
        if (progress && !progress(double(i + 1) / numSteps)) return Outcome::Stopped;
    }
    return Outcome::ReachedTime;
}

Session::Outcome Session::runTo(double time, double interval, const Progress& progress) {
    const double begin = getTime(), span = time - begin;
    if (!(span > 0) || !(interval > 0))
        throw std::invalid_argument("runTo() from t = " + writeGeneral(begin, 6) + " s to " +
                                    writeGeneral(time, 6) + " s by " + writeGeneral(interval, 6) +
                                    " s: it needs a later time and a positive interval");
    checkMotions(_model->getFile(), begin, time);
    const auto numRows = std::max(1L, std::lround(std::ceil(span / interval * (1 - 1e-12))));
    for (long row = 1; row <= numRows; ++row) {
        const double next = row == numRows ? time : begin + double(row) * interval;
        while (getTime() < next) {
            // Reports between steps are interpolated: the motion does not depend on them.
            const double h = _integrator->getLastStepSize();  // 0 before the first step
            const double look = getTime() + (h > 0 ? kStepsBetweenLooks * h : 1e-6 * span);
            const auto status = _integrator->stepTo(look > getTime() ? std::min(next, look) : next);
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
    StaticEquilibrium equilibrium(_model->getSystem());
    equilibrium.setObserver([&] {
        if (goesOn && !goesOn()) throw Cancelled("nothing has changed");
    });
    equilibrium.solve(copyState());
    State state = equilibrium.getState();
    state.updU() = 0;
    setState(state);
    Equilibrium found{equilibrium.getNumIterations(), {}};
    for (const std::string& motion : equilibrium.getFreeMotions())
        found.freeMotions.push_back(nameBodies(*_model, motion));
    return found;
}

//-------------------------------------------------------------------------------------------------
// quantities

std::vector<double> Session::calcProbe(const Probe& probe) const {
    std::vector<double> values(probe.columns.size());
    probe.calc({getState(), _uDot, _multipliers, double(_integrator->getWork()), _turns.get()},
               values.data());
    return values;
}

std::vector<double> Session::get(const std::string& path) const {
    if (const auto quantity = findQuantity(path)) return quantity->get();
    std::vector<std::string> known = listQuantities();
    for (const Probe& probe : getProbes()) {
        if (probe.name == path) return calcProbe(probe);
        known.push_back(probe.name);
    }
    const ModelValue parameters = _model->getFile().get("parameters");
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
            throw std::runtime_error("'" + path + "' is a probe: it tells, and cannot be set");
        if (path.compare(0, 11, "parameters.") == 0)
            throw std::runtime_error("'" + path + "' is a key of the model: change() it");
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
    setState(quantity->calcStateWith(values));
}

bool Session::change(const std::string& key, const std::string& value, Restart restart) {
    ModelText text = _text;
    text.set(key, value);
    const bool goesOn = restart == Restart::Never || isBesideMotion(key);
    Session changed(text, _options);
    if (goesOn) changed.goOnFrom(*this);
    *this = std::move(changed);
    return !goesOn;
}

//-------------------------------------------------------------------------------------------------
// pictures

std::vector<State> Session::getPath() const {
    std::vector<State> path = _path;
    path.push_back(getState());
    return path;
}

std::unique_ptr<OffscreenVisualizer> Session::makeVisualizer() const {
    std::unique_ptr<OffscreenVisualizer> visualizer = model::makeVisualizer(*_model);
    visualizer->setOutputFolder("");
    visualizer->fitToMotion(getPath());
    return visualizer;
}

}  // namespace simflex
