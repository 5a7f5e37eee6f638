/** @file
Reduced parts against CalculiX's results for the deck with the same rigid ties (*RIGID BODY), and
against beam theory. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using testing::Brick;
using testing::TestFolder;

double hertzOf(const ReducedBody& body, int mode) {
    return std::sqrt(body.omegaSquared[mode]) / (2 * M_PI);
}

/** Returns the map from (rigid motion about the centre of mass, ξ) to the motion of an interface:
6×(6+n_f). **/
Eigen::MatrixXd interfaceMotion(const ReducedBody& body, const ReducedBody::Interface& interface) {
    const auto& s = interface.position;
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(6, 6 + body.numModes);
    B.leftCols(6).setIdentity();
    B.block<3, 3>(0, 3) << 0, s[2], -s[1], -s[2], 0, s[0], s[1], -s[0], 0;
    B.block(0, 6, 3, body.numModes) =
        Eigen::Map<const Eigen::MatrixXd>(interface.Phi.data(), 3, body.numModes);
    B.block(3, 6, 3, body.numModes) =
        Eigen::Map<const Eigen::MatrixXd>(interface.Psi.data(), 3, body.numModes);
    return B;
}

/** Returns the motion of interface `loaded` under a load at its master with interface `held`
fixed. **/
Eigen::VectorXd calcDeflection(const ReducedBody& body, const std::string& held,
                               const std::string& loaded, const std::array<double, 6>& load) {
    const Eigen::MatrixXd A = interfaceMotion(body, body.getInterface(held));
    const Eigen::MatrixXd B = interfaceMotion(body, body.getInterface(loaded));
    const Eigen::Index n = 6 + body.numModes;
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 6, n + 6);
    for (int i = 0; i < body.numModes; ++i) system(6 + i, 6 + i) = body.omegaSquared[i];
    system.block(n, 0, 6, n) = A;
    system.block(0, n, n, 6) = A.transpose();
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + 6);
    right.head(n) = B.transpose() * Eigen::Map<const Eigen::VectorXd>(load.data(), 6);
    // Rows differ by many orders of magnitude: scale to a unit diagonal of the elastic part.
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(n + 6);
    for (int i = 0; i < body.numModes; ++i) scale[6 + i] = 1 / std::sqrt(body.omegaSquared[i]);
    const Eigen::MatrixXd scaled = scale.asDiagonal() * system * scale.asDiagonal();
    const Eigen::VectorXd scaledRight = scale.asDiagonal() * right;
    const Eigen::VectorXd x = scale.asDiagonal() * scaled.fullPivLu().solve(scaledRight).eval();
    return B * x.head(n);
}

struct ExamplePart {
    const char* name;
    const char* elementType;
    double h;
    const char *firstSet, *secondSet;
    double length;
    int numModes;  ///< 44, plus one if the last is one of a pair
};

void PrintTo(const ExamplePart& part, std::ostream* out) {
    *out << part.name << " " << part.elementType;
}

/** Coarse meshes suffice to compare the same mesh in two programs. **/
class ExamplePartTest : public ::testing::TestWithParam<ExamplePart> {
protected:
    ReducedBody reducePart() {
        const ExamplePart& part = GetParam();
        deck = testing::meshExamplePart(folder, part.name, part.elementType, part.h);
        ReductionOptions options;
        options.name = part.name;
        options.interfaces = {{"first", part.firstSet}, {"second", part.secondSet}};
        options.interfaces[0].master = {0, 0, 0};
        options.interfaces[1].master = {part.length, 0, 0};
        return reduce(readCalculixDeck(deck), options);
    }

    TestFolder folder;
    std::string deck;
};

// A single test, since the reduction dominates the run time.
TEST_P(ExamplePartTest, FrequenciesAndTipDeflectionMatchCalculixWithin1e3) {
    SIMFLEX_NEEDS_CALCULIX();
    const ExamplePart& part = GetParam();
    const std::pair<std::string, std::array<double, 3>> first{part.firstSet, {0, 0, 0}},
        second{part.secondSet, {part.length, 0, 0}};
    const ReducedBody body = reducePart();
    ASSERT_EQ(body.numModes, part.numModes);
    const auto reference = testing::calcCalculixFrequencies(folder, deck, {first, second}, 12);
    for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(hertzOf(body, i), reference[6 + i], 1e-3 * reference[6 + i])
            << "mode " << i + 1;
        // A reduced part is never softer than its mesh.
        EXPECT_GT(hertzOf(body, i), (1 - 1e-5) * reference[6 + i]) << "mode " << i + 1;
    }
    const std::array<double, 6> load{100, 40, -25, 0.3, -0.2, 0.5};
    const auto expected = testing::calcCalculixDeflection(folder, deck, first, second, load);
    const Eigen::VectorXd u = calcDeflection(body, "first", "second", load);
    for (int k = 0; k < 6; ++k)
        EXPECT_NEAR(u[k], expected[k], 1e-3 * std::abs(expected[k])) << "component " << k;
}

INSTANTIATE_TEST_SUITE_P(
    Parts, ExamplePartTest,
    ::testing::Values(ExamplePart{"crank", "C3D8R", 0.002, "SHAFT", "PIN", 0.06, 44},
                      ExamplePart{"crank", "C3D20", 0.003, "SHAFT", "PIN", 0.06, 44},
                      ExamplePart{"rod", "C3D8", 0.002, "BIG_END", "SMALL_END", 0.18, 44},
                      ExamplePart{"rod", "C3D8R", 0.002, "BIG_END", "SMALL_END", 0.18, 45},
                      ExamplePart{"shapely_rod", "C3D10", 0.004, "BIG_END", "SMALL_END", 0.18, 45}),
    [](const auto& part) { return std::string(part.param.name) + "_" + part.param.elementType; });

/** Returns a bar along x of cells split into two wedges or six tetrahedra each; node sets LEFT and
RIGHT, the ends. **/
std::string splitBarText(const std::string& type) {
    const bool isWedge = type == "C3D6" || type == "C3D15",
               isQuadratic = type == "C3D15" || type == "C3D10";
    const int n[3] = {8, 2, 2};
    const double size[3] = {0.12, 0.02, 0.03};
    std::map<std::array<int, 3>, int> numbers;  // by twice the grid position
    std::ostringstream nodes, elements, left, right;
    nodes << std::setprecision(14);
    const auto numberOf = [&](const std::array<int, 3>& at) {
        const auto [found, isNew] = numbers.emplace(at, int(numbers.size()) + 1);
        if (isNew) {
            nodes << found->second;
            for (size_t a = 0; a < 3; ++a) nodes << "," << size[a] * at[a] / (2 * n[a]);
            nodes << "\n";
            if (at[0] == 0) left << found->second << ",\n";
            if (at[0] == 2 * n[0]) right << found->second << ",\n";
        }
        return found->second;
    };
    const std::vector<std::vector<int>> pieces =
        isWedge ? std::vector<std::vector<int>>{{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}}
                : std::vector<std::vector<int>>{{0, 1, 2, 6}, {0, 5, 1, 6}, {0, 4, 5, 6},
                                                {0, 7, 4, 6}, {0, 3, 7, 6}, {0, 2, 3, 6}};
    const std::vector<std::pair<int, int>> edges =
        isWedge ? std::vector<std::pair<int, int>>{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5},
                                                   {5, 3}, {0, 3}, {1, 4}, {2, 5}}
                : std::vector<std::pair<int, int>>{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
    constexpr int kCorners[8][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0},
                                    {0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}};
    int element = 0;
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i)
                for (const auto& piece : pieces) {
                    std::vector<std::array<int, 3>> places;
                    for (const int c : piece)
                        places.push_back({2 * i + kCorners[c][0], 2 * j + kCorners[c][1],
                                          2 * k + kCorners[c][2]});
                    if (isQuadratic)
                        for (const auto& [from, to] : edges) {
                            const auto a = places[size_t(from)], b = places[size_t(to)];
                            places.push_back(
                                {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2});
                        }
                    elements << ++element;
                    for (const auto& place : places) elements << "," << numberOf(place);
                    elements << "\n";
                }
    return "*NODE\n" + nodes.str() + "*ELEMENT, TYPE=" + type + ", ELSET=BODY\n" + elements.str() +
           "*NSET, NSET=LEFT\n" + left.str() + "*NSET, NSET=RIGHT\n" + right.str() +
           Brick().materialText();
}

class SplitBarTest : public ::testing::TestWithParam<const char*> {};

TEST_P(SplitBarTest, FrequenciesAndTipDeflectionMatchCalculix) {
    SIMFLEX_NEEDS_CALCULIX();
    TestFolder folder;
    testing::writeText(folder / "bar.inp", splitBarText(GetParam()));
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    options.interfaces[0].master = {0, 0.01, 0.015};
    options.interfaces[1].master = {0.12, 0.01, 0.015};
    options.numModes = 100;
    options.numCheckedModes = 6;
    const ReducedBody body = reduce(readCalculixDeck(folder / "bar.inp"), options);
    const std::pair<std::string, std::array<double, 3>> left{"LEFT", {0, 0.01, 0.015}},
        right{"RIGHT", {0.12, 0.01, 0.015}};
    const auto reference =
        testing::calcCalculixFrequencies(folder, folder / "bar.inp", {left, right}, 12);
    for (int i = 0; i < 6; ++i) {
        // The full model matches CalculiX to its seven digits; the part is slightly above.
        const double full = body.report->fullFrequencies[size_t(i)], part = hertzOf(body, i);
        EXPECT_NEAR(full, reference[size_t(6 + i)], 1e-5 * full) << "mode " << i + 1;
        EXPECT_GT(part, full * (1 - 1e-9)) << "mode " << i + 1;
        EXPECT_LT(part, full * (1 + 1e-3)) << "mode " << i + 1;
    }
    const std::array<double, 6> load{100, 40, -25, 0.3, -0.2, 0.5};
    const auto expected =
        testing::calcCalculixDeflection(folder, folder / "bar.inp", left, right, load);
    const Eigen::VectorXd u = calcDeflection(body, "left", "right", load);
    for (int k = 0; k < 6; ++k)
        EXPECT_NEAR(u[k], expected[size_t(k)], 1e-5 * std::abs(expected[size_t(k)]) + 1e-12)
            << "component " << k;
}

INSTANTIATE_TEST_SUITE_P(Types, SplitBarTest, ::testing::Values("C3D4", "C3D10", "C3D6", "C3D15"));

TEST(CrankPartFile, OfOneMillimetreMeshMatchesCalculix) {
    SIMFLEX_NEEDS_CALCULIX();
    const std::string parts = SIMFLEX_BINARY_DIR "/parts/";
    const ReducedBody crank = readReducedBody(parts + "crank.h5");
    TestFolder folder;
    testing::writeText(folder / "crank.inp", testing::readText(parts + "crank.inp"));
    testing::writeText(folder / "crank_mesh.inp", testing::readText(parts + "crank_mesh.inp"));
    const auto reference = testing::calcCalculixFrequencies(
        folder, folder / "crank.inp", {{"SHAFT", {0, 0, 0}}, {"PIN", {0.06, 0, 0}}}, 12);
    for (int i = 0; i < 6; ++i)
        EXPECT_NEAR(hertzOf(crank, i), reference[6 + i], 1e-3 * reference[6 + i]);
    EXPECT_NEAR(crank.mass, 2700 * 0.072 * 0.012 * 0.006, 1e-12);
}

/** A slender beam with zero Poisson's ratio and no interfaces, so its modes are free-free. **/
class SlenderBeam : public ::testing::Test {
protected:
    static ReducedBody reduceBeam(const Brick& brick, int numModes) {
        TestFolder folder;
        testing::writeText(folder / "beam.inp", brick.text());
        ReductionOptions options;
        options.name = "beam";
        options.numModes = numModes;
        return reduce(readCalculixDeck(folder / "beam.inp"), options);
    }
};

TEST_F(SlenderBeam, FreeFreeFrequenciesMatchEulerBernoulli) {
    Brick brick;
    brick.size = {1, 0.01, 0.013};
    brick.elements = {50, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    const ReducedBody body = reduceBeam(brick, 6 + 6);
    const double roots[3] = {4.7300, 7.8532, 10.9956};
    // Bending about both axes, each with its own depth.
    std::vector<double> expected, allowed;
    for (const double root : roots)
        for (const double depth : {brick.size[1], brick.size[2]}) {
            expected.push_back(root * root * depth * std::sqrt(brick.E / (12 * brick.rho)) /
                               (2 * M_PI));
            // Shear and rotatory inertia lower ω by about ½ (βr)²(1 + E/κG) (Timoshenko), r² =
            // depth²/12.
            allowed.push_back(0.5 * root * root * depth * depth / 12 * (1 + 2 * 1.2));
        }
    std::vector<size_t> order(expected.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(),
              [&](size_t a, size_t b) { return expected[a] < expected[b]; });
    for (size_t i = 0; i < order.size(); ++i) {
        const double error = hertzOf(body, int(i)) / expected[order[i]] - 1;
        EXPECT_LT(error, 1e-4) << "mode " << i + 1;
        EXPECT_GT(error, -1.5 * allowed[order[i]] - 1e-4) << "mode " << i + 1;
    }
}

TEST_F(SlenderBeam, AxialFrequencyOfABarMatchesTheWaveEquation) {
    Brick brick;
    brick.size = {0.1, 0.03, 0.03};  // stubby, so that the axial mode comes early
    brick.elements = {20, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    const ReducedBody body = reduceBeam(brick, 20);
    const double expected = std::sqrt(brick.E / brick.rho) / (2 * brick.size[0]);
    double closest = 0;
    for (int i = 0; i < body.numModes; ++i)
        if (std::abs(hertzOf(body, i) - expected) < std::abs(closest - expected))
            closest = hertzOf(body, i);
    EXPECT_NEAR(closest, expected, 1e-4 * expected);
}

TEST_F(SlenderBeam, InterfacesAtTheEndsLeaveTheBeamTheBeam) {
    Brick brick;
    brick.size = {1, 0.01, 0.01};
    brick.elements = {50, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    TestFolder folder;
    testing::writeText(folder / "beam.inp", brick.text());
    ReductionOptions options;
    options.interfaces = {{"left", "left"}, {"right", "RIGHT"}};
    options.numModes = 30;
    const ReducedBody body = reduce(readCalculixDeck(folder / "beam.inp"), options);
    // Clamped at one end: F L³/3EI.
    const double EI = brick.E * std::pow(0.01, 4) / 12;
    const Eigen::VectorXd u = calcDeflection(body, "left", "right", {0, 1, 0, 0, 0, 0});
    EXPECT_NEAR(u[1], 1 / (3 * EI), 1e-3 / (3 * EI));  // shear adds 0.01 %
    EXPECT_NEAR(u[5], 1 / (2 * EI), 1e-3 / (2 * EI));
    const Eigen::VectorXd stretch = calcDeflection(body, "left", "right", {1, 0, 0, 0, 0, 0});
    EXPECT_NEAR(stretch[0], 1 / (brick.E * 1e-4), 1e-6 / (brick.E * 1e-4));
}

}  // namespace
}  // namespace simflex
