// Stress of reduced parts against CalculiX's full models and closed forms.

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using testing::Brick;
using testing::CalculixStress;
using ::testing::HasSubstr;
using testing::TestFolder;
using Tensor = std::array<double, 6>;
using Vec3 = std::array<double, 3>;

StressOptions atAllNodes() {
    StressOptions options;
    options.nodes = StressOptions::Nodes::All;
    return options;
}

/** Returns ξ = Ω⁻² f under steady modal forces. **/
std::vector<double> solveModes(const ReducedBody& body, const std::vector<double>& force) {
    std::vector<double> xi = force;
    for (size_t i = 0; i < xi.size(); ++i) xi[i] /= body.omegaSquared[i];
    return xi;
}

/** Returns modal forces of forces and moments (x y z each) on interfaces. **/
std::vector<double> calcInterfaceForces(const ReducedBody& body,
                                        const std::vector<std::pair<std::string, Tensor>>& loads) {
    std::vector<double> force(size_t(body.numModes), 0);
    for (const auto& [name, load] : loads) {
        const auto& interface = body.getInterface(name);
        for (size_t i = 0; i < force.size(); ++i)
            for (size_t a = 0; a < 3; ++a)
                force[i] +=
                    interface.Phi[3 * i + a] * load[a] + interface.Psi[3 * i + a] * load[3 + a];
    }
    return force;
}

/** Returns the stress or strain of a modal state at a node, by number. **/
Tensor recover(const ReducedBody& body, const std::vector<float>& values, int number,
               const std::vector<double>& xi) {
    const auto& nodes = body.modalStress->nodes;
    const auto found =
        std::lower_bound(nodes.begin(), nodes.end(), body.mesh.indexOf(number)) - nodes.begin();
    Tensor result{};
    for (size_t i = 0; i < xi.size(); ++i)
        for (size_t c = 0; c < 6; ++c)
            result[c] += xi[i] * double(values[6 * (nodes.size() * i + size_t(found)) + c]);
    return result;
}

Tensor recoverStress(const ReducedBody& body, int number, const std::vector<double>& xi) {
    return recover(body, body.modalStress->stress, number, xi);
}

double calcVonMises(const Tensor& s) {
    return std::sqrt(
        0.5 * (std::pow(s[0] - s[1], 2) + std::pow(s[1] - s[2], 2) + std::pow(s[2] - s[0], 2)) +
        3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

ReducedBody reduceWithStress(const std::string& deck,
                             const std::vector<InterfaceOptions>& interfaces, int numModes) {
    ReductionOptions options;
    options.interfaces = interfaces;
    options.numModes = numModes;
    options.stress = atAllNodes();
    return reduce(readCalculixDeck(deck), options);
}

std::string makeLoadCards(int tie, const Tensor& load) {
    std::ostringstream cards;
    cards.precision(12);
    cards << "*CLOAD\n";
    for (size_t k = 0; k < 6; ++k)
        if (load[k] != 0)
            cards << testing::getTieNode(tie) + int(k / 3) << "," << k % 3 + 1 << "," << load[k]
                  << "\n";
    return cards.str();
}

/** Returns the largest difference of all components at all nodes. **/
double calcLargestDifference(const ReducedBody& body, const std::vector<double>& xi,
                             const CalculixStress& full) {
    double largest = 0;
    for (const int number : body.mesh.nodeNumbers) {
        const Tensor found = recoverStress(body, number, xi), expected = full.stress.at(number);
        for (size_t c = 0; c < 6; ++c)
            largest = std::max(largest, std::abs(found[c] - expected[c]));
    }
    return largest;
}

class CantileverStress : public ::testing::Test {
protected:
    CantileverStress() {
        brick.type = "C3D20R";
        brick.size = {0.2, 0.02, 0.01};
        brick.elements = {20, 2, 2};
        testing::writeText(folder / "beam.inp", brick.text());
        // Constraint modes alone represent interface loads exactly.
        body = reduceWithStress(folder / "beam.inp", {{"root", "LEFT"}, {"tip", "RIGHT"}}, 12);
    }

    /** Returns the tip's load and the root's reaction. **/
    std::vector<double> load(const Vec3& force) const {
        const double L = brick.size[0];
        return solveModes(
            body, calcInterfaceForces(
                      body, {{"tip", {force[0], force[1], force[2], 0, 0, 0}},
                             {"root",
                              {-force[0], -force[1], -force[2], 0, L * force[2], -L * force[1]}}}));
    }

    TestFolder folder;
    Brick brick;
    ReducedBody body;
};

TEST_F(CantileverStress, UnderTipForceIsThatOfBeamTheory) {
    const double F = 100, b = brick.size[2], h = brick.size[1], I = b * h * h * h / 12;
    const std::vector<double> xi = load({0, F, 0});
    int checked = 0;
    for (int node = 0; node < body.mesh.numNodes(); ++node) {
        const auto s = body.mesh.position(node);
        const double x = s[0] + body.centerOfMass[0], y = s[1];
        if (x < 0.05 || x > 0.15 || std::abs(s[2]) > 1e-9) continue;  // away from the ends
        const Tensor stress = recoverStress(body, body.mesh.nodeNumbers[size_t(node)], xi);
        const double bending = -F * (brick.size[0] - x) * y / I;
        // Bending is linear in x and y, which the elements represent exactly; Poisson's ratio
        // curves the section, to order (h/L)².
        EXPECT_NEAR(stress[0], bending, 2e-3 * F * 0.15 * h / 2 / I);
        ++checked;
    }
    EXPECT_GT(checked, 40);
}

TEST_F(CantileverStress, IsThatOfCalculixsFullModelAtEveryNode) {
    SIMFLEX_NEEDS_CALCULIX();
    const Tensor tip{30, 100, -50, 0, 0, 0};
    const CalculixStress full = testing::calcCalculixStress(
        folder, "beam.inp",
        testing::makeTieCards(0, "LEFT", {0, 0, 0}) +
            testing::makeTieCards(1, "RIGHT", {brick.size[0], 0, 0}) + "*BOUNDARY\nTIE0, 1, 3\n",
        makeLoadCards(1, tip));
    // Digits of CalculiX's extrapolation, see TestElementStress.cpp.
    double size = 0;
    for (const auto& [node, s] : full.stress) size = std::max(size, std::abs(s[0]));
    EXPECT_LT(calcLargestDifference(body, load({tip[0], tip[1], tip[2]}), full), 4e-4 * size);
}

TEST_F(CantileverStress, StaysWithThePartThroughFileModeSelectionAndScaling) {
    writeReducedBody(folder / "beam.h5", body);
    const ReducedBody back = readReducedBody(folder / "beam.h5");
    EXPECT_EQ(back.modalStress->nodes, body.modalStress->nodes);
    EXPECT_EQ(back.modalStress->stress, body.modalStress->stress);
    EXPECT_EQ(back.modalStress->strain, body.modalStress->strain);

    // For a displacement in a selected mode, the stress equals the full part's in that mode.
    const ReducedBody few = selectModes(body, {1, 4});
    const int number = body.mesh.nodeNumbers[40];
    EXPECT_EQ(recoverStress(few, number, {0.25, 2}),
              recoverStress(body, number, {0, 0.25, 0, 0, 2, 0}));
    // Three times as stiff: the same loads give the same stress and a third of the strain.
    const ReducedBody stiff = body.withScaledStiffness(3);
    const std::vector<double> xi = load({0, 100, 0});
    std::vector<double> xiStiff = xi;
    for (double& value : xiStiff) value /= 3;
    for (size_t c = 0; c < 6; ++c) {
        EXPECT_NEAR(recoverStress(stiff, number, xiStiff)[c], recoverStress(body, number, xi)[c],
                    1e-6 * calcVonMises(recoverStress(body, number, xi)));
        EXPECT_NEAR(3 * recover(stiff, stiff.modalStress->strain, number, xiStiff)[c],
                    recover(body, body.modalStress->strain, number, xi)[c], 1e-16);  // of 1e-6
    }
}

TEST(ModalStress, NodesAreThoseOfTheSkinUnlessAskedOtherwise) {
    const TestFolder folder;
    testing::writeText(folder / "brick.inp", Brick().text());
    const FeModel model = readCalculixDeck(folder / "brick.inp");
    ReductionOptions options;
    options.numModes = 8;
    options.stress.emplace();
    const ReducedBody skin = reduce(model, options);
    options.stress = atAllNodes();
    const ReducedBody all = reduce(model, options);
    EXPECT_EQ(skin.modalStress->nodes.size(), 81u - 7);
    EXPECT_EQ(all.modalStress->nodes.size(), 81u);
    // Interior elements also contribute at the skin.
    for (const int node : skin.modalStress->nodes) {
        const int number = skin.mesh.nodeNumbers[size_t(node)];
        EXPECT_EQ(recoverStress(skin, number, {1, 2}), recoverStress(all, number, {1, 2}));
    }
}

TEST(ModalStress, RefusesModelsWithoutADeck) {
    const TestFolder folder;
    testing::writeText(folder / "brick.inp", Brick().text());
    FeModel model = readCalculixDeck(folder / "brick.inp");
    model.source = "stiffness.mtx";
    model.elements = nullptr;
    ReductionOptions options;
    options.numModes = 8;
    options.stress.emplace();
    try {
        reduce(model, options);
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("stress needs the elements of the part"));
        EXPECT_THAT(error.what(), HasSubstr("stiffness.mtx"));
    }
}

/** Returns a mesh of C3D20R over a unit cube of cells, mapped; node sets by predicates of cell
coordinates. **/
std::string makeMappedDeck(const std::array<int, 3>& cells, const std::function<Vec3(Vec3)>& map,
                           const std::map<std::string, std::function<bool(Vec3)>>& sets,
                           bool isClosed) {
    const int n[3] = {2 * cells[0], 2 * cells[1], 2 * cells[2]};
    const auto number = [&](int i, int j, int k) {
        return 1 + i + (n[0] + 1) * ((isClosed ? j % n[1] : j) + (n[1] + 1) * k);
    };
    std::ostringstream text;
    text.precision(14);
    text << "*NODE\n";
    std::map<std::string, std::string> members;
    for (int k = 0; k <= n[2]; ++k)
        for (int j = 0; j < (isClosed ? n[1] : n[1] + 1); ++j)
            for (int i = 0; i <= n[0]; ++i) {
                if (i % 2 + j % 2 + k % 2 > 1) continue;
                const Vec3 cell{double(i) / n[0], double(j) / n[1], double(k) / n[2]};
                const Vec3 x = map(cell);
                const int node = number(i, j, k);
                text << node << "," << x[0] << "," << x[1] << "," << x[2] << "\n";
                for (const auto& [name, has] : sets)
                    if (has(cell)) members[name] += std::to_string(node) + ",\n";
            }
    text << "*ELEMENT, TYPE=C3D20R, ELSET=BODY\n";
    static const int offsets[20][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2},
                                       {2, 0, 2}, {2, 2, 2}, {0, 2, 2}, {1, 0, 0}, {2, 1, 0},
                                       {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2}, {1, 2, 2},
                                       {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
    int element = 1;
    for (int k = 0; k < n[2]; k += 2)
        for (int j = 0; j < n[1]; j += 2)
            for (int i = 0; i < n[0]; i += 2) {
                text << element++;
                for (int m = 0; m < 20; ++m)
                    text << (m == 12 ? ",\n" : ",")
                         << number(i + offsets[m][0], j + offsets[m][1], k + offsets[m][2]);
                text << "\n";
            }
    for (const auto& [name, list] : members) text << "*NSET, NSET=" << name << "\n" << list;
    return text.str() +
           "*MATERIAL, NAME=STEEL\n*ELASTIC\n210e9, 0.3\n*DENSITY\n7800\n"
           "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n";
}

/** A square plate, 0.2 m long, with a hole of diameter 0.04 m, under tension along x: around the
hole, cell j = 0 at x; the outer edge is the square. **/
class PlateWithHole : public ::testing::Test {
protected:
    static constexpr double kHalf = 0.1, kRadius = 0.02, kThickness = 0.005, kForce = 1e4;

    PlateWithHole() {
        testing::writeText(folder / "plate.inp",
                           makeMappedDeck(
                               {6, 32, 1},
                               [](const Vec3& cell) {
                                   const double angle = 2 * M_PI * cell[1], c = std::cos(angle),
                                                s = std::sin(angle),
                                                edge = kHalf / std::max(std::abs(c), std::abs(s)),
                                                radius =
                                                    kRadius * std::pow(edge / kRadius, cell[0]);
                                   return Vec3{radius * c, radius * s, kThickness * cell[2]};
                               },
                               {{"RIGHT", [](const Vec3& c) { return isOnSide(c, 0); }},
                                {"LEFT", [](const Vec3& c) { return isOnSide(c, 0.5); }}},
                               true));
    }

    static bool isOnSide(const Vec3& cell, double middle) {
        const double from = std::abs(cell[1] - middle), turns = std::min(from, 1 - from);
        return cell[0] == 1 && turns < 0.125 + 1e-9;
    }

    TestFolder folder;
};

TEST_F(PlateWithHole, StressConcentrationIsThatOfTheFullModel) {
    SIMFLEX_NEEDS_CALCULIX();
    const Vec3 right{kHalf, 0, kThickness / 2}, left{-kHalf, 0, kThickness / 2};
    const CalculixStress full = testing::calcCalculixStress(
        folder, "plate.inp",
        testing::makeTieCards(0, "LEFT", left) + testing::makeTieCards(1, "RIGHT", right) +
            "*BOUNDARY\nTIE0, 1, 3\n",
        makeLoadCards(1, {kForce, 0, 0, 0, 0, 0}));
    double largest = 0;
    int where = 0;
    for (const auto& [node, s] : full.stress)
        if (s[0] > largest) largest = s[0], where = node;
    const FeModel model = readCalculixDeck(folder / "plate.inp");
    for (const int numModes : {12, 30}) {
        ReductionOptions options;
        options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
        options.interfaces[0].master = left;
        options.interfaces[1].master = right;
        options.numModes = numModes;
        options.stress.emplace();
        const ReducedBody body = reduce(model, options);
        const auto xi =
            solveModes(body, calcInterfaceForces(body, {{"right", {kForce, 0, 0, 0, 0, 0}},
                                                        {"left", {-kForce, 0, 0, 0, 0, 0}}}));
        // 2 % would suffice; interface loads are exact, so only CalculiX's digits remain.
        EXPECT_NEAR(recoverStress(body, where, xi)[0], largest, 4e-4 * largest) << numModes;
        // At the hole, perpendicular to the tension; more than three times the mean stress in a
        // narrow plate.
        const auto at = body.mesh.position(body.mesh.indexOf(where));
        EXPECT_NEAR(std::hypot(at[0], at[1]), kRadius, 1e-6);
        EXPECT_NEAR(std::abs(at[1]), kRadius, 1e-3);
        const double mean = kForce / (2 * kHalf * kThickness);
        EXPECT_GT(largest / mean, 3);
        EXPECT_LT(largest / mean, 3.5);
    }
}

TEST(UniformTension, IsExactInReducedPartsToo) {
    // ν = 0, so the rigid end faces cause no disturbance.
    const TestFolder folder;
    Brick brick;
    brick.nu = 0;
    testing::writeText(folder / "bar.inp", brick.text());
    const ReducedBody body =
        reduceWithStress(folder / "bar.inp", {{"left", "LEFT"}, {"right", "RIGHT"}}, 14);
    const double F = 5e3, expected = F / (brick.size[1] * brick.size[2]);
    const auto xi = solveModes(body, calcInterfaceForces(body, {{"right", {F, 0, 0, 0, 0, 0}},
                                                                {"left", {-F, 0, 0, 0, 0, 0}}}));
    for (const int number : body.mesh.nodeNumbers) {
        const Tensor stress = recoverStress(body, number, xi);
        EXPECT_NEAR(stress[0], expected, 1e-6 * expected);
        for (size_t c = 1; c < 6; ++c) EXPECT_NEAR(stress[c], 0, 1e-6 * expected);
        EXPECT_NEAR(recover(body, body.modalStress->strain, number, xi)[0], expected / brick.E,
                    1e-6 * expected / brick.E);
    }
}

/** An annular disc on a rigid hub, rotating about z. **/
TEST(SpinningDisc, RadialAndHoopStressAreThoseOfTheClosedForm) {
    const double a = 0.05, b = 0.15, thickness = 0.01, nu = 0.3, rho = 7800, omega = 300;
    const TestFolder folder;
    testing::writeText(
        folder / "disc.inp",
        makeMappedDeck(
            {5, 12, 1},
            [&](const Vec3& cell) {
                const double angle = 2 * M_PI * cell[1], r = a + (b - a) * cell[0];
                return Vec3{r * std::cos(angle), r * std::sin(angle), thickness * (cell[2] - 0.5)};
            },
            {{"BORE", [](const Vec3& c) { return c[0] == 0; }}}, true));
    const ReducedBody body = reduceWithStress(folder / "disc.inp", {{"hub", "BORE"}}, 300);
    // Generalized force of rotation about z: ½ ω² ∂I_zz/∂ξ.
    std::vector<double> force;
    for (size_t i = 0; i < size_t(body.numModes); ++i)
        force.push_back(0.5 * omega * omega * body.I1[6 * i + 2]);
    const auto xi = solveModes(body, force);

    // Plane stress: σ_r = A − B/r² − (3+ν)/8 ρω²r², σ_φ = A + B/r² − (1+3ν)/8 ρω²r²; u(a) = 0,
    // σ_r(b) = 0.
    const double q = rho * omega * omega / 8, outer = (3 + nu) * q * b * b;
    // E u/r = σ_φ − ν σ_r = (1−ν)A + (1+ν)B/r² − (1−ν²) q r²; A = outer + B/b².
    const double B = ((1 - nu * nu) * q * a * a - (1 - nu) * outer) /
                     ((1 + nu) / (a * a) + (1 - nu) / (b * b)),
                 A = outer + B / (b * b);
    double worst = 0;
    for (const int number : body.mesh.nodeNumbers) {
        const auto s = body.mesh.position(body.mesh.indexOf(number));
        const double r = std::hypot(s[0], s[1]), c = s[0] / r, w = s[1] / r;
        if (r < a + 0.25 * (b - a)) continue;  // the hub also restrains the thickness
        const Tensor t = recoverStress(body, number, xi);
        const double radial = c * c * t[0] + w * w * t[1] + 2 * c * w * t[3],
                     hoop = w * w * t[0] + c * c * t[1] - 2 * c * w * t[3];
        worst = std::max({worst, std::abs(radial - (A - B / (r * r) - (3 + nu) * q * r * r)),
                          std::abs(hoop - (A + B / (r * r) - (1 + 3 * nu) * q * r * r))});
    }

    EXPECT_LT(worst, 0.02 * outer);
}

}  // namespace
}  // namespace simflex
