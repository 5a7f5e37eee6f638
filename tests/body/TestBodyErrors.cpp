/** @file
Messages for errors in a model. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/Joint.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

class BodyErrorsTest : public ::testing::Test {
protected:
    /** The message of the exception that `action` throws, or "". **/
    template <class Action>
    static std::string messageOf(Action action) {
        try {
            action();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    const std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
};

TEST_F(BodyErrorsTest, UnknownInterfaceNamesThoseThatExist) {
    const FlexibleBody body(flexible, part, "crank");
    EXPECT_THAT(messageOf([&] { body.interface("pin"); }),
                AllOf(HasSubstr("masses1"), HasSubstr("'pin'"), HasSubstr("'A', 'B'")));
    EXPECT_THROW(body.interface("pin"), std::out_of_range);
}

TEST_F(BodyErrorsTest, UnknownNodeIsNamed) {
    const FlexibleBody body(flexible, part);
    EXPECT_THAT(messageOf([&] { body.node(12345); }), HasSubstr("12345"));
    EXPECT_THROW(body.node(12345), std::out_of_range);
}

TEST_F(BodyErrorsTest, BodiesAndJointsThatAreNotThereAreRefused) {
    const FlexibleBody body(flexible, part, "crank");
    const Joint joint = Joint::Ball(flexible, matter.Ground(), body.interface("A"));
    EXPECT_EQ(flexible.getBody(body.getIndex()).getName(), "crank");
    EXPECT_EQ(flexible.getJoint(joint.getIndex()).getIndex(), joint.getIndex());
    EXPECT_THROW(flexible.getBody(FlexibleBodyIndex(1)), std::out_of_range);
    EXPECT_THROW(flexible.getJoint(JointIndex(1)), std::out_of_range);
}

TEST_F(BodyErrorsTest, NodeWithoutElementsCarriesNoAttachment) {
    auto loose = std::make_shared<ReducedBody>(*part);
    loose->mesh.elements.clear();
    const FlexibleBody body(flexible, loose);
    EXPECT_THAT(messageOf([&] { body.node(1); }),
                AllOf(HasSubstr("masses1"), HasSubstr("node 1 ")));
}

TEST_F(BodyErrorsTest, WrongNumberOfModalCoordinatesIsRefused) {
    const FlexibleBody body(flexible, part, "crank");
    State state = system.realizeTopology();
    const auto message = messageOf([&] { body.setModalCoordinates(state, Vector(4, Real(0))); });
    EXPECT_THAT(message, AllOf(HasSubstr("crank"), HasSubstr("11"), HasSubstr("4")));
    EXPECT_THROW(body.setModalSpeeds(state, Vector(12, Real(0))), std::invalid_argument);
}

TEST_F(BodyErrorsTest, SecondFlexibleBodySubsystemIsRefused) {
    EXPECT_THAT(messageOf([&] { FlexibleBodySubsystem(system, matter); }),
                HasSubstr("has one already"));
    ASSERT_NE(FlexibleBodySubsystem::find(system), nullptr);
    EXPECT_EQ(&FlexibleBodySubsystem::find(system)->getGuts(), &flexible.getGuts());
    MultibodySystem empty;
    EXPECT_EQ(FlexibleBodySubsystem::find(empty), nullptr);
}

TEST_F(BodyErrorsTest, WhatHoldsBodiesOfTwoSystemsTogetherIsRefused) {
    MultibodySystem otherSystem;
    SimbodyMatterSubsystem otherMatter{otherSystem};
    FlexibleBodySubsystem otherFlexible{otherSystem, otherMatter};
    const Body::Rigid brick(MassProperties(1, Vec3(0), UnitInertia(1)));
    const MobilizedBody::Free mine(matter.Ground(), brick), others(otherMatter.Ground(), brick);
    const FlexibleBody body(flexible, part, "crank"), otherBody(otherFlexible, part, "rod");
    const std::vector<Attachment> own{matter.Ground(), mine, body.interface("A"), body.node(1)},
        foreign{otherMatter.Ground(), others, otherBody.interface("A"), otherBody.node(1)};
    const auto isOfOther = AllOf(HasSubstr("another system"), HasSubstr("'p'"));
    for (const Attachment& a : own)
        for (const Attachment& b : foreign) {
            EXPECT_THAT(messageOf([&] { Joint::Pin(flexible, a, b, "p"); }), isOfOther);
            EXPECT_THAT(messageOf([&] { Joint::Pin(flexible, b, a, "p"); }), isOfOther);
        }
    EXPECT_THAT(messageOf([&] { Joint::Pin(flexible, foreign[1], foreign[2], "p"); }), isOfOther);
    const Joint::Pin pin(otherFlexible, foreign[0], foreign[2], "q");
    EXPECT_THAT(messageOf([&] { Joint::Lock(flexible, pin, "p"); }), isOfOther);
    EXPECT_EQ(flexible.getNumJoints(), 0);
    EXPECT_FALSE(pin.isIn(flexible));
    EXPECT_TRUE(pin.isIn(otherFlexible));
}

TEST_F(BodyErrorsTest, NoTwoBodiesOrJointsOfAKindHaveOneName) {
    const FlexibleBody first(flexible, part, "femur"), second(flexible, part, "femur"),
        third(flexible, part, "femur"), fourth(flexible, part, "femur 3");
    EXPECT_EQ(first.getName(), "femur");
    EXPECT_EQ(second.getName(), "femur 2");
    EXPECT_EQ(third.getName(), "femur 3");
    EXPECT_EQ(fourth.getName(), "femur 3 2");
    EXPECT_EQ(second.interface("A").getName(), "femur 2.A");
    const Joint::Pin hip(flexible, matter.Ground(), first.interface("A"), "hip"),
        other(flexible, matter.Ground(), second.interface("A"), "hip");
    EXPECT_EQ(hip.getName(), "hip");
    EXPECT_EQ(other.getName(), "hip 2");
    // A motion is named after the joint that it drives.
    const Joint::PrescribedRotation drive(
        flexible, matter.Ground(), first.interface("A"), [](Real) { return Vec3(0); }, "hip");
    EXPECT_EQ(drive.getName(), "hip");
}

TEST_F(BodyErrorsTest, NodesAreFoundByTheirPlaceInTheDeck) {
    auto shifted = std::make_shared<ReducedBody>(*part);
    shifted->centerOfMass = {1, -2, 0.5};
    const FlexibleBody body(flexible, shifted, "crank");
    for (const int number : part->mesh.nodeNumbers) {
        const auto s = part->mesh.position(part->mesh.indexOf(number));
        const Vec3 place = Vec3(s[0], s[1], s[2]) + Vec3(1, -2, 0.5);
        EXPECT_LT((body.getNodePosition(number) - place).norm(), 1e-15);
        EXPECT_EQ(body.findNearestNode(place + Vec3(1e-3, -1e-3, 1e-3)), number);
    }
    EXPECT_THAT(messageOf([&] { body.findNearestNode(Vec3(NaN)); }), HasSubstr("'crank'"));
    EXPECT_THROW(body.getNodePosition(123456), std::out_of_range);
}

TEST_F(BodyErrorsTest, JointBetweenFramesOfOneRigidBodyIsRefused) {
    MobilizedBody::Free rigid(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    const auto message = messageOf([&] {
        Joint::Ball(flexible, Attachment(rigid, Transform(Vec3(1, 0, 0))), Attachment(rigid),
                    "loop");
    });
    EXPECT_THAT(message, AllOf(HasSubstr("'loop'"), HasSubstr("same rigid body")));
    EXPECT_EQ(flexible.getNumJoints(), 0);
}

TEST_F(BodyErrorsTest, PrescribedRotationWithoutFunctionIsRefused) {
    const FlexibleBody body(flexible, part);
    const auto message = messageOf([&] {
        Joint::PrescribedRotation(flexible, matter.Ground(), body.interface("A"),
                                  Joint::AngleFunction(), "drive");
    });
    EXPECT_THAT(message, AllOf(HasSubstr("'drive'"), HasSubstr("angle function")));
}

TEST_F(BodyErrorsTest, NotANumberInAPartIsNamed) {
    const auto messageWith = [&](auto spoil) {
        auto spoilt = std::make_shared<ReducedBody>(*part);
        spoil(*spoilt);
        return messageOf([&] { FlexibleBody(flexible, spoilt); });
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.mass = nan; }),
                AllOf(HasSubstr("'masses1'"), HasSubstr("mass is nan; it must be positive")));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.inertia[3] = nan; }), HasSubstr("inertia"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.centerOfMass[1] = nan; }),
                HasSubstr("centre of mass"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.omegaSquared[2] = nan; }),
                HasSubstr("omegaSquared entry 2"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.I1[7] = nan; }), HasSubstr("I1 entry 7"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.I2[1][3] = nan; }), HasSubstr("I2 entry 3"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.N[2][5] = nan; }), HasSubstr("N entry 5"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.Phi[9] = nan; }), HasSubstr("Phi entry 9"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.mesh.positions[4] = nan; }),
                HasSubstr("positions entry 4"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.interfaces[1].Psi[4] = nan; }),
                HasSubstr("Psi entry 4"));
    EXPECT_THAT(messageWith([&](ReducedBody& b) { b.interfaces[1].position[0] = nan; }),
                HasSubstr("position"));
    EXPECT_EQ(flexible.getNumBodies(), 0);
}

TEST_F(BodyErrorsTest, InconsistentPartIsRefused) {
    const auto messageWith = [&](auto spoil) {
        auto spoilt = std::make_shared<ReducedBody>(*part);
        spoil(*spoilt);
        return messageOf([&] { FlexibleBody(flexible, spoilt); });
    };
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.I1.pop_back(); }),
                AllOf(HasSubstr("65"), HasSubstr("66")));
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.N[0][1] += 1e-3; }), HasSubstr("antisymmetric"));
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.I2[4][1] += 1e-3; }), HasSubstr("symmetric"));
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.omegaSquared[0] = 0; }),
                HasSubstr("rigid mode"));
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.interfaces[0].nodes[0] = 99; }),
                AllOf(HasSubstr("'A'"), HasSubstr("99")));
    EXPECT_THAT(messageWith([](ReducedBody& b) {
                    std::swap(b.mesh.nodeNumbers[0], b.mesh.nodeNumbers[1]);
                }),
                HasSubstr("node numbers of the mesh must ascend, but 1 stands behind 2"));
    EXPECT_THAT(messageWith([](ReducedBody& b) {
                    b.interfaces[0].nodes.push_back(b.interfaces[0].nodes[0]);
                }),
                HasSubstr("the nodes of interface 'A' must ascend, but "));
    EXPECT_THAT(messageWith([](ReducedBody& b) {
                    b.mesh.nodeSets["ENDS"] = {2, 1};
                }),
                HasSubstr("the nodes of node set 'ENDS' must ascend, but 1 stands behind 2"));
    EXPECT_THAT(
        messageWith([](ReducedBody& b) { std::swap(b.omegaSquared[0], b.omegaSquared[1]); }),
        HasSubstr("modes must ascend in omega², but mode 2 has "));
    // Modes of twice the length have four times the modal mass.
    EXPECT_THAT(messageWith([](ReducedBody& b) {
                    for (auto& component : b.I2)
                        for (double& value : component) value *= 4;
                }),
                HasSubstr("the modal mass of modes 1 and 1 is 4 by the trace of I2; it must be 1: "
                          "the modes are not mass-normalised"));
    EXPECT_THAT(messageWith([](ReducedBody& b) { b.provenance.units = "mm t s"; }),
                HasSubstr("its units are 'mm t s'; all numbers of a part are read in m kg s"));
    EXPECT_THAT(messageOf([&] { FlexibleBody(flexible, nullptr, "rod"); }), HasSubstr("'rod'"));
}

TEST_F(BodyErrorsTest, AttachmentsAndJointsAreNamedAfterWhatTheyHold) {
    const FlexibleBody body(flexible, part, "crank");
    EXPECT_EQ(body.interface("A").getName(), "crank.A");
    EXPECT_EQ(body.node(3).getName(), "crank node 3");
    EXPECT_EQ(Attachment(matter.Ground()).getName(), "ground");
    EXPECT_EQ(Joint::Ball(flexible, matter.Ground(), body.interface("A")).getName(),
              "ground - crank.A");
    EXPECT_EQ(Joint::Ball(flexible, matter.Ground(), body.interface("A"), "shaft").getName(),
              "shaft");
}

TEST_F(BodyErrorsTest, ForceSubsystemAddedLaterIsNamedWithWhatToDo) {
    const GeneralForceSubsystem late(system);
    EXPECT_THAT(messageOf([&] { system.realizeTopology(); }),
                AllOf(HasSubstr("'GeneralForceSubsystem' (subsystem 4)"),
                      HasSubstr("after the FlexibleBodySubsystem (subsystem 3)"),
                      HasSubstr("construct it before")));
    EXPECT_THROW(system.realizeTopology(), std::invalid_argument);
}

TEST(SubsystemOrder, ElementsAddedLaterToAnEarlierSubsystemAct) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, makePointMassPart().body);
    const Force::Gravity gravity(forces, matter, Vec3(0, -3, 0));
    State state = system.realizeTopology();
    system.realize(state, Stage::Acceleration);
    EXPECT_LT((body.getFrame().getBodyOriginAcceleration(state) - Vec3(0, -3, 0)).norm(), 1e-13);
}

}  // namespace
}  // namespace simflex::test
