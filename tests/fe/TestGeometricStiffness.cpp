// Stress stiffness of every element type: k x_a = f_a, because both sides are ∫ ∇N σ dV.

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/calculix/GeometricStiffness.h"

namespace simflex {
namespace {

using testing::DistortedCube;
using testing::TestFolder;

/** Forces without resultant force and moment. **/
std::vector<double> makeLoad(const Mesh& mesh) {
    std::mt19937 random(7);
    std::vector<double> force(3 * size_t(mesh.numNodes()), 0);
    // Pairs of nodes pull at each other along the line between them.
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

class GeometricStiffness : public ::testing::TestWithParam<const char*> {};

TEST_P(GeometricStiffness, TimesThePositionsIsTheLoad) {
    const TestFolder folder;
    const std::string type = GetParam();
    // One element of reduced integration alone has mechanisms.
    testing::Brick brick;
    brick.elements = {3, 2, 2};
    brick.type = type;
    testing::writeText(folder / "cube.inp",
                       type == "C3D20R" ? brick.text() : DistortedCube(type).text());
    const FeModel model = readCalculixDeck(folder / "cube.inp");
    const auto force = makeLoad(model.mesh);
    std::vector<double> product(force.size(), 0);
    calcGeometricStiffness(model, {{"pulls", force}}, {}, [&](int, const SymmetricMatrix& k) {
        for (int column = 0; column < k.size; ++column)
            for (auto e = k.columnStarts[size_t(column)]; e < k.columnStarts[size_t(column) + 1];
                 ++e)
                for (int a = 0; a < 3; ++a) {
                    const int row = k.rows[size_t(e)];
                    const double value = k.values[size_t(e)];
                    product[size_t(3 * row + a)] +=
                        value * model.mesh.positions[size_t(3 * column + a)];
                    if (row != column)
                        product[size_t(3 * column + a)] +=
                            value * model.mesh.positions[size_t(3 * row + a)];
                }
    });
    for (size_t dof = 0; dof < force.size(); ++dof) EXPECT_NEAR(product[dof], force[dof], 1e-5);
    EXPECT_TRUE(folder.listTemporaryFiles().empty());
}

INSTANTIATE_TEST_SUITE_P(ElementTypes, GeometricStiffness,
                         ::testing::Values("C3D4", "C3D6", "C3D8", "C3D10", "C3D10T", "C3D15",
                                           "C3D20", "C3D20R"));

}  // namespace
}  // namespace simflex
