// A GoogleTest that compares a flexible model with the same held rigid, which is then Simbody's.
#include <gtest/gtest.h>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

/** Angle of a pendulum 0.1 s after its release from the horizontal. **/
Real calcAngle(bool isRigid) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Pin pin(flexible, matter.Ground(), rod.interface("big_end"), "pin");
    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    if (isRigid) rod.setRigid(state);
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.1);
    return pin.calcCoordinates(integrator.getState())[0];
}

TEST(Pendulum, FallsAsARigidOneDoesButForItsFlexibility) {
    const Real rigid = calcAngle(true), flexible = calcAngle(false);
    EXPECT_LT(rigid, -0.3);
    EXPECT_NE(rigid, flexible);
    EXPECT_NEAR(rigid, flexible, 1e-4);  // the rod is stiff: its end deflects by micrometres
}
