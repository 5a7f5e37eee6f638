#include "simflex/model/analyses/TransientRun.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/file/KnownTimes.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

using SimTK::State;
using SimTK::Vector;

namespace {

constexpr int kUsualRows = 200;
constexpr double kWholeInterval = 1e-9;  // of the number of intervals
constexpr int kMostRows = 100'000'000;

// A step's error leaves some 1e-4 of the energy in a default run, numerical damping of vibrations
// that the steps do not resolve some 1e-3.
constexpr double kLargestImbalance = 0.01;
// What the accuracy of positions cannot show: the weight's work along it.
constexpr double kEarthsGravity = 9.81;
constexpr double kEnergyRoundOff = 1e-9;

/** Number of intervals that cover a duration; the last may be shorter. **/
int countIntervals(double duration, double interval, const ModelValue& where) {
    const double count = std::ceil(duration / interval - kWholeInterval * (duration / interval));
    if (count > kMostRows)
        where.fail("gives more than " + std::to_string(kMostRows) + " rows of output");
    return std::max(1, int(count));
}

}  // namespace

TransientRun::TransientRun(ModelRun& run, const ModelValue& analysis)
    : _run(run),
      _analysis(analysis),
      _name(analysis.getName()),
      _duration(analysis.get("duration").getNumber()),
      _turns(*run._model),
      _warnings(*run._model, run._probes,
                [this](const std::string& message) { _run.warn(_name, message); }),
      _kept(Clock::now()) {
    const ModelValue interval = analysis.get("interval");
    _interval = interval.isGiven() ? interval.getNumber() : _duration / kUsualRows;
    if (_interval > _duration) {
        std::ostringstream text;
        text << _interval << " s is longer than the duration, " << _duration
             << " s; for results of the start and the end only give the duration itself";
        interval.fail(text.str());
    }
    _lastRow = countIntervals(_duration, _interval, interval.isGiven() ? interval : analysis);
    const ModelValue output = run._model->getFile().get("output");
    _keepsStates = output.get("states").getText() != "none";
    _checkpointInterval = output.get("checkpoint").getNumber();

    const ModelValue pictures = run._model->getFile().get("pictures");
    if (run._options.drawsPictures && pictures.isGiven()) {
        _frameInterval =
            1 / (pictures.get("rate").getNumber() * pictures.get("slow_motion").getNumber());
        _lastFrame = countIntervals(_duration, _frameInterval, pictures.get("rate"));
        if (_frameInterval > _duration)
            run.warn(_name, "pictures: rate and slow_motion make one every " +
                                writeGeneral(_frameInterval, 4) +
                                " s, so there are only those of the start and the end");
    }
    _integrator = makeIntegrator(*run._model);
    // What happens between two rows is to be seen.
    const ModelValue solver = run._model->getFile().get("solver");
    if (!solver.get("maximum_step").isGiven() && !solver.get("fixed_step").isGiven()) {
        const ModelValue shortest = solver.get("minimum_step"), first = solver.get("initial_step");
        _integrator->setMaximumStepSize(std::max({run._options.longestStep * _interval,
                                                  shortest.isGiven() ? shortest.getNumber() : 0.0,
                                                  first.isGiven() ? first.getNumber() : 0.0}));
    }
    if (run._options.threads > 0) _integrator->setNumThreads(run._options.threads);
    _integrator->setStepObserver([this](SimTK::Real time) { return watchStep(time); });
}

void TransientRun::start(const State& state) {
    _progress.inputs = calcInputChecksums(*_run._model);
    _progress.analysis = _name;
    _startTime = state.getTime();
    checkMotions(_run._model->getFile(), _startTime, _startTime + _duration);
    _integrator->initialize(state);
    const Moment moment{_integrator->getState(), _integrator->getUDot(),
                        _integrator->getMultipliers(), 0};
    _progress.energy.balanceAtStart = calcEnergy(*_run._model, moment, "balance");
    _progress.energy.potentialAtStart = calcEnergy(*_run._model, moment, "potential");
}

void TransientRun::resume(const State& start, const RunCheckpoint& checkpoint) {
    _progress = checkpoint;
    _startTime = start.getTime();
    std::istringstream text(checkpoint.integrator);
    _integrator->readCheckpoint(text, start);
    _turns.restore(checkpoint.turns);
    _warnings.restore(checkpoint.warnings);
    std::ostringstream note;
    note << "analysis '" << _name << "' goes on at t = " << _integrator->getTime() << " of "
         << _startTime + _duration << " s";
    _run._options.listener.tellNote(note.str());
    _run._options.listener.tellProgress(_name, (_integrator->getTime() - _startTime) / _duration);
}

double TransientRun::calcRowTime(int row) const {
    return row == _lastRow ? _startTime + _duration : _startTime + row * _interval;
}

double TransientRun::calcFrameTime(int frame) const {
    return std::min(_startTime + frame * _frameInterval, _startTime + _duration);
}

void TransientRun::perform() {
    while (_progress.numRows <= _lastRow || int(_progress.frames.size()) <= _lastFrame) {
        const int frame = int(_progress.frames.size());
        const double rowTime =
            _progress.numRows <= _lastRow ? calcRowTime(_progress.numRows) : SimTK::Infinity;
        const double frameTime = frame <= _lastFrame ? calcFrameTime(frame) : SimTK::Infinity;
        advance(std::min(rowTime, frameTime));
        if (frameTime <= rowTime) takeFrame();
        if (rowTime <= frameTime) try {
                takeRow(rowTime);
            } catch (const std::exception& error) {
                failWith(error);
            }
        if (_checkpointInterval > 0 &&
            std::chrono::duration<double>(Clock::now() - _kept).count() > _checkpointInterval)
            keep();
    }
    finish();
}

void TransientRun::failWith(const std::exception& error) {
    _run._writer->flush();
    throw std::runtime_error("analysis '" + _name + "': " + nameBodies(*_run._model, error.what()) +
                             "; the rows before stay in '" + _run._resultPath + "'");
}

void TransientRun::advance(double time) {
    if (time <= _integrator->getTime()) return;
    ImplicitIntegrator::StepStatus status;
    try {
        status = _integrator->stepTo(time);
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception& error) {
        failWith(error);
    }
    if (status != ImplicitIntegrator::StepStatus::Interrupted) return;
    keep();
    std::ostringstream text;
    text << "analysis '" << _name << "' has reached t = " << _reached << " of "
         << _startTime + _duration << " s, which '" << _run._resultPath
         << "' holds; go on with: " << _run._options.resumeCommand;
    throw Cancelled(text.str());
}

bool TransientRun::watchStep(double time) {
    _reached = time;
    return _run._options.listener.tellProgress(_name, (time - _startTime) / _duration, [&] {
        char text[120];
        std::snprintf(text, sizeof text, "t = %.5g s, h = %.2g s, order %d", time,
                      double(_integrator->getLastStepSize()), _integrator->getLastOrder());
        const std::string source = nameBodies(*_run._model, _integrator->getErrorSource());
        return text + (source.empty() ? "" : ", limited by '" + source + "'");
    });
}

void TransientRun::takeRow(double time) {
    const Clock::time_point begun = Clock::now();
    const State& state = _integrator->getState();
    _turns.update(state);
    const Moment moment{state, _integrator->getUDot(), _integrator->getMultipliers(),
                        _integrator->getWork(), &_turns};
    takeEnergy(moment);
    const std::vector<double> values = _run._probes.calc(moment);
    _warnings.check(state, values, _turns);
    // The State's own time may be later by round-off, where a step ends close by.
    _run._writer->addRow(time, values,
                         _keepsStates ? toNumbers(state.getQ()) : std::vector<double>(),
                         _keepsStates ? toNumbers(state.getU()) : std::vector<double>());
    ++_progress.numRows;
    _progress.outputSeconds += secondsSince(begun);
}

void TransientRun::takeEnergy(const Moment& moment) {
    RunCheckpoint::Energy& energy = _progress.energy;
    const double kinetic = calcEnergy(*_run._model, moment, "kinetic");
    const double potential = calcEnergy(*_run._model, moment, "potential");
    const double error = std::abs(kinetic + potential - moment.work - energy.balanceAtStart);
    energy.largestKinetic = std::max(energy.largestKinetic, kinetic);
    energy.largestPotentialChange =
        std::max(energy.largestPotentialChange, std::abs(potential - energy.potentialAtStart));
    energy.largestWork = std::max(energy.largestWork, std::abs(moment.work));
    if (!(error > energy.largestError)) return;
    energy.largestError = error;
    energy.timeOfError = moment.state.getTime();
}

void TransientRun::checkEnergy() {
    const RunCheckpoint::Energy& energy = _progress.energy;
    const double exchanged =
        std::max({energy.largestKinetic, energy.largestPotentialChange, energy.largestWork});
    double weight = 0;
    for (const Model::BodyEntry& body : _run._model->getBodies())
        weight += kEarthsGravity * body.mobod.getBodyMass(_integrator->getState());
    const double accuracy = _run._model->getFile().get("solver").get("accuracy").getNumber();
    const double roundOff = kEnergyRoundOff * std::abs(energy.balanceAtStart);
    const double unseen = std::max(weight * accuracy, roundOff);
    if (!(energy.largestError > kLargestImbalance * exchanged + unseen)) return;
    std::ostringstream text;
    text << "the energy balance is off by " << energy.largestError
         << " J, at t = " << energy.timeOfError << " s, where no more than " << exchanged
         << " J was ever exchanged (kinetic energy up to " << energy.largestKinetic
         << " J, potential and strain energy changed by up to " << energy.largestPotentialChange
         << " J, work of loads, motions and dampers up to " << energy.largestWork
         << " J): the results are wrong by as much. Try a finer solver.accuracy (now " << accuracy
         << " m) or a shorter solver.maximum_step until it closes";
    _run.warn(_name, text.str());
}

void TransientRun::takeFrame() {
    const Clock::time_point begun = Clock::now();
    const State& state = _integrator->getState();
    _progress.frames.push_back({state.getTime(), toNumbers(state.getQ()), toNumbers(state.getU())});
    _progress.outputSeconds += secondsSince(begun);
}

void TransientRun::keep() {
    _run._writer->flush();
    std::ostringstream text;
    _integrator->writeCheckpoint(text);
    _progress.integrator = text.str();
    _progress.turns = _turns.save();
    _progress.warnings = _warnings.save();
    writeRunCheckpoint(_run.getCheckpointPath(), _progress);
    _kept = Clock::now();
}

void TransientRun::finish() {
    checkEnergy();
    const IntegratorStatistics& statistics = _integrator->getStatistics();
    _run._writer->setStatistics(
        _name, {{"steps", double(statistics.stepsTaken)},
                {"newton_iterations", double(statistics.newtonIterations)},
                {"error_test_failures", double(statistics.errorTestFailures)},
                {"convergence_failures",
                 double(statistics.convergenceFailures + statistics.projectionFailures +
                        statistics.nonFiniteFailures)},
                {"factorizations", double(statistics.factorizations)},
                {"redundant_constraints", double(statistics.redundantConstraints)},
                {"largest_energy_error", _progress.energy.largestError},
                {"largest_kinetic_energy", _progress.energy.largestKinetic},
                {"integration_seconds", statistics.totalSeconds - statistics.outputSeconds},
                {"output_seconds", statistics.outputSeconds + _progress.outputSeconds}});
    _run._ends[_name] = _integrator->getState();
    std::vector<std::string> redundant = _integrator->getRedundantConstraints();
    std::sort(redundant.begin(), redundant.end());
    for (const std::string& line : redundant)
        _run._remarks[_name].push_back(nameBodies(*_run._model, line));
    if (_lastFrame >= 0) {
        // Drawing can be stopped as well.
        keep();
        Results::Analysis rows;
        if (_run._model->getFile().get("pictures").get("plots").isGiven())
            rows = readResults(_run._resultPath, ReadStates::No).findAnalysis(_name);
        rows.name = _name;
        _run._remarks[_name].push_back(drawFrames(*_run._model, _progress.frames, rows,
                                                  _run.getUsualFolder(), _run._options.listener,
                                                  _run._options.resumeCommand));
    }
    _run._writer->setComplete(_name);
    removeRunCheckpoint(_run.getCheckpointPath());
}

}  // namespace model
}  // namespace simflex
