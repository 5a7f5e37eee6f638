// A slider-crank of plain Simbody bodies. flexible_link.cpp is the same with a flexible rod.
#include "Simbody.h"
using namespace SimTK;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    const Body::Rigid disk(MassProperties(0.5, Vec3(0), Inertia(1e-3)));
    const Body::Rigid block(MassProperties(0.2, Vec3(0), Inertia(1e-4)));
    const Vec3 center(0.09, 0, 0);
    const Inertia aboutCenter(3.47e-7, 9.56e-5, 9.58e-5);
    const Body::Rigid bar(
        MassProperties(0.0311, center, aboutCenter.shiftFromMassCenter(center, 0.0311)));

    MobilizedBody::Pin crank(matter.Ground(), Transform(), disk, Transform());
    MobilizedBody::Slider slider(matter.Ground(), Transform(), block, Transform());
    MobilizedBody::Pin rod(crank, Transform(Vec3(0.06, 0, 0)), bar, Transform());
    Constraint::Ball smallEnd(rod, Vec3(0.18, 0, 0), slider, Vec3(0));

    Force::MobilityConstantForce motor(forces, crank, 0, 0.02);
    State state = system.realizeTopology();
    slider.setOneQ(state, 0, 0.24);
    RungeKuttaMersonIntegrator integ(system);
    TimeStepper ts(system, integ);
    ts.initialize(state);
    ts.stepTo(0.5);
    std::printf("slider at %.4f m, %s took %d steps\n", slider.getOneQ(ts.getState(), 0),
                integ.getMethodName(), integ.getNumStepsTaken());
}
