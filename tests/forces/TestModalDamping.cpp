/** @file
Modal damping against the decay of a free oscillation in closed form. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <limits>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

class ModalDampingTest : public ::testing::Test {
protected:
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    const std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    const FlexibleBody body{flexible, part, "crank"};
};

TEST_F(ModalDampingTest, CoefficientsAreTwiceRatioTimesFrequencyAndAddUp) {
    Vector ratios(part->numModes);
    for (int i = 0; i < ratios.size(); ++i) ratios[i] = 0.01 * i;
    const ModalDamping perMode(flexible, body, ratios), uniform(flexible, body, 0.05);
    const FlexibleBody other(flexible, part, "other");
    const Eigen::VectorXd& damping = flexible.getGuts().body(body.getIndex()).damping;
    for (int i = 0; i < part->numModes; ++i)
        EXPECT_DOUBLE_EQ(damping[i], 2 * (0.01 * i + 0.05) * std::sqrt(part->omegaSquared[i]));
    EXPECT_TRUE(flexible.getGuts().body(other.getIndex()).damping.isZero(0));
}

/** One mode vibrates alone on a body with a fixed frame: ξ = e^(−ζΩt)(cos Ω_d t + ζΩ/Ω_d sin Ω_d
t). **/
TEST_F(ModalDampingTest, FreeOscillationDecaysAsInClosedForm) {
    const double ratio = 0.04;
    const ModalDamping damping(flexible, body, ratio);
    State state = system.realizeTopology();
    body.getFrame().lock(state);
    const double xi0 = 1;  // linear at any size, since the frame does not rotate
    Vector xi(part->numModes, Real(0));
    xi[4] = xi0;
    body.setModalCoordinates(state, xi);
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-10);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    const double Omega = std::sqrt(part->omegaSquared[4]), rate = ratio * Omega;
    const double turned = Omega * std::sqrt(1 - ratio * ratio), end = 5.3 / Omega;
    stepper.stepTo(end);
    const double expected = xi0 * std::exp(-rate * end) *
                            (std::cos(turned * end) + rate / turned * std::sin(turned * end));
    EXPECT_NEAR(body.getModalCoordinates(stepper.getState())[4], expected, 1e-7 * xi0);
}

TEST_F(ModalDampingTest, RayleighAndFrequencyBandsFollowTheirFormulas) {
    const FlexibleBody other(flexible, part, "other");
    ModalDamping::rayleigh(flexible, body, 3, 2e-4);
    ModalDamping::byFrequency(flexible, other);
    const auto& records = flexible.getGuts().bodies();
    bool hasBand[3] = {};
    for (int i = 0; i < part->numModes; ++i) {
        const double Omega = std::sqrt(part->omegaSquared[size_t(i)]), frequency = Omega / (2 * Pi);
        EXPECT_DOUBLE_EQ(records[0].damping[i], 3 + 2e-4 * Omega * Omega);
        const int band = frequency < 100 ? 0 : frequency < 1000 ? 1 : 2;
        const double ratios[] = {0.01, 0.1, 1};
        EXPECT_DOUBLE_EQ(records[1].damping[i], 2 * ratios[band] * Omega);
        hasBand[band] = true;
    }
    EXPECT_TRUE(hasBand[0] && hasBand[1]);
}

/** Free decay of coupled modes on a fixed frame, natively and by BDF, against e^(At). **/
TEST_F(ModalDampingTest, FullMatrixDecaysAsTheMatrixExponential) {
    const int n = part->numModes;
    Eigen::MatrixXd root(n, n);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) root(i, j) = std::sin(1.3 * i + 2.1 * j * j);
    const Eigen::MatrixXd D = 10 * root * root.transpose();
    Matrix given(n, n);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) given(i, j) = D(i, j);
    ModalDamping::matrix(flexible, body, given);
    ModalDamping(flexible, body, 0.01);

    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    A.topRightCorner(n, n).setIdentity();
    for (int i = 0; i < n; ++i) {
        A(n + i, i) = -part->omegaSquared[size_t(i)];
        A(n + i, n + i) = -2 * 0.01 * std::sqrt(part->omegaSquared[size_t(i)]);
    }
    A.bottomRightCorner(n, n) -= D;
    Eigen::VectorXd start = Eigen::VectorXd::Zero(2 * n);
    start[1] = start[4] = 1;
    const double end = 0.02;
    const Eigen::EigenSolver<Eigen::MatrixXd> eigen(A);
    const Eigen::VectorXcd weights =
        eigen.eigenvectors().lu().solve(start.cast<std::complex<double>>());
    const Eigen::VectorXd expected =
        (eigen.eigenvectors() *
         ((eigen.eigenvalues() * end).array().exp() * weights.array()).matrix())
            .real();

    State state = system.realizeTopology();
    body.getFrame().lock(state);
    Vector xi(n, Real(0));
    xi[1] = xi[4] = 1;
    body.setModalCoordinates(state, xi);
    const auto differenceOf = [&](const State& reached) {
        const Vector now = body.getModalCoordinates(reached);
        double largest = 0;
        for (int i = 0; i < n; ++i) largest = std::max(largest, std::abs(now[i] - expected[i]));
        return largest;
    };
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(end);
    EXPECT_LT(differenceOf(stepper.getState()), 1e-6);

    system.realize(state, Stage::Dynamics);
    const Real energy = flexible.calcEnergy(state);
    double differences[2];
    for (int k = 0; k < 2; ++k) {
        BdfIntegrator bdf(system);
        bdf.setAccuracy(k ? 1e-8 : 1e-6);
        bdf.setProjectInitialState(false);  // modes of unit size
        bdf.initialize(state);
        bdf.stepTo(end);
        differences[k] = differenceOf(bdf.getState());
        system.realize(bdf.getState(), Stage::Dynamics);
        const Real kept = flexible.calcEnergy(bdf.getState());
        EXPECT_LT(kept, 0.9 * energy);
        EXPECT_NEAR(kept - bdf.getWork(), energy, (k ? 1e-4 : 1e-2) * energy);
    }
    EXPECT_LT(differences[1], differences[0] / 10);  // accuracy^(2/3): 21
}

TEST_F(ModalDampingTest, BadMatricesAreNamed) {
    const auto messageOf = [&](const Matrix& D) -> std::string {
        try {
            ModalDamping::matrix(flexible, body, D);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    const int n = part->numModes;
    EXPECT_THAT(messageOf(Matrix(2, 3, Real(0))), HasSubstr("the matrix is 2x3; it must be 11x11"));
    Matrix D(n, n, Real(0));
    D(0, 0) = -1;
    EXPECT_THAT(messageOf(D), HasSubstr("'crank': the matrix has the eigenvalue -1"));
    D(0, 1) = 2;
    EXPECT_THAT(messageOf(D), HasSubstr("not symmetric"));
    D(0, 1) = NaN;
    EXPECT_THAT(messageOf(D), HasSubstr("not a number"));
}

TEST_F(ModalDampingTest, BadRatiosAreNamed) {
    const auto messageOf = [](auto action) -> std::string {
        try {
            action();
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, -0.02); }),
                ::testing::AllOf(HasSubstr("crank"), HasSubstr("-0.02"), HasSubstr("0 or more")));
    EXPECT_THAT(
        messageOf([&] { ModalDamping(flexible, body, std::numeric_limits<double>::quiet_NaN()); }),
        HasSubstr("nan"));
    Vector ratios(part->numModes, 0.01);
    ratios[3] = std::numeric_limits<double>::infinity();
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, ratios); }), HasSubstr("mode 4"));
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, Vector(3, 0.01)); }),
                ::testing::AllOf(HasSubstr("3 ratios"), HasSubstr("11 modes")));
}

}  // namespace
}  // namespace simflex::test
