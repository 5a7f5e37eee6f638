// Accelerations of attachments against differences of their velocities.

#include "simflex/body/FrameAcceleration.h"

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** Parameter: whether the flexible body has geometric stiffening, which makes frames second order
in ξ. **/
class FrameAccelerations : public ::testing::TestWithParam<bool> {};

TEST_P(FrameAccelerations, AreDerivativesOfVelocities) {
    PointMassPartOptions options;
    options.stiffening = GetParam() ? 2 : 0;
    const PointMassPart part = makePointMassPart(options);

    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, part.body);
    MobilizedBody::Pin arm(matter.updGround(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    MobilizedBody::Ball hand(arm, Transform(Vec3(0.3, 0, 0)),
                             Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Transform());
    const Transform X(Rotation(0.7, UnitVec3(1, 2, -1)), Vec3(0.05, -0.1, 0.07));
    const std::vector<Attachment> frames{Attachment::onInterface(body, "B", X),
                                         Attachment::onNode(body, part.body->mesh.nodeNumbers[2]),
                                         Attachment(hand, X), Attachment(matter.Ground(), X)};

    State state = system.realizeTopology();
    std::mt19937 random(7);
    std::uniform_real_distribution<Real> unit(-1, 1);
    Vector uDot(state.getNU());
    for (int k = 0; k < state.getNU(); ++k) {
        state.updU()[k] = unit(random);
        uDot[k] = unit(random);
    }
    Vector xi(body.getNumModes());
    for (int k = 0; k < xi.size(); ++k) xi[k] = 0.2 * unit(random);
    body.setModalCoordinates(state, xi);
    body.setFramePose(state, Transform(Rotation(1.1, UnitVec3(-1, 3, 1)), Vec3(1, 2, 3)));
    hand.setQToFitRotation(state, Rotation(0.8, UnitVec3(2, -1, 1)));
    system.realize(state, Stage::Velocity);
    Vector qDot;
    matter.multiplyByN(state, false, state.getU(), qDot);

    // V along q + h q̇, u + h u̇: its derivative at h = 0 is the acceleration.
    const auto velocityAt = [&](Real h, const Attachment& frame) {
        State near = state;
        near.updQ() += h * qDot;
        near.updU() += h * uDot;
        system.realize(near, Stage::Velocity);
        return frame.calcMotion(near).V;
    };
    const std::vector<FrameMotion> motions = calcFrameMotions(flexible, state, uDot, frames);
    ASSERT_EQ(motions.size(), frames.size());
    for (size_t k = 0; k < frames.size(); ++k) {
        const Real h = 1e-4;
        const SpatialVec expected =
            (8 * (velocityAt(h, frames[k]) - velocityAt(-h, frames[k])) -
             (velocityAt(2 * h, frames[k]) - velocityAt(-2 * h, frames[k]))) /
            (12 * h);
        const FrameMotion direct = frames[k].calcMotion(state);
        for (int half : {0, 1}) {
            EXPECT_LT((motions[k].A[half] - expected[half]).norm(), 1e-9) << frames[k].getName();
            EXPECT_LT((motions[k].V[half] - direct.V[half]).norm(), 1e-13);
        }
        EXPECT_LT((motions[k].X.p() - direct.X.p()).norm(), 1e-14);
    }
    EXPECT_GT(motions[0].A[1].norm(), 0.1);  // there is something to compare
}

INSTANTIATE_TEST_SUITE_P(Parts, FrameAccelerations, ::testing::Bool(), [](const auto& tested) {
    return tested.param ? "WithStiffening" : "WithoutStiffening";
});

/** A shell's node, which belongs to no element. **/
TEST(NodeFrames, BetweenTwoNodesOfASolidTurnWithIt) {
    const PointMassPart part = makePointMassPart();
    auto own = std::make_shared<ReducedBody>(*part.body);
    Mesh& mesh = own->mesh;
    const int above = mesh.elements[0].nodes[4], below = mesh.elements[0].nodes[0];
    mesh.nodeNumbers.push_back(mesh.nodeNumbers.back() + 1);
    for (size_t a = 0; a < 3; ++a)
        mesh.positions.push_back(0.25 * (3 * mesh.position(below)[a] + mesh.position(above)[a]));
    // A field of translation and rotation for each mode.
    const auto turnOf = [](int mode) { return Vec3(1 + mode, -2, 0.5 * mode); };
    own->Phi.clear();
    for (int mode = 0; mode < own->numModes; ++mode)
        for (int node = 0; node < mesh.numNodes(); ++node) {
            const auto s = mesh.position(node);
            const Vec3 phi = Vec3(mode, 1, 2) + turnOf(mode) % Vec3(s[0], s[1], s[2]);
            own->Phi.insert(own->Phi.end(), {phi[0], phi[1], phi[2]});
        }
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, own);
    const Attachment frame = Attachment::onNode(body, mesh.nodeNumbers.back());
    State state = system.realizeTopology();
    Vector xi(body.getNumModes(), Real(0));
    xi[3] = 1e-3;
    body.setModalCoordinates(state, xi);
    system.realize(state, Stage::Velocity);
    const Vec4 turn = frame.calcMotion(state).X.R().convertRotationToAngleAxis();
    const Vec3 expected = 1e-3 * turnOf(3);
    EXPECT_LT((turn[0] * turn.getSubVec<3>(1) - expected).norm(), 1e-12);

    // A node off their line is refused.
    const auto beside = std::make_shared<ReducedBody>(*own);
    beside->mesh.positions.back() += 0.01;
    EXPECT_THROW(Attachment::onNode(FlexibleBody(flexible, beside), mesh.nodeNumbers.back()),
                 std::invalid_argument);
}

}  // namespace
}  // namespace simflex::test
