// K and M of every element: agreement with CalculiX to the digits of its text, patch tests, rigid
// motions.

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>

#include "fe/CalculixMatrices.h"
#include "fe/DeckMaterials.h"
#include "fe/TestDecks.h"
#include "simflex/fe/decks/DeckBuilder.h"
#include "simflex/fe/decks/DeckElements.h"
#include "simflex/fe/elements/ElementAssembly.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::DistortedCube;
using testing::TestFolder;

MatrixXd toDense(const SymmetricMatrix& A) {
    MatrixXd dense = MatrixXd::Zero(A.size, A.size);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k)
            dense(A.rows[size_t(k)], column) = dense(column, A.rows[size_t(k)]) =
                A.values[size_t(k)];
    return dense;
}

/** m ⊗ 1₃ **/
MatrixXd perAxis(const MatrixXd& m) {
    MatrixXd M = MatrixXd::Zero(3 * m.rows(), 3 * m.cols());
    for (Index i = 0; i < m.rows(); ++i)
        for (Index j = 0; j < m.cols(); ++j)
            M.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(m(i, j));
    return M;
}

/** A deck and the matrices that simflex assembles for it. **/
struct Assembled {
    DeckModel deck;
    FeElements elements;
    MatrixXd K, m;

    Assembled(const TestFolder& folder, const std::string& text, bool hasSlips = false)
        : deck(build(folder, text)), elements(makeElements(deck)) {
        elements.setCalculixSlips(hasSlips);
        SymmetricMatrix sparseK, sparseM;
        assembleElements(elements, deck.mesh, sparseK, sparseM, {});
        K = toDense(sparseK);
        m = toDense(sparseM);
    }

    int numNodes() const { return deck.mesh.numNodes(); }
    Eigen::Vector3d at(int node) const {
        const auto x = deck.mesh.position(node);
        return {x[0], x[1], x[2]};
    }

    /** Samples a spatial field at all nodes. **/
    template <class Field>
    VectorXd sample(const Field& field) const {
        VectorXd u(3 * numNodes());
        for (int node = 0; node < numNodes(); ++node) u.segment<3>(3 * node) = field(at(node));
        return u;
    }

    /** Returns unit rigid motions about the middle. **/
    MatrixXd rigidMotions() const {
        MatrixXd R(3 * numNodes(), 6);
        for (Index a = 0; a < 3; ++a) {
            R.col(a) = sample([&](const Eigen::Vector3d&) { return Eigen::Vector3d::Unit(a); });
            R.col(3 + a) = sample([&](const Eigen::Vector3d& x) {
                return Eigen::Vector3d::Unit(a).cross(x - Eigen::Vector3d(0.5, 0.5, 0.5)).eval();
            });
        }
        return R;
    }

private:
    static DeckModel build(const TestFolder& folder, const std::string& text) {
        testing::writeText(folder / "part.inp", text);
        return buildDeckModel(folder / "part.inp", readModelCards(folder / "part.inp"));
    }
};

class EveryElement : public ::testing::TestWithParam<std::tuple<const char*, const char*>> {
protected:
    std::string text() const {
        return DistortedCube(std::get<0>(GetParam())).meshText() + std::get<1>(GetParam());
    }
    TestFolder folder;
};

TEST_P(EveryElement, HasCalculixMatricesToTheDigitsOfItsText) {
    SIMFLEX_NEEDS_CALCULIX();
    const Assembled own(folder, text(), true);
    const auto reference = testing::calcCalculixMatrices(folder, own.deck);
    // In CalculiX the modes of C3D8I are displacements relative to the mean of the corners.
    MatrixXd T = MatrixXd::Identity(own.K.rows(), own.K.cols());
    for (int e = 0; e < own.elements.size(); ++e)
        for (int mode = 8; mode < own.elements.numNodesOf(e) && own.elements.numNodesOf(e) == 11;
             ++mode)
            for (int k = 0; k < 8; ++k)
                T.block<3, 3>(3 * own.elements.nodesOf(e)[mode], 3 * own.elements.nodesOf(e)[k])
                    .diagonal()
                    .setConstant(1.0 / 8);
    constexpr double Digits = 6e-14;
    const MatrixXd K = T.transpose() * own.K * T, M = T.transpose() * perAxis(own.m) * T;
    EXPECT_LT((K - reference.K).cwiseAbs().maxCoeff(), Digits * reference.K.cwiseAbs().maxCoeff());
    EXPECT_LT((M - reference.M).cwiseAbs().maxCoeff(), Digits * reference.M.cwiseAbs().maxCoeff());
}

TEST_P(EveryElement, LeavesRigidMotionsFree) {
    const Assembled own(folder, text());
    const MatrixXd R = own.rigidMotions(), M = perAxis(own.m);
    const double highest = Eigen::SelfAdjointEigenSolver<MatrixXd>(own.K).eigenvalues().maxCoeff() /
                           M.diagonal().maxCoeff();
    const MatrixXd energy = R.transpose() * own.K * R, mass = R.transpose() * M * R;
    for (Index a = 0; a < 6; ++a)
        EXPECT_LT(std::abs(energy(a, a)), 1e-15 * highest * mass(a, a)) << "motion " << a;
}

/** Linear displacements load no inner node, and their energy follows the material law. **/
TEST_P(EveryElement, PassesThePatchTest) {
    const Assembled own(folder, text());
    Eigen::Matrix3d H;
    H << 1e-3, 4e-4, -2e-4, 2e-4, -3e-4, 5e-4, 0, 1e-4, 7e-4;
    const VectorXd u = own.sample([&](const Eigen::Vector3d& x) { return (H * x).eval(); });
    double energy = 0;
    ElementPoints points;
    for (int e = 0; e < own.elements.size(); ++e) {
        own.elements.calcPoints(e, own.deck.mesh, points);
        for (const ElementPoint& point : points.points)
            for (size_t i = 0; i < 6; ++i)
                for (size_t j = 0; j < 6; ++j) {
                    const double strain[6] = {H(0, 0),           H(1, 1),
                                              H(2, 2),           H(0, 1) + H(1, 0),
                                              H(0, 2) + H(2, 0), H(1, 2) + H(2, 1)};
                    energy += point.volume * strain[i] * point.D[i][j] * strain[j];
                }
    }
    EXPECT_NEAR(u.dot(own.K * u), energy, 1e-13 * energy);
    // Nodal forces equal those of the stress, regardless of hourglass modes and incompatible modes.
    VectorXd force = VectorXd::Zero(u.size());
    for (int e = 0; e < own.elements.size(); ++e) {
        own.elements.calcPoints(e, own.deck.mesh, points);
        Eigen::Matrix<double, 6, Eigen::Dynamic> B;
        for (const ElementPoint& point : points.points) {
            point.calcStrainMatrix(B);
            Eigen::Matrix<double, 6, 1> strain;
            strain << H(0, 0), H(1, 1), H(2, 2), H(0, 1) + H(1, 0), H(0, 2) + H(2, 0),
                H(1, 2) + H(2, 1);
            const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(
                point.D[0].data());
            const VectorXd f = point.volume * B.transpose() * (D * strain);
            for (int k = 0; k < own.elements.numNodesOf(e); ++k)
                force.segment<3>(3 * own.elements.nodesOf(e)[k]) += f.segment<3>(3 * k);
        }
    }
    EXPECT_LT((own.K * u - force).cwiseAbs().maxCoeff(), 1e-13 * force.cwiseAbs().maxCoeff());
    // Incompatible modes and hourglass modes are not loaded.
    for (int node = own.numNodes() - own.deck.mesh.numInternalNodes; node < own.numNodes(); ++node)
        EXPECT_LT((own.K * u).segment<3>(3 * node).norm(), 1e-13 * force.cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(
    Types, EveryElement,
    ::testing::Combine(::testing::Values("C3D4", "C3D6", "C3D8", "C3D8R", "C3D8I", "C3D10",
                                         "C3D10T", "C3D15", "C3D20", "C3D20R"),
                       ::testing::Values(testing::Steel, testing::Wood, testing::Crystal)));
INSTANTIATE_TEST_SUITE_P(Wound, EveryElement,
                         ::testing::Combine(::testing::Values("C3D6", "C3D8", "C3D10", "C3D15",
                                                              "C3D20", "C3D20R"),
                                            ::testing::Values(testing::WoundTube)));

}  // namespace
}  // namespace simflex
