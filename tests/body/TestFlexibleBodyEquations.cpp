/** @file
Equations of motion of one flexible body against its point masses, which do not use modal
invariants. **/

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBodyEquations.h"
#include "support/PointMassMotion.h"

namespace simflex::test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

class FlexibleBodyEquationsTest : public ::testing::TestWithParam<int> {
protected:
    FlexibleBodyEquationsTest()
        : n(GetParam()),
          part(makePart(n)),
          model(part.body),
          motion(PointMassMotion::makeRandom(n, 100 + unsigned(n))) {
        data.resize(model);
        calcInertia(model, motion.xi, motion.xiDot, data);
    }

    static PointMassPart makePart(int numModes) {
        PointMassPartOptions options;
        options.seed = 40 + unsigned(numModes);
        options.numModes = numModes;
        return makePointMassPart(options);
    }

    /** Returns the library's M·(ω̇, v̇, ξ̈). **/
    VectorXd multiplyByMass(const VectorXd& uDot) const {
        Vector3d rotation = Vector3d::Zero();
        VectorXd modes = VectorXd::Zero(n), product(6 + n);
        addInInertiaTerms(data, uDot.head<3>(), uDot.tail(n), rotation, modes);
        product << rotation, model.mass * uDot.segment<3>(3), modes;
        return product;
    }

    /** Mass matrix as second derivative of the masses' kinetic energy, by polarisation: T is
     * quadratic in u. **/
    MatrixXd differentiateKineticEnergyTwice() const {
        const auto energyAt = [&](const VectorXd& u) {
            PointMassMotion moved = motion;
            moved.omega_B = u.head<3>();
            moved.v_G = u.segment<3>(3);
            moved.xiDot = u.tail(n);
            return test::calcKineticEnergy(part, moved);
        };
        MatrixXd M(6 + n, 6 + n);
        const MatrixXd unit = MatrixXd::Identity(6 + n, 6 + n);
        for (int i = 0; i < 6 + n; ++i)
            for (int j = 0; j < 6 + n; ++j)
                M(i, j) = energyAt(unit.col(i) + unit.col(j)) - energyAt(unit.col(i)) -
                          energyAt(unit.col(j));
        return M;
    }

    int n;
    PointMassPart part;
    FlexibleBodyModel model;
    PointMassMotion motion;
    FlexibleBodyData data;
};

INSTANTIATE_TEST_SUITE_P(Modes, FlexibleBodyEquationsTest, ::testing::Values(1, 6, 11, 23, 42));

TEST_P(FlexibleBodyEquationsTest, MassMatrixIsSecondDerivativeOfKineticEnergyOfMasses) {
    const MatrixXd expected = differentiateKineticEnergyTwice();
    for (int j = 0; j < 6 + n; ++j) {
        const VectorXd column = multiplyByMass(VectorXd::Unit(6 + n, j));
        EXPECT_LT((column - expected.col(j)).cwiseAbs().maxCoeff(), 1e-14 * part.body->mass)
            << "column " << j;
    }
}

TEST_P(FlexibleBodyEquationsTest, InertiaPartOfNewtonMatrixIsSecondDerivativeOfKineticEnergy) {
    const double gamma = 1e-4;
    calcInertia(model, motion.xi, VectorXd::Zero(n), data);
    MatrixXd J(6 + n, 6 + n);
    calcNewtonMatrix(model, data, gamma, gamma, Vector3d::Zero(), Vector3d::Zero(),
                     VectorXd::Zero(n), VectorXd::Zero(n), VectorXd::Zero(n), J);
    J.diagonal().tail(n) -= gamma * model.omegaSquared;
    EXPECT_LT((gamma * J - differentiateKineticEnergyTwice()).cwiseAbs().maxCoeff(),
              1e-14 * part.body->mass);
}

TEST_P(FlexibleBodyEquationsTest, KineticEnergyIsThatOfMasses) {
    const double expected = test::calcKineticEnergy(part, motion);
    EXPECT_NEAR(simflex::calcKineticEnergy(model, data, motion.omega_B, motion.v_G, motion.xiDot),
                expected, 1e-14 * expected);
}

TEST_P(FlexibleBodyEquationsTest, EquationsObeyDAlembertsPrincipleOnMasses) {
    const VectorXd expected = calcInertiaForces(part, motion);
    Vector3d rotation;
    VectorXd modes(n), actual(6 + n);
    calcVelocityTerms(model, data, motion.omega_B, rotation, modes);
    addInInertiaTerms(data, motion.omegaDot_B, motion.xiDotDot, rotation, modes);
    actual << rotation, model.mass * motion.vDot_G, modes;
    EXPECT_LT((actual - expected).norm(), 1e-13 * expected.norm());
}

/** Lagrange's equations for coordinates (θ, ξ), R = R₀ exp(θ), at θ = 0 where θ̈ = ω̇. **/
TEST_P(FlexibleBodyEquationsTest, VelocityTermsAreThoseOfNumericallyDifferentiatedLagrangian) {
    // T(θ, ξ, θ̇, ξ̇) with ω = J(θ)θ̇, J = Σ(−[θ]×)^k/(k+1)! the right Jacobian.
    const auto energyAt = [&](const VectorXd& q, const VectorXd& qDot) {
        Vector3d power = qDot.head<3>(), omega = power;
        for (int k = 1; k < 12; ++k) {
            power = -Vector3d(q.head<3>()).cross(power) / (k + 1);
            omega += power;
        }
        PointMassMotion moved = motion;
        moved.omega_B = omega;
        moved.v_G.setZero();
        moved.xi = q.tail(n);
        moved.xiDot = qDot.tail(n);
        return test::calcKineticEnergy(part, moved);
    };
    const auto momentumAt = [&](const VectorXd& q, const VectorXd& qDot, int i) {
        const VectorXd unit = VectorXd::Unit(3 + n, i);
        return (energyAt(q, qDot + unit) - energyAt(q, qDot - unit)) / 2;
    };
    const auto differentiate = [](auto function) {
        const double h = 1e-3;
        return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h);
    };
    VectorXd q(3 + n), qDot(3 + n), expected(3 + n), actual(3 + n);
    q << Vector3d::Zero(), motion.xi;
    qDot << motion.omega_B, motion.xiDot;
    for (int i = 0; i < 3 + n; ++i)
        expected[i] = differentiate([&](double h) { return momentumAt(q + h * qDot, qDot, i); }) -
                      differentiate([&](double h) {
                          return energyAt(q + h * VectorXd::Unit(3 + n, i), qDot);
                      });

    Vector3d rotation;
    VectorXd modes(n);
    calcVelocityTerms(model, data, motion.omega_B, rotation, modes);
    actual << rotation, modes;
    EXPECT_LT((actual - expected).norm(), 1e-9 * expected.norm());
}

TEST_P(FlexibleBodyEquationsTest, NewtonMatrixIsDerivativeOfFullResidual) {
    std::mt19937 random(7);
    const VectorXd damping = makeRandomVector(n, 5, random).cwiseAbs();
    for (const double gamma : {1e-5, 1e-3, 0.1}) {
        // r(u + δ), with ξ + γδ and u̇ + δ/γ.
        const auto residualAt = [&](const VectorXd& delta) {
            const VectorXd xi = motion.xi + gamma * delta.tail(n),
                           xiDot = motion.xiDot + delta.tail(n);
            const VectorXd xiDotDot = motion.xiDotDot + delta.tail(n) / gamma;
            const Vector3d omega = motion.omega_B + delta.head<3>();
            FlexibleBodyData moved;
            moved.resize(model);
            calcInertia(model, xi, xiDot, moved);
            Vector3d rotation;
            VectorXd modes(n), residual(6 + n);
            calcVelocityTerms(model, moved, omega, rotation, modes);
            addInInertiaTerms(moved, motion.omegaDot_B + delta.head<3>() / gamma, xiDotDot,
                              rotation, modes);
            modes += damping.cwiseProduct(xiDot) + model.omegaSquared.cwiseProduct(xi);
            residual << rotation, model.mass * (motion.vDot_G + delta.segment<3>(3) / gamma), modes;
            return residual;
        };
        MatrixXd expected(6 + n, 6 + n), actual(6 + n, 6 + n);
        for (int j = 0; j < 6 + n; ++j) {
            // The residual is a polynomial of degree 4: this difference has only round-off errors.
            const VectorXd step = 0.1 * VectorXd::Unit(6 + n, j);
            expected.col(j) = (8 * (residualAt(step) - residualAt(-step)) -
                               (residualAt(2 * step) - residualAt(-2 * step))) /
                              1.2;
        }
        calcNewtonMatrix(model, data, gamma, gamma, motion.omega_B, motion.omegaDot_B, motion.xiDot,
                         motion.xiDotDot, damping, actual);
        // Each row relative to its largest entry, so that stiff terms do not hide small ones.
        for (int i = 0; i < 6 + n; ++i) {
            const double roundOff =
                1e-15 * std::max(expected.row(i).cwiseAbs().maxCoeff(),
                                 10 * std::abs(residualAt(VectorXd::Zero(6 + n))[i]));
            EXPECT_LT((actual.row(i) - expected.row(i)).cwiseAbs().maxCoeff(), 1e3 * roundOff)
                << "row " << i << ", gamma " << gamma;
        }
    }
}

TEST_P(FlexibleBodyEquationsTest, NewtonMatrixHasEveryGyroscopicTermAtHighSpeed) {
    // Without the dominant stiffness and inertia: J − M/γ − γΩ² at ω of 100 rad/s.
    const double gamma = 1e-3;
    const Vector3d omega = 50 * motion.omega_B;
    const auto velocityTermsAt = [&](const VectorXd& delta) {
        FlexibleBodyData moved;
        moved.resize(model);
        calcInertia(model, motion.xi + gamma * delta.tail(n), motion.xiDot + delta.tail(n), moved);
        Vector3d rotation;
        VectorXd modes(n), terms(6 + n);
        calcVelocityTerms(model, moved, omega + delta.head<3>(), rotation, modes);
        terms << rotation, Vector3d::Zero(), modes;
        return terms;
    };
    MatrixXd J(6 + n, 6 + n);
    calcNewtonMatrix(model, data, gamma, gamma, omega, Vector3d::Zero(), motion.xiDot,
                     VectorXd::Zero(n), VectorXd::Zero(n), J);
    J.diagonal().tail(n) -= gamma * model.omegaSquared;
    for (int j = 0; j < 6 + n; ++j) {
        const VectorXd step = VectorXd::Unit(6 + n, j);
        const VectorXd difference = (8 * (velocityTermsAt(step) - velocityTermsAt(-step)) -
                                     (velocityTermsAt(2 * step) - velocityTermsAt(-2 * step))) /
                                    12;
        const VectorXd actual = J.col(j) - multiplyByMass(step) / gamma;
        EXPECT_LT((actual - difference).norm(), 1e-10 * (1 + difference.norm())) << "column " << j;
    }
}

TEST(PointMassPartTest, AccelerationsOfMassesAreDerivativesOfTheirVelocities) {
    const PointMassPart part = makePointMassPart();
    const PointMassMotion start = PointMassMotion::makeRandom(part.body->numModes, 3);
    const auto velocitiesAt = [&](double t) {
        PointMassMotion motion = start;
        const Vector3d turn = t * start.omega_B;
        motion.R_GB =
            start.R_GB * (turn.norm() > 0
                              ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                              : Matrix3d(Matrix3d::Identity()));
        motion.omega_B += t * start.omegaDot_B;
        motion.v_G += t * start.vDot_G;
        motion.xi += t * start.xiDot;
        motion.xiDot += t * start.xiDotDot;
        return calcMassVelocities(part, motion);
    };
    const double h = 1e-4;
    const Eigen::Matrix3Xd difference = (velocitiesAt(h) - velocitiesAt(-h)) / (2 * h);
    EXPECT_LT((difference - calcMassAccelerations(part, start)).norm(), 1e-6);
}

TEST(PointMassPartTest, IsValidAndMeanAxis) {
    const PointMassPart part = makePointMassPart();
    ASSERT_NO_THROW(part.body->validate());
    // An arbitrary modal velocity has no momentum in an undeformed body.
    PointMassMotion motion(part.body->numModes);
    std::mt19937 random(5);
    motion.xiDot = makeRandomVector(part.body->numModes, 1, random);
    EXPECT_LT(calcLinearMomentum(part, motion).norm(), 1e-14);
    EXPECT_LT(calcAngularMomentum(part, motion).norm(), 1e-14);
}

/** Returns a matrix with rows and columns of families in random order; entries between families are
`between`. **/
Eigen::MatrixXd makeFamilies(int rows, int columns, double between) {
    Eigen::MatrixXd matrix(rows, columns);
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j)
            matrix(i, j) =
                (7 * i + 3) % 11 % 5 == (5 * j + 1) % 13 % 5 ? std::sin(i + 2.5 * j) : between;
    return matrix;
}

Eigen::MatrixXd multiply(const TiledMatrix& tiles, const Eigen::MatrixXd& x, int rows) {
    Eigen::MatrixXd y = Eigen::MatrixXd::Constant(tiles.paddedRows(), x.cols(), SimTK::NaN);
    std::vector<const double*> factors;
    std::vector<double*> products;
    for (int c = 0; c < int(x.cols()); ++c) {
        factors.push_back(x.col(c).data());
        products.push_back(y.col(c).data());
    }
    tiles.multiply(int(x.cols()), factors.data(), products.data());
    EXPECT_EQ(y.bottomRows(y.rows() - rows), Eigen::MatrixXd::Zero(y.rows() - rows, y.cols()));
    return y.topRows(rows);
}

TEST(TiledMatrix, ProductsAreThoseOfTheMatrixHoweverItsZerosLie) {
    for (const double between : {0.0, 1e-14, 0.5}) {
        const Eigen::MatrixXd A = makeFamilies(101, 44, between);
        for (const int count : {1, 2, 3, 5, 8, 16, 21}) {
            const Eigen::MatrixXd x = makeFamilies(44, count, 0.3), y = A * x;
            for (const double negligible : {0.0, 1e-12}) {
                const TiledMatrix tiles(A, negligible);
                const Eigen::MatrixXd found = multiply(tiles, x, 101);
                EXPECT_LT((found - y).cwiseAbs().maxCoeff(), 1e-12);
                EXPECT_EQ(found.col(0), multiply(tiles, x.leftCols(1), 101).col(0));
            }
        }
    }
}

TEST(TiledMatrix, EntriesThatCountForZeroTakeNoPart) {
    const Eigen::MatrixXd A = makeFamilies(200, 40, 1e-14);
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(40, 1);
    x(7, 0) = 1e16;  // 100 by way of each of them
    const Eigen::MatrixXd all = multiply(TiledMatrix(A), x, 200);
    const Eigen::MatrixXd kept = multiply(TiledMatrix(A, 1e-12), x, 200);
    int numSmall = 0, numLeftOut = 0;
    for (int i = 0; i < 200; ++i) {
        if (A(i, 7) != 1e-14) {
            EXPECT_EQ(kept(i, 0), all(i, 0));
            continue;
        }
        ++numSmall;
        numLeftOut += kept(i, 0) == 0;
    }
    // Except those that share a tile with rows of another family.
    EXPECT_GT(numLeftOut, 0.8 * numSmall);
    // A matrix without zeros stays unchanged.
    const Eigen::MatrixXd full = makeFamilies(200, 40, 0.1);
    EXPECT_EQ(multiply(TiledMatrix(full, 1e-12), x, 200), multiply(TiledMatrix(full), x, 200));
}

}  // namespace
}  // namespace simflex::test
