/** @file
Forces on attachment frames: their power in the system equals that of the force on the moving
frame. **/

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/AttachmentForce.h"
#include "support/NativeReference.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

enum class Place { Interface, Node, RigidBody };

class AttachmentForceTest
    : public ::testing::TestWithParam<std::tuple<Place, AttachmentForce::Axes>> {
protected:
    AttachmentForceTest() : body(flexible, makePointMassPart().body) {
        MobilizedBody::Free base(matter.Ground(),
                                 Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
        rigid =
            MobilizedBody::Pin(base, Transform(Vec3(1, 0, 0)),
                               Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform());
    }

    Attachment makeAttachment() const {
        const Transform X(Rotation(0.6, UnitVec3(1, -2, 1)), Vec3(0.1, 0.2, -0.3));
        switch (std::get<0>(GetParam())) {
            case Place::Interface:
                return body.interface("A", X);
            case Place::Node:
                return body.node(7, X);
            case Place::RigidBody:
                return Attachment(rigid, X);
        }
        throw std::logic_error("no such place");
    }

    State makeState() {
        State state = system.realizeTopology();
        std::mt19937 random(17);
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.5 * unit(random);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = unit(random);
        body.setModalCoordinates(state, 0.05 * body.getModalCoordinates(state));
        system.realize(state, Stage::Position);
        matter.normalizeQuaternions(state);
        system.realize(state, Stage::Dynamics);
        return state;
    }

    Vector calcGeneralizedForces(const State& state) const {
        system.realize(state, Stage::Dynamics);
        Vector generalized;
        matter.multiplyBySystemJacobianTranspose(
            state, system.getRigidBodyForces(state, Stage::Dynamics), generalized);
        return generalized + system.getMobilityForces(state, Stage::Dynamics);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    MobilizedBody rigid;
};

INSTANTIATE_TEST_SUITE_P(Places, AttachmentForceTest,
                         ::testing::Combine(::testing::Values(Place::Interface, Place::Node,
                                                              Place::RigidBody),
                                            ::testing::Values(AttachmentForce::Axes::Ground,
                                                              AttachmentForce::Axes::Attachment)));

TEST_P(AttachmentForceTest, PowerIsThatOfTheForceOnTheMovingFrame) {
    const Attachment attachment = makeAttachment();
    const AttachmentForce::Axes axes = std::get<1>(GetParam());
    const AttachmentForce force(
        flexible, attachment,
        [](Real t) { return SpatialVec(t * Vec3(1, -2, 3), t * Vec3(40, 50, -60)); }, axes);
    State state = makeState();
    const Real without = calcPowerOfForces(flexible, state);  // t = 0
    state.setTime(2);
    const Real applied = calcPowerOfForces(flexible, state) - without;

    // Velocity of the frame by differences of its pose along q̇.
    const Vector q = state.getQ(), qDot = state.getQDot();
    const Transform X_GA = attachment.calcMotion(state).X;
    const auto poseAt = [&](Real t) {
        State moved = state;
        moved.updQ() = q + t * qDot;
        system.realize(moved, Stage::Velocity);
        return attachment.calcMotion(moved).X;
    };
    const Real h = 1e-4;
    const Transform a = poseAt(h), b = poseAt(-h), c = poseAt(2 * h), d = poseAt(-2 * h);
    const Vec3 v = (8 * (a.p() - b.p()) - (c.p() - d.p())) / (12 * h);
    const Mat33 RDot =
        (8 * (Mat33(a.R()) - Mat33(b.R())) - (Mat33(c.R()) - Mat33(d.R()))) / (12 * h);
    const Mat33 spin = RDot * Mat33(~X_GA.R());
    const Vec3 omega(spin(2, 1), spin(0, 2), spin(1, 0));

    SpatialVec F(Vec3(2, -4, 6), Vec3(80, 100, -120));
    if (axes == AttachmentForce::Axes::Attachment) F = X_GA.R() * F;
    const Real expected = ~F[0] * omega + ~F[1] * v;
    EXPECT_NEAR(applied, expected, 1e-9 * std::abs(expected));
}

TEST_P(AttachmentForceTest, TwoEqualForcesAddUp) {
    const SpatialVec load(Vec3(1, 2, 3), Vec3(4, 5, 6));
    const AttachmentForce::Axes axes = std::get<1>(GetParam());
    const AttachmentForce varying(
        flexible, makeAttachment(), [load](Real t) { return t * load; }, axes);
    State state = makeState();
    const Vector none = calcGeneralizedForces(state);
    state.setTime(1);
    const Vector one = calcGeneralizedForces(state) - none;
    const AttachmentForce constant(flexible, makeAttachment(), load, axes);
    state = makeState();
    state.setTime(1);
    const Vector two = calcGeneralizedForces(state) - none;
    EXPECT_LT((two - 2 * one).norm(), 1e-11 * none.norm());
    EXPECT_GT(one.norm(), 1);
}

TEST(AttachmentForceErrors, MissingFunctionIsNamed) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    try {
        AttachmentForce(flexible, matter.Ground(), AttachmentForce::Function());
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("ground"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace simflex::test
