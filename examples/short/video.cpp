// Pictures and a video of a swinging rod, without a display. Links simflex::render.
#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/FrameReporter.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);  // Simbody draws axes of 1 m
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);

    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Pin pin(flexible, matter.Ground(), rod.interface("big_end"), "pin");

    OffscreenVisualizer viz(system, 640, 360);
    viz.addFlexibleBody(rod).setShowJoints(true).setOutputFolder("frames");
    if (isVideoAvailable()) viz.addVideo("swing.mp4");
    auto* reporter = new FrameReporter(viz, 0.04);
    reporter->setFitToRun(true);  // drawn after the run, exaggerated, nothing leaves the picture
    system.addEventReporter(reporter);

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.4);
    reporter->finish();
    std::printf("%d frames in frames/\n", viz.getNumFrames());
}
