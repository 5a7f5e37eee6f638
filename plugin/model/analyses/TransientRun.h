#pragma once
/** @file
A transient analysis: rows of probes at regular times, States for pictures, and checkpoints. **/

#include <chrono>
#include <memory>
#include <optional>

#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/analyses/StateRows.h"
#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {
namespace model {

class TransientRun {
public:
    /** @param analysis  its entry in the model file **/
    TransientRun(ModelRun& run, const ModelValue& analysis);

    void start(const SimTK::State& state);
    void resume(const SimTK::State& start, const RunCheckpoint& checkpoint);

    /** Columns of the States stored with each row. **/
    std::map<std::string, std::vector<std::string>> getStateColumns() const {
        return m_states ? m_states->getColumns()
                        : std::map<std::string, std::vector<std::string>>();
    }

    /** @throws Cancelled, std::runtime_error. Recorded rows are kept. **/
    void perform();

private:
    using Clock = std::chrono::steady_clock;

    double calcRowTime(int row) const;
    double calcFrameTime(int frame) const;
    /** @returns false if an event has ended the motion. **/
    bool advance(double time);
    void noteEvents();
    void writeEvents();
    bool watchStep(double time);
    /** Warns of initial values of the file that the start does not have. **/
    void warnOfStart(const SimTK::State& given);
    void warnOfUnseenSwitches(const SimTK::State& state);
    void takeRow(double time);
    /** Fails with the name of the analysis; keeps the rows so far. **/
    [[noreturn]] void failWith(const std::exception& error);
    void takeEnergy(const Moment& moment);
    /** Warns if the energy balance does not close. **/
    void checkEnergy();
    void takeFrame();
    void keep();
    void finish();

    ModelRun& m_run;
    ModelValue m_analysis;
    std::string m_name;
    double m_reached = 0;  ///< time of the last internal step
    double m_startTime = 0, m_duration = 0, m_interval = 0;
    double m_frameInterval = 0;  ///< 0: no pictures
    double m_checkpointInterval = 0;
    int m_lastRow = 0, m_lastFrame = -1, m_numEventWarnings = 0;
    std::optional<StateRows> m_states;  ///< empty if States are not stored

    std::unique_ptr<ImplicitIntegrator> m_integrator;
    MotionWarnings m_warnings;
    bool m_watchesElements = false;  ///< at every step
    RunCheckpoint m_progress;
    std::vector<std::string> m_redundant;  ///< redundant constraints at the start
    Clock::time_point m_kept;
};

}  // namespace model
}  // namespace simflex
