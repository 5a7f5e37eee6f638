// A slider-crank with a flexible rod: rigid_link.cpp, a plain Simbody program, and ten lines more.
#include "simflex/Simflex.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    const Body::Rigid disk(MassProperties(0.5, Vec3(0), Inertia(1e-3)));
    const Body::Rigid block(MassProperties(0.2, Vec3(0), Inertia(1e-4)));
    FlexibleBodySubsystem flexible(system, matter);  // after all other forces

    MobilizedBody::Pin crank(matter.Ground(), Transform(), disk, Transform());
    MobilizedBody::Slider slider(matter.Ground(), Transform(), block, Transform());
    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Pin bigEnd(flexible, Attachment(crank, Vec3(0.06, 0, 0)), rod.interface("big_end"));
    Joint::Ball smallEnd(flexible, rod.interface("small_end"), slider);

    Force::MobilityConstantForce motor(forces, crank, 0, 0.02);
    State state = system.realizeTopology();
    slider.setOneQ(state, 0, 0.24);
    rod.setPoseByInterface(state, "big_end", Vec3(0.06, 0, 0));
    RadauIntegrator integ(system);
    simflex::TimeStepper ts(system, integ);
    ts.initialize(state);
    ts.stepTo(0.5);
    std::printf("slider at %.4f m, %s took %d steps\n", slider.getOneQ(ts.getState(), 0),
                integ.getMethodName(), integ.getNumStepsTaken());
}
