/** @file
Exponential map, its Jacobian, and the motion of frames on a flexible body, against series and
finite differences. **/

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/InterfaceKinematics.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using SimTK::Mat33;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

using Long33 = std::array<std::array<long double, 3>, 3>;

Long33 multiply(const Long33& a, const Long33& b) {
    Long33 product{};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            for (int k = 0; k < 3; ++k) product[i][j] += a[i][k] * b[k][j];
    return product;
}

Long33 skew(const Vec3& v) {
    return {{{0, -(long double)v[2], v[1]},
             {v[2], 0, -(long double)v[0]},
             {-(long double)v[1], v[0], 0}}};
}

void addScaled(const Long33& term, long double factor, Mat33& sum, Long33& total) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            total[i][j] += factor * term[i][j];
            sum(i, j) = double(total[i][j]);
        }
}

/** Σ A^k/k!, Σ A^k/(k+1)! and the derivative of the latter along Ȧ, term by term in long double.
 * **/
struct Series {
    Mat33 exponential, jacobian, jacobianDot;

    Series(const Vec3& theta, const Vec3& thetaDot) {
        const Long33 A = skew(theta), ADot = skew(thetaDot);
        Long33 power{}, powerDot{}, sums[3]{};
        for (int i = 0; i < 3; ++i) power[i][i] = 1;
        long double factorial = 1;  // k!
        for (int k = 0; k < 80; ++k) {
            if (k > 0) factorial *= k;
            addScaled(power, 1 / factorial, exponential, sums[0]);
            addScaled(power, 1 / (factorial * (k + 1)), jacobian, sums[1]);
            addScaled(powerDot, 1 / (factorial * (k + 1)), jacobianDot, sums[2]);
            const Long33 fromDot = multiply(powerDot, A), fromPower = multiply(power, ADot);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) powerDot[i][j] = fromDot[i][j] + fromPower[i][j];
            power = multiply(power, A);
        }
    }
};

Real largestOf(const Mat33& A) {
    Real largest = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) largest = std::max(largest, std::abs(A(i, j)));
    return largest;
}

class ExponentialMapTest : public ::testing::TestWithParam<double> {
protected:
    const Vec3 theta = GetParam() * Vec3(SimTK::UnitVec3(0.3, -0.5, 0.8));
    const Vec3 thetaDot{0.7, 1.3, -0.4};
    const Series series{theta, thetaDot};
};

INSTANTIATE_TEST_SUITE_P(Angles, ExponentialMapTest,
                         ::testing::Values(0.0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-5, 1e-3, 0.009999,
                                           0.010001, 0.1, 0.5, 0.99999, 1.00001, 2.0, 3.14159, 3.2,
                                           6.28318, 9.0));

TEST_P(ExponentialMapTest, ExponentialEqualsItsSeries) {
    EXPECT_LT(largestOf(Mat33(calcExponential(theta)) - series.exponential), 5e-15);
}

TEST_P(ExponentialMapTest, LeftJacobianEqualsItsSeries) {
    EXPECT_LT(largestOf(calcLeftJacobian(theta) - series.jacobian), 2e-15);
}

TEST_P(ExponentialMapTest, DerivativeOfLeftJacobianEqualsItsSeries) {
    EXPECT_LT((calcLeftJacobianDotTimes(theta, thetaDot) - series.jacobianDot * thetaDot).norm(),
              5e-15);
}

TEST_P(ExponentialMapTest, LeftJacobianTurnsRatesIntoAngularVelocity) {
    const Real h = 1e-3;
    const auto at = [&](Real t) { return Mat33(calcExponential(theta + t * thetaDot)); };
    const Mat33 rate = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    const Mat33 expected = SimTK::crossMat(calcLeftJacobian(theta) * thetaDot) * at(0);
    EXPECT_LT(largestOf(rate - expected), 1e-10);
}

TEST_P(ExponentialMapTest, ExponentialIsARotationToRoundOff) {
    const Mat33 R(calcExponential(theta));
    EXPECT_LT(largestOf(~R * R - Mat33(1)), 2e-15);
    EXPECT_NEAR(SimTK::det(R), 1, 2e-15);
}

/** A frame on interface "B" of a point-mass part, shifted and rotated, and a smooth motion of body
and modes. **/
class FlexibleFrameTest : public ::testing::Test {
protected:
    FlexibleFrameTest() {
        const PointMassPart part = makePointMassPart();
        const ReducedBody::Interface& interface = part.body->getInterface("B");
        const auto& s = interface.position;
        frame.shapes = FrameShapes::make(Vec3(s[0], s[1], s[2]), interface.Phi, interface.Psi);
        frame.X_IA = Transform(Rotation(0.7, SimTK::UnitVec3(1, 2, -1)), Vec3(0.05, -0.1, 0.07));
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < frame.numModes(); ++i) {
            xi0.push_back(0.05 * unit(random));
            xiDot0.push_back(unit(random));
            xiDotDot0.push_back(3 * unit(random));
        }
    }

    struct Motion {
        BodyFrame body;
        std::vector<double> xi, xiDot;
    };

    /** ω(t) = ω₀ + ω̇₀t in B to second order; v, ξ likewise. **/
    Motion motionAt(Real t) const {
        Motion motion;
        // R(t) = R₀ exp(ω₀t + ½ω̇₀t²): ω̇ = ω̇₀ at t = 0.
        motion.body.R_GB = R0 * calcExponential(t * omega0 + 0.5 * t * t * omegaDot0);
        motion.body.p_GB = p0 + t * v0 + 0.5 * t * t * vDot0;
        motion.body.v_G = v0 + t * vDot0;
        // Right Jacobian (that of −θ) times the rate.
        motion.body.omega_B =
            calcLeftJacobian(-(t * omega0 + 0.5 * t * t * omegaDot0)) * (omega0 + t * omegaDot0);
        for (int i = 0; i < frame.numModes(); ++i) {
            motion.xi.push_back(xi0[i] + t * xiDot0[i] + 0.5 * t * t * xiDotDot0[i]);
            motion.xiDot.push_back(xiDot0[i] + t * xiDotDot0[i]);
        }
        return motion;
    }

    FrameMotion frameAt(Real t) const {
        const Motion motion = motionAt(t);
        return calcFrameMotion(frame, calcFramePose(frame, motion.xi.data()), motion.body,
                               motion.xiDot.data());
    }

    template <class Function>
    static auto differentiate(Function function) {
        const Real h = 1e-4;  // rotations of milliradians
        return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h);
    }

    std::mt19937 random{11};
    FlexibleFrame frame;
    std::vector<double> xi0, xiDot0, xiDotDot0;
    const Rotation R0{0.9, SimTK::UnitVec3(1, -1, 0.5)};
    const Vec3 p0{1, 2, -0.5}, v0{0.3, -0.7, 1.1}, vDot0{-2, 0.4, 0.8}, omega0{1.2, -0.8, 2.1},
        omegaDot0{-1.5, 2.5, 0.6};
};

TEST_F(FlexibleFrameTest, VelocityIsDerivativeOfPose) {
    const FrameMotion now = frameAt(0);
    const Vec3 velocity = differentiate([&](Real t) { return frameAt(t).X.p(); });
    const Mat33 rate = differentiate([&](Real t) { return Mat33(frameAt(t).X.R()); });
    EXPECT_LT((velocity - now.V[1]).norm(), 1e-10);
    EXPECT_LT(largestOf(rate - SimTK::crossMat(now.V[0]) * Mat33(now.X.R())), 1e-10);
}

TEST_F(FlexibleFrameTest, AccelerationIsDerivativeOfVelocity) {
    const SpatialVec expected = differentiate([&](Real t) { return frameAt(t).V; });
    const Motion now = motionAt(0);
    const SpatialVec actual =
        calcFrameAcceleration(frame, calcFramePose(frame, now.xi.data()), now.body,
                              now.xiDot.data(), omegaDot0, vDot0, xiDotDot0.data());
    EXPECT_LT((actual[0] - expected[0]).norm(), 1e-9);
    EXPECT_LT((actual[1] - expected[1]).norm(), 1e-9);
}

TEST_F(FlexibleFrameTest, AccelerationOfRigidFrameIsDerivativeOfItsVelocity) {
    const auto bodyAt = [&](Real t) {
        const Motion motion = motionAt(t);
        FrameMotion body;
        body.X = Transform(motion.body.R_GB, motion.body.p_GB);
        body.V = {motion.body.R_GB * motion.body.omega_B, motion.body.v_G};
        if (t == 0) body.A = {motion.body.R_GB * omegaDot0, vDot0};
        return body;
    };
    const Transform X_BF(Rotation(0.4, SimTK::ZAxis), Vec3(0.2, -0.3, 0.4));
    const SpatialVec expected =
        differentiate([&](Real t) { return shiftMotion(bodyAt(t), X_BF).V; });
    const FrameMotion actual = shiftMotion(bodyAt(0), X_BF);
    EXPECT_LT((actual.A[0] - expected[0]).norm(), 1e-9);
    EXPECT_LT((actual.A[1] - expected[1]).norm(), 1e-9);
}

TEST_F(FlexibleFrameTest, GeneralizedForceHasThePowerOfTheForceOnTheFrame) {
    const Motion now = motionAt(0);
    const FlexibleFramePose pose = calcFramePose(frame, now.xi.data());
    const SpatialVec force(Vec3(1, -2, 3), Vec3(-4, 5, 6));
    Vec3 torque_B(0), force_G(0);
    std::vector<double> modal(frame.numModes(), 0.0);
    addInFrameForce(frame, pose, now.body.R_GB, force, torque_B, force_G, modal.data());
    Real power = ~torque_B * now.body.omega_B + ~force_G * now.body.v_G;
    for (int i = 0; i < frame.numModes(); ++i) power += modal[i] * now.xiDot[i];
    const SpatialVec V = frameAt(0).V;
    const Real expected = ~force[0] * V[0] + ~force[1] * V[1];
    EXPECT_NEAR(power, expected, 1e-13 * std::abs(expected));
}

TEST_F(FlexibleFrameTest, ConstraintRowTimesSpeedsIsErrorRate) {
    const Motion now = motionAt(0);
    const SpatialVec d(Vec3(0.3, -0.1, 0.6), Vec3(1, 0.2, -0.5));
    std::vector<double> row(6 + frame.numModes(), 1.0);  // rows are added to
    addInConstraintRow(frame, calcFramePose(frame, now.xi.data()), now.body.R_GB, d, row.data());
    Real rate = 0;
    for (int a = 0; a < 3; ++a)
        rate += (row[a] - 1) * now.body.omega_B[a] + (row[3 + a] - 1) * now.body.v_G[a];
    for (int i = 0; i < frame.numModes(); ++i) rate += (row[6 + i] - 1) * now.xiDot[i];
    const SpatialVec V = frameAt(0).V;
    EXPECT_NEAR(rate, ~d[0] * V[0] + ~d[1] * V[1], 1e-13);
}

TEST_F(FlexibleFrameTest, OrientationStaysOrthogonalForLargeDeformation) {
    for (const double factor : {1.0, 10.0, 100.0, 1000.0}) {
        std::vector<double> xi = xi0;
        for (double& value : xi) value *= factor;
        const FlexibleFramePose pose = calcFramePose(frame, xi.data());
        const Mat33 R(pose.R_BA);
        EXPECT_LT(largestOf(~R * R - Mat33(1)), 4e-15) << "theta " << pose.theta.norm();
        EXPECT_NEAR(pose.rho.norm(), frame.X_IA.p().norm(), 1e-15);
    }
}

}  // namespace
}  // namespace simflex::test
