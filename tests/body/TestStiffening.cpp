/** @file
Bodies with geometric stiffening: the switch, second-order frames against finite differences, energy
against the part's matrices. **/

#include <gmock/gmock.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

PointMassPart makePart(double stiffening) {
    PointMassPartOptions options;
    options.stiffening = stiffening;
    return makePointMassPart(options);
}

class StiffenedFrame : public ::testing::Test {
protected:
    StiffenedFrame() {
        const PointMassPart part = makePart(2);
        const FlexibleBodyModel model(part.body);
        frame.shapes = model.getInterfaceShapes("B");
        frame.X_IA = Transform(Rotation(0.7, UnitVec3(1, 2, -1)), Vec3(0.05, -0.1, 0.07));
        K = part.body->stiffening->interfaces[1];
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < frame.numModes(); ++i) {
            xi0.push_back(0.2 * unit(random));
            xiDot0.push_back(unit(random));
            xiDotDot0.push_back(3 * unit(random));
        }
    }

    struct Motion {
        BodyFrame body;
        std::vector<double> xi, xiDot;
    };

    Motion motionAt(Real t) const {
        Motion motion;
        const Vec3 turn = t * omega0 + 0.5 * t * t * omegaDot0;
        motion.body.R_GB = R0 * calcExponential(turn);
        motion.body.p_GB = t * v0 + 0.5 * t * t * vDot0;
        motion.body.v_G = v0 + t * vDot0;
        motion.body.omega_B = calcLeftJacobian(-turn) * (omega0 + t * omegaDot0);
        for (int i = 0; i < frame.numModes(); ++i) {
            motion.xi.push_back(xi0[i] + t * xiDot0[i] + 0.5 * t * t * xiDotDot0[i]);
            motion.xiDot.push_back(xiDot0[i] + t * xiDotDot0[i]);
        }
        return motion;
    }

    FrameMotion frameAt(Real t) const {
        const Motion motion = motionAt(t);
        return FrameAtXi(frame, motion.xi.data(), FrameAtXi::Order::Second)
            .calcMotion(motion.body, motion.xiDot.data());
    }

    template <class Function>
    static auto differentiate(Function function) {
        const Real h = 1e-4;
        return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h);
    }

    std::mt19937 random{5};
    FlexibleFrame frame;
    std::array<std::vector<double>, 6> K;
    std::vector<double> xi0, xiDot0, xiDotDot0;
    const Rotation R0{0.9, UnitVec3(1, -1, 0.5)};
    const Vec3 v0{0.3, -0.7, 1.1}, vDot0{-2, 0.4, 0.8}, omega0{1.2, -0.8, 2.1},
        omegaDot0{-1.5, 2.5, 0.6};
};

TEST_F(StiffenedFrame, DisplacementAndRotationVectorAreThoseOfSecondOrder) {
    frame.X_IA = Transform();
    const FlexibleFramePose pose = FrameAtXi(frame, xi0.data(), FrameAtXi::Order::Second).getPose();
    const FrameSums linear = multiplyShapes(*frame.shapes, xi0.data());
    const int n = frame.numModes();
    for (int a = 0; a < 6; ++a) {
        double second = 0;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                second -= 0.5 * K[size_t(a)][size_t(i + n * j)] * xi0[i] * xi0[j];
        const Real expected =
            second + (a < 3 ? linear.translation[a] + frame.shapes->s[a] : linear.rotation[a - 3]);
        EXPECT_NEAR(a < 3 ? pose.r[a] : pose.theta[a - 3], expected, 1e-14);
        EXPECT_GT(std::abs(second), 1e-3);
    }
}

TEST_F(StiffenedFrame, VelocityIsDerivativeOfPose) {
    const FrameMotion now = frameAt(0);
    const Vec3 velocity = differentiate([&](Real t) { return frameAt(t).X.p(); });
    const Mat33 rate = differentiate([&](Real t) { return Mat33(frameAt(t).X.R()); });
    EXPECT_LT((velocity - now.V[1]).norm(), 1e-10);
    EXPECT_LT((rate - crossMat(now.V[0]) * Mat33(now.X.R())).norm(), 1e-10);
}

TEST_F(StiffenedFrame, AccelerationIsDerivativeOfVelocity) {
    const SpatialVec expected = differentiate([&](Real t) { return frameAt(t).V; });
    const Motion now = motionAt(0);
    const SpatialVec actual =
        FrameAtXi(frame, now.xi.data(), FrameAtXi::Order::Second)
            .calcAcceleration(now.body, now.xiDot.data(), omegaDot0, vDot0, xiDotDot0.data());
    EXPECT_LT((actual[0] - expected[0]).norm(), 1e-9);
    EXPECT_LT((actual[1] - expected[1]).norm(), 1e-9);
}

TEST_F(StiffenedFrame, GeneralizedForceHasThePowerOfTheForceOnTheFrame) {
    const Motion now = motionAt(0);
    const FrameAtXi at(frame, now.xi.data(), FrameAtXi::Order::Second);
    const SpatialVec force(Vec3(1, -2, 3), Vec3(-4, 5, 6));
    Vec3 torque_B(0), force_G(0);
    std::vector<double> modal(frame.numModes(), 0.0);
    addInFrameForce(at.getTangent(), at.getPose(), now.body.R_GB, force, torque_B, force_G,
                    modal.data());
    Real power = ~torque_B * now.body.omega_B + ~force_G * now.body.v_G;
    for (int i = 0; i < frame.numModes(); ++i) power += modal[i] * now.xiDot[i];
    const SpatialVec V = frameAt(0).V;
    const Real expected = ~force[0] * V[0] + ~force[1] * V[1];
    EXPECT_NEAR(power, expected, 1e-13 * std::abs(expected));
}

TEST_F(StiffenedFrame, FrameWithoutCurvatureIsOfFirstOrder) {
    auto plain = std::make_shared<FrameShapes>(*frame.shapes);
    plain->curvature.clear();
    const FlexibleFrame node{plain, frame.X_IA};
    const auto pose = FrameAtXi(node, xi0.data(), FrameAtXi::Order::Second).getPose();
    EXPECT_EQ(pose.r, calcFramePose(node, xi0.data()).r);
}

class StiffenedBody : public ::testing::Test {
protected:
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
};

TEST_F(StiffenedBody, StiffeningIsOnIfThePartHasItAndCanBeSwitched) {
    FlexibleBody body(flexible, makePart(1).body), off(flexible, makePart(1).body);
    off.setStiffeningDisabledByDefault(true);
    State state = system.realizeTopology();
    EXPECT_TRUE(body.hasStiffening());
    EXPECT_TRUE(body.isStiffeningEnabled(state));
    EXPECT_FALSE(off.isStiffeningEnabled(state));
    off.enableStiffening(state);
    body.disableStiffening(state);
    EXPECT_TRUE(off.isStiffeningEnabled(state));
    EXPECT_FALSE(body.isStiffeningEnabled(state));
    system.realize(state, Stage::Velocity);
    body.enableStiffening(state);
    EXPECT_LT(state.getSystemStage(), Stage::Instance);
}

TEST_F(StiffenedBody, AskingForItWithoutDataSaysHowToGetThem) {
    FlexibleBody body(flexible, makePart(0).body, "blade");
    State state = system.realizeTopology();
    EXPECT_FALSE(body.hasStiffening());
    EXPECT_FALSE(body.isStiffeningEnabled(state));
    body.disableStiffening(state);
    body.setStiffeningDisabledByDefault(true);
    for (const auto& ask :
         {std::function<void()>([&] { body.enableStiffening(state); }),
          std::function<void()>([&] { body.setStiffeningDisabledByDefault(false); })})
        try {
            ask();
            ADD_FAILURE() << "accepted";
        } catch (const std::invalid_argument& error) {
            EXPECT_THAT(error.what(), AllOf(HasSubstr("'blade'"), HasSubstr("masses1"),
                                            HasSubstr("simflex reduce --stiffening")));
        }
}

TEST_F(StiffenedBody, KineticEnergyIsLessByTheStiffnessOfTurning) {
    const FlexibleBody body(flexible, makePart(2).body);
    State state = system.realizeTopology();
    Vector xi(body.getNumModes());
    for (int i = 0; i < xi.size(); ++i) xi[i] = 0.1 * std::cos(i);
    body.setModalCoordinates(state, xi);
    const Rotation R(0.7, UnitVec3(1, 2, 3));
    body.setFramePose(state, Transform(R));
    const Vec3 omega_B(3, -2, 4);
    body.setFrameVelocity(state, SpatialVec(R * omega_B, Vec3(0)));
    system.realize(state, Stage::Velocity);
    const Real stiffened = body.calcKineticEnergy(state);
    const Vec3 spin = ~R * body.calcMomentum(state)[0];
    body.disableStiffening(state);
    system.realize(state, Stage::Velocity);

    // T loses ½ Σ_ab ω_aω_b ξᵀK_abξ over all nine ab; angular momentum ∂T/∂ω goes with it.
    const int n = xi.size();
    const int at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    Mat33 inertia(0);
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j)
                    inertia(a, b) +=
                        body.getPart().stiffening->turning[size_t(at[a][b])][size_t(i + n * j)] *
                        xi[i] * xi[j];
    const Real expected = 0.5 * ~omega_B * (inertia * omega_B);
    EXPECT_NEAR(body.calcKineticEnergy(state) - stiffened, expected, 1e-12);
    EXPECT_LT((~R * body.calcMomentum(state)[0] - spin - inertia * omega_B).norm(), 1e-12);
    EXPECT_GT(std::abs(expected), 1e-2);
}

}  // namespace
}  // namespace simflex::test
