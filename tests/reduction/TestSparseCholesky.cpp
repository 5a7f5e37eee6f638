#include <gmock/gmock.h>
#include <omp.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "simflex/reduction/SparseCholesky.h"
#include "simflex/reduction/SymmetricProduct.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/** Returns −Δ on a box of points with three coupled unknowns each, lower triangle. **/
SymmetricMatrix makeBoxMatrix(int nx, int ny, int nz) {
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    const auto add = [&](int row, int column, double value) {
        rows.push_back(row);
        columns.push_back(column);
        values.push_back(value);
    };
    const auto at = [&](int x, int y, int z) { return 3 * ((x * ny + y) * nz + z); };
    for (int x = 0; x < nx; ++x)
        for (int y = 0; y < ny; ++y)
            for (int z = 0; z < nz; ++z) {
                const int here = at(x, y, z);
                for (int a = 0; a < 3; ++a) {
                    add(here + a, here + a, 6.5 + 0.1 * a + 0.01 * std::sin(double(here)));
                    if (a) add(here + a, here, 0.2);
                    if (x) add(here + a, at(x - 1, y, z) + a, -1);
                    if (y) add(here + a, at(x, y - 1, z) + a, -1);
                    if (z) add(here + a, at(x, y, z - 1) + a, -1);
                    if (x && z) add(here + a, at(x - 1, y, z - 1) + (a + 1) % 3, 0.05);
                }
            }
    return SymmetricMatrix::fromEntries(3 * nx * ny * nz, rows, columns, values);
}

MatrixXd toDense(const SymmetricMatrix& A) {
    MatrixXd full = MatrixXd::Zero(A.size, A.size);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            full(A.rows[k], column) = full(column, A.rows[k]) = A.values[k];
    return full;
}

TEST(SparseCholesky, SolvesAsDenseLinearAlgebraDoes) {
    const SymmetricMatrix A = makeBoxMatrix(9, 8, 7);
    const MatrixXd full = toDense(A);
    SparseCholesky cholesky;
    cholesky.factor(A);
    for (const int width : {1, 5, 8, 19}) {
        const MatrixXd B = MatrixXd::Random(A.size, width);
        EXPECT_LT((cholesky.solve(B) - full.ldlt().solve(B)).norm(), 1e-13 * B.norm()) << width;
    }
}

TEST(SparseCholesky, TriangularSolvesMakeTheInverse) {
    const SymmetricMatrix A = makeBoxMatrix(11, 5, 6);
    const MatrixXd full = toDense(A);
    SparseCholesky cholesky;
    cholesky.factor(A);
    const std::vector<int> order = cholesky.listOrder();
    for (const int width : {8, 11}) {
        const Vectors B = Vectors::Random(A.size, width);
        Vectors half(A.size, width), X(A.size, width);
        for (int k = 0; k < A.size; ++k) half.row(k) = B.row(order[size_t(k)]);
        cholesky.solveLower(half);
        Vectors ofOrder = half;
        cholesky.solveUpper(ofOrder);
        for (int k = 0; k < A.size; ++k) X.row(order[size_t(k)]) = ofOrder.row(k);
        EXPECT_LT((full * X - B).norm(), 1e-13 * full.norm());
        EXPECT_NEAR(half.squaredNorm(), (B.transpose() * X).trace(), 1e-12 * half.squaredNorm());
    }
}

TEST(SparseCholesky, SolvesOfLargeSupernodesAreRight) {
    // A nearly dense matrix: one supernode wider than the threads' block size.
    const int n = 700;
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    for (int c = 0; c < n; ++c)
        for (int r = c; r < n; ++r) {
            rows.push_back(r);
            columns.push_back(c);
            values.push_back(r == c ? 20.0 : std::sin(0.37 * r + 1.3 * c) / (1 + r - c));
        }
    const SymmetricMatrix A = SymmetricMatrix::fromEntries(n, rows, columns, values);
    SparseCholesky cholesky;
    cholesky.factor(A);
    const MatrixXd B = MatrixXd::Random(n, 3);
    EXPECT_LT((toDense(A) * cholesky.solve(B) - B).norm(), 1e-12 * B.norm());
}

TEST(SparseCholesky, GivesTheSameBitsForAnyNumberOfThreads) {
    const SymmetricMatrix A = makeBoxMatrix(24, 20, 16);
    const MatrixXd B = MatrixXd::Random(A.size, 12);
    const int before = omp_get_max_threads();
    MatrixXd one, more;
    for (const int threads : {1, 2, 3}) {
        omp_set_num_threads(threads);
        SparseCholesky cholesky;
        cholesky.factor(A);
        (threads == 1 ? one : more) = cholesky.solve(B);
        EXPECT_TRUE(threads == 1 || one == more) << threads;
        omp_set_num_threads(1);
        EXPECT_TRUE(one == cholesky.solve(B)) << threads;
    }
    omp_set_num_threads(before);
}

TEST(SparseCholesky, PredictsWhatTheFactorTakes) {
    const SymmetricMatrix A = makeBoxMatrix(20, 20, 20);
    SparseCholesky cholesky;
    const SparseCholesky::Prediction prediction = cholesky.analyze(A);
    cholesky.factor(A);
    EXPECT_EQ(prediction.numEntries, cholesky.numFactorEntries());
    EXPECT_GE(prediction.factorBytes, 8 * prediction.numEntries);
    EXPECT_GT(prediction.flops, double(prediction.numEntries));
    EXPECT_LT(prediction.numEntries, 0.2 * A.size * A.size);
}

TEST(SparseCholesky, FactorsAnotherMatrixAfterwards) {
    SparseCholesky cholesky;
    for (const int n : {4, 7, 7, 5}) {
        SymmetricMatrix A = makeBoxMatrix(n, 5, 6);
        for (double& value : A.values) value *= n;
        cholesky.factor(A);
        const MatrixXd B = MatrixXd::Random(A.size, 2);
        EXPECT_LT((toDense(A) * cholesky.solve(B) - B).norm(), 1e-12 * B.norm());
    }
}

TEST(LowerTriangle, MultipliesAsTheWholeMatrixDoes) {
    const SymmetricMatrix A = makeBoxMatrix(7, 6, 5);
    for (const int width : {1, 8, 21}) {
        const Shapes X = Shapes::Random(A.size, width);
        const Shapes product = LowerTriangle(A).multiply(X);
        EXPECT_LT((product - toDense(A) * X).norm(), 1e-13 * product.norm());
    }
}

TEST(SparseCholesky, NamesTheRowOfASingularPivot) {
    SymmetricMatrix A = makeBoxMatrix(3, 3, 3);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            if (column == 40 || A.rows[k] == 40) A.values[k] = 0;
    SparseCholesky cholesky;
    try {
        cholesky.factor(A);
        FAIL();
    } catch (const SparseCholesky::SingularMatrix& error) {
        EXPECT_EQ(error.row, 40);
    }
}

// Large enough for METIS, which seeds and uses the process's rand().
TEST(SparseCholesky, OrdersTheSameAtTheSameTimeAndLeavesTheUsersRandomNumbersAlone) {
    const SymmetricMatrix A = makeBoxMatrix(24, 22, 20);
    const auto countEntries = [&] {
        SparseCholesky cholesky;
        const auto& prediction = cholesky.analyze(A);
        EXPECT_STREQ(prediction.order, "METIS");
        return prediction.numEntries;
    };
    const auto expected = countEntries();
    std::vector<std::int64_t> found(8);
    std::vector<std::thread> threads;
    for (auto& number : found) threads.emplace_back([&] { number = countEntries(); });
    for (std::thread& thread : threads) thread.join();
    for (const auto number : found) EXPECT_EQ(number, expected);

    std::srand(7);
    const int first = std::rand(), second = std::rand();
    std::srand(7);
    EXPECT_EQ(std::rand(), first);
    countEntries();
    EXPECT_EQ(std::rand(), second);
}

}  // namespace
}  // namespace simflex
