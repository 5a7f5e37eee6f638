// Stress stiffness of every element type: k x_a = f_a, because both sides are ∫ ∇N σ dV.

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/GeometricStiffness.h"

namespace simflex {
namespace {

using testing::TestFolder;

/** A distorted cube as hexahedron, wedges or tetrahedra, with mid-edge nodes where asked for. **/
struct DistortedCube {
    std::vector<std::array<double, 3>> nodes{{0, 0, 0},      {1, 0.1, 0},   {1.2, 1, 0.1},
                                             {-0.1, 0.9, 0}, {0, 0.1, 0.8}, {1.1, 0, 1},
                                             {1, 1.1, 1.2},  {0.1, 1, 0.9}};
    std::vector<std::vector<int>> elements;

    DistortedCube(const std::string& type) {
        const std::vector<std::pair<int, int>> hex{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                                   {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
            wedge{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
            tet{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
        if (type == "C3D8" || type == "C3D20") {
            elements = {{0, 1, 2, 3, 4, 5, 6, 7}};
            if (type != "C3D8") addMiddles(hex);
        } else if (type == "C3D6" || type == "C3D15") {
            elements = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
            if (type == "C3D15") addMiddles(wedge);
        } else {
            elements = {{0, 1, 3, 4}, {1, 2, 3, 6}, {1, 6, 4, 5}, {3, 4, 6, 7}, {1, 3, 4, 6}};
            if (type != "C3D4") addMiddles(tet);
        }
    }

    void addMiddles(const std::vector<std::pair<int, int>>& edges) {
        std::map<std::pair<int, int>, int> middles;
        for (auto& element : elements)
            for (const auto& edge : edges) {
                const int a = element[size_t(edge.first)], b = element[size_t(edge.second)];
                const auto [found, isNew] = middles.emplace(std::minmax(a, b), int(nodes.size()));
                element.push_back(found->second);
                if (!isNew) continue;
                std::array<double, 3> middle{};
                for (size_t k = 0; k < 3; ++k)
                    middle[k] = 0.5 * (nodes[size_t(a)][k] + nodes[size_t(b)][k]);
                nodes.push_back(middle);
            }
    }

    std::string text(const std::string& type) const {
        std::ostringstream out;
        out << "*NODE\n";
        for (size_t k = 0; k < nodes.size(); ++k)
            out << k + 1 << "," << nodes[k][0] << "," << nodes[k][1] << "," << nodes[k][2] << "\n";
        out << "*ELEMENT, TYPE=" << type << ", ELSET=BODY\n";
        for (size_t e = 0; e < elements.size(); ++e) {
            out << e + 1;
            for (size_t k = 0; k < elements[e].size(); ++k)
                out << (k == 12 ? ",\n" : ",") << elements[e][k] + 1;
            out << "\n";
        }
        return out.str() + testing::Brick().materialText();
    }
};

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
                       type == "C3D20R" ? brick.text() : DistortedCube(type).text(type));
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
