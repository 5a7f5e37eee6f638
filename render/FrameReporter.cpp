#include "simflex/render/FrameReporter.h"

#include <iostream>

namespace simflex {

FrameReporter::FrameReporter(const OffscreenVisualizer& visualizer, SimTK::Real reportInterval)
    : SimTK::PeriodicEventReporter(reportInterval),
      viz(visualizer),
      motion(visualizer.getSystem()) {}

FrameReporter::FrameReporter(const SimTK::System& system, SimTK::Real reportInterval)
    : FrameReporter(OffscreenVisualizer(system), reportInterval) {}

FrameReporter::~FrameReporter() {
    if (motion.getNumStates() > 0)
        std::cerr << "simflex: " << motion.getNumStates()
                  << " frames were recorded but not drawn: FrameReporter::finish() was not called"
                  << std::endl;
}

FrameReporter& FrameReporter::setFitToRun(bool fit) {
    isFittedToRun = fit;
    return *this;
}

FrameReporter& FrameReporter::setStage(SimTK::Stage stage) {
    drawnStage = stage;
    return *this;
}

void FrameReporter::handleEvent(const SimTK::State& state) const {
    viz.getSystem().realize(state, drawnStage);
    if (isFittedToRun)
        motion.record(state);
    else
        viz.report(state);
}

void FrameReporter::finish(const FrameProgress& progress) {
    if (motion.getNumStates() > 0) {
        const MotionRecorder recorded = std::move(motion);
        motion.clear();
        viz.fitToMotion(recorded);
        viz.reportAll(recorded, progress);
    }
    viz.finish();
}

}  // namespace simflex
