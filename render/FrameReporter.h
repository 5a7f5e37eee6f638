#pragma once
/** @file
Writes a picture at regular times of a simulation, as SimTK::Visualizer::Reporter shows one: of a
State that it realizes to Stage::Acceleration.

@code
    simflex::OffscreenVisualizer viz(system);
    system.addEventReporter(new simflex::FrameReporter(viz, 1.0 / 30));
@endcode

Then deformations are drawn as they are. Where they are to be exaggerated, the camera should see all
of the run and one range of colours should suit it, frames have to wait for its end:

@code
    auto* reporter = new simflex::FrameReporter(viz, 1.0 / 30);
    reporter->setFitToRun(true);
    system.addEventReporter(reporter);
    // ... simulate
    reporter->finish();
@endcode **/

#include "Simbody.h"
#include "simflex/render/MotionRecorder.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

class FrameReporter : public SimTK::PeriodicEventReporter {
public:
    /** Frames go to the visualizer's output folder, one every `reportInterval` of simulation time.
    The System takes over the reporter; the visualizer may go out of scope. **/
    explicit FrameReporter(const OffscreenVisualizer& visualizer,
                           SimTK::Real reportInterval = SimTK::Infinity);

    /** With a visualizer of its own, all settings at their defaults. **/
    explicit FrameReporter(const SimTK::System& system,
                           SimTK::Real reportInterval = SimTK::Infinity);

    /** Says on standard error when a run was recorded but never drawn. **/
    ~FrameReporter() override;

    const OffscreenVisualizer& getVisualizer() const { return viz; }
    OffscreenVisualizer& updVisualizer() { return viz; }

    /** Whether the run is only recorded until finish() fits the visualizer to it and draws it. **/
    FrameReporter& setFitToRun(bool fit);

    /** How far States are realized before they are drawn. Default: Stage::Acceleration, as
    SimTK::Visualizer::Reporter has it, for generators that show forces, accelerations or reactions.
    Where nothing does, Stage::Position is cheaper: with hundreds of joints on flexible bodies
    Simbody takes seconds for accelerations. **/
    FrameReporter& setStage(SimTK::Stage stage);

    void handleEvent(const SimTK::State& state) const override;

    /** Draws what was recorded, if anything, and completes all frames and videos.
    @throws as OffscreenVisualizer::finish() does. **/
    void finish(const FrameProgress& progress = {});

private:
    OffscreenVisualizer viz;
    bool isFittedToRun = false;
    SimTK::Stage drawnStage = SimTK::Stage::Acceleration;
    mutable MotionRecorder motion;
};

}  // namespace simflex
