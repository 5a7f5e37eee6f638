#pragma once
/** @file
Writes a picture at regular times of a simulation, as SimTK::Visualizer::Reporter shows one.

@code
    simflex::OffscreenVisualizer viz(system);
    system.addEventReporter(new simflex::FrameReporter(viz, 1.0 / 30));
@endcode **/

#include "Simbody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

class FrameReporter : public SimTK::PeriodicEventReporter {
public:
    /** Frames go to the visualizer's output folder, one every `reportInterval` of simulation time.
    The System takes over the reporter; the visualizer may go out of scope. **/
    explicit FrameReporter(const OffscreenVisualizer& visualizer,
                           SimTK::Real reportInterval = SimTK::Infinity)
        : SimTK::PeriodicEventReporter(reportInterval), viz(visualizer) {}

    /** With a visualizer of its own, all settings at their defaults. **/
    explicit FrameReporter(const SimTK::System& system,
                           SimTK::Real reportInterval = SimTK::Infinity)
        : FrameReporter(OffscreenVisualizer(system), reportInterval) {}

    const OffscreenVisualizer& getVisualizer() const { return viz; }
    OffscreenVisualizer& updVisualizer() { return viz; }

    void handleEvent(const SimTK::State& state) const override { viz.report(state); }

private:
    OffscreenVisualizer viz;
};

}  // namespace simflex
