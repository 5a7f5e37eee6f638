// Simbody's own integrator and TimeStepper on a system with a flexible body of few modes.
#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/part/ReducedBodyFile.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);  // after all other forces

    const ReducedBody part = selectLowestModes(readReducedBody("rod.h5"), 4);
    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(part));
    Joint::Pin pin(flexible, matter.Ground(), rod.interface("big_end"), "pin");
    ModalDamping(flexible, rod, 0.02);

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    flexible.initializeNative(state);  // assembles, and sets weights so that accuracy is in m

    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-6);
    SimTK::TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.05);
    system.realize(stepper.getState(), Stage::Acceleration);
    const SpatialVec reaction =
        pin.calcReaction(stepper.getState(), Joint::Side::M, Joint::Side::M);
    std::printf("after %d steps: force on the rod %.3f N up, angle %.3f rad\n",
                integrator.getNumStepsTaken(), reaction[1][1],
                pin.calcCoordinates(stepper.getState())[0]);
}
