/** @file
.vtu files, read back according to VTK's file format document. tests/part/read_vtu.py reads them
with an XML parser and numpy. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "fe/TestDecks.h"
#include "simflex/part/VtuFile.h"
#include "support/VtuReader.h"

namespace simflex::test {
namespace {

using simflex::testing::TestFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Point = std::array<double, 3>;

/** Corners and edges of an element in the order of Mesh.h. **/
struct Shape {
    ElementType linear, quadratic;
    std::vector<Point> corners;
    std::vector<std::array<int, 2>> edges;
    int vtkLinear, vtkQuadratic;               // cell types of VTK
    std::vector<std::array<int, 2>> vtkEdges;  // their midpoints follow the corners in VTK
};

const Shape kTetrahedron = {ElementType::Tet4,
                            ElementType::Tet10,
                            {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                            {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
                            10,
                            24,
                            {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
const Shape kHexahedron = {
    ElementType::Hex8,
    ElementType::Hex20,
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
    {{0, 1},
     {1, 2},
     {2, 3},
     {3, 0},
     {4, 5},
     {5, 6},
     {6, 7},
     {7, 4},
     {0, 4},
     {1, 5},
     {2, 6},
     {3, 7}},
    12,
    25,
    {{0, 1},
     {1, 2},
     {2, 3},
     {3, 0},
     {4, 5},
     {5, 6},
     {6, 7},
     {7, 4},
     {0, 4},
     {1, 5},
     {2, 6},
     {3, 7}}};
const Shape kWedge = {ElementType::Wedge6,
                      ElementType::Wedge15,
                      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
                      {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
                      13,
                      26,
                      {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}};

/** Returns one element, made asymmetric by an affine map, with straight edges. **/
Mesh makeElement(const Shape& shape, bool isQuadratic) {
    std::vector<Point> points = shape.corners;
    for (const auto& [a, b] : shape.edges)
        if (isQuadratic) {
            Point middle;
            for (size_t k = 0; k < 3; ++k)
                middle[k] = 0.5 * (points[size_t(a)][k] + points[size_t(b)][k]);
            points.push_back(middle);
        }
    Mesh mesh;
    ElementBlock block;
    block.type = isQuadratic ? shape.quadratic : shape.linear;
    for (const Point& p : points) {
        block.nodes.push_back(mesh.numNodes());
        mesh.nodeNumbers.push_back(10 * (mesh.numNodes() + 1));
        mesh.positions.insert(mesh.positions.end(), {p[0] + 0.3 * p[1], 1.2 * p[1] - 0.2 * p[2],
                                                     0.9 * p[2] + 0.1 * p[0]});
    }
    mesh.elements = {block};
    return mesh;
}

class VtuFileTest : public ::testing::Test {
protected:
    VtuContent write(const VtuFile& vtu) {
        vtu.write(file);
        return readVtu(file);
    }
    TestFolder folder;
    std::string file = folder / "part.vtu";
};

class VtuElements : public VtuFileTest, public ::testing::WithParamInterface<const Shape*> {};

TEST_P(VtuElements, HaveTheNodeOrderAndTypeOfVtk) {
    const Shape& shape = *GetParam();
    for (const bool isQuadratic : {false, true}) {
        const Mesh mesh = makeElement(shape, isQuadratic);
        const VtuContent found = write(VtuFile(mesh));
        ASSERT_EQ(found.numCells, 1);
        EXPECT_THAT(found["types"].values,
                    ElementsAre(isQuadratic ? shape.vtkQuadratic : shape.vtkLinear));
        const std::vector<double>& nodes = found["connectivity"].values;
        ASSERT_EQ(nodes.size(), size_t(mesh.numNodes()));
        EXPECT_THAT(found["offsets"].values, ElementsAre(mesh.numNodes()));
        const auto at = [&](size_t vtkNode) {
            Point p;
            for (size_t k = 0; k < 3; ++k)
                p[k] = found["Points"].values[3 * size_t(nodes[vtkNode]) + k];
            return p;
        };
        const size_t corners = shape.corners.size();
        for (size_t e = 0; isQuadratic && e < shape.vtkEdges.size(); ++e)
            for (size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(at(corners + e)[k],
                            0.5 * (at(size_t(shape.vtkEdges[e][0]))[k] +
                                   at(size_t(shape.vtkEdges[e][1]))[k]),
                            1e-15)
                    << "edge " << e;
        // Normal of the first face: into a tetrahedron and a hexahedron, out of a wedge.
        const Point a = at(0), b = at(1), c = at(2), d = at(corners == 4 ? 3 : corners / 2);
        double volume = 0;
        for (size_t k = 0; k < 3; ++k) {
            const size_t i = (k + 1) % 3, j = (k + 2) % 3;
            volume +=
                ((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])) * (d[k] - a[k]);
        }
        EXPECT_EQ(volume > 0, corners != 6);
        // Vertical edges of hexahedra and wedges join corners at the same position.
        for (size_t k = 0; corners > 4 && k < corners / 2; ++k)
            for (size_t axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(at(corners / 2 + k)[axis] - at(k)[axis], d[axis] - a[axis], 1e-15);
    }
}

INSTANTIATE_TEST_SUITE_P(Shapes, VtuElements,
                         ::testing::Values(&kTetrahedron, &kHexahedron, &kWedge));

TEST_F(VtuFileTest, AMeshWithoutElementsIsWrittenAsPoints) {
    Mesh mesh = makeElement(kTetrahedron, false);
    mesh.elements.clear();
    const VtuContent found = write(VtuFile(mesh));
    EXPECT_EQ(found.numPoints, 4);
    EXPECT_EQ(found.numCells, 4);
    EXPECT_THAT(found["types"].values, ElementsAre(1, 1, 1, 1));
    EXPECT_THAT(found["connectivity"].values, ElementsAre(0, 1, 2, 3));
}

TEST_F(VtuFileTest, NamesWithMarkupControlCharactersAndBrokenUtf8AreLegalXml) {
    EXPECT_EQ(escapeXml("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    EXPECT_EQ(escapeXml("größer 模態 🦀"), "größer 模態 🦀");
    EXPECT_EQ(escapeXml("\x01\x1F\x7F\n"), "????");
    EXPECT_EQ(escapeXml("a\xFFz \xC3"), "a?z ?");
    EXPECT_EQ(escapeXml("\xC0\x80 \xED\xA0\x80 \xF4\x90\x80\x80"), "?? ??? ????");
}

/** Returns a wedge as a part with two modes and all data different. **/
ReducedBody makePart() {
    ReducedBody part;
    part.name = "Pleuel <größer> & \"Co\"";
    part.mass = 2;
    part.centerOfMass = {0.5, -1, 2};
    part.inertia = {1, 1, 1, 0, 0, 0};
    part.numModes = 2;
    part.omegaSquared = {std::pow(2 * M_PI * 123.4, 2), std::pow(2 * M_PI * 4567.0, 2)};
    part.I1.assign(12, 0);
    part.I2.fill(std::vector<double>(4, 0));
    part.I2[0] = {2, 0, 0, 2};
    for (auto& N : part.N) N.assign(4, 0);
    part.mesh = makeElement(kWedge, true);
    const size_t rows = 3 * size_t(part.mesh.numNodes());
    for (size_t i = 0; i < 2 * rows; ++i) part.Phi.push_back(0.25 * double(i) - 3);
    part.interfaces = {
        {"seat", {0, 0, 0}, std::vector<double>(6), std::vector<double>(6), {0, 2}},
        {"pin & eye", {1, 0, 0}, std::vector<double>(6), std::vector<double>(6), {5}}};
    return part;
}

TEST_F(VtuFileTest, APartHasItsNodesInTheDeckAndEveryModeWithItsFrequency) {
    const ReducedBody part = makePart();
    writeVtu(file, part);
    const VtuContent found = readVtu(file);
    ASSERT_EQ(found.numPoints, 15);
    for (size_t i = 0; i < 45; ++i)
        EXPECT_EQ(found["Points"].values[i], part.mesh.positions[i] + part.centerOfMass[i % 3]);
    for (size_t n = 0; n < 15; ++n)
        EXPECT_EQ(found["node number"].values[n], part.mesh.nodeNumbers[n]);
    EXPECT_THAT(found["interface"].values,
                ElementsAre(1, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0));
    const char* names[] = {"mode 01 123.4 Hz", "mode 02 4567.0 Hz"};
    for (size_t k = 0; k < 2; ++k) {
        const VtuArray& mode = found[names[k]];
        EXPECT_EQ(mode.components, 3);
        ASSERT_EQ(mode.values.size(), 45u);
        for (size_t i = 0; i < 45; ++i) EXPECT_EQ(mode.values[i], part.Phi[45 * k + i]);
    }
    EXPECT_NEAR(found["frequency [Hz]"].values[1], 4567, 1e-9);
    EXPECT_EQ(found.texts.at("interface names"),
              "115 101 97 116 0 112 105 110 32 38 32 101 121 101 0 ");
    EXPECT_EQ(found.arrays.count("stress 01 123.4 Hz"), 0u);
}

TEST_F(VtuFileTest, ModalStressIsInVtksTensorOrderAndNotANumberWhereThereIsNone) {
    ReducedBody part = makePart();
    part.modalStress.emplace();
    part.modalStress->nodes = {4, 7};
    part.modalStress->stress.assign(24, 0);
    part.modalStress->strain.assign(24, 0);
    // Mode 2, node 7: xx yy zz xy xz yz.
    const std::array<float, 6> tensor = {5, -2, 3, 7, 11, 13};
    std::copy(tensor.begin(), tensor.end(), part.modalStress->stress.begin() + 18);
    // Mode 1, node 4: pure shear, whose von Mises stress is larger by √3.
    part.modalStress->stress[3] = 100;
    writeVtu(file, part);
    const VtuContent found = readVtu(file);
    const VtuArray& stress = found["stress 02 4567.0 Hz"];
    EXPECT_EQ(stress.components, 6);
    EXPECT_THAT(std::vector<double>(stress.values.begin() + 42, stress.values.begin() + 48),
                ElementsAre(5, -2, 3, 7, 13, 11));
    EXPECT_THAT(found.xml, HasSubstr("ComponentName3=\"XY\" ComponentName4=\"YZ\" "
                                     "ComponentName5=\"XZ\""));
    EXPECT_TRUE(std::isnan(stress.values[0]));
    const std::vector<double>& vonMises = found["von Mises 01 123.4 Hz"].values;
    EXPECT_NEAR(vonMises[4], 100 * std::sqrt(3.0), 1e-5);  // single precision
    EXPECT_EQ(vonMises[7], 0);
    EXPECT_TRUE(std::isnan(vonMises[0]));
    EXPECT_NEAR(calcVonMises({250, 0, 0, 0, 0, 0}), 250, 1e-12);
    EXPECT_EQ(calcVonMises({9, 9, 9, 0, 0, 0}), 0);
}

TEST_F(VtuFileTest, AnotherProgramsXmlParserReadsIt) {
    writeVtu(file, makePart());
    const std::string command = "/usr/bin/python3 '" SIMFLEX_SOURCE_DIR
                                "/tests/part/read_vtu.py' '" +
                                file + "' >'" + folder / "out" + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << simflex::testing::readText(folder / "out");
    EXPECT_THAT(
        simflex::testing::readText(folder / "out"),
        HasSubstr("UnstructuredGrid: 15 points, 1 cells, interface names: seat | pin & eye"));
}

TEST_F(VtuFileTest, SamePartGivesTheSameBytes) {
    writeVtu(file, makePart());
    const std::string first = simflex::testing::readText(file);
    writeVtu(file, makePart());
    EXPECT_TRUE(simflex::testing::readText(file) == first);
}

TEST_F(VtuFileTest, ErrorsNameTheFileOrTheFieldAndLeaveNothing) {
    const Mesh mesh = makeElement(kWedge, false);
    VtuFile vtu(mesh);
    const auto messageOf = [](const auto& act) -> std::string {
        try {
            act();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_THAT(messageOf([&] { vtu.addPointField("u", 3, std::vector<float>(17)); }),
                HasSubstr("field 'u' has 17 numbers, the mesh of 6 nodes needs 18"));
    EXPECT_THAT(messageOf([&] { vtu.setPoints({1, 2}); }), HasSubstr("points has 2"));
    EXPECT_THAT(messageOf([&] { vtu.write(folder / "no/such.vtu"); }), HasSubstr("no/such.vtu"));
    Mesh broken = mesh;
    broken.elements[0].nodes[2] = 6;
    EXPECT_THAT(messageOf([&] { VtuFile(broken).write(file); }), HasSubstr("node index 6"));
    std::filesystem::create_directories(file + "/inside");
    EXPECT_NE(messageOf([&] { vtu.write(file); }), "accepted");
    EXPECT_THAT(simflex::testing::listFiles(folder.path()), ElementsAre("part.vtu", "tmp"));
}

}  // namespace
}  // namespace simflex::test
