/** @file
What FlexibleBodySubsystem applies when Simbody realizes Stage::Dynamics, against the point masses.
**/

#include <gmock/gmock.h>
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

    /** Applied forces for each Simbody mobility: those on bodies brought to the mobilities, and
     * those on them. **/
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

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem general{system};
    FlexibleBodySubsystem flexible{system, matter};
    const PointMassPart part = makePointMassPart();
    FlexibleBody body;
};

TEST_F(NativeForcesTest, AppliedForcesAreMinusVelocityTermsElasticityAndDamping) {
    const ModalDamping damping(flexible, body, 0.03);
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 21);
    const State state = makeState(motion);
    system.realize(state, Stage::Dynamics);

    // Inertia forces of the masses at zero accelerations; Simbody has ω×I₀ω already.
    motion.omegaDot_B.setZero();
    motion.vDot_G.setZero();
    motion.xiDotDot.setZero();
    const Eigen::VectorXd inertia = calcInertiaForces(part, motion);
    const auto& I = part.body->inertia;
    Eigen::Matrix3d I0;
    I0 << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
    const Eigen::Vector3d own = motion.omega_B.cross(I0 * motion.omega_B);
    const Eigen::Vector3d torque_G = -motion.R_GB * (inertia.head<3>() - own);
    const Eigen::Map<const Eigen::VectorXd> omegaSquared(part.body->omegaSquared.data(),
                                                         numModes());
    const Eigen::VectorXd modes = -inertia.tail(numModes()) - omegaSquared.cwiseProduct(motion.xi) -
                                  0.06 * omegaSquared.cwiseSqrt().cwiseProduct(motion.xiDot);

    const auto& bodyForces = system.getRigidBodyForces(state, Stage::Dynamics);
    const MobilizedBodyIndex frame = body.getFrame().getMobilizedBodyIndex();
    EXPECT_LT((bodyForces[frame][0] - toSimTK(torque_G)).norm(), 1e-13);
    EXPECT_LT(bodyForces[frame][1].norm(), 1e-14);
    const Vector& mobilityForces = system.getMobilityForces(state, Stage::Dynamics);
    EXPECT_LT((getModes(state, mobilityForces) - modes).norm(), 1e-13 * modes.norm());
    for (int k = 0; k < body.getNumModalMobilizers(); ++k) {
        const SpatialVec& onCarrier = bodyForces[body.getModalMobilizer(k).getMobilizedBodyIndex()];
        EXPECT_EQ(onCarrier[0].norm() + onCarrier[1].norm(), 0);
    }
}

/** Undeformed, ΔM vanishes, and Simbody's own accelerations must be exact. **/
TEST_F(NativeForcesTest, UndeformedBodyHasExactNativeAccelerations) {
    const SimTK::Force::Gravity gravity(general, matter, Vec3(1, -9, 2));
    const SpatialVec load(Vec3(1, -2, 3), Vec3(4, 5, -6));
    const AttachmentForce force(flexible, body.interface("B"), load);
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 22, 0);
    const State state = makeState(motion);
    ::testing::internal::CaptureStderr();
    system.realize(state, Stage::Acceleration);
    ::testing::internal::GetCapturedStderr();

    const SpatialVec A = body.getFrame().getBodyAcceleration(state);
    motion.omegaDot_B = motion.R_GB.transpose() * toEigen(A[0]);
    motion.vDot_G = toEigen(A[1]);
    motion.xiDotDot = getModes(state, state.getUDot());

    // d'Alembert: virtual power of inertia, weight and load, for each speed.
    const ReducedBody::Interface& seat = part.body->getInterface("B");
    const Eigen::Vector3d s(seat.position[0], seat.position[1], seat.position[2]), g(1, -9, 2);
    const Eigen::Vector3d torque = motion.R_GB.transpose() * toEigen(load[0]),
                          push = motion.R_GB.transpose() * toEigen(load[1]);
    const Eigen::Map<const Eigen::Matrix3Xd> Phi(seat.Phi.data(), 3, numModes()),
        Psi(seat.Psi.data(), 3, numModes());
    Eigen::VectorXd applied(6 + numModes());
    applied << torque + s.cross(push), part.body->mass * g + toEigen(load[1]),
        Phi.transpose() * push + Psi.transpose() * torque;
    const Eigen::VectorXd inertia = calcInertiaForces(part, motion);
    EXPECT_LT((inertia - applied).norm(), 1e-12 * applied.norm());
}

TEST_F(NativeForcesTest, PotentialEnergyFallsByTheWorkOfItsForces) {
    const SimTK::Force::Gravity gravity(general, matter, Vec3(1, -9, 2));
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 23, 0.01);
    motion.omega_B.setZero();  // no velocity terms but those of ξ̇ alone, which have no power
    State state = makeState(motion);
    system.realize(state, Stage::Dynamics);
    const Real power = ~calcGeneralizedForces(state) * state.getU();
    const Vector q = state.getQ(), qDot = state.getQDot();
    const auto energyAt = [&](Real t) {
        state.updQ() = q + t * qDot;
        system.realize(state, Stage::Dynamics);
        return system.calcPotentialEnergy(state);
    };
    const Real h = 1e-3, slope = (energyAt(h) - energyAt(-h)) / (2 * h);
    EXPECT_NEAR(slope, -power, 1e-9 * std::abs(power));
}

/** The power of the velocity terms is the rate by which ½uᵀM(q)u changes with q alone … minus
 * Simbody's part. **/
TEST_F(NativeForcesTest, VelocityForcesKeepTheEnergyOfFreeMotion) {
    // d/dt ½uᵀMu = uᵀM u̇ + ½uᵀṀu vanishes along M u̇ = −h: uᵀh = ½uᵀṀu, with h of d'Alembert at zero
    // accelerations.
    PointMassMotion motion = PointMassMotion::makeRandom(numModes(), 24);
    const auto energyAt = [&](double t) {
        PointMassMotion moved = motion;
        moved.xi += t * motion.xiDot;
        return test::calcKineticEnergy(part, moved);
    };
    const double slope = (energyAt(1e-3) - energyAt(-1e-3)) / 2e-3;
    const State state = makeState(motion);
    system.realize(state, Stage::Dynamics);
    Eigen::VectorXd elastic(numModes());
    for (int i = 0; i < numModes(); ++i) elastic[i] = part.body->omegaSquared[i] * motion.xi[i];
    const Real power = ~calcGeneralizedForces(state) * state.getU() + elastic.dot(motion.xiDot);
    EXPECT_NEAR(power, -slope, 1e-9 * elastic.norm());
}

TEST_F(NativeForcesTest, DisabledSubsystemAppliesNothingAndWarnsOfNothing) {
    const AttachmentForce force(flexible, body.interface("B"), SpatialVec(Vec3(1), Vec3(2)));
    State state = makeState(PointMassMotion::makeRandom(numModes(), 25));
    flexible.getGuts().setNativeForcesEnabled(state, false);
    ::testing::internal::CaptureStderr();
    system.realize(state, Stage::Acceleration);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(calcGeneralizedForces(state).norm(), 0);
    flexible.getGuts().setNativeForcesEnabled(state, true);
    system.realize(state, Stage::Dynamics);
    EXPECT_GT(calcGeneralizedForces(state).norm(), 1);
}

TEST_F(NativeForcesTest, MissingInertiaCouplingIsSaidOnce) {
    State state = makeState(PointMassMotion::makeRandom(numModes(), 26));
    ::testing::internal::CaptureStderr();
    system.realize(state, Stage::Dynamics);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    ::testing::internal::CaptureStderr();
    system.realize(state, Stage::Acceleration);
    EXPECT_THAT(::testing::internal::GetCapturedStderr(),
                ::testing::AllOf(::testing::HasSubstr("inertia coupling"),
                                 ::testing::HasSubstr("BdfIntegrator")));
    ::testing::internal::CaptureStderr();
    state.setTime(1);
    system.realize(state, Stage::Acceleration);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace simflex::test
