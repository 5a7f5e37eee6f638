#pragma once
/** @file
One transient analysis: rows of probes at regular times, States for pictures, checkpoints. **/

#include <chrono>
#include <memory>

#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/probes/TurnCounter.h"
#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {
namespace model {

class TransientRun {
public:
    /** @param analysis  its entry in the model file **/
    TransientRun(ModelRun& run, const ModelValue& analysis);

    /** Begins at a State. **/
    void start(const SimTK::State& state);
    /** Goes on where the checkpoint was written. **/
    void resume(const SimTK::State& start, const RunCheckpoint& checkpoint);

    /** @throws Cancelled, std::runtime_error. What was recorded stays. **/
    void perform();

private:
    using Clock = std::chrono::steady_clock;

    double calcRowTime(int row) const;
    double calcFrameTime(int frame) const;
    void advance(double time);
    bool watchStep(double time);
    void takeRow(double time);
    /** Names the analysis; the rows so far are kept. **/
    [[noreturn]] void failWith(const std::exception& error);
    void takeEnergy(const Moment& moment);
    /** Warns if the energy balance does not close. **/
    void checkEnergy();
    void takeFrame();
    void keep();
    void finish();

    ModelRun& _run;
    ModelValue _analysis;
    std::string _name;
    double _reached = 0;  ///< by the last internal step
    double _startTime = 0, _duration = 0, _interval = 0;
    double _frameInterval = 0;  ///< 0: no pictures
    double _checkpointInterval = 0;
    int _lastRow = 0, _lastFrame = -1;
    bool _keepsStates = true;

    std::unique_ptr<ImplicitIntegrator> _integrator;
    TurnCounter _turns;
    MotionWarnings _warnings;
    RunCheckpoint _progress;
    Clock::time_point _kept;
};

}  // namespace model
}  // namespace simflex
