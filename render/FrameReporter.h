#pragma once
/** @file
Writes a picture at regular times of a simulation, as SimTK::Visualizer::Reporter shows one. The
State is realized to Stage::Acceleration.

@code
    simflex::OffscreenVisualizer viz(system);
    system.addEventReporter(new simflex::FrameReporter(viz, 1.0 / 30));
@endcode

Deformations are then drawn unscaled. To exaggerate them, to fit the camera to the run and to use
one range of colours, draw the frames after the run:

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
    /** Frames are written to the visualizer's output folder, one every `reportInterval` of
    simulation time. The System owns the reporter; the visualizer may go out of scope. **/
    explicit FrameReporter(const OffscreenVisualizer& visualizer,
                           SimTK::Real reportInterval = SimTK::Infinity);

    /** With its own visualizer, all settings at their defaults. **/
    explicit FrameReporter(const SimTK::System& system,
                           SimTK::Real reportInterval = SimTK::Infinity);

    /** Warns on standard error if a run was recorded but never drawn. **/
    ~FrameReporter() override;

    const OffscreenVisualizer& getVisualizer() const { return viz; }
    OffscreenVisualizer& updVisualizer() { return viz; }

    /** Sets whether the run is only recorded until finish() fits the visualizer to it and draws
    it. **/
    FrameReporter& setFitToRun(bool fit);

    /** Sets the stage to which States are realized before they are drawn. Default:
    Stage::Acceleration, as in SimTK::Visualizer::Reporter, for generators that show forces,
    accelerations or reactions. Without these Stage::Position is cheaper: with hundreds of joints on
    flexible bodies Simbody takes seconds for accelerations. **/
    FrameReporter& setStage(SimTK::Stage stage);

    void handleEvent(const SimTK::State& state) const override;

    /** Draws a recorded run and completes all frames and videos.
    @throws as OffscreenVisualizer::finish() does. **/
    void finish(const FrameProgress& progress = {});

private:
    OffscreenVisualizer viz;
    bool isFittedToRun = false;
    SimTK::Stage drawnStage = SimTK::Stage::Acceleration;
    mutable MotionRecorder motion;
};

}  // namespace simflex
