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
#include "simflex/model/results/ResultLayout.h"

namespace simflex {
namespace model {

using SimTK::State;
using SimTK::Vector;

namespace {

constexpr int UsualRows = 200;
constexpr double WholeInterval = 1e-9;  // relative tolerance
constexpr int MostRows = 100'000'000;

// In a default run, step errors leave some 1e-4 of the energy, and numerical damping of unresolved
// vibrations some 1e-3.
constexpr double LargestImbalance = 0.01;
// For the energy that an error within the position accuracy causes: weight times accuracy.
constexpr double EarthsGravity = 9.81;
constexpr double EnergyRoundOff = 1e-9;
/** Relative loss of a given initial speed. **/
constexpr double LostSpeed = 1e-3;

/** Number of intervals that cover a duration; the last may be shorter. **/
int countIntervals(double duration, double interval, const ModelValue& where) {
    const double count = std::ceil(duration / interval - WholeInterval * (duration / interval));
    if (count > MostRows)
        where.fail("gives more than " + std::to_string(MostRows) + " rows of output");
    return std::max(1, int(count));
}

}  // namespace

TransientRun::TransientRun(ModelRun& run, const ModelValue& analysis)
    : m_run(run),
      m_analysis(analysis),
      m_name(analysis.getName()),
      m_duration(analysis.get("duration").getNumber()),
      m_warnings(*run.m_model, run.m_probes,
                 [this](const std::string& message) { m_run.warn(m_name, message); }),
      m_kept(Clock::now()) {
    const ModelValue interval = analysis.get("interval");
    m_interval = interval.isGiven() ? interval.getNumber() : m_duration / UsualRows;
    if (m_interval > m_duration) {
        std::ostringstream text;
        text << m_interval << " s is longer than the duration, " << m_duration
             << " s; for results at the start and the end only, give the duration itself";
        interval.fail(text.str());
    }
    m_lastRow = countIntervals(m_duration, m_interval, interval.isGiven() ? interval : analysis);
    const ModelValue output = run.m_model->getFile().get("output");
    if (output.get("states").getText() != "none") m_states.emplace(*run.m_model);
    m_checkpointInterval = output.get("checkpoint").getNumber();

    const ModelValue pictures = run.m_model->getFile().get("pictures");
    if (run.m_options.drawsPictures && pictures.isGiven()) {
        m_frameInterval =
            1 / (pictures.get("rate").getNumber() * pictures.get("slow_motion").getNumber());
        m_lastFrame = countIntervals(m_duration, m_frameInterval, pictures.get("rate"));
        if (m_frameInterval > m_duration)
            run.warn(m_name, "pictures: rate and slow_motion make one every " +
                                 writeGeneral(m_frameInterval, 4) +
                                 " s, so there are only those of the start and the end");
    }
    m_watchesElements = m_warnings.hasElementsWithRange();
    m_integrator = makeIntegrator(*run.m_model);
    // Limit the step so that events between two rows are seen.
    const ModelValue solver = run.m_model->getFile().get("solver");
    if (!solver.get("maximum_step").isGiven() && !solver.get("fixed_step").isGiven()) {
        const ModelValue shortest = solver.get("minimum_step"), first = solver.get("initial_step");
        m_integrator->setMaximumStepSize(std::max({run.m_options.longestStep * m_interval,
                                                   shortest.isGiven() ? shortest.getNumber() : 0.0,
                                                   first.isGiven() ? first.getNumber() : 0.0}));
    }
    if (run.m_options.threads > 0) m_integrator->setNumThreads(run.m_options.threads);
    m_integrator->setStepObserver([this](SimTK::Real time) { return watchStep(time); });
}

void TransientRun::start(const State& state) {
    m_progress.analysis = m_name;
    m_startTime = state.getTime();
    const double end = m_startTime + m_duration;
    if (!(std::abs(m_startTime) <= LargestTime && std::abs(end) <= LargestTime))
        m_analysis.fail("goes from " + writeGeneral(m_startTime, 6) + " s to " +
                        writeGeneral(end, 6) + " s; times are at most " +
                        writeGeneral(LargestTime, 6) + " s");
    if (!(m_startTime + m_interval > m_startTime && end - m_interval < end))
        m_analysis.fail("its interval of " + writeGeneral(m_interval, 6) +
                        " s is lost in the round-off of times from " +
                        writeGeneral(m_startTime, 6) + " s to " + writeGeneral(end, 6) + " s");
    checkMotions(m_run.m_model->getFile(), m_startTime, m_startTime + m_duration);
    m_run.m_model->forgetLawFailure();
    try {
        m_integrator->initialize(state);
    } catch (const std::exception& error) {
        if (m_run.m_model->getLawFailure().empty()) throw;
        throw std::runtime_error("analysis '" + m_name +
                                 "': " + explainFailure(*m_run.m_model, error.what()));
    }
    warnOfStart(state);
    m_redundant = m_integrator->getRedundantConstraints();
    const Moment moment{m_integrator->getState(), m_integrator->getUDot(),
                        m_integrator->getMultipliers(), 0};
    m_progress.energy.balanceAtStart = calcEnergy(*m_run.m_model, moment, "balance");
    m_progress.energy.potentialAtStart = calcEnergy(*m_run.m_model, moment, "potential");
}

void TransientRun::warnOfStart(const State& given) {
    const State& state = m_integrator->getState();
    for (const std::string& event : m_run.m_model->findEventsThatHold(state))
        m_run.warn(m_name, "event '" + event +
                               "': its condition is true from the start; it will happen when the "
                               "condition becomes true again");
    const ModelValue bodies = m_run.m_model->getFile().get("initial").get("bodies");
    for (const Model::BodyEntry& body : m_run.m_model->getBodies()) {
        if (!bodies.has(body.name)) continue;
        const Vector wanted = body.mobod.getUAsVector(given),
                     found = body.mobod.getUAsVector(state);
        if (!((found - wanted).normInf() > LostSpeed * wanted.normInf())) continue;
        std::ostringstream text;
        text << "initial.bodies." << body.name
             << ": joints do not let it move as given; its mobilizer "
             << "begins with speeds " << found << " instead of " << wanted
             << ". Give all bodies that move together their speeds, or a joint its rate "
                "(initial.rates)";
        m_run.warn(m_name, text.str());
    }
    warnOfUnseenSwitches(state);
}

/** See Stepper::calcSwitchError(). **/
void TransientRun::warnOfUnseenSwitches(const State& state) {
    const std::string rubbing = nameRubbingJoints(*m_run.m_model);
    const auto& bodies = m_run.m_model->getBodies();
    const bool bends = std::any_of(bodies.begin(), bodies.end(), [&](const auto& body) {
        return body.flexible && !body.flexible->isRigid(state);
    });
    const ModelValue solver = m_run.m_model->getFile().get("solver");
    if (rubbing.empty() || !bends || solver.get("method").getText() != "radau") return;
    m_run.warn(m_name,
               "where parts bend, radau steps over the instants at which " + rubbing +
                   " begins to stick or to slide: friction may exceed its limit in single rows, "
                   "and its error does not fall with the accuracy; 'solver: {method: bdf}' "
                   "locates them");
}

void TransientRun::resume(const State& start, const RunCheckpoint& checkpoint) {
    m_progress = checkpoint;
    m_startTime = start.getTime();
    std::istringstream text(checkpoint.integrator);
    m_integrator->readCheckpoint(text, start);
    m_warnings.restore(checkpoint.warnings);
    std::ostringstream note;
    note << "analysis '" << m_name << "' continues at t = " << m_integrator->getTime() << " of "
         << m_startTime + m_duration << " s";
    m_run.m_options.listener.tellNote(note.str());
    m_run.m_options.listener.tellProgress(m_name,
                                          (m_integrator->getTime() - m_startTime) / m_duration);
}

double TransientRun::calcRowTime(int row) const {
    return row == m_lastRow ? m_startTime + m_duration : m_startTime + row * m_interval;
}

double TransientRun::calcFrameTime(int frame) const {
    return std::min(m_startTime + frame * m_frameInterval, m_startTime + m_duration);
}

void TransientRun::perform() {
    while (m_progress.numRows <= m_lastRow || int(m_progress.frames.size()) <= m_lastFrame) {
        const int frame = int(m_progress.frames.size());
        const double rowTime =
            m_progress.numRows <= m_lastRow ? calcRowTime(m_progress.numRows) : SimTK::Infinity;
        const double frameTime = frame <= m_lastFrame ? calcFrameTime(frame) : SimTK::Infinity;
        if (!advance(std::min(rowTime, frameTime))) {
            if (m_lastFrame >= 0) takeFrame();
            takeRow(m_integrator->getTime());
            break;
        }
        if (frameTime <= rowTime) takeFrame();
        if (rowTime <= frameTime) try {
                takeRow(rowTime);
            } catch (const std::exception& error) {
                failWith(error);
            }
        if (m_checkpointInterval > 0 &&
            std::chrono::duration<double>(Clock::now() - m_kept).count() > m_checkpointInterval)
            keep();
    }
    finish();
}

void TransientRun::writeEvents() {
    std::vector<Results::Analysis::Event> events;
    for (size_t i = 0; i < m_progress.events.size(); ++i)
        events.push_back({m_progress.events[i], m_progress.eventTimes[i]});
    if (!events.empty()) m_run.m_writer->setEvents(m_name, events);
}

void TransientRun::failWith(const std::exception& error) {
    noteEvents();
    writeEvents();
    m_run.m_writer->flush();
    throw std::runtime_error("analysis '" + m_name +
                             "': " + explainFailure(*m_run.m_model, error.what()) +
                             "; the rows before stay in '" + m_run.m_resultPath + "'");
}

bool TransientRun::advance(double time) {
    if (time <= m_integrator->getTime()) return true;
    ImplicitIntegrator::StepStatus status;
    try {
        status = m_integrator->stepTo(time);
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception& error) {
        failWith(error);
    }
    noteEvents();
    if (status == ImplicitIntegrator::StepStatus::Terminated) return false;
    if (status != ImplicitIntegrator::StepStatus::Interrupted) return true;
    writeEvents();
    keep();
    std::ostringstream text;
    text << "analysis '" << m_name << "' has reached t = " << m_reached << " of "
         << m_startTime + m_duration << " s, which '" << m_run.m_resultPath
         << "' holds; continue with: " << m_run.m_options.resumeCommand;
    throw Cancelled(text.str());
}

void TransientRun::noteEvents() {
    for (const auto& [event, time] : m_run.m_model->takeOccurrences()) {
        m_progress.events.push_back(event);
        m_progress.eventTimes.push_back(time);
    }
    constexpr int MostTold = 3;
    for (const std::string& warning : m_run.m_model->takeEventWarnings())
        if (++m_numEventWarnings <= MostTold)
            m_run.warn(m_name, warning + (m_numEventWarnings < MostTold
                                              ? ""
                                              : " (and so on: no more of these are told)"));
}

bool TransientRun::watchStep(double time) {
    m_reached = time;
    m_run.m_model->forgetLawFailure();
    if (m_watchesElements) m_warnings.checkElements(m_integrator->showAdvancedState());
    return m_run.m_options.listener.tellProgress(m_name, (time - m_startTime) / m_duration, [&] {
        char text[120];
        std::snprintf(text, sizeof text, "t = %.5g s, h = %.2g s, order %d", time,
                      double(m_integrator->getLastStepSize()), m_integrator->getLastOrder());
        const std::string source = m_integrator->getErrorSource();
        return text + (source.empty() ? "" : ", limited by '" + source + "'");
    });
}

void TransientRun::takeRow(double time) {
    const Clock::time_point begun = Clock::now();
    const State& state = m_integrator->getState();
    const Moment moment{state, m_integrator->getUDot(), m_integrator->getMultipliers(),
                        m_integrator->getWork()};
    takeEnergy(moment);
    const std::vector<double> values = m_run.m_probes.calc(moment);
    m_warnings.check(state, values);
    // If a step ends close by, the State's own time may be later by round-off.
    m_run.m_writer->addRow(time, values, m_states ? m_states->pack(moment) : std::vector<double>());
    ++m_progress.numRows;
    m_progress.outputSeconds += secondsSince(begun);
}

void TransientRun::takeEnergy(const Moment& moment) {
    RunCheckpoint::Energy& energy = m_progress.energy;
    const double kinetic = calcEnergy(*m_run.m_model, moment, "kinetic");
    const double potential = calcEnergy(*m_run.m_model, moment, "potential");
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
    const RunCheckpoint::Energy& energy = m_progress.energy;
    const double exchanged =
        std::max({energy.largestKinetic, energy.largestPotentialChange, energy.largestWork});
    double weight = 0;
    for (const Model::BodyEntry& body : m_run.m_model->getBodies())
        weight += EarthsGravity * body.mobod.getBodyMass(m_integrator->getState());
    const double accuracy = m_run.m_model->getFile().get("solver").get("accuracy").getNumber();
    const double roundOff = EnergyRoundOff * std::abs(energy.balanceAtStart);
    const double unseen = std::max(weight * accuracy, roundOff);
    if (!(energy.largestError > LargestImbalance * exchanged + unseen)) return;
    std::ostringstream text;
    text << "the energy balance is off by " << energy.largestError
         << " J, at t = " << energy.timeOfError << " s, where no more than " << exchanged
         << " J was ever exchanged (kinetic energy up to " << energy.largestKinetic
         << " J, potential and strain energy changed by up to " << energy.largestPotentialChange
         << " J, work of loads, motions and dampers up to " << energy.largestWork
         << " J): the results are wrong by as much. Try a finer solver.accuracy (now " << accuracy
         << " m) or a shorter solver.maximum_step until it closes";
    m_run.warn(m_name, text.str());
}

void TransientRun::takeFrame() {
    const Clock::time_point begun = Clock::now();
    const State& state = m_integrator->getState();
    m_progress.frames.push_back({state.getTime(), toNumbers(state.getQ()), toNumbers(state.getU()),
                                 toNumbers(state.getZ()),
                                 toNumbers(m_run.m_model->getFlexibleBodies().getHolding(state))});
    m_progress.outputSeconds += secondsSince(begun);
}

void TransientRun::keep() {
    m_run.m_writer->flush();
    std::ostringstream text;
    m_integrator->writeCheckpoint(text);
    m_progress.integrator = text.str();
    m_progress.warnings = m_warnings.save();
    writeRunCheckpoint(m_run.getCheckpointPath(), m_progress);
    m_kept = Clock::now();
}

void TransientRun::finish() {
    checkEnergy();
    const IntegratorStatistics& statistics = m_integrator->getStatistics();
    std::map<std::string, double> kept{
        {"steps", double(statistics.stepsTaken)},
        {"newton_iterations", double(statistics.newtonIterations)},
        {"error_test_failures", double(statistics.errorTestFailures)},
        {"convergence_failures",
         double(statistics.convergenceFailures + statistics.projectionFailures +
                statistics.nonFiniteFailures)},
        {"factorizations", double(statistics.factorizations)},
        {"redundant_constraints", double(statistics.redundantConstraints)},
        {"largest_energy_error", m_progress.energy.largestError},
        {"largest_kinetic_energy", m_progress.energy.largestKinetic},
        {"integration_seconds", statistics.totalSeconds - statistics.outputSeconds},
        {"output_seconds", statistics.outputSeconds + m_progress.outputSeconds}};
    const FmuCost fmus = m_run.takeFmuCost();
    if (fmus.exchanges > 0) {
        kept["fmu_exchanges"] = fmus.exchanges;
        kept["fmu_seconds"] = fmus.seconds;
        kept["fmu_library_seconds"] = fmus.librarySeconds;
    }
    m_run.m_writer->setStatistics(m_name, kept);
    writeEvents();
    m_run.m_ends[m_name] = m_integrator->getState();
    // Events may have released or locked joints since the start.
    for (const std::string& line : m_integrator->getRedundantConstraints())
        m_redundant.push_back(line);
    std::sort(m_redundant.begin(), m_redundant.end());
    m_redundant.erase(std::unique(m_redundant.begin(), m_redundant.end()), m_redundant.end());
    for (const std::string& line : m_redundant) m_run.m_remarks[m_name].push_back(line);
    if (m_lastFrame >= 0) {
        // Drawing can be interrupted, too.
        keep();
        Results::Analysis rows;
        if (m_run.m_model->getFile().get("pictures").get("plots").isGiven())
            rows = readResults(m_run.m_resultPath, ReadStates::No).findAnalysis(m_name);
        rows.name = m_name;
        m_run.m_remarks[m_name].push_back(
            drawFrames(*m_run.m_model, m_progress.frames, rows, m_run.getUsualFolder(),
                       m_run.m_options.listener, m_run.m_options.resumeCommand));
    }
    m_run.m_writer->setComplete(m_name);
    removeRunCheckpoint(m_run.getCheckpointPath());
}

}  // namespace model
}  // namespace simflex
