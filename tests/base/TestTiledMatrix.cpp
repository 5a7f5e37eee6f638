// Products of tiled matrices against dense ones, for every number of vectors and shape of tiles.

#include "simflex/base/TiledMatrix.h"

#include <gtest/gtest.h>

#include <random>

namespace simflex {
namespace {

using Eigen::MatrixXd;

MatrixXd makeRandom(int rows, int columns, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    return MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(random); });
}

MatrixXd multiply(const TiledMatrix& A, const MatrixXd& X) {
    MatrixXd Y = MatrixXd::Constant(A.paddedRows(), X.cols(), 7e7);
    std::vector<const double*> x;
    std::vector<double*> y;
    for (Eigen::Index c = 0; c < X.cols(); ++c) {
        x.push_back(X.col(c).data());
        y.push_back(Y.col(c).data());
    }
    A.multiply(int(X.cols()), x.data(), y.data());
    return Y;
}

void expectProduct(const TiledMatrix& tiled, const MatrixXd& A, int count) {
    const MatrixXd X = makeRandom(int(A.cols()), count, 3), Y = multiply(tiled, X);
    EXPECT_LE((Y.topRows(A.rows()) - A * X).cwiseAbs().maxCoeff(), 1e-14 * double(A.cols() + 1))
        << A.rows() << "x" << A.cols() << ", " << count << " vectors";
    EXPECT_TRUE((Y.bottomRows(Y.rows() - A.rows()).array() == 0).all());
}

TEST(TiledMatrix, ProductsAreThoseOfTheDenseMatrix) {
    for (const int rows : {1, 7, 8, 9, 24, 41})
        for (const int columns : {1, 5, 32})
            for (const int count : {1, 2, 3, 7, 8, 19}) {
                const MatrixXd A = makeRandom(rows, columns, unsigned(rows + columns));
                expectProduct(TiledMatrix(A), A, count);
            }
}

TEST(TiledMatrix, ResultsDoNotDependOnHowManyVectorsThereAre) {
    for (const double negligible : {0.0, 1e-9}) {
        MatrixXd A = makeRandom(30, 20, 1);
        if (negligible > 0)
            for (int i = 0; i < 30; ++i)
                for (int j = 0; j < 20; ++j) A(i, j) *= (i + j) % 4 == 0 ? 1 : 0;
        const TiledMatrix tiled(A, negligible);
        const MatrixXd X = makeRandom(20, 11, 2), together = multiply(tiled, X);
        for (int c = 0; c < 11; ++c)
            EXPECT_TRUE(multiply(tiled, X.col(c)) == together.col(c)) << "vector " << c;
    }
}

TEST(TiledMatrix, SkippedZerosChangeNothingAndNegligibleEntriesLittle) {
    // Rows of four patterns in turn, as in symmetric parts, with round-off noise.
    const MatrixXd dense = makeRandom(40, 32, 4), dirt = 1e-15 * makeRandom(40, 32, 5);
    for (const bool isDirty : {false, true}) {
        MatrixXd A = MatrixXd::Zero(40, 32);
        for (int i = 0; i < 40; ++i)
            for (int j = 0; j < 32; ++j)
                if (i % 4 == j % 4) A(i, j) = dense(i, j);
        const TiledMatrix tiled(isDirty ? MatrixXd(A + dirt) : A, 1e-12);
        for (const int count : {1, 3, 8}) expectProduct(tiled, A, count);
    }
}

TEST(TiledMatrix, TakesTheEntriesOfATransposedMatrixAgain) {
    TiledMatrix tiled;
    for (const unsigned seed : {1u, 2u}) {
        const MatrixXd A = makeRandom(13, 9, seed);
        tiled.assignTransposed(A.transpose());
        EXPECT_EQ(tiled.cols(), 9);
        EXPECT_EQ(tiled.paddedRows(), 16);
        expectProduct(tiled, A, 4);
    }
}

}  // namespace
}  // namespace simflex
