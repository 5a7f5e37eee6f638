/** @file
Forces applied by FlexibleBodySubsystem when Simbody realizes Stage::Dynamics, against the point
masses.
**/

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "support/PointMassMotion.h"

namespace simflex::test {
namespace {

using SimTK::Mat33;
using SimTK::MobilizedBodyIndex;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Stage;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

class NativeForcesTest : public ::testing::Test {
protected:
    NativeForcesTest() : body(flexible, part.body, "crank") {}

    int numModes() const { return part.body->numModes; }

    State makeState(const PointMassMotion& motion) {
        State state = system.realizeTopology();
        Mat33 R;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) R(i, j) = motion.R_GB(i, j);
        body.setFramePose(state, Transform(Rotation(R), toSimTK(motion.p_GB)));
        body.setFrameVelocity(
            state, SpatialVec(Rotation(R) * toSimTK(motion.omega_B), toSimTK(motion.v_G)));
        body.setModalCoordinates(state, Vector(numModes(), motion.xi.data()));
        body.setModalSpeeds(state, Vector(numModes(), motion.xiDot.data()));
        return state;
    }

    /** Returns the applied forces per Simbody mobility: body forces mapped to the mobilities, plus
    mobility forces. **/
    Vector calcGeneralizedForces(const State& state) const {
        Vector generalized;
        matter.multiplyBySystemJacobianTranspose(
            state, system.getRigidBodyForces(state, Stage::Dynamics), generalized);
        return generalized + system.getMobilityForces(state, Stage::Dynamics);
    }

    /** The modal part of a vector over Simbody's mobilities. **/
    Eigen::VectorXd getModes(const State& state, const Vector& u) const {
        Eigen::VectorXd modes(numModes());
        for (int i = 0; i < numModes(); ++i)
            modes[i] = u[int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6];
        return modes;
    }

    /** Sets the body's accelerations from Simbody. **/
    void putAccelerations(const State& state, PointMassMotion& motion) const {
        const SpatialVec A = body.getFrame().getBodyAcceleration(state);
        motion.omegaDot_B = motion.R_GB.transpose() * toEigen(A[0]);
        motion.vDot_G = toEigen(A[1]);
        motion.xiDotDot = getModes(state, state.getUDot());
    }

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem general{system};
    FlexibleBodySubsystem flexible{system, matter};
    const PointMassPart part = makePointMassPart();
    FlexibleBody body;
};

TEST_F(NativeForcesTest, AppliedForcesAreWhatSimbodysInertiaLacks) {
    const ModalDamping damping(flexible, body, 0.03);
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 21);
    const State state = makeState(motion);
    system.realize(state, Stage::Acceleration);
    putAccelerations(state, motion);

    // Simbody already includes I₀ω̇ + ω×I₀ω and ξ̈ of the masses' inertia forces.
    const Eigen::VectorXd inertia = calcInertiaForces(part, motion);
    const auto& I = part.body->inertia;
    Eigen::Matrix3d I0;
    I0 << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
    const Eigen::Vector3d own = I0 * motion.omegaDot_B + motion.omega_B.cross(I0 * motion.omega_B);
    const Eigen::Vector3d torque_G = -motion.R_GB * (inertia.head<3>() - own);
    const Eigen::Map<const Eigen::VectorXd> omegaSquared(part.body->omegaSquared.data(),
                                                         numModes());
    const Eigen::VectorXd modes = -(inertia.tail(numModes()) - motion.xiDotDot) -
                                  omegaSquared.cwiseProduct(motion.xi) -
                                  0.06 * omegaSquared.cwiseSqrt().cwiseProduct(motion.xiDot);

    const auto& bodyForces = system.getRigidBodyForces(state, Stage::Dynamics);
    const MobilizedBodyIndex frame = body.getFrame().getMobilizedBodyIndex();
    EXPECT_LT((bodyForces[frame][0] - toSimTK(torque_G)).norm(), 1e-12 * torque_G.norm());
    EXPECT_LT(bodyForces[frame][1].norm(), 1e-14);
    const Vector& mobilityForces = system.getMobilityForces(state, Stage::Dynamics);
    EXPECT_LT((getModes(state, mobilityForces) - modes).norm(), 1e-12 * modes.norm());
    for (int k = 0; k < body.getNumModalMobilizers(); ++k) {
        const SpatialVec& onCarrier = bodyForces[body.getModalMobilizer(k).getMobilizedBodyIndex()];
        EXPECT_EQ(onCarrier[0].norm() + onCarrier[1].norm(), 0);
    }
}

TEST_F(NativeForcesTest, DeformedBodyMovesAsItsMassesDo) {
    const SimTK::Force::Gravity gravity(general, matter, Vec3(1, -9, 2));
    const SpatialVec load(Vec3(1, -2, 3), Vec3(4, 5, -6));
    const AttachmentForce force(flexible, body.interface("B"), load);
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 22, 0.02);
    const State state = makeState(motion);
    system.realize(state, Stage::Acceleration);
    putAccelerations(state, motion);

    // d'Alembert: virtual power of inertia, weight, elasticity and load, for each speed. A mode's
    // motion at the interface is its velocity for ξ̇_i = 1.
    const Eigen::Vector3d g(1, -9, 2);
    const Eigen::Map<const Eigen::VectorXd> omegaSquared(part.body->omegaSquared.data(),
                                                         numModes());
    Eigen::VectorXd applied(6 + numModes());
    for (int i = 0; i < applied.size(); ++i) {
        PointMassMotion unit(numModes());
        unit.R_GB = motion.R_GB;
        unit.p_GB = motion.p_GB;
        unit.xi = motion.xi;
        (i < 3 ? unit.omega_B[i] : i < 6 ? unit.v_G[i - 3] : unit.xiDot[i - 6]) = 1;
        State moving = makeState(unit);
        system.realize(moving, Stage::Velocity);
        const SpatialVec V = body.interface("B").calcMotion(moving).V;
        applied[i] = ~load[0] * V[0] + ~load[1] * V[1];
    }
    applied.segment<3>(3) += part.body->mass * g;
    applied.tail(numModes()) -= omegaSquared.cwiseProduct(motion.xi);
    const Eigen::VectorXd inertia = calcInertiaForces(part, motion);
    EXPECT_LT((inertia - applied).norm(), 1e-12 * applied.norm());
}

/** dE/dt = 0 along (q̇, u̇): the energy of the masses, elasticity and gravity. **/
TEST_F(NativeForcesTest, EnergyStaysAlongTheMotionThatSimbodyFinds) {
    const SimTK::Force::Gravity gravity(general, matter, Vec3(1, -9, 2));
    State state = makeState(PointMassMotion::makeRandom(numModes(), 23, 0.01));
    system.realize(state, Stage::Acceleration);
    const Vector q = state.getQ(), qDot = state.getQDot(), u = state.getU(), uDot = state.getUDot();
    const auto energiesAt = [&](Real t) {
        state.updQ() = q + t * qDot;
        state.updU() = u + t * uDot;
        system.realize(state, Stage::Dynamics);
        return SimTK::Vec2(flexible.calcKineticEnergy(state), flexible.calcPotentialEnergy(state));
    };
    const Real h = 1e-6;
    const SimTK::Vec2 rates = (energiesAt(h) - energiesAt(-h)) / (2 * h);
    EXPECT_NEAR(rates[0] + rates[1], 0, 1e-7 * std::abs(rates[0]));
    EXPECT_GT(std::abs(rates[0]), 1);
}

TEST_F(NativeForcesTest, DisabledSubsystemAppliesNothing) {
    const AttachmentForce force(flexible, body.interface("B"), SpatialVec(Vec3(1), Vec3(2)));
    State state = makeState(PointMassMotion::makeRandom(numModes(), 25));
    flexible.getGuts().setNativeForcesEnabled(state, false);
    system.realize(state, Stage::Acceleration);
    EXPECT_EQ(calcGeneralizedForces(state).norm(), 0);
    flexible.getGuts().setNativeForcesEnabled(state, true);
    system.realize(state, Stage::Dynamics);
    EXPECT_GT(calcGeneralizedForces(state).norm(), 1);
}

}  // namespace
}  // namespace simflex::test
