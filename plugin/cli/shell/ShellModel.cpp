#include "simflex/cli/shell/ShellModel.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "simflex/cli/shell/KeptState.h"
#include "simflex/model/file/KnownTimes.h"

namespace simflex {
namespace cli {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;

namespace {

constexpr size_t kMostSamples = 100000;
constexpr size_t kMostPathStates = 64;
constexpr int kStepsBetweenLooks = 20;  // at Ctrl-C, about

template <class T>
void dropEverySecond(std::vector<T>& items) {
    size_t kept = 0;
    for (size_t i = 0; i < items.size(); i += 2) items[kept++] = std::move(items[i]);
    items.resize(kept);
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

ShellModel::ShellModel(const ModelText& text, const ModelOptions& options)
    : _text(text),
      _model(std::make_shared<const Model>(readModel(text), options)),
      _probes(Probes::make(_model)),
      _start(findStart(*_model)),
      _turns(*_model),
      _warn(options.listener.warn ? options.listener.warn : [](const std::string&) {}) {
    reset();
}

std::string ShellModel::getTitle() const {
    const ModelValue title = _model->getFile().get("title");
    return title.isGiven() ? title.getText()
                           : std::filesystem::path(_text.path).filename().string();
}

Moment ShellModel::makeMoment() const {
    return {getState(), _uDot, _multipliers, _integrator->getWork(), &_turns};
}

double ShellModel::calcEnergy() const {
    _model->getSystem().realize(getState(), Stage::Dynamics);
    return _model->getFlexibleBodies().calcEnergy(getState());
}

void ShellModel::reset() {
    start(_start);
    _warnings = std::make_unique<MotionWarnings>(*_model, _probes, _warn);
    _record = {};
    _path.clear();
    _pathStride = 1;
    _pathCount = 0;
    recordRow();
}

void ShellModel::setState(const State& state) {
    start(state);
    recordRow();
}

void ShellModel::continueFrom(const ShellModel& other) {
    start(other.getState());
    _turns.restore(other._turns.save());
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

void ShellModel::keepState(const std::string& path) const {
    writeKeptState(path, *_model, getState());
}

void ShellModel::restoreState(const std::string& path) {
    const State state = readKeptState(path, *_model);
    start(state);
    while (!_record.time.empty() && _record.time.back() >= state.getTime()) {
        _record.time.pop_back();
        _record.rows.pop_back();
    }
    while (!_path.empty() && _path.back().getTime() >= state.getTime()) _path.pop_back();
    recordRow();
}

State ShellModel::makeFresh(const State& state) const {
    State fresh = _model->makeInitialState();
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

void ShellModel::start(const State& state) {
    std::unique_ptr<ImplicitIntegrator> integrator = makeIntegrator(*_model);
    integrator->initialize(makeFresh(state));
    _integrator = std::move(integrator);
    _energyBefore = calcEnergy();
    _turns.reset();
}

void ShellModel::recordRow() {
    _turns.update(getState());
    _uDot = _integrator->getUDot();
    _multipliers = _integrator->getMultipliers();
    const std::vector<double> values = _probes.calc(makeMoment());
    _record.add(getTime(), values);
    _warnings->check(getState(), values, _turns);
    if (_pathCount++ % _pathStride) return;
    if (_path.size() == kMostPathStates) {
        dropEverySecond(_path);
        _pathStride *= 2;
    }
    _path.push_back(getState());
}

ShellModel::Outcome ShellModel::step(int numSteps, const std::function<bool(double)>& progress) {
    for (int i = 0; i < numSteps; ++i) {
        const double before = getTime();
        const auto status = _integrator->stepOnce();
        checkMotions(_model->getFile(), before, getTime());
        recordRow();
        if (status == ImplicitIntegrator::StepStatus::Terminated) return Outcome::Terminated;
        if (!progress(double(i + 1) / numSteps)) return Outcome::Interrupted;
    }
    return Outcome::ReachedTime;
}

ShellModel::Outcome ShellModel::runTo(double time, double interval,
                                      const std::function<bool(double)>& progress) {
    const double begin = getTime(), span = time - begin;
    checkMotions(_model->getFile(), begin, time);
    const auto numRows = std::max(1L, std::lround(std::ceil(span / interval * (1 - 1e-12))));
    for (long row = 1; row <= numRows; ++row) {
        const double next = row == numRows ? time : begin + double(row) * interval;
        while (getTime() < next) {
            // Reports between steps are interpolated: the motion does not depend on them.
            const double h = _integrator->getLastStepSize();  // 0 before the first step
            const double look = getTime() + (h > 0 ? kStepsBetweenLooks * h : 1e-6 * span);
            const auto status = _integrator->stepTo(look > getTime() ? std::min(next, look) : next);
            const bool goesOn = progress((getTime() - begin) / span);
            if (status == ImplicitIntegrator::StepStatus::Terminated || !goesOn) {
                recordRow();
                return goesOn ? Outcome::Terminated : Outcome::Interrupted;
            }
        }
        recordRow();
    }
    return Outcome::ReachedTime;
}

std::vector<State> ShellModel::getPath() const {
    std::vector<State> path = _path;
    path.push_back(getState());
    return path;
}

}  // namespace cli
}  // namespace simflex
