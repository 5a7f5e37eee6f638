// Rigid or flexible: the switch in the State.

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

class RigidSwitch : public ::testing::Test {
protected:
    State makeDeformed() {
        State state = system.realizeTopology();
        body.setFramePose(state, Transform(Rotation(0.3, UnitVec3(1, 2, 3)), Vec3(1, 2, 3)));
        body.setFrameVelocity(state, SpatialVec(Vec3(1, -2, 3), Vec3(4, 5, 6)));
        for (const FlexibleBody* one : {&body, &other}) {
            one->setModalCoordinates(state, Vector(11, 0.01));
            one->setModalSpeeds(state, Vector(11, 0.2));
        }
        system.realize(state, Stage::Velocity);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body{flexible, makePointMassPart().body, "one"},
        other{flexible, body.getPartHandle(), "other"};
};

TEST_F(RigidSwitch, HoldsAllModesAtZeroAndLeavesTheFrameAndOtherBodies) {
    State state = makeDeformed();
    const Transform pose = body.getFramePose(state);
    const SpatialVec velocity = body.getFrameVelocity(state);
    EXPECT_FALSE(body.isRigid(state));

    body.setRigid(state);
    EXPECT_TRUE(body.isRigid(state));
    EXPECT_FALSE(other.isRigid(state));
    EXPECT_LT(state.getSystemStage(), Stage::Instance);
    system.realize(state, Stage::Velocity);
    EXPECT_EQ(body.getModalCoordinates(state).normInf(), 0);
    EXPECT_EQ(body.getModalSpeeds(state).normInf(), 0);
    EXPECT_EQ(other.getModalCoordinates(state)[10], 0.01);
    EXPECT_EQ((body.getFramePose(state).p() - pose.p()).norm(), 0);
    EXPECT_EQ((body.getFrameVelocity(state)[0] - velocity[0]).norm(), 0);
    EXPECT_EQ((body.getFrameVelocity(state)[1] - velocity[1]).norm(), 0);
    system.realize(state, Stage::Acceleration);
    for (int k = 0; k < body.getNumModalMobilizers(); ++k)
        EXPECT_EQ(body.getModalMobilizer(k).getUDotAsVector(state).normInf(), 0);
}

TEST_F(RigidSwitch, HoldsWhateverIsWrittenToTheModesLater) {
    State state = makeDeformed();
    body.setRigid(state);
    body.setModalCoordinates(state, Vector(11, 0.01));
    body.setModalSpeeds(state, Vector(11, 0.2));
    EXPECT_TRUE(body.isRigid(state));
    flexible.initializeNative(state);
    EXPECT_EQ(body.getModalCoordinates(state).normInf(), 0);
    EXPECT_EQ(body.getModalSpeeds(state).normInf(), 0);
}

TEST_F(RigidSwitch, FreesAllModesAgainFromRest) {
    State state = makeDeformed();
    body.setRigid(state);
    system.realize(state, Stage::Velocity);
    body.setFlexible(state);
    EXPECT_FALSE(body.isRigid(state));
    EXPECT_LT(state.getSystemStage(), Stage::Instance);
    EXPECT_EQ(body.getModalCoordinates(state).normInf(), 0);
    system.realize(state, Stage::Acceleration);
    Real largest = 0;
    for (int k = 0; k < body.getNumModalMobilizers(); ++k) {
        EXPECT_FALSE(body.getModalMobilizer(k).isLocked(state));
        largest = std::max(largest, body.getModalMobilizer(k).getUDotAsVector(state).normInf());
    }
    EXPECT_GT(largest, 0.1);  // the body spins
}

TEST_F(RigidSwitch, IsOnOnlyIfEveryModeIsHeldAtZero) {
    State state = makeDeformed();
    body.setRigid(state);
    body.getModalMobilizer(1).unlock(state);
    EXPECT_FALSE(body.isRigid(state));
    body.getModalMobilizer(1).lockAt(state, Vector(5, 1e-6));
    EXPECT_FALSE(body.isRigid(state));
    body.getModalMobilizer(1).lockAt(state, Vector(5, Real(0)), Motion::Velocity);
    EXPECT_FALSE(body.isRigid(state));
    body.getModalMobilizer(1).lockAt(state, Vector(5, Real(0)));
    EXPECT_TRUE(body.isRigid(state));
}

TEST_F(RigidSwitch, CanBeOnFromTheStart) {
    body.setRigidByDefault(true);
    EXPECT_TRUE(body.isRigidByDefault());
    EXPECT_FALSE(other.isRigidByDefault());
    State state = system.realizeTopology();
    EXPECT_TRUE(body.isRigid(state));
    EXPECT_FALSE(other.isRigid(state));
    body.setFlexible(state);
    EXPECT_FALSE(body.isRigid(state));
    body.setRigidByDefault(false);
    EXPECT_FALSE(body.isRigidByDefault());
    EXPECT_FALSE(body.isRigid(system.realizeTopology()));
}

TEST_F(RigidSwitch, PartWithoutModesIsAlwaysRigid) {
    PointMassPartOptions options;
    options.numModes = 0;
    FlexibleBody stone(flexible, makePointMassPart(options).body);
    State state = system.realizeTopology();
    EXPECT_TRUE(stone.isRigidByDefault());
    stone.setFlexible(state);
    EXPECT_TRUE(stone.isRigid(state));
    stone.setRigid(state);
    EXPECT_TRUE(stone.isRigid(state));
}

}  // namespace
}  // namespace simflex::test
