/** @file
Reduced parts of shells, beams and ties against CalculiX's frequencies and the theory of plates and
rings. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "fe/TestDecks.h"
#include "fe/ThinDeck.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using testing::TestFolder;
using testing::ThinDeck;
using Point = ThinDeck::Point;

class ThinParts : public ::testing::Test {
protected:
    FeModel readDeck(bool hasCalculixShells = false) {
        testing::writeText(folder / "deck.inp", deck.text());
        CalculixOptions options;
        options.hasCalculixShells = hasCalculixShells;
        return readCalculixDeck(folder / "deck.inp", options);
    }

    ReducedBody reduceDeck(const ReductionOptions& options, bool hasCalculixShells = false) {
        return reduce(readDeck(hasCalculixShells), options);
    }

    static double hertzOf(const ReducedBody& body, int mode) {
        return std::sqrt(body.omegaSquared[size_t(mode)]) / (2 * M_PI);
    }

    /** Returns √(D/ρh) of a plate of METAL of thickness h [m²/s]. **/
    double plateFactor(double h) const {
        return h * std::sqrt(70e9 / (12 * (1 - deck.nu * deck.nu) * 2700));
    }

    TestFolder folder;
    ThinDeck deck;
};

TEST_F(ThinParts, AFreeSquarePlateHasItsTheorysFrequencies) {
    const double h = 0.004;
    deck.addPatch("S8R", "PLATE", 10, 10, [](double u, double v) -> Point { return {u, v, 0}; });
    deck.addShellSection("PLATE", h);
    ReductionOptions options;
    options.numModes = 6 + 6;
    const ReducedBody body = reduceDeck(options);
    // λ = ωa²√(ρh/D) of a thin plate, ν = 0.3 (converged Ritz series).
    const double lambda[6] = {13.468, 19.596, 24.270, 34.801, 34.801, 61.093};
    for (int i = 0; i < 6; ++i) {
        const double expected = lambda[i] * plateFactor(h) / (2 * M_PI);
        EXPECT_NEAR(hertzOf(body, i), expected, 3e-3 * expected) << "mode " << i + 1;
    }
}

class LinearShellPart : public ThinParts, public ::testing::WithParamInterface<const char*> {};

TEST_P(LinearShellPart, OfASkewMeshHasThePlatesFrequencies) {
    const double h = 0.01;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> off(-0.3, 0.3);
    std::map<std::pair<long, long>, Point> moved;
    deck.addPatch(GetParam(), "PLATE", 20, 20, [&](double u, double v) -> Point {
        const auto key = std::pair(std::lround(20 * u), std::lround(20 * v));
        if (moved.count(key)) return moved[key];
        const bool isInner = u > 0.01 && u < 0.99 && v > 0.01 && v < 0.99;
        return moved[key] = {u + (isInner ? off(random) / 20 : 0),
                             v + (isInner ? off(random) / 20 : 0), 0};
    });
    deck.addShellSection("PLATE", h);
    deck.addNodeSet("EDGE", [](const Point& x) { return x[0] < 1e-9; });
    ReductionOptions options;
    options.numModes = 12;
    // Leissa's values for 2.1e11 Pa and 7800 kg/m³: one edge clamped, and free.
    const double scale = std::sqrt((70e9 / 2700) / (2.1e11 / 7800));
    const double clamped[5] = {8.7266, 21.3042, 53.5542, 68.2984, 77.7448},
                 free[5] = {33.7119, 49.4558, 61.0513, 87.516, 87.516};
    const ReducedBody body = reduceDeck(options);
    for (int i = 0; i < 5; ++i)
        EXPECT_NEAR(hertzOf(body, i), scale * free[i], 0.01 * scale * free[i]) << "mode " << i + 1;
    options.interfaces = {{"edge", "EDGE"}};
    const auto held = reduceDeck(options).report->normalFrequencies;
    for (size_t i = 0; i < 5; ++i)
        EXPECT_NEAR(held[i], scale * clamped[i], 0.01 * scale * clamped[i]) << "mode " << i + 1;
}

TEST_P(LinearShellPart, OfASkewMeshBendsAsARingHoweverThin) {
    const double R = 1;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> off(-0.2, 0.2);
    constexpr int Around = 72, Across = 6;
    std::vector<std::array<double, 2>> moved;  // on the ring, by position
    for (int place = 0; place < Around * (Across + 1); ++place)
        moved.push_back({off(random), place % (Across + 1) % Across == 0 ? 0 : off(random)});
    for (const double h : {1e-2, 1e-3, 1e-4}) {
        deck = ThinDeck();
        deck.nu = 0;
        deck.addPatch(GetParam(), "RING", Around, Across, [&](double u, double v) -> Point {
            const long i = std::lround(Around * u) % Around, j = std::lround(Across * v);
            const auto& by = moved[size_t(i * (Across + 1) + j)];
            const double angle = 2 * M_PI * (double(i) + by[0]) / Around;
            return {R * std::cos(angle), R * std::sin(angle), 0.2 * (double(j) + by[1]) / Across};
        });
        deck.addShellSection("RING", h);
        ReductionOptions options;
        options.numModes = 6 + 2;
        const ReducedBody body = reduceDeck(options);
        const double expected =
            6 / std::sqrt(5.0) * h / (R * R) * std::sqrt(70e9 / (12 * 2700)) / (2 * M_PI);
        for (int i = 0; i < 2; ++i)
            EXPECT_NEAR(hertzOf(body, i), expected, 1e-2 * expected) << "h = " << h;
    }
}

INSTANTIATE_TEST_SUITE_P(Types, LinearShellPart, ::testing::Values("S3", "S4", "S4R"));

TEST_F(ThinParts, AFreeDiscHasItsTheorysFrequencies) {
    const double h = 0.02;
    // A square in the middle and four patches around it, radius 1.
    deck.addPatch("S8R", "DISC", 8, 8, [](double u, double v) -> Point {
        return {0.8 * u - 0.4, 0.8 * v - 0.4, 0};
    });
    for (int side = 0; side < 4; ++side)
        deck.addPatch("S8R", "DISC", 8, 8, [&](double u, double v) -> Point {
            const double angle = M_PI / 4 * (2 * v - 1);
            const double x = (1 - u) * 0.4 + u * std::cos(angle),
                         y = (1 - u) * 0.4 * (2 * v - 1) + u * std::sin(angle);
            const int c[4] = {1, 0, -1, 0}, s[4] = {0, 1, 0, -1};
            return {c[side] * x - s[side] * y, s[side] * x + c[side] * y, 0};
        });
    deck.addShellSection("DISC", h);
    ReductionOptions options;
    options.numModes = 6 + 6;
    const ReducedBody body = reduceDeck(options);
    // Thin plate, ν = 0.3; shear reduces λ by up to 0.2 %.
    const double lambda[6] = {5.358, 5.358, 9.003, 12.439, 12.439, 20.475};
    for (int i = 0; i < 6; ++i) {
        const double expected = lambda[i] * plateFactor(h) / (2 * M_PI);
        EXPECT_NEAR(hertzOf(body, i), expected, 5e-3 * expected) << "mode " << i + 1;
    }
}

TEST_F(ThinParts, ARingHasItsTheorysFrequencies) {
    const double R = 0.1, h = 0.001;
    deck.nu = 0;
    deck.addPatch("S8R", "RING", 32, 2, [&](double u, double v) -> Point {
        const double angle = 2 * M_PI * (u == 1 ? 0 : u);
        return {R * std::cos(angle), R * std::sin(angle), 0.02 * v};
    });
    deck.addShellSection("RING", h);
    ReductionOptions options;
    options.numModes = 6 + 16;
    const ReducedBody body = reduceDeck(options);
    for (int n = 2; n <= 4; ++n) {
        const double expected = n * (n * n - 1.0) / std::sqrt(n * n + 1.0) * h / (R * R) *
                                std::sqrt(70e9 / (12 * 2700)) / (2 * M_PI);
        int count = 0;
        for (int i = 0; i < body.numModes; ++i)
            count += std::abs(hertzOf(body, i) - expected) < 3e-3 * expected;
        EXPECT_GE(count, 2) << "mode " << n;  // sine and cosine
    }
}

/** A ring of radius 1 m, given number of elements around and thickness. **/
struct Ring {
    const char *type, *section;  ///< no section: a shell or, through the thickness, bricks
    int numAround;
    double thickness;
    int numLayers = 1;
};

void PrintTo(const Ring& ring, std::ostream* out) {
    *out << ring.numAround << " × " << ring.numLayers << " " << ring.type << " " << ring.section
         << ", R/t " << 1 / ring.thickness;
}

class CurvedElements : public ThinParts, public ::testing::WithParamInterface<Ring> {
protected:
    /** By how much its stiffness in the mode n = 2 is above the theory's, as a part of that. **/
    double calcExcess(bool hasCalculixShells = false) {
        const Ring ring = GetParam();
        const double t = ring.thickness;
        const auto at = [](double u) -> Point {
            const double angle = 2 * M_PI * (u == 1 ? 0 : u);
            return {std::cos(angle), std::sin(angle), 0};
        };
        deck.nu = 0;
        const bool isShell = std::string(ring.section).empty(),
                   isCircle = ring.section == std::string("CIRC"),
                   isPipe = ring.section == std::string("PIPE");
        if (ring.type[0] == 'C') {
            deck.addBricks(ring.type, "RING", {ring.numAround, ring.numLayers, 2},
                           [&](const Point& u) -> Point {
                               const double r = 1 + t * (0.5 - u[1]);
                               return {r * at(u[0])[0], r * at(u[0])[1], 0.25 * u[2]};
                           });
            deck.add("*SOLID SECTION, ELSET=RING, MATERIAL=METAL\n");
        } else if (isShell) {
            deck.addPatch(ring.type, "RING", ring.numAround, 3, [&](double u, double v) -> Point {
                return {at(u)[0], at(u)[1], 0.25 * v};
            });
            deck.addShellSection("RING", t);
        } else {
            deck.addCurvedBeam(ring.type, "RING", ring.numAround, at);
            // Stiff out of plane where the section allows it.
            deck.addBeamSection("RING", ring.section, isCircle || isPipe ? t / 2 : 20 * t,
                                isPipe ? 0.4999 * t : t, "0,0,1");
        }
        const FeModel model = readDeck(hasCalculixShells);
        for (const std::string& warning : model.warnings)
            if (warning.find(" and lock: ") != std::string::npos) warnings.push_back(warning);
        ReductionOptions options;
        options.numModes = 6 + 4;
        const ReducedBody body = reduce(model, options);
        const double inertia = isCircle || isPipe ? t * t / 16 : t * t / 12;  // I/A
        const double expected = 6 / std::sqrt(5.0) * std::sqrt(70e9 * inertia / 2700) / (2 * M_PI);
        // A round section bends as easily out of its plane, with a different formula.
        const double found = hertzOf(body, isCircle || isPipe ? 2 : 0);
        return std::pow(found / expected, 2) - 1;
    }

    std::vector<std::string> warnings;
};

class LockingElements : public CurvedElements {};

TEST_P(LockingElements, AreWarnedOfByHowMuchTheyLock) {
    const double excess = calcExcess(true);
    ASSERT_EQ(warnings.size(), 1u) << "excess " << excess;
    const auto readBehind = [&](const std::string& words) {
        const size_t place = warnings[0].find(words);
        return place == std::string::npos ? 0 : std::stod(warnings[0].substr(place + words.size()));
    };
    const double factor = readBehind("about a factor of ");
    const double told = factor > 0 ? factor - 1 : readBehind("about ") / 100;
    EXPECT_GT(excess, 0.6 * told) << warnings[0];
    EXPECT_LT(excess, 1.6 * told) << warnings[0];
}

INSTANTIATE_TEST_SUITE_P(
    Rings, LockingElements,
    ::testing::Values(Ring{"B32", "RECT", 12, 0.02}, Ring{"B32", "RECT", 24, 0.02},
                      Ring{"B32", "RECT", 24, 0.005}, Ring{"B32", "CIRC", 24, 0.01},
                      Ring{"S8", "", 24, 0.02}, Ring{"S6", "", 12, 0.02}, Ring{"S6", "", 24, 0.01},
                      Ring{"B31", "RECT", 24, 0.01}, Ring{"B31", "RECT", 48, 0.001},
                      Ring{"B32R", "CIRC", 12, 0.03}, Ring{"C3D20", "", 24, 0.01},
                      Ring{"C3D20", "", 24, 0.01, 2}, Ring{"C3D20", "", 12, 0.03},
                      Ring{"C3D8I", "", 24, 0.01}, Ring{"C3D8I", "", 24, 0.01, 2},
                      Ring{"C3D8I", "", 48, 0.001}, Ring{"C3D8", "", 96, 0.05},
                      Ring{"C3D8", "", 96, 0.05, 2}, Ring{"C3D8", "", 96, 0.02, 3}));

TEST_F(ThinParts, LinearBricksThroughAThicknessAreWarnedOf) {
    for (const std::string type : {"C3D8", "C3D8R", "C3D8I", "C3D20", "C3D20R"})
        for (const int layers : {1, 2, 8}) {
            deck = ThinDeck();
            deck.addBricks(type, "STRIP", {40, layers, 8}, [](const Point& u) -> Point {
                return {0.1 * u[0], 0.02 * u[1], 0.02 * u[2]};
            });
            deck.add("*SOLID SECTION, ELSET=STRIP, MATERIAL=METAL\n");
            const FeModel model = readDeck();
            const bool isWarned = layers < 8 && (type == "C3D8" || type == "C3D8R");
            EXPECT_EQ(model.warnings.size(), isWarned ? 1u : 0u)
                << type << " " << layers << ::testing::PrintToString(model.warnings);
        }
}

struct Bar {
    const char* shape;
    std::vector<double> sizes;
    double area, second, polar, torsion;  ///< A, I of bending along n₁, I_p, J
};

void PrintTo(const Bar& bar, std::ostream* out) {
    *out << bar.shape << ::testing::PrintToString(bar.sizes);
}

class StraightBar : public ThinParts, public ::testing::WithParamInterface<Bar> {};

TEST_P(StraightBar, WeighsBendsAndTwistsAsItsSectionDoes) {
    const Bar& bar = GetParam();
    const double L = 2, E = 70e9, rho = 2700, G = E / (2 * (1 + deck.nu));
    for (const char* type : {"B31", "B32", "B32R"}) {
        deck = ThinDeck();
        deck.addBeam(type, "BAR", 40, {0, 0, 0}, {0.6 * L, 0.8 * L, 0});
        std::string numbers;
        for (const double size : bar.sizes)
            numbers += (numbers.empty() ? "" : ",") + std::to_string(size);
        deck.add(std::string("*BEAM SECTION, ELSET=BAR, MATERIAL=METAL, SECTION=") + bar.shape +
                 "\n" + numbers + "\n0,0,1\n");
        ReductionOptions options;
        options.numModes = 6 + 30;
        const FeModel model = readDeck();
        EXPECT_NEAR(model.calcMass(), rho * bar.area * L, 1e-9 * rho * bar.area * L) << type;
        const ReducedBody body = reduce(model, options);
        const auto expectMode = [&](double expected, double tolerance, const char* what) {
            double nearest = 0;
            for (int k = 0; k < body.numModes; ++k)
                if (std::abs(hertzOf(body, k) - expected) < std::abs(nearest - expected))
                    nearest = hertzOf(body, k);
            EXPECT_NEAR(nearest, expected, tolerance * expected) << type << ", " << what;
        };
        const double bending = std::pow(4.730040745 / L, 2) *
                               std::sqrt(E * bar.second / (rho * bar.area)) / (2 * M_PI);
        expectMode(bending, 2e-3, "bending");
        // About its axis the mass turns as the section does.
        for (const int n : {1, 2})
            expectMode(n / (2 * L) * std::sqrt(G * bar.torsion / (rho * bar.polar)), 3e-3,
                       "torsion");
    }
}

/** J/b³a of rectangles a = b, 2b, 5b (Timoshenko and Goodier, Theory of Elasticity). **/
constexpr double Square = 0.140577, Two = 0.228682, Five = 0.291317;
constexpr double b4 = 0.02 * 0.02 * 0.02 * 0.02;

INSTANTIATE_TEST_SUITE_P(
    Sections, StraightBar,
    ::testing::Values(
        Bar{"RECT", {0.02, 0.02}, 4e-4, b4 / 12, b4 / 6, Square* b4},
        Bar{"RECT", {0.04, 0.02}, 8e-4, 8 * b4 / 12, 10 * b4 / 12, Two * 2 * b4},
        Bar{"RECT", {0.02, 0.1}, 2e-3, 5 * b4 / 12, 130 * b4 / 12, Five * 5 * b4},
        Bar{"CIRC", {0.02, 0.02}, M_PI * 1e-4, M_PI* b4 / 64, M_PI* b4 / 32, M_PI* b4 / 32},
        Bar{"PIPE",
            {0.01, 0.002},
            M_PI * 0.36e-4,
            M_PI * 0.5904 * b4 / 64,
            M_PI * 0.5904 * b4 / 32,
            M_PI * 0.5904 * b4 / 32}));

TEST_F(ThinParts, ABoxTwistsByBredt) {
    const double L = 2, a = 0.06, b = 0.03, t = 0.001;  // of the walls' middles
    deck.addBeam("B31", "BAR", 40, {0, 0, 0}, {L, 0, 0});
    deck.add(
        "*BEAM SECTION, ELSET=BAR, MATERIAL=METAL, SECTION=BOX\n.061,.031,.001,.001,.001,.001\n"
        "0,0,1\n");
    ReductionOptions options;
    options.numModes = 6 + 24;
    const ReducedBody body = reduceDeck(options);
    const double polar = t * (a * a * a / 6 + b * b * b / 6 + a * a * b / 2 + b * b * a / 2),
                 torsion = 2 * a * a * b * b * t / (a + b), G = 70e9 / (2 * (1 + deck.nu));
    for (const int n : {1, 2}) {
        const double expected = n / (2 * L) * std::sqrt(G * torsion / (2700 * polar));
        double nearest = 0;
        for (int k = 0; k < body.numModes; ++k)
            if (std::abs(hertzOf(body, k) - expected) < std::abs(nearest - expected))
                nearest = hertzOf(body, k);
        EXPECT_NEAR(nearest, expected, 3e-3 * expected);
    }
}

class SoundElements : public CurvedElements {};

TEST_P(SoundElements, BendAsARingWithoutAWarning) {
    EXPECT_NEAR(calcExcess(), 0, 0.04);
    EXPECT_THAT(warnings, ::testing::IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Rings, SoundElements,
    ::testing::Values(Ring{"S8R", "", 12, 0.005}, Ring{"B32R", "RECT", 12, 0.005},
                      Ring{"B32R", "PIPE", 12, 0.01}, Ring{"B32R", "CIRC", 12, 0.01},
                      Ring{"B32", "RECT", 12, 0.005}, Ring{"B32", "CIRC", 24, 0.01},
                      Ring{"B31", "RECT", 48, 0.001}, Ring{"S4", "", 72, 0.001},
                      Ring{"C3D20R", "", 24, 0.005}, Ring{"C3D8I", "", 72, 0.02, 2}));

/** If only the matrices of a part are known, its unknowns are displacements. **/
class SectionUnknownsTest : public ThinParts {
protected:
    FeModel readModel() {
        testing::writeText(folder / "deck.inp", deck.text());
        return readCalculixDeck(folder / "deck.inp");
    }

    static void expectSameOfMatricesAlone(FeModel model, const ReductionOptions& options,
                                          const std::string& what) {
        const ReducedBody own = reduce(model, options);
        model.elements.reset();
        const ReducedBody ofMatrices = reduce(model, options);
        ASSERT_EQ(own.numModes, ofMatrices.numModes) << what;
        for (int k = 0; k < own.numModes; ++k)
            EXPECT_NEAR(hertzOf(own, k), hertzOf(ofMatrices, k), 1e-7 * hertzOf(ofMatrices, k))
                << what << ", mode " << k + 1;
        const Eigen::MatrixXd a = calcFlexibility(own), b = calcFlexibility(ofMatrices);
        EXPECT_LE((a - b).norm(), 1e-6 * b.norm()) << what;
    }

    /** Returns the flexibility of the interfaces in the modes of the part. **/
    static Eigen::MatrixXd calcFlexibility(const ReducedBody& body) {
        Eigen::MatrixXd shapes(6 * Eigen::Index(body.interfaces.size()), body.numModes);
        Eigen::Index row = 0;
        for (const auto& interface : body.interfaces)
            for (const auto* of : {&interface.Phi, &interface.Psi}) {
                shapes.middleRows(row, 3) =
                    Eigen::Map<const Eigen::MatrixXd>(of->data(), 3, body.numModes);
                row += 3;
            }
        const Eigen::Map<const Eigen::VectorXd> stiffness(body.omegaSquared.data(), body.numModes);
        return shapes * stiffness.cwiseInverse().asDiagonal() * shapes.transpose();
    }
};

TEST_F(SectionUnknownsTest, ReducePartsToWhatDisplacementsDo) {
    for (const std::string shell : {"S3", "S4", "S6", "S8R"})
        for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
            deck = ThinDeck();
            // An angle section with a knot along its edge, a step in thickness and an offset, and a
            // beam stiffener that ends on the edge.
            deck.addPatch(shell, "FOOT", 4, 3, [](double u, double v) -> Point {
                return {0.5 * u, 0.2 * v, 0};
            });
            deck.addPatch(shell, "WALL", 4, 2, [](double u, double v) -> Point {
                return {0.5 * u, 0, 0.15 * v};
            });
            deck.addPatch(shell, "THICK", 2, 3, [](double u, double v) -> Point {
                return {0.5 + 0.25 * u, 0.2 * v, 0};
            });
            deck.addBeam(shell == "S3" || shell == "S4" ? "B31" : "B32R", "STIFF", 2,
                         {0.5, 0, 0.15}, {0.75, 0, 0});
            deck.addShellSection("FOOT", 0.004);
            deck.addShellSection("WALL", 0.003);
            deck.addShellSection("THICK", 0.006, 0.5);
            deck.addBeamSection("STIFF", "RECT", 0.01, 0.006, "0,1,0");
            deck.addNodeSet("NEAR", [](const Point& x) { return x[0] < 1e-9 && x[2] > -1e-9; });
            deck.addNodeSet("FAR", [](const Point& x) { return x[0] > 0.75 - 1e-9; });
            deck.add("*ELEMENT, TYPE=SPRINGA, ELSET=SPRINGS\n9001," +
                     std::to_string(deck.addNode({0.25, 0, 0.15})) + "," +
                     std::to_string(deck.addNode({0.25, 0.2, 0})) +
                     "\n*SPRING, ELSET=SPRINGS\n\n1e5\n");
            const FeModel model = readModel();
            ReductionOptions options;
            options.interfaces = {{"near", "NEAR", tie}, {"far", "FAR", tie}};
            options.numModes = 20;
            expectSameOfMatricesAlone(model, options, shell);
            options.interfaces.clear();
            expectSameOfMatricesAlone(model, options, shell + " without interfaces");
        }
}

TEST_F(SectionUnknownsTest, FollowInterfacesThatHaveOneSideOfAShell) {
    deck.addPatch("S4", "PLATE", 6, 3, [](double u, double v) -> Point {
        return {0.5 * u, 0.2 * v, 0};
    });
    deck.addShellSection("PLATE", 0.01);
    FeModel model = readModel();
    // Nodes of both sides at the ends; and both sides at one end as separate interfaces.
    for (int node = 0; node < model.mesh.numNodes(); ++node) {
        const Point x = model.mesh.position(node);
        const bool isEnd = x[0] < 0.1 || x[0] > 0.4;
        if (isEnd && std::abs(x[2]) > 1e-9)
            model.mesh
                .nodeSets[std::string(x[0] < 0.25 ? "LOW" : "HIGH") +
                          (x[2] > 0 ? "ABOVE" : "BELOW")]
                .push_back(node);
    }
    for (const auto& [first, second] :
         {std::pair("LOWABOVE", "HIGHBELOW"), std::pair("LOWBELOW", "LOWABOVE")})
        for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
            ReductionOptions options;
            options.interfaces = {{first, first, TieType::Rigid}, {second, second, tie}};
            options.numModes = 20;
            expectSameOfMatricesAlone(model, options, std::string(first) + " and " + second);
        }
}

/** Elements, and the length over thickness at which they match Bernoulli's beam to `digits`. **/
struct SlenderStrip {
    const char* type;
    double ratio, digits;
};

class TooSlenderParts : public ThinParts {
protected:
    /** Returns the three lowest frequencies of a free-free strip with zero Poisson's ratio [Hz].
     **/
    std::array<double, 3> calcFrequencies(const std::string& type, double ratio) {
        constexpr double L = 1, w = 0.02;
        deck = ThinDeck();
        deck.nu = 0;
        if (type[0] == 'B') {
            deck.addBeam(type, "STRIP", 40, {0, 0, 0}, {L, 0, 0});
            deck.addBeamSection("STRIP", "RECT", w, L / ratio, "0,1,0");
        } else {
            deck.addPatch(type, "STRIP", 40, 1, [](double u, double v) -> Point {
                return {u, w * v, 0};
            });
            deck.addShellSection("STRIP", L / ratio);
        }
        ReductionOptions options;
        options.numModes = 6 + 4;
        const ReducedBody body = reduceDeck(options);
        return {hertzOf(body, 0), hertzOf(body, 1), hertzOf(body, 2)};
    }
};

class SlenderParts : public TooSlenderParts, public ::testing::WithParamInterface<SlenderStrip> {};

TEST_P(SlenderParts, BendAsThickerOnesDo) {
    // Without shear and rotatory inertia, frequencies are proportional to the thickness.
    constexpr double Thicker = 1000;
    const auto [type, ratio, digits] = GetParam();
    const auto thick = calcFrequencies(type, Thicker), thin = calcFrequencies(type, ratio);
    const double lambda[3] = {4.730040744862704, 7.853204624095838, 10.995607838001671};
    for (size_t k = 0; k < 3; ++k) {
        const double scaled = thick[k] * Thicker / ratio;
        // Shear and rotatory inertia lower the thicker strip's frequency, (1 + E/κG)/24 of
        // (λ/ratio)²; fully integrated elements that resist bending by shear become softer.
        EXPECT_NEAR(thin[k], scaled, (digits + 0.5 * std::pow(lambda[k] / Thicker, 2)) * scaled)
            << "mode " << k + 1;
        const double bernoulli =
            lambda[k] * lambda[k] / (2 * M_PI) / ratio * std::sqrt(70e9 / 12 / 2700);
        EXPECT_NEAR(thin[k], bernoulli, 1e-2 * bernoulli) << "mode " << k + 1;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Types, SlenderParts,
    ::testing::Values(SlenderStrip{"S4", 1e4, 1e-5}, SlenderStrip{"S4", 1e5, 1e-3},
                      SlenderStrip{"S8", 1e4, 1e-5}, SlenderStrip{"S8", 1e5, 1e-3},
                      SlenderStrip{"B31", 1e4, 1e-5}, SlenderStrip{"B32", 1e4, 1e-5},
                      SlenderStrip{"B32", 1e5, 1e-3}, SlenderStrip{"B32R", 1e4, 1e-5},
                      SlenderStrip{"B32R", 1e5, 1e-3}),
    [](const auto& strip) {
        return std::string(strip.param.type) + "_" + std::to_string(int(strip.param.ratio));
    });

TEST_F(TooSlenderParts, ThoseTooSlenderForTheDigitsOfTheirStiffnessAreRefusedAsThat) {
    try {
        calcFrequencies("S8", 1e6);
        FAIL() << "it was reduced";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), ::testing::HasSubstr("times as long as it is thick"));
        EXPECT_THAT(error.what(), ::testing::HasSubstr("shorter pieces"));
    }
}

TEST_F(ThinParts, ShellsBeamsAndSolidsTiedTogetherHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 5, 3, [](double u, double v) -> Point {
        return {-0.05 + 0.25 * u, 0.15 * v, 0};
    });
    deck.addBox("BLOCK", {2, 3, 2}, {-0.1, 0, -0.02}, {0, 0.15, 0.02});
    deck.addBox("FOOT", {2, 2, 1}, {-0.1, 0.02, -0.05}, {0, 0.13, -0.02 - 1e-5});
    // Along an edge of the plate and beyond: attached to a single node it could rotate freely about
    // the normal.
    deck.addBeam("B32R", "MAST", 1, {0.2, 0.1, 0}, {0.2, 0.15, 0});
    deck.addBeam("B32R", "MAST", 3, {0.2, 0.15, 0}, {0.2, 0.35, 0});
    deck.addShellSection("PLATE", 0.006);
    deck.addBeamSection("MAST", "CIRC", 0.012, 0.012, "1,0,0");
    deck.add(
        "*SOLID SECTION, ELSET=BLOCK, MATERIAL=HEAVY\n*SOLID SECTION, ELSET=FOOT, MATERIAL=METAL\n"
        "*SURFACE, NAME=BELOW\n16,S1\n17,S1\n18,S1\n19,S1\n20,S1\n21,S1\n"
        "*SURFACE, NAME=TOP\nFOOT,S2\n*TIE, NAME=T, POSITION TOLERANCE=1e-4\nTOP,BELOW\n");
    ReductionOptions options;
    options.numModes = 6 + 10;
    const ReducedBody body = reduceDeck(options, true);
    const auto reference = testing::calcCalculixFrequencies(folder, folder / "deck.inp", {}, 16);
    for (int i = 0; i < 10; ++i)
        EXPECT_NEAR(hertzOf(body, i), reference[size_t(6 + i)], 1e-5 * reference[size_t(6 + i)])
            << "mode " << i + 1;
}

class StiffenedStrip : public ThinParts, public ::testing::WithParamInterface<const char*> {};

/** Compressed at both ends by forces of constant direction, it buckles at π²EI/L². **/
TEST_P(StiffenedStrip, BucklesAtEulersLoad) {
    const double L = 1, w = 0.02, t = 0.01, EI = 70e9 * w * t * t * t / 12;
    const std::string type = GetParam();
    for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
        deck = ThinDeck();
        deck.nu = 0;
        ReductionOptions options;
        options.numModes = 6 + 12;
        options.hasStiffening = true;
        if (type[0] == 'B') {
            deck.addBeam(type, "STRIP", 40, {0, 0, 0}, {L, 0, 0});
            deck.addBeamSection("STRIP", "RECT", w, t, "0,1,0");
            options.interfaces = {{"a", "node:" + std::to_string(deck.addNode({0, 0, 0})), tie},
                                  {"b", "node:" + std::to_string(deck.addNode({L, 0, 0})), tie}};
        } else {
            deck.addPatch(type, "STRIP", 40, 2, [&](double u, double v) -> Point {
                return {L * u, w * v, 0};
            });
            deck.addShellSection("STRIP", t);
            deck.addNodeSet("A", [](const Point& x) { return x[0] < 1e-9; });
            deck.addNodeSet("B", [&](const Point& x) { return x[0] > L - 1e-9; });
            options.interfaces = {{"a", "A", tie}, {"b", "B", tie}};
        }
        const ReducedBody body = reduceDeck(options);
        const auto ofForce = [&](size_t interface) {
            return Eigen::Map<const Eigen::MatrixXd>(
                body.stiffening->interfaces[interface][0].data(), body.numModes, body.numModes);
        };
        // Solve (Ω² + P (K_a − K_b)) x = 0 as (K_b − K_a) x = 1/P Ω² x.
        const Eigen::Map<const Eigen::VectorXd> omegaSquared(body.omegaSquared.data(),
                                                             body.numModes);
        const Eigen::VectorXd inverse = omegaSquared.cwiseSqrt().cwiseInverse();
        const Eigen::MatrixXd scaled =
            inverse.asDiagonal() * (ofForce(1) - ofForce(0)) * inverse.asDiagonal();
        const double load =
            1 / Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues().maxCoeff();
        const double expected = M_PI * M_PI * EI / (L * L);
        EXPECT_NEAR(load, expected, 5e-3 * expected);
    }
}

INSTANTIATE_TEST_SUITE_P(Types, StiffenedStrip,
                         ::testing::Values("S3", "S4", "S4R", "S8R", "B31", "B32", "B32R"));

class BeamPart : public ThinParts, public ::testing::WithParamInterface<const char*> {
protected:
    /** Returns the displacements of b under unit forces at b, with a held [m/N]. **/
    static Eigen::Matrix3d calcFlexibility(const ReducedBody& body) {
        const auto shapesOf = [&](const char* name) {
            const auto& interface = body.getInterface(name);
            Eigen::MatrixXd shapes(6, body.numModes);
            shapes << Eigen::Map<const Eigen::MatrixXd>(interface.Phi.data(), 3, body.numModes),
                Eigen::Map<const Eigen::MatrixXd>(interface.Psi.data(), 3, body.numModes);
            return shapes;
        };
        const Eigen::Vector3d arm =
            Eigen::Map<const Eigen::Vector3d>(body.getInterface("b").position.data()) -
            Eigen::Map<const Eigen::Vector3d>(body.getInterface("a").position.data());
        const Eigen::MatrixXd ofA = shapesOf("a");
        Eigen::MatrixXd motion = shapesOf("b").topRows<3>() - ofA.topRows<3>();
        for (Eigen::Index k = 0; k < motion.cols(); ++k)
            motion.col(k) -= Eigen::Vector3d(ofA.col(k).tail<3>()).cross(arm);
        const Eigen::Map<const Eigen::VectorXd> stiffness(body.omegaSquared.data(), body.numModes);
        return motion * stiffness.cwiseInverse().asDiagonal() * motion.transpose();
    }
};

/** Ends that are one node each, for any tie and element length. **/
TEST_P(BeamPart, BendsAsTimoshenkoFoundBetweenItsEndNodes) {
    const double L = 0.5, h = 0.02, w = 0.03, E = 70e9, G = E / (2 * (1 + deck.nu)), A = h * w;
    for (const int numElements : {20, 40, 80})
        for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
            deck = ThinDeck();
            deck.addBeam(GetParam(), "BEAM", numElements, {0, 0, 0}, {L, 0, 0});
            deck.addBeamSection("BEAM", "RECT", h, w, "0,1,0");  // h along y
            ReductionOptions options;
            options.interfaces = {{"a", "node:" + std::to_string(deck.addNode({0, 0, 0})), tie},
                                  {"b", "node:" + std::to_string(deck.addNode({L, 0, 0})), tie}};
            options.numModes = 12;
            const Eigen::Matrix3d flexibility = calcFlexibility(reduceDeck(options));
            const double shear = L / (5.0 / 6 * G * A),
                         inY = 4 * L * L * L / (E * w * h * h * h) + shear,
                         inZ = 4 * L * L * L / (E * h * w * w * w) + shear;
            const std::string what = std::to_string(numElements) + " elements";
            EXPECT_NEAR(flexibility(0, 0), L / (E * A), 2e-3 * L / (E * A)) << what;
            EXPECT_NEAR(flexibility(1, 1), inY, 2e-3 * inY) << what;
            EXPECT_NEAR(flexibility(2, 2), inZ, 2e-3 * inZ) << what;
        }
}

INSTANTIATE_TEST_SUITE_P(Types, BeamPart, ::testing::Values("B31", "B32", "B32R"));

TEST_F(ThinParts, AnInterfaceThatIsABeamsNodeIsThatNodesMotion) {
    SIMFLEX_NEEDS_CALCULIX();
    constexpr int Bays = 16;
    for (int k = 0; k < Bays; ++k)
        deck.addBeam("B32R", "GIRDER", 1, {0.1 * k, 0, 0}, {0.1 * (k + 1), 0, 0});
    deck.addBeamSection("GIRDER", "RECT", 0.06, 0.03, "0,0,1");
    std::vector<int> nodes;
    for (int k = 0; k <= Bays; ++k) nodes.push_back(deck.addNode({0.1 * k, 0, 0}));
    const FeModel model = readDeck(true);
    ReductionOptions options;
    options.numModes = 6 * int(nodes.size());  // none but those of the nodes
    const auto hertz = [&](TieType tie) {
        options.interfaces.clear();
        for (const int node : nodes)
            options.interfaces.push_back(
                {"p" + std::to_string(node), "node:" + std::to_string(node), tie});
        return hertzOf(reduce(model, options), 0);
    };
    const double whole = testing::calcCalculixFrequencies(folder, folder / "deck.inp", {}, 7)[6];
    for (const TieType tie : {TieType::Rigid, TieType::Distributing})
        EXPECT_NEAR(hertz(tie), whole, 1e-5 * whole);
}

TEST_F(ThinParts, ModesOfEqualBaysStayTogether) {
    // Between held nodes, sixteen bending modes with one frequency follow eight others.
    constexpr int Bays = 8;
    for (int k = 0; k < Bays; ++k)
        deck.addBeam("B32R", "GIRDER", 1, {0.2 * k, 0, 0}, {0.2 * (k + 1), 0, 0});
    deck.addBeamSection("GIRDER", "RECT", 0.06, 0.03, "0,0,1");
    ReductionOptions options;
    for (int k = 0; k <= Bays; ++k) {
        const int node = deck.addNode({0.2 * k, 0, 0});
        options.interfaces.push_back({"p" + std::to_string(k), "node:" + std::to_string(node)});
    }
    const FeModel model = readDeck(true);
    const int numStatic = 6 * (Bays + 1);
    for (const int wanted : {8, 9, 11}) {
        options.numModes = numStatic + wanted;
        const ReducedBody body = reduce(model, options);
        EXPECT_EQ(body.numModes, numStatic - 6 + 8) << wanted;
        EXPECT_EQ(describeEqualModes(body, options).empty(), wanted == 8) << wanted;
    }
    // All of them, of which the singular mass of such elements leaves fewer.
    for (const int wanted : {12, 22, 23}) {
        options.numModes = numStatic + wanted;
        try {
            reduce(model, options);
            ADD_FAILURE() << wanted;
        } catch (const std::invalid_argument& error) {
            EXPECT_THAT(error.what(), ::testing::HasSubstr("24 normal modes are taken instead of " +
                                                           std::to_string(wanted)));
        }
    }
}

}  // namespace
}  // namespace simflex
