// Stress and strain of displacement fields against CalculiX's for every element and material.

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <sstream>

#include "fe/DeckMaterials.h"
#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/elements/ElementStress.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::CalculixStress;
using testing::DistortedCube;
using ::testing::HasSubstr;
using testing::TestFolder;
using Tensor = std::array<double, 6>;

/** Returns displacements that no element represents exactly. **/
std::vector<double> makeField(const Mesh& mesh) {
    std::vector<double> u;
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const auto x = mesh.position(node);
        u.push_back(1e-3 * std::sin(2 * x[0] + x[1] * x[2]));
        u.push_back(1e-3 * (x[0] * x[1] - x[2] * x[2]) + 2e-4 * x[1]);
        u.push_back(1e-3 * std::cos(x[0] - 3 * x[1] + x[2]));
    }
    return u;
}

/** Prescribes the field at all nodes. CalculiX needs something to solve for, so a separate
tetrahedron has a free corner. **/
CalculixStress runCalculix(const TestFolder& folder, const std::string& deck, const Mesh& mesh,
                           const std::vector<double>& field) {
    std::ostringstream step;
    step.precision(12);
    step << "*BOUNDARY\n";
    for (size_t dof = 0; dof < field.size(); ++dof)
        step << mesh.nodeNumbers[dof / 3] << "," << dof % 3 + 1 << "," << dof % 3 + 1 << ","
             << field[dof] << "\n";
    return testing::calcCalculixStress(
        folder, deck,
        "*NODE\n9001, 9, 9, 9\n9002, 10, 9, 9\n9003, 9, 10, 9\n9004, 9, 9, 10\n"
        "*ELEMENT, TYPE=C3D4, ELSET=OTHER\n9001, 9001, 9002, 9003, 9004\n"
        "*MATERIAL, NAME=OTHER\n*ELASTIC\n1e9, 0\n*SOLID SECTION, ELSET=OTHER, MATERIAL=OTHER\n"
        "*BOUNDARY\n9001, 1, 3\n9002, 1, 3\n9003, 1, 3\n9004, 1, 2\n",
        step.str());
}

double largestEntry(const std::vector<Tensor>& tensors) {
    double largest = 0;
    for (const Tensor& tensor : tensors)
        for (const double entry : tensor) largest = std::max(largest, std::abs(entry));
    return largest;
}

/** Averages over the wedges the linear interpolation between their points at ±1/√3 of the
height. **/
void extrapolateWedges(const DistortedCube& cube, CalculixStress& stress) {
    std::map<int, int> numElements;
    for (auto& [node, tensor] : stress.stress) tensor.fill(0);
    for (size_t e = 0; e < cube.elements.size(); ++e)
        for (size_t k = 0; k < 6; ++k) ++numElements[cube.elements[e][k] + 1];
    for (size_t e = 0; e < cube.elements.size(); ++e)
        for (size_t k = 0; k < 6; ++k) {
            const int node = cube.elements[e][k] + 1, own = k < 3 ? 1 : 2;
            for (size_t c = 0; c < 6; ++c) {
                const double here = stress.atPoints.at({int(e) + 1, own})[c],
                             there = stress.atPoints.at({int(e) + 1, 3 - own})[c];
                stress.stress.at(node)[c] +=
                    (0.5 * (here + there) + 0.5 * std::sqrt(3.0) * (here - there)) /
                    numElements.at(node);
            }
        }
}

class ElementStressTest : public ::testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(ElementStressTest, IsCalculixsOwnUnderTheSameDisplacements) {
    SIMFLEX_NEEDS_CALCULIX();
    const auto [type, material] = GetParam();
    const TestFolder folder;
    testing::writeText(folder / "cube.inp", DistortedCube(type).meshText() + material);
    const FeModel model = readCalculixDeck(folder / "cube.inp");
    const std::vector<double> field = makeField(model.mesh);
    CalculixStress expected = runCalculix(folder, "cube.inp", model.mesh, field);
    const ElementStress elements(model);

    // At integration points to CalculiX's seven digits.
    const auto points = elements.calcAtPoints(field.data());
    ASSERT_EQ(points.size(), expected.atPoints.size());
    std::vector<Tensor> all;
    for (const auto& [where, stress] : expected.atPoints) all.push_back(stress);
    const double size = largestEntry(all);
    for (const auto& point : points)
        for (size_t c = 0; c < 6; ++c)
            EXPECT_NEAR(point.stress[c], expected.atPoints.at({point.element, point.point})[c],
                        2e-6 * size)
                << "element " << point.element << " point " << point.point << " component " << c;

    // CalculiX's table for C3D6 swaps nodes 2 and 5 of a wedge: use linear interpolation along the
    // height from its values at the points instead.
    if (std::string(type) == "C3D6") extrapolateWedges(DistortedCube(type), expected);

    // At nodes to the digits of its extrapolation: 2.549, -0.683, 0.183, -0.04904 stand for (1 ±
    // √3)³/8…; their errors add up to 1.5e-4.
    std::vector<int> nodes;
    for (int node = 0; node < model.mesh.numNodes(); ++node) nodes.push_back(node);
    std::vector<float> stress(6 * nodes.size()), strain(6 * nodes.size());
    elements.calcAtNodes(nodes, field.data(), 1, stress.data(), strain.data());
    std::vector<Tensor> strains;
    for (const auto& [node, tensor] : expected.strain) strains.push_back(tensor);
    const double strainSize = largestEntry(strains);
    for (const int node : nodes)
        for (size_t c = 0; c < 6; ++c) {
            const int number = model.mesh.nodeNumbers[size_t(node)];
            const size_t at = 6 * size_t(node) + c;
            EXPECT_NEAR(stress[at], expected.stress.at(number)[c], 2e-4 * size)
                << "node " << number << " component " << c;
            if (std::string(type) == "C3D6") continue;
            EXPECT_NEAR(strain[at], expected.strain.at(number)[c], 2e-4 * strainSize)
                << "node " << number << " component " << c;
        }
}

INSTANTIATE_TEST_SUITE_P(ElementTypes, ElementStressTest,
                         ::testing::Values(std::make_pair("C3D4", testing::Steel),
                                           std::make_pair("C3D6", testing::Steel),
                                           std::make_pair("C3D8", testing::Steel),
                                           std::make_pair("C3D8R", testing::Steel),
                                           std::make_pair("C3D10", testing::Steel),
                                           std::make_pair("C3D10T", testing::Steel),
                                           std::make_pair("C3D15", testing::Steel),
                                           std::make_pair("C3D20", testing::Steel),
                                           std::make_pair("C3D20R", testing::Steel)));
INSTANTIATE_TEST_SUITE_P(Materials, ElementStressTest,
                         ::testing::Values(std::make_pair("C3D8", testing::SteelAndRubber),
                                           std::make_pair("C3D8", testing::Wood),
                                           std::make_pair("C3D10", testing::Wood),
                                           std::make_pair("C3D8R", testing::WoundTube),
                                           std::make_pair("C3D15", testing::WoundTube),
                                           std::make_pair("C3D20R", testing::WoundTube),
                                           std::make_pair("C3D20", testing::Crystal)));

class ElementStressOfCubeTest : public ::testing::Test {
protected:
    ElementStressOfCubeTest() {
        testing::writeText(folder / "cube.inp", DistortedCube("C3D20R").meshText() + testing::Wood);
        model = readCalculixDeck(folder / "cube.inp");
    }
    std::string errorOf() const {
        try {
            ElementStress{model};
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    TestFolder folder;
    FeModel model;
};

TEST_F(ElementStressOfCubeTest, UniformStrainIsExactAndRotationGivesNone) {
    const double gradient[2][3][3] = {{{1e-3, 4e-4, -2e-4}, {2e-4, -3e-4, 5e-4}, {0, 1e-4, 7e-4}},
                                      {{0, -3e-3, 1e-3}, {3e-3, 0, 2e-3}, {-1e-3, -2e-3, 0}}};
    std::vector<double> fields;
    std::vector<int> nodes;
    for (const auto& H : gradient)
        for (int node = 0; node < model.mesh.numNodes(); ++node) {
            const auto x = model.mesh.position(node);
            for (const auto& row : H)
                fields.push_back(0.1 + row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
        }
    for (int node = 0; node < model.mesh.numNodes(); ++node) nodes.push_back(node);
    std::vector<float> stress(12 * nodes.size()), strain(12 * nodes.size());
    ElementStress(model).calcAtNodes(nodes, fields.data(), 2, stress.data(), strain.data());
    const Tensor expected{1e-3, -3e-4, 7e-4, 3e-4, -1e-4, 3e-4};
    for (const int node : nodes)
        for (size_t c = 0; c < 6; ++c) {
            EXPECT_NEAR(strain[6 * size_t(node) + c], expected[c], 1e-9);
            EXPECT_NEAR(strain[6 * (nodes.size() + size_t(node)) + c], 0, 1e-15);
            EXPECT_NEAR(stress[6 * (nodes.size() + size_t(node)) + c], 0, 1e-4);  // of 1e7
        }
}

TEST_F(ElementStressOfCubeTest, ManyFieldsGiveTheBitsOfEachAlone) {
    const size_t numDofs = 3 * size_t(model.mesh.numNodes());
    const int count = 19;
    std::vector<double> fields = makeField(model.mesh);
    fields.resize(numDofs * count);
    for (size_t i = numDofs; i < fields.size(); ++i) fields[i] = 1e-3 * std::sin(double(i));
    const std::vector<int> nodes{3, 7, 19};
    std::vector<float> stress(18 * count), strain(18 * count), one(18), oneStrain(18);
    const ElementStress elements(model);
    elements.calcAtNodes(nodes, fields.data(), count, stress.data(), strain.data());
    for (size_t f = 0; f < count; ++f) {
        elements.calcAtNodes(nodes, fields.data() + f * numDofs, 1, one.data(), oneStrain.data());
        for (size_t k = 0; k < 18; ++k) {
            EXPECT_EQ(stress[18 * f + k], one[k]);
            EXPECT_EQ(strain[18 * f + k], oneStrain[k]);
        }
    }
}

TEST_F(ElementStressOfCubeTest, AModelOfMatricesIsRefused) {
    model.source = folder / "K.mtx";
    model.elements = nullptr;
    EXPECT_THAT(errorOf(), AllOf(HasSubstr("needs the elements"), HasSubstr("K.mtx")));
}

}  // namespace
}  // namespace simflex
