/** @file
Linear models in modal coordinates have the same poles and responses. **/

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simflex/solver/ModalForm.h"

namespace simflex {
namespace {

using namespace SimTK;

/** Masses in a row, ẋ = A x + B p of x = (q, q̇), in transformed coordinates x = T x′. **/
StateSpace makeSpace(const Matrix& M, const Matrix& K, const Matrix& D, const Matrix& forces,
                     const Matrix& observed) {
    const int n = M.nrow();
    StateSpace space;
    space.A = Matrix(2 * n, 2 * n, 0.0);
    space.B = Matrix(2 * n, forces.ncol(), 0.0);
    space.C = Matrix(observed.nrow(), 2 * n, 0.0);
    space.D = Matrix(observed.nrow(), forces.ncol(), 0.0);
    space.D1 = space.D2 = space.D;
    for (int i = 0; i < n; ++i) {
        space.A(i, n + i) = 1;
        for (int j = 0; j < n; ++j) {
            space.A(n + i, j) = -K(i, j) / M(i, i);
            space.A(n + i, n + j) = -D(i, j) / M(i, i);
        }
        for (int k = 0; k < forces.ncol(); ++k) space.B(n + i, k) = forces(i, k) / M(i, i);
        for (int k = 0; k < observed.nrow(); ++k) space.C(k, i) = observed(k, i);
    }
    Matrix T(2 * n, 2 * n), inverse;
    for (int i = 0; i < 2 * n; ++i)
        for (int j = 0; j < 2 * n; ++j)
            T(i, j) = (i == j ? 2 : 0) + std::cos(1.7 * i + 0.9 * j * j);
    inverse = T.invert();
    space.A = inverse * space.A * T;
    space.B = inverse * space.B;
    space.C = space.C * T;
    return space;
}

Matrix makeDiagonal(const std::vector<Real>& values) {
    Matrix matrix(int(values.size()), int(values.size()), 0.0);
    for (int i = 0; i < matrix.nrow(); ++i) matrix(i, i) = values[size_t(i)];
    return matrix;
}

Matrix makeColumn(const std::vector<Real>& values) {
    Matrix matrix(int(values.size()), 1);
    for (int i = 0; i < matrix.nrow(); ++i) matrix(i, 0) = values[size_t(i)];
    return matrix;
}

/** Returns the stiffness of springs between neighbours and from the first mass to a wall. **/
Matrix makeChain(const std::vector<Real>& springs) {
    Matrix K(int(springs.size()), int(springs.size()), 0.0);
    for (int i = 0; i < K.nrow(); ++i) {
        K(i, i) += springs[size_t(i)];
        if (i == 0) continue;
        K(i - 1, i - 1) += springs[size_t(i)];
        K(i - 1, i) -= springs[size_t(i)];
        K(i, i - 1) -= springs[size_t(i)];
    }
    return K;
}

void expectSame(const StateSpace& found, const StateSpace& expected, Real tolerance,
                const std::vector<Real>& omegas = {0.3, 2.0, 11.0, 70.0}) {
    for (const Real omega : omegas) {
        const auto a = found.calcTransfer(Complex(0, omega)),
                   b = expected.calcTransfer(Complex(0, omega));
        ASSERT_EQ(a.nrow(), b.nrow());
        for (int i = 0; i < a.nrow(); ++i)
            for (int k = 0; k < a.ncol(); ++k)
                EXPECT_LT(std::abs(a(i, k) - b(i, k)), tolerance * std::abs(b(i, k)))
                    << i << ' ' << k << " at " << omega;
    }
}

std::vector<Complex> listPoles(const Matrix& A) {
    Vector_<Complex> poles;
    SimTK::Eigen(A).getAllEigenValues(poles);
    std::vector<Complex> list;
    for (int k = 0; k < poles.size(); ++k) list.push_back(poles[k]);
    std::sort(list.begin(), list.end(), [](Complex a, Complex b) {
        return std::abs(a) != std::abs(b) ? std::abs(a) < std::abs(b) : a.imag() < b.imag();
    });
    return list;
}

TEST(ModalForm, EachPairOfPolesStandsByItself) {
    // Dampers that couple the modes, one of them overdamped.
    Matrix D = makeChain({0.3, 2, 0.01});
    D(2, 2) += 90;
    const StateSpace space = makeSpace(makeDiagonal({1, 2, 0.5}), makeChain({100, 300, 900}), D,
                                       makeColumn({1, 0, 0}), ~makeColumn({0, 1, 0.2}));
    const StateSpace modal = calcModalForm(space, {ModalForm::Kind::Modal});
    expectSame(modal, space, 1e-11);
    const auto poles = listPoles(space.A);
    size_t pole = 0;
    for (int i = 0; i < 6;) {
        const bool isPair = i + 1 < 6 && modal.A(i, i + 1) != 0;
        const int size = isPair ? 2 : 1;
        for (int row = i; row < i + size; ++row)
            for (int j = 0; j < 6; ++j) {
                if (j >= i && j < i + size) continue;
                EXPECT_EQ(modal.A(row, j), 0);
            }
        EXPECT_LT(std::abs(Complex(modal.A(i, i), isPair ? std::abs(modal.A(i, i + 1)) : 0) -
                           Complex(poles[pole].real(), std::abs(poles[pole].imag()))),
                  1e-11 * std::abs(poles[pole]));
        if (isPair) {
            EXPECT_EQ(modal.A(i, i), modal.A(i + 1, i + 1));
            EXPECT_EQ(modal.A(i, i + 1), -modal.A(i + 1, i));
        }
        i += size;
        pole += size_t(size);
    }
}

TEST(ModalForm, AFreeBodyHasTwoZerosInOneBlock) {
    Matrix K = makeChain({0, 300, 900});
    const StateSpace space = makeSpace(makeDiagonal({1, 2, 0.5}), K, 1e-3 * K,
                                       makeColumn({1, 0, 0}), ~makeColumn({0, 1, 0.2}));
    const StateSpace modal = calcModalForm(space, {ModalForm::Kind::Modal});
    expectSame(modal, space, 1e-7);
    EXPECT_EQ(modal.A.nrow(), 6);
    for (int i = 0; i < 2; ++i)
        for (int j = 2; j < 6; ++j) EXPECT_EQ(modal.A(i, j), 0);
    const StateSpace rigid = calcModalForm(space, {ModalForm::Kind::Modal, 1});
    EXPECT_EQ(rigid.A.nrow(), 2);
    // It moves as a mass of 3.5 kg.
    expectSame(rigid, space, 1e-4, {0.05});
}

TEST(ModalForm, FastModesThatAreLeftOutAnswerAsSpringsDo) {
    const Matrix K = makeChain({100, 300, 900, 5000});
    const StateSpace space = makeSpace(makeDiagonal({1, 2, 0.5, 0.1}), K, 1e-4 * K,
                                       makeColumn({1, 0, 0, 2}), ~makeColumn({0, 1, 0.2, -1}));
    const StateSpace low = calcModalForm(space, {ModalForm::Kind::Modal, 2});
    EXPECT_EQ(low.A.nrow(), 4);
    EXPECT_LT(std::abs(low.calcTransfer(0.0)(0, 0) / space.calcTransfer(0.0)(0, 0) - 1.0), 1e-11);
    expectSame(low, space, 0.01, {1, 3, 5});
    const auto poles = listPoles(space.A), kept = listPoles(low.A);
    for (size_t k = 0; k < kept.size(); ++k)
        EXPECT_LT(std::abs(std::abs(kept[k]) - std::abs(poles[k])), 1e-11 * std::abs(poles[k]));
    // The same selection by frequency.
    ModalForm form{ModalForm::Kind::Modal};
    form.highest = 0.5 * (std::abs(poles[3]) + std::abs(poles[4]));
    EXPECT_EQ(calcModalForm(space, form).A.nrow(), 4);
}

TEST(ModalForm, TheMinimalOneHasWhatIsReachedAndSeen) {
    // Actuated and observed in the middle, the antisymmetric mode has no part.
    Matrix K(3, 3, 0.0);
    for (const int i : {0, 2}) {
        K(i, i) += 400;
        K(1, 1) += 300;
        K(i, i) += 300;
        K(1, i) = K(i, 1) = -300;
    }
    const StateSpace space = makeSpace(makeDiagonal({1, 2, 1}), K, 1e-3 * K, makeColumn({0, 1, 0}),
                                       ~makeColumn({0, 1, 0}));
    const StateSpace minimal = calcModalForm(space, {ModalForm::Kind::Minimal});
    EXPECT_EQ(minimal.A.nrow(), 4);
    expectSame(minimal, space, 1e-10);
    EXPECT_EQ(calcModalForm(space, {ModalForm::Kind::Modal}).A.nrow(), 6);
}

TEST(ModalForm, OfTwoModesOfOneFrequencyOneIsReached) {
    const Matrix K = makeDiagonal({400, 400, 900}), D = makeDiagonal({0.4, 0.4, 0.1});
    Matrix observed(2, 3, 0.0);
    observed(0, 0) = observed(0, 2) = observed(1, 1) = 1;
    const StateSpace space =
        makeSpace(makeDiagonal({1, 1, 1}), K, D, makeColumn({0.6, 0.8, 1}), observed);
    const StateSpace minimal = calcModalForm(space, {ModalForm::Kind::Minimal});
    EXPECT_EQ(minimal.A.nrow(), 4);
    expectSame(minimal, space, 1e-8);
    expectSame(calcModalForm(space, {ModalForm::Kind::Modal}), space, 1e-8);
}

TEST(ModalForm, ACriticallyDampedMassIsOneBlock) {
    const StateSpace space =
        makeSpace(makeDiagonal({1, 1}), makeDiagonal({100, 400}), makeDiagonal({20, 0.1}),
                  makeColumn({1, 1}), ~makeColumn({1, 1}));
    const StateSpace modal = calcModalForm(space, {ModalForm::Kind::Modal});
    EXPECT_EQ(modal.A.nrow(), 4);
    expectSame(modal, space, 1e-7);
}

// The response of one of two neighbouring real poles is a thousand times that of both together.
TEST(ModalForm, WhatIsDampedNearlyCriticallyStaysTogether) {
    for (const Real factor : {0.999, 1.0, 1 + 1e-7, 1.001, 1.05}) {
        const StateSpace space = makeSpace(makeDiagonal({1, 1, 1}), makeDiagonal({2500, 2500, 1e8}),
                                           makeDiagonal({100 * factor, 100 * factor, 1}),
                                           makeColumn({1, 0.5, 1}), ~makeColumn({1, -0.2, 1}));
        for (const int modes : {1, 2}) {
            const StateSpace low = calcModalForm(space, {ModalForm::Kind::Modal, modes});
            EXPECT_EQ(low.A.nrow(), 4) << factor;  // two of equal frequency
            expectSame(low, space, 1e-5, {1, 20, 100});
        }
    }
    const StateSpace fast = makeSpace(makeDiagonal({1}), makeDiagonal({1e4}), makeDiagonal({1}),
                                      makeColumn({1}), ~makeColumn({1}));
    ModalForm slow{ModalForm::Kind::Modal};
    slow.highest = 50;
    try {
        calcModalForm(fast, slow);
        FAIL() << "nothing is left";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("at 15.92 Hz"), std::string::npos) << error.what();
    }
}

TEST(ModalForm, RefusesWhatNothingReaches) {
    const StateSpace space =
        makeSpace(makeDiagonal({1, 1}), makeDiagonal({100, 400}), makeDiagonal({1, 1}),
                  makeColumn({1, 0}), ~makeColumn({0, 1}));
    EXPECT_THROW(calcModalForm(space, {ModalForm::Kind::Minimal}), std::runtime_error);
}

}  // namespace
}  // namespace simflex
