// Stress stiffness of every element type: k x_a = f_a, because both sides are ∫ ∇N σ dV.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/elements/GeometricStiffness.h"

namespace simflex {
namespace {

using testing::DistortedCube;
using testing::TestFolder;

/** Returns self-equilibrated forces. **/
std::vector<double> makeLoad(const Mesh& mesh) {
    std::mt19937 random(7);
    std::vector<double> force(3 * size_t(mesh.numNodes()), 0);
    // Pairs of nodes attract each other along their connecting line.
    for (int a = 0; a < mesh.numNodes(); ++a)
        for (int b = a + 1; b < mesh.numNodes(); ++b) {
            const double pull = std::uniform_real_distribution<double>(-1, 1)(random);
            for (int k = 0; k < 3; ++k) {
                const double part =
                    pull * (mesh.position(b)[size_t(k)] - mesh.position(a)[size_t(k)]);
                force[size_t(3 * a + k)] += part;
                force[size_t(3 * b + k)] -= part;
            }
        }
    return force;
}

/** Expands each entry to a diagonal block with `rows` rows. **/
Eigen::MatrixXd toDense(const SymmetricMatrix& A, int rowsPerEntry) {
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(rowsPerEntry * A.size, rowsPerEntry * A.size);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k)
            for (int a = 0; a < rowsPerEntry; ++a) {
                const int i = rowsPerEntry * A.rows[size_t(k)] + a, j = rowsPerEntry * column + a;
                dense(i, j) = dense(j, i) = A.values[size_t(k)];
            }
    return dense;
}

class GeometricStiffness : public ::testing::TestWithParam<const char*> {};

TEST_P(GeometricStiffness, TimesThePositionsIsTheLoad) {
    const TestFolder folder;
    const std::string type = GetParam();
    // A single element with reduced integration has mechanisms.
    testing::Brick brick;
    brick.elements = {3, 2, 2};
    brick.type = type;
    testing::writeText(folder / "cube.inp",
                       type == "C3D20R" ? brick.text() : DistortedCube(type).text());
    const FeModel model = readCalculixDeck(folder / "cube.inp");
    const auto force = makeLoad(model.mesh);
    const Eigen::Map<const Eigen::VectorXd> f(force.data(), Eigen::Index(force.size()));
    const Eigen::VectorXd u = toDense(model.K, 1).completeOrthogonalDecomposition().solve(f);
    Eigen::VectorXd product;
    calcGeometricStiffness(model, u.data(), 1, {}, [&](int, const SymmetricMatrix& k) {
        product = toDense(k, 3) * Eigen::Map<const Eigen::VectorXd>(model.mesh.positions.data(),
                                                                    Eigen::Index(force.size()));
    });
    EXPECT_LT((product - f).cwiseAbs().maxCoeff(), 1e-9 * f.cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(ElementTypes, GeometricStiffness,
                         ::testing::Values("C3D4", "C3D6", "C3D8", "C3D8I", "C3D10", "C3D10T",
                                           "C3D15", "C3D20", "C3D20R"));

}  // namespace
}  // namespace simflex
