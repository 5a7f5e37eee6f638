#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "simflex/reduction/BlockLanczos.h"

#ifdef _OPENMP
#include <omp.h>
#endif

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/** A diagonal in coordinates rotated by a Householder reflection, so that no eigenvector is an
axis: C = H D H, H = 1 − 2 v vᵀ. **/
class TurnedDiagonal : public SymmetricOperator {
public:
    explicit TurnedDiagonal(VectorXd diagonal) : _d(std::move(diagonal)), _v(_d.size()) {
        for (Index k = 0; k < _v.size(); ++k) _v[k] = std::sin(1.0 + double(k));
        _v.normalize();
    }

    Index size() const override { return _d.size(); }

    void apply(const Vectors& X, Vectors& Y) const override {
        Y = reflect(_d.asDiagonal() * reflect(X));
        numApplied += X.cols();
    }

    MatrixXd reflect(const MatrixXd& X) const { return X - 2 * _v * (_v.transpose() * X); }

    mutable Index numApplied = 0;

private:
    VectorXd _d, _v;
};

/** Returns 1/k⁴, the spectrum of a beam. **/
VectorXd beamSpectrum(Index size) {
    VectorXd d(size);
    for (Index k = 0; k < size; ++k) d[k] = std::pow(double(k + 1), -4);
    return d;
}

void expectEigenpairs(const SymmetricOperator& C, const Eigenpairs& pairs,
                      const VectorXd& expected) {
    ASSERT_EQ(pairs.values.size(), expected.size());
    ASSERT_EQ(pairs.vectors.cols(), expected.size());
    for (Index k = 0; k < expected.size(); ++k)
        EXPECT_NEAR(pairs.values[k], expected[k], 1e-12 * expected[k] + 1e-15 * expected[0]) << k;
    const MatrixXd gram = pairs.vectors.transpose() * pairs.vectors;
    EXPECT_LT((gram - MatrixXd::Identity(gram.rows(), gram.cols())).norm(), 1e-12);
    Vectors CV;
    C.apply(pairs.vectors, CV);
    const MatrixXd residual = CV - pairs.vectors * pairs.values.asDiagonal();
    for (Index k = 0; k < expected.size(); ++k)
        EXPECT_LT(residual.col(k).norm(), 2e-12 * expected[k] + 1e-14 * expected[0]) << k;
}

TEST(BlockLanczos, FindsTheLargestEigenpairs) {
    const VectorXd d = beamSpectrum(5000);
    const TurnedDiagonal C(d);
    expectEigenpairs(C, calcLargestEigenpairs(C, {40}, "modes"), d.head(40));
}

TEST(BlockLanczos, FindsCloseAndDoubleEigenvalues) {
    VectorXd d = beamSpectrum(3000);
    for (Index k = 0; k + 1 < d.size(); k += 2) d[k + 1] = d[k];  // pairs
    for (Index k = 10; k < 15; ++k) d[k] = d[10] * (1 - 1e-11 * double(k - 10));
    const TurnedDiagonal C(d);
    expectEigenpairs(C, calcLargestEigenpairs(C, {30}, "modes"), d.head(30));
}

TEST(BlockLanczos, FindsAnEigenvalueMoreOftenThanItsBlockIsWide) {
    VectorXd d = beamSpectrum(2000);
    d.segment(3, 30).setConstant(d[3]);
    const TurnedDiagonal C(d);
    expectEigenpairs(C, calcLargestEigenpairs(C, {40}, "modes"), d.head(40));
}

TEST(BlockLanczos, StopsAtTheSmallestThatIsWanted) {
    const VectorXd d = beamSpectrum(3000);
    const TurnedDiagonal C(d);
    ModeRange range;
    range.smallest = 0.5 * (d[24] + d[25]);
    expectEigenpairs(C, calcLargestEigenpairs(C, range, "modes"), d.head(25));
    range.count = 10;
    expectEigenpairs(C, calcLargestEigenpairs(C, range, "modes"), d.head(10));
    range.smallest = 2;
    EXPECT_EQ(calcLargestEigenpairs(C, range, "modes").values.size(), 0);
}

TEST(BlockLanczos, FindsFewWantedAmongVeryManyOthers) {
    // A random start has almost no component of the three: its first Ritz values lie below all of
    // them.
    const VectorXd d = beamSpectrum(20000);
    const TurnedDiagonal C(d);
    ModeRange range;
    range.smallest = 0.5 * (d[2] + d[3]);
    expectEigenpairs(C, calcLargestEigenpairs(C, range, "modes"), d.head(3));
}

TEST(BlockLanczos, CountsTheEigenvaluesThatAreThere) {
    VectorXd d = VectorXd::Zero(1500);
    d.head(37) = VectorXd::LinSpaced(37, 2, 1);
    const TurnedDiagonal C(d);
    expectEigenpairs(C, calcLargestEigenpairs(C, {60}, "modes"), d.head(37));
}

TEST(BlockLanczos, RestartsWhereTheBasisIsShort) {
    const VectorXd d = beamSpectrum(3000);
    const TurnedDiagonal C(d);
    LanczosOptions options;
    options.largestBasis = 60;
    expectEigenpairs(C, calcLargestEigenpairs(C, {20}, "modes", {}, options), d.head(20));
}

TEST(BlockLanczos, SmallAndNearlyWholeSpectraAreSolvedDensely) {
    const VectorXd d = VectorXd::LinSpaced(90, 3, 1);
    const TurnedDiagonal C(d);
    expectEigenpairs(C, calcLargestEigenpairs(C, {90}, "modes"), d);
}

TEST(BlockLanczos, SameBitsForAnyNumberOfThreads) {
    const TurnedDiagonal C(beamSpectrum(40000));
    const int before = omp_get_max_threads();
    omp_set_num_threads(1);
    const Eigenpairs one = calcLargestEigenpairs(C, {12}, "modes");
    omp_set_num_threads(3);
    const Eigenpairs three = calcLargestEigenpairs(C, {12}, "modes");
    omp_set_num_threads(before);
    EXPECT_TRUE(one.values == three.values);
    EXPECT_TRUE(one.vectors == three.vectors);
}

TEST(BlockLanczos, StopsOnRequestAndTellsHowFarItIs) {
    const TurnedDiagonal C(beamSpectrum(3000));
    std::vector<double> fractions;
    const ProgressCallback watch = [&](const std::string& phase, double fraction) {
        EXPECT_EQ(phase, "modes");
        fractions.push_back(fraction);
        return true;
    };
    calcLargestEigenpairs(C, {30}, "modes", watch);
    ASSERT_GT(fractions.size(), 5u);
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    EXPECT_GT(fractions.back(), 0.5);
    EXPECT_THROW(
        calcLargestEigenpairs(C, {30}, "modes", [](const std::string&, double) { return false; }),
        Cancelled);
}

}  // namespace
}  // namespace simflex
