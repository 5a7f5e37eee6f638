/** @file
Decks of shells and beams against CalculiX's frequencies of the same deck. **/

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "fe/FreeModes.h"
#include "fe/TestDecks.h"
#include "fe/ThinDeck.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/NodeSelection.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TestFolder;
using testing::ThinDeck;
using Point = ThinDeck::Point;

Point flat(double u, double v) {
    return {0.3 * u, 0.2 * v, 0};
}

class ThinDecks : public ::testing::Test {
protected:
    /** By default, linear shells become CalculiX's solids. **/
    FeModel read(const std::string& text, bool hasCalculixShells = true) {
        testing::writeText(folder / "deck.inp", text);
        CalculixOptions options;
        options.hasCalculixShells = hasCalculixShells;
        return readCalculixDeck(folder / "deck.inp", options);
    }

    std::string errorOf(const std::string& text, bool hasCalculixShells = true) {
        try {
            read(text, hasCalculixShells);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    /** CalculiX prints 7 digits. **/
    FeModel expectCalculixFrequencies(int numZero = 6) {
        const FeModel model = read(deck.text());
        constexpr int kNumModes = 16;
        const auto own = testing::calcFreeFrequencies(model, kNumModes);
        const auto reference =
            testing::calcCalculixFrequencies(folder, folder / "deck.inp", {}, kNumModes);
        for (int i = 0; i < numZero; ++i)
            EXPECT_LT(own[i], 1e-3 * own[numZero]) << "rigid mode " << i + 1;
        for (int i = numZero; i < kNumModes; ++i)
            EXPECT_NEAR(own[i], reference[i], 1e-5 * reference[i]) << "mode " << i + 1;
        return model;
    }

    TestFolder folder;
    ThinDeck deck;
};

class EveryShell : public ThinDecks, public ::testing::WithParamInterface<const char*> {};

TEST_P(EveryShell, AsAFlatPlateHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch(GetParam(), "PLATE", 6, 4, flat);
    deck.addShellSection("PLATE", 0.004);
    const FeModel model = expectCalculixFrequencies();
    EXPECT_NEAR(model.calcMass(), 2700 * 0.3 * 0.2 * 0.004, 1e-9);
}

TEST_P(EveryShell, OfFirstOrderIsToldOf) {
    const std::string type = GetParam();
    deck.addPatch(GetParam(), "PLATE", 4, 3, [](double u, double v) -> Point {
        return {0.2 * u, 0.15 * v, 0};
    });
    deck.addShellSection("PLATE", 0.006);
    const FeModel model = read(deck.text());
    const bool isLinear = type == "S3" || type == "S4" || type == "S4R";
    const auto isTold =
        ::testing::Contains(::testing::AllOf(HasSubstr("shells of first order (" + type + ": "),
                                             HasSubstr("leave --calculix-shells out")));
    if (isLinear) {
        EXPECT_THAT(model.warnings, isTold);
    } else {
        EXPECT_THAT(model.warnings, ::testing::Not(::testing::Contains(HasSubstr("first order"))));
    }
}

class EveryCurvedShell : public EveryShell {};

TEST_P(EveryCurvedShell, AsACylinderHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch(GetParam(), "SHELL", 24, 3, [](double u, double v) -> Point {
        const double angle = 2 * M_PI * (u == 1 ? 0 : u);
        return {0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.15 * v};
    });
    deck.addShellSection("SHELL", 0.003);
    expectCalculixFrequencies();
}

TEST_P(EveryShell, AsAnAngleWithAKnotHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch(GetParam(), "A", 4, 3, [](double u, double v) -> Point {
        return {0.2 * u, 0.15 * v, 0};
    });
    deck.addPatch(GetParam(), "A", 3, 3, [](double u, double v) -> Point {
        return {0, 0.15 * v, 0.12 * u};
    });
    deck.addShellSection("A", 0.004);
    expectCalculixFrequencies();
}

INSTANTIATE_TEST_SUITE_P(Types, EveryShell,
                         ::testing::Values("S3", "S4", "S4R", "S6", "S8", "S8R"));
INSTANTIATE_TEST_SUITE_P(Types, EveryCurvedShell, ::testing::Values("S3", "S6", "S8", "S8R"));

TEST_F(ThinDecks, PlatesOfTwoThicknessesMeetInAKnotOnALine) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "THIN", 3, 3, [](double u, double v) -> Point {
        return {0.1 * u, 0.15 * v, 0};
    });
    deck.addPatch("S8R", "THICK", 3, 3, [](double u, double v) -> Point {
        return {0.1 + 0.1 * u, 0.15 * v, 0};
    });
    deck.addShellSection("THIN", 0.003);
    deck.addShellSection("THICK", 0.006);
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, AnOffsetPlateHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 6, 4, flat);
    deck.addShellSection("PLATE", 0.004, 0.5);
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, NodalThicknessHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 6, 4, flat);
    deck.add("*NODAL THICKNESS\nALL, 0.003\n1, 0.005\n");
    deck.add("*SHELL SECTION, ELSET=PLATE, MATERIAL=METAL, NODAL THICKNESS\n0.1\n");
    expectCalculixFrequencies();
}

/** An orthotropic material and axes aligned with nothing else. **/
const char* kPly =
    "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
    "140e9,10e9,9e9,.3,.25,.4,5e9,4e9,\n3e9\n*DENSITY\n1600\n"
    "*ORIENTATION, NAME=ASKEW\n1.,.4,.2,-.3,1.,.1\n"
    "*ORIENTATION, NAME=ROUND, SYSTEM=CYLINDRICAL\n0.,0.,0.,0.,0.,1.\n";

Point bowl(double u, double v) {
    return {0.3 * u, 0.2 * v, 0.05 * u * u - 0.08 * u * v};
}

TEST_P(EveryShell, OfPlyHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    const bool isLinear = GetParam()[1] == '4' || GetParam()[1] == '3';  // S4R must be flat
    deck.addPatch(GetParam(), "PLATE", 6, 4, isLinear ? flat : bowl);
    deck.add(kPly);
    deck.add("*SHELL SECTION, ELSET=PLATE, MATERIAL=PLY, ORIENTATION=ASKEW\n.004\n");
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, ShellsOfPlyWithoutAxesAndWithRoundOnesHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 4, 3, [](double u, double v) -> Point {
        return {0.1 + 0.2 * u, 0.2 * v, 0};
    });
    deck.addPatch("S8R", "WALL", 2, 3, [](double u, double v) -> Point {
        return {0.1, 0.2 * v, 0.1 * u};
    });
    deck.add(kPly);
    deck.add(
        "*SHELL SECTION, ELSET=PLATE, MATERIAL=PLY, ORIENTATION=ROUND\n.004\n"
        "*SHELL SECTION, ELSET=WALL, MATERIAL=PLY\n.004\n");
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, BeamsOfPlyHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addBeam("B32", "A", 6, {0, 0, 0}, {0.2, 0.1, 0.05});
    deck.addBeam("B32R", "B", 6, {0.2, 0.1, 0.05}, {0.4, 0, 0});
    deck.add(kPly);
    for (const char* set : {"A", "B"})
        deck.add(std::string("*BEAM SECTION, ELSET=") + set +
                 ", MATERIAL=PLY, ORIENTATION=ASKEW, SECTION=RECT\n.012,.008\n0,1,0\n");
    expectCalculixFrequencies();
}

class LayeredShell : public ThinDecks, public ::testing::WithParamInterface<const char*> {};

TEST_P(LayeredShell, HasCalculixFrequenciesAndTheMassOfItsLayers) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch(GetParam(), "PLATE", 6, 4, flat);
    deck.add(kPly);
    deck.add(
        "*SHELL SECTION, ELSET=PLATE, COMPOSITE, OFFSET=.2\n"
        ".001,3,METAL\n.002,,PLY,ASKEW\n.0005,,HEAVY\n");
    const FeModel model = expectCalculixFrequencies();
    EXPECT_NEAR(model.calcMass(), 0.3 * 0.2 * (2.7 + 2 * 1.6 + 0.5 * 7.8), 1e-9);
}

TEST_P(LayeredShell, ThatIsCurvedHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch(GetParam(), "PLATE", 6, 4, bowl);
    deck.addPatch(GetParam(), "MORE", 4, 4, [](double u, double v) { return bowl(1 + u, v); });
    deck.add(kPly);
    deck.add(
        "*SHELL SECTION, ELSET=PLATE, COMPOSITE, ORIENTATION=ASKEW\n"
        ".001,,PLY\n.002,,METAL\n.001,,PLY\n");
    deck.addShellSection("MORE", 0.004);
    expectCalculixFrequencies();
}

INSTANTIATE_TEST_SUITE_P(Types, LayeredShell, ::testing::Values("S8R", "S6"));

TEST_F(ThinDecks, LayersOfOneMaterialAreAPlate) {
    deck.addPatch("S6", "PLATE", 4, 3, bowl);
    const std::string layers = "*SHELL SECTION, ELSET=PLATE, COMPOSITE\n.001,,METAL\n.003,,METAL\n";
    // For second-order elements two points per layer, three for a plate, integrate bending exactly.
    const FeModel layered = read(deck.text() + layers);
    deck.addShellSection("PLATE", 0.004);
    const auto a = testing::calcFreeFrequencies(layered, 10),
               b = testing::calcFreeFrequencies(read(deck.text()), 10);
    for (size_t k = 6; k < 10; ++k) EXPECT_NEAR(a[k], b[k], 1e-3 * b[k]);
}

TEST_F(ThinDecks, AnAngleTurnsALayerAboutTheNormal) {
    deck.addPatch("S8R", "PLATE", 3, 2, flat);
    deck.add(kPly);
    deck.add("*ORIENTATION, NAME=TURNED\n" + std::to_string(std::cos(M_PI / 6)) + "," +
             std::to_string(std::sin(M_PI / 6)) + ",0.,-1.,2.,0.\n");
    const std::string section = "*SHELL SECTION, ELSET=PLATE, COMPOSITE\n.001,,METAL\n.002,,PLY,";
    const auto a = testing::calcFreeFrequencies(read(deck.text() + section + "30.\n"), 10),
               b = testing::calcFreeFrequencies(read(deck.text() + section + "TURNED\n"), 10);
    for (size_t k = 6; k < 10; ++k) EXPECT_NEAR(a[k], b[k], 1e-6 * b[k]);
}

TEST_F(ThinDecks, NormalsAreAsTheyAreGiven) {
    SIMFLEX_NEEDS_CALCULIX();
    const auto left = [](double u, double v) -> Point { return {0.2 * u, 0.15 * v, 0.02 * u}; };
    deck.addPatch("S8R", "ROOF", 3, 2, left);
    deck.addPatch("S8R", "ROOF", 3, 2, [](double u, double v) -> Point {
        return {0.2 + 0.2 * u, 0.15 * v, 0.02 - 0.02 * u};
    });
    deck.addShellSection("ROOF", 0.01);
    const auto averaged = testing::calcFreeFrequencies(read(deck.text()), 10);
    deck.add("*NORMAL\n");
    for (int row = 0; row < 2; ++row)
        for (int k = 0; k <= 2; ++k)
            for (const int element : {3 * row + 3, 3 * row + 7})
                deck.add(std::to_string(element) + "," +
                         std::to_string(deck.addNode(left(1, (row + 0.5 * k) / 2))) + "," +
                         (element > 6 ? "" : "-") + "0.1,0.,1.\n");
    const auto given = testing::calcFreeFrequencies(expectCalculixFrequencies(), 10);
    EXPECT_GT(std::abs(given[6] / averaged[6] - 1), 1e-4);
}

TEST_F(ThinDecks, NormalsOfBeamsAreAsTheyAreGiven) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addBeam("B32", "BEAM", 8, {0, 0, 0}, {0.4, 0.1, 0});
    deck.addBeamSection("BEAM", "RECT", 0.012, 0.004, "0,0,1");
    const std::string node = std::to_string(deck.addNode({0.1, 0.025, 0}));
    const std::string text =
        deck.text() + "*NORMAL\n3," + node + ",.232,-.928,.3\n2," + node + ",.232,-.928,.3\n";
    deck.add("*NORMAL\n3," + node + ",.232,-.928,.3\n");
    expectCalculixFrequencies();
    // CalculiX 2.20 loses the section's first axis, and mass, where two beams share a normal.
    EXPECT_NEAR(read(text).calcMass(), 2700 * 0.012 * 0.004 * std::hypot(0.4, 0.1), 1e-2 * 0.05344);
}

struct BeamType {
    const char *type, *shape;
};

class EveryBeam : public ThinDecks, public ::testing::WithParamInterface<BeamType> {};

TEST_P(EveryBeam, StraightHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addBeam(GetParam().type, "BEAM", 12, {0, 0, 0}, {0.4, 0.1, 0.05});
    deck.addBeamSection("BEAM", GetParam().shape, 0.012, 0.008, "0,1,0");
    expectCalculixFrequencies();
}

TEST_P(EveryBeam, AsATeeWithAKnotHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addBeam(GetParam().type, "BEAM", 8, {0, 0, 0}, {0.4, 0, 0});
    deck.addBeam(GetParam().type, "BEAM", 4, {0.2, 0, 0}, {0.2, 0.2, 0});
    deck.addBeamSection("BEAM", GetParam().shape, 0.012, 0.008, "0,0,1");
    expectCalculixFrequencies();
}

TEST_P(EveryBeam, AsAFrameInSpaceHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    const char* type = GetParam().type;
    deck.addBeam(type, "X", 4, {0, 0, 0}, {0.4, 0, 0});
    deck.addBeam(type, "X", 4, {0, 0.3, 0}, {0.4, 0.3, 0});
    deck.addBeam(type, "X", 3, {0, 0, 0}, {0, 0.3, 0});
    deck.addBeam(type, "X", 3, {0.4, 0, 0}, {0.4, 0.3, 0});
    for (const double x : {0.0, 0.4})
        for (const double y : {0.0, 0.3}) deck.addBeam(type, "Z", 3, {x, y, 0}, {x, y, -0.25});
    deck.addBeamSection("X", GetParam().shape, 0.012, 0.012, "0,0,1");
    deck.addBeamSection("Z", GetParam().shape, 0.01, 0.02, "1,0,0");
    expectCalculixFrequencies();
}

INSTANTIATE_TEST_SUITE_P(Types, EveryBeam,
                         ::testing::Values(BeamType{"B31", "RECT"}, BeamType{"B32", "RECT"},
                                           BeamType{"B32", "CIRC"}, BeamType{"B32R", "RECT"},
                                           BeamType{"B32R", "CIRC"}),
                         [](const auto& beam) {
                             return std::string(beam.param.type) + "_" + beam.param.shape;
                         });

TEST_F(ThinDecks, ACircleOfOneNumberHasItAsItsRadiusAsInAbaqus) {
    for (const std::string type : {"B32", "B32R"}) {
        ThinDeck two, one;
        for (ThinDeck* deckOf : {&two, &one})
            deckOf->addBeam(type, "BEAM", 8, {0, 0, 0}, {0.4, 0, 0});
        two.addBeamSection("BEAM", "CIRC", 0.012, 0.012, "0,1,0");
        one.add("*BEAM SECTION, ELSET=BEAM, MATERIAL=METAL, SECTION=CIRC\n0.006\n0,1,0\n");
        const FeModel right = read(two.text()), found = read(one.text());
        EXPECT_NEAR(found.calcMass(), right.calcMass(), 1e-12 * right.calcMass());
        EXPECT_THAT(found.warnings, ::testing::ElementsAre(HasSubstr("is taken as the radius")));
        EXPECT_TRUE(right.warnings.empty());
    }
}

TEST_F(ThinDecks, NodeSetsAreFoundWhateverTheirCase) {
    Mesh mesh;
    mesh.nodeSets = {{"seat", {1}}, {"TIP", {2}}, {"tip", {3}}, {"Root", {4}}};
    for (const auto& [name, node] : std::vector<std::pair<std::string, int>>{
             {"seat", 1}, {"SEAT", 1}, {"TIP", 2}, {"tip", 3}, {"Tip", 2}, {"root", 4}})
        EXPECT_EQ(selectNodes(mesh, name), std::vector<int>{node}) << name;
    EXPECT_THROW(selectNodes(mesh, "toe"), std::invalid_argument);
}

TEST_F(ThinDecks, AShellThatEndsAtASolidIsHingedThereAsInCalculix) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 4, 3, [](double u, double v) -> Point {
        return {0.2 * u, 0.15 * v, 0};
    });
    deck.addBox("BLOCK", {2, 3, 2}, {-0.05, 0, -0.02}, {0, 0.15, 0.02});
    deck.addShellSection("PLATE", 0.006);
    deck.add("*SOLID SECTION, ELSET=BLOCK, MATERIAL=HEAVY\n");
    const FeModel model = expectCalculixFrequencies(7);
    EXPECT_THAT(model.warnings, ::testing::ElementsAre(HasSubstr("hinge")));
}

TEST_F(ThinDecks, AShellThatReachesIntoASolidHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 5, 3, [](double u, double v) -> Point {
        return {-0.05 + 0.25 * u, 0.15 * v, 0};
    });
    deck.addBox("BLOCK", {2, 3, 2}, {-0.1, 0, -0.02}, {0, 0.15, 0.02});
    deck.addShellSection("PLATE", 0.006);
    deck.add("*SOLID SECTION, ELSET=BLOCK, MATERIAL=HEAVY\n");
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, BeamStiffenedShellHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "PLATE", 6, 4, flat);
    deck.addBeam("B32R", "RIB", 6, {0, 0.1, 0}, {0.3, 0.1, 0});
    deck.addShellSection("PLATE", 0.004);
    deck.add(
        "*BEAM SECTION, ELSET=RIB, MATERIAL=HEAVY, SECTION=RECT, OFFSET1=-.6\n.01,.006\n0,0,1\n");
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, EquationsOfShellNodesHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    const auto right = [](double u, double v) -> Point { return {0.1 + 0.1 * u, 0.15 * v, 0}; };
    deck.addPatch("S8R", "PLATE", 3, 3, [](double u, double v) -> Point {
        return {0.1 * u, 0.15 * v, 0};
    });
    std::vector<int> numbers;
    for (int k = 0; k <= 6; ++k) numbers.push_back(deck.addNode(right(0, k / 6.0)));
    deck.startPiece();
    deck.addPatch("S8R", "PLATE", 3, 3, right);
    deck.addShellSection("PLATE", 0.004);
    deck.add("*EQUATION\n");
    for (int k = 0; k <= 6; ++k)
        for (int a = 1; a <= 3; ++a)
            deck.add("2\n" + std::to_string(deck.addNode(right(0, k / 6.0))) + "," +
                     std::to_string(a) + ",1.," + std::to_string(numbers[size_t(k)]) + "," +
                     std::to_string(a) + ",-1.\n");
    expectCalculixFrequencies(7);  // the seam is a hinge
}

TEST_F(ThinDecks, PlatesWhoseNormalsDifferByTheirDigitsMeetInAKnotOnALine) {
    SIMFLEX_NEEDS_CALCULIX();
    deck.addPatch("S8R", "THIN", 3, 3, [](double u, double v) -> Point {
        return {0.1 * u, 0.15 * v, 0};
    });
    deck.addPatch("S8R", "THICK", 3, 3, [](double u, double v) -> Point {
        return {0.1 + 0.1 * u, 0.15 * v, 2e-6 * u};
    });
    deck.addShellSection("THIN", 0.004);
    deck.addShellSection("THICK", 0.006);
    expectCalculixFrequencies();
}

TEST_F(ThinDecks, FoldedPlatesOfTwoThicknessesHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    // Up to half a degree CalculiX treats the fold as smooth.
    for (const double degrees : {0.02, 0.1, 0.4, 0.7, 5.0}) {
        SCOPED_TRACE(degrees);
        const double angle = degrees * M_PI / 180;
        deck = ThinDeck();
        deck.addPatch("S8R", "THIN", 1, 2, [](double u, double v) -> Point {
            return {-0.02 + 0.02 * u, 0, 0.04 * v};
        });
        deck.addPatch("S8R", "THICK", 1, 2, [&](double u, double v) -> Point {
            return {0.02 * u * std::cos(angle), -0.02 * u * std::sin(angle), 0.04 * v};
        });
        deck.addShellSection("THIN", 0.0005);
        deck.addShellSection("THICK", 0.002);
        expectCalculixFrequencies();
    }
}

TEST_F(ThinDecks, ANodeByItsNumberIsChosenWithItsExpandedNodes) {
    deck.addBeam("B32R", "BEAM", 4, {0, 0, 0}, {0.4, 0, 0});
    deck.addBeamSection("BEAM", "RECT", 0.012, 0.008, "0,1,0");
    const int end = deck.addNode({0.4, 0, 0});
    deck.add("*NSET, NSET=END\n" + std::to_string(end) + "\n");
    const Mesh mesh = read(deck.text()).mesh;
    EXPECT_EQ(selectNodes(mesh, "node:" + std::to_string(end)), mesh.nodeSets.at("END"));
    EXPECT_EQ(mesh.nodeSets.at("END").size(), 9u);
}

TEST_F(ThinDecks, ASecondSectionOfAnElementIsWarnedOf) {
    deck.addPatch("S8R", "PLATE", 6, 4, flat);
    deck.addShellSection("PLATE", 0.004);
    EXPECT_THAT(read(deck.text()).warnings, ::testing::IsEmpty());
    deck.add("*ELSET, ELSET=TWO\n1, 3\n");
    deck.addShellSection("TWO", 0.008);
    EXPECT_THAT(read(deck.text()).warnings,
                ::testing::ElementsAre(AllOf(HasSubstr("element 1 and 1 other a second section"),
                                             HasSubstr("*SHELL SECTION"))));
}

TEST_F(ThinDecks, OppositeNormalsOfNeighboursAreWarnedOfWhereTheSideMatters) {
    for (const double offset : {0.0, 0.5}) {
        deck = ThinDeck();
        deck.addPatch("S8R", "PLATE", 3, 4, flat);
        deck.addPatch("S8R", "TURNED", 3, 4, [](double u, double v) { return flat(2 - u, v); });
        deck.addShellSection("PLATE", 0.004, offset);
        deck.addShellSection("TURNED", 0.004, offset);
        const auto warnings = read(deck.text()).warnings;
        if (offset == 0)
            EXPECT_THAT(warnings, ::testing::IsEmpty());
        else
            EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr("opposite normals")));
    }
}

TEST_F(ThinDecks, QuadrilateralShellsWithACornerTwiceAreTriangles) {
    const auto plateOf = [&](const std::string& type, const std::string& elements) {
        return read("*NODE\n1,0,0,0\n2,1,0,0\n3,1.1,1,0\n4,0,1,0\n*ELEMENT, TYPE=" + type +
                        ", ELSET=PLATE\n" + elements +
                        "*SHELL SECTION, ELSET=PLATE, MATERIAL=M\n0.1\n*MATERIAL, NAME=M\n"
                        "*ELASTIC\n1e9, 0.3\n*DENSITY\n1000\n",
                    false);
    };
    const FeModel triangles = plateOf("S3", "1, 1,2,3\n2, 1,3,4\n");
    for (const char* collapsed : {"1, 1,2,3,3\n2, 1,1,3,4\n", "1, 1,2,2,3\n2, 1,3,4,1\n"}) {
        const FeModel model = plateOf("S4", collapsed);
        EXPECT_EQ(model.K.values, triangles.K.values);
        EXPECT_EQ(model.m.values, triangles.m.values);
    }
}

TEST_F(ThinDecks, NodeSetsHoldTheExpandedNodesToo) {
    deck.addPatch("S8R", "PLATE", 2, 2, flat);
    deck.addShellSection("PLATE", 0.004);
    deck.addNodeSet("EDGE", [](const Point& x) { return x[0] == 0; });
    deck.add("*SURFACE, NAME=TOP\nPLATE, SPOS\n");
    const FeModel model = read(deck.text());
    // 5 nodes, of which 3 corners have bottom, middle and top, 2 middles bottom and top.
    EXPECT_EQ(model.mesh.nodeSets.at("EDGE").size(), 5u + 3 * 3 + 2 * 2);
    std::vector<double> heights;
    for (const int node : model.mesh.nodeSets.at("EDGE"))
        heights.push_back(model.mesh.position(node)[2]);
    EXPECT_NEAR(*std::max_element(heights.begin(), heights.end()), 0.002, 1e-12);
    EXPECT_NEAR(*std::min_element(heights.begin(), heights.end()), -0.002, 1e-12);
    for (const int node : model.mesh.nodeSets.at("TOP"))
        EXPECT_NEAR(model.mesh.position(node)[2], 0.002, 1e-12);
    EXPECT_EQ(model.mesh.nodeSets.at("TOP").size(), 21u);
}

TEST_F(ThinDecks, ReadAgainGiveTheSameBits) {
    deck.addPatch("S8R", "PLATE", 3, 2, flat);
    deck.addBeam("B32R", "RIB", 3, {0, 0.1, 0}, {0.3, 0.1, 0});
    deck.addShellSection("PLATE", 0.004);
    deck.addBeamSection("RIB", "RECT", 0.01, 0.006, "0,0,1");
    const FeModel a = read(deck.text()), b = read(deck.text());
    EXPECT_EQ(a.K.values, b.K.values);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.constraints.coefficients, b.constraints.coefficients);
    EXPECT_EQ(a.constraints.columns, b.constraints.columns);
}

TEST_F(ThinDecks, CardsThatSayTheSameMakeTheSamePart) {
    const auto make = [](const std::string& cards) {
        ThinDeck made;
        made.addPatch("S4", "PLATE", 4, 3, flat);
        made.add(cards);
        return made.text();
    };
    const std::string engineering =
                          "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
                          "1.4e11,1e10,1e10,.3,0,0,5e9,4e9,\n3e9\n*DENSITY\n1600\n",
                      lamina =
                          "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=LAMINA\n"
                          "1.4e11,1e10,.3,5e9,4e9,3e9\n*DENSITY\n1600\n",
                      layers =
                          "*SHELL SECTION, ELSET=PLATE, COMPOSITE\n.001,,PLY,30.\n.002,,METAL\n"
                          ".002,,METAL\n.001,,PLY,30.\n",
                      half =
                          "*SHELL GENERAL SECTION, ELSET=PLATE, COMPOSITE, SYMMETRIC\n"
                          ".001,,PLY,30.\n.002,,METAL\n";
    const FeModel plain = read(make(engineering + layers), false);
    for (const std::string& cards : {lamina + layers, engineering + half}) {
        const FeModel same = read(make(cards), false);
        ASSERT_EQ(same.K.rows, plain.K.rows);
        const double largest = *std::max_element(plain.K.values.begin(), plain.K.values.end());
        for (size_t k = 0; k < plain.K.values.size(); ++k)
            ASSERT_NEAR(same.K.values[k], plain.K.values[k], 1e-14 * largest);
        EXPECT_EQ(same.m.values, plain.m.values);
    }
}

TEST_F(ThinDecks, NonstructuralMassIsThatOfItsAreaOrLength) {
    deck.addPatch("S4", "PLATE", 4, 4, flat);
    deck.addBeam("B31", "RIB", 4, {0, 0.1, 0}, {0.3, 0.1, 0});
    deck.addShellSection("PLATE", 0.004);
    deck.add("*BEAM SECTION, ELSET=RIB, MATERIAL=METAL, SECTION=CIRC\n0.01\n0,0,1\n");
    const double bare = read(deck.text(), false).calcMass();
    EXPECT_NEAR(bare, 2700 * (0.06 * 0.004 + 0.3 * M_PI * 1e-4), 1e-9);
    deck.add(
        "*NONSTRUCTURAL MASS, ELSET=PLATE, UNITS=MASS PER AREA\n5.\n"
        "*NONSTRUCTURAL MASS, ELSET=RIB, UNITS=MASS PER LENGTH\n2.\n");
    EXPECT_NEAR(read(deck.text(), false).calcMass() - bare, 5 * 0.06 + 2 * 0.3, 1e-9);
    deck.add("*NONSTRUCTURAL MASS, ELSET=PLATE, UNITS=TOTAL MASS\n5.\n");
    EXPECT_THAT(errorOf(deck.text(), false), HasSubstr("divide the mass by the area"));
}

struct BadSection {
    const char* name;
    const char* card;
    const char* message;
};

class RefusedSection : public ThinDecks, public ::testing::WithParamInterface<BadSection> {};

TEST_P(RefusedSection, IsNamedWithFileLineAndReason) {
    deck.addPatch("S8R", "PLATE", 1, 1, flat);
    deck.addBeam("B32R", "RIB", 1, {0, 0, 0}, {0.3, 0, 0});
    deck.add(
        "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "1e9,2e9,3e9,.1,.1,.1,1e9,1e9,\n1e9\n*DENSITY\n1000\n");
    const std::string card = GetParam().card;
    if (card.find("PLATE") == std::string::npos) deck.addShellSection("PLATE", 0.004);
    if (card.find("ELSET=RIB") == std::string::npos)
        deck.addBeamSection("RIB", "RECT", .01, .01, "0,0,1");
    deck.add(card);
    EXPECT_THAT(errorOf(deck.text()), AllOf(HasSubstr(GetParam().message),
                                            ::testing::ContainsRegex("deck.inp:[0-9]+: ")));
}

INSTANTIATE_TEST_SUITE_P(
    Cards, RefusedSection,
    ::testing::Values(
        BadSection{"Composite", "*SHELL SECTION,ELSET=PLATE,MATERIAL=METAL,COMPOSITE\n.1,,METAL\n",
                   "take MATERIAL out"},
        BadSection{"NoLayers", "*SHELL SECTION,ELSET=PLATE,COMPOSITE\n", "needs its layers"},
        BadSection{"LayerWithoutMaterial",
                   "*SHELL SECTION,ELSET=PLATE,COMPOSITE\n.1,,METAL\n.1,METAL\n",
                   "a layer needs its thickness, a number of points (or nothing) and its material"},
        BadSection{"LayerOfNoMaterial",
                   "*SHELL SECTION,ELSET=PLATE,COMPOSITE\n.1,,METAL\n.1,,METALL\n",
                   "the deck has no material METALL"},
        BadSection{"LayerOfNoThickness",
                   "*SHELL SECTION,ELSET=PLATE,COMPOSITE\n.1,,METAL\n0,,METAL\n",
                   "a layer has thickness 0"},
        BadSection{"LayersOfBeams", "*BEAM SECTION,ELSET=RIB,COMPOSITE,SECTION=RECT\n.1,.1\n",
                   "*BEAM SECTION with COMPOSITE is not known"},
        BadSection{"SomeLayersWithoutAxes",
                   "*ORIENTATION,NAME=O\n1,0,0,0,1,0\n*SHELL SECTION,ELSET=PLATE,COMPOSITE\n"
                   ".1,,PLY,O\n.1,,PLY\n",
                   "give each layer its own"},
        BadSection{"Axes", "*SHELL SECTION,ELSET=PLATE,MATERIAL=METAL,ORIENTATION=O\n.1\n",
                   "ORIENTATION"},
        BadSection{"NoSuchAxes",
                   "*ORIENTATION,NAME=O\nD\n*SHELL SECTION,ELSET=PLATE,MATERIAL=PLY,ORIENTATION=O\n"
                   ".1\n",
                   "names *DISTRIBUTION D, which the deck does not have"},
        BadSection{"NoAxesOfAnElement",
                   "*DISTRIBUTION,NAME=D\n2,1,0,0,0,1,0\n*ORIENTATION,NAME=O\nD\n"
                   "*SHELL SECTION,ELSET=PLATE,MATERIAL=PLY,ORIENTATION=O\n.1\n",
                   "gives no axes of element 1"},
        BadSection{"AxesOfHalfNumbers", "*DISTRIBUTION,NAME=D\n1,1,0,0\n*ORIENTATION,NAME=O\nD\n",
                   "needs an element or element set and six numbers"},
        BadSection{"NoThickness", "*SHELL SECTION,ELSET=PLATE,MATERIAL=METAL\n", "thickness"},
        BadSection{"ZeroThickness", "*SHELL SECTION,ELSET=PLATE,MATERIAL=METAL\n0.\n", "positive"},
        BadSection{"NoNodalThickness",
                   "*SHELL SECTION,ELSET=PLATE,MATERIAL=METAL,NODAL THICKNESS\n",
                   "*NODAL THICKNESS"},
        BadSection{"SolidSection", "*SOLID SECTION,ELSET=PLATE,MATERIAL=METAL\n", "does not fit"},
        BadSection{"Box", "*BEAM SECTION,ELSET=RIB,MATERIAL=METAL,SECTION=BOX\n.1,.1,.01\n",
                   "four walls of its box"},
        BadSection{"ThickWall", "*BEAM SECTION,ELSET=RIB,MATERIAL=METAL,SECTION=PIPE\n.01,.02\n",
                   "a wall of .02, which its section has no room for"},
        BadSection{"General",
                   "*BEAM GENERAL SECTION,ELSET=RIB,MATERIAL=METAL,SECTION=GENERAL\n.1,.1,.01\n",
                   "section GENERAL has no geometry"},
        BadSection{"OwnMaterialWithoutG",
                   "*BEAM GENERAL SECTION,ELSET=RIB,SECTION=RECT,DENSITY=1.\n.1,.1\n0,0,1\n2e11\n",
                   "*BEAM GENERAL SECTION needs E and G in its third line"},
        BadSection{"SmallG",
                   "*BEAM GENERAL SECTION,ELSET=RIB,SECTION=RECT,DENSITY=1.\n.1,.1\n0,0,1\n"
                   "2e11,2e10\n",
                   "*BEAM GENERAL SECTION has E = 2e+11 and G = 2e+10; E must be positive and G "
                   "more than E/3"},
        BadSection{"OwnMaterialWithoutDensity",
                   "*BEAM GENERAL SECTION,ELSET=RIB,SECTION=RECT\n.1,.1\n0,0,1\n2e11,8e10\n",
                   "*BEAM GENERAL SECTION needs DENSITY="},
        BadSection{"AxisAlongBeam",
                   "*BEAM SECTION,ELSET=RIB,MATERIAL=METAL,SECTION=RECT\n.1,.1\n1,0,0\n", "n1"},
        BadSection{"NoShape", "*BEAM SECTION,ELSET=RIB,MATERIAL=METAL\n.1,.1\n", "SECTION="},
        BadSection{"NormalOfNoElement", "*NORMAL\n99,1,0,0,1\n", "no shell or beam of the deck"},
        BadSection{"NormalOfAnotherNode", "*NORMAL\n2,3,0,0,1\n", "which is none of its nodes"},
        BadSection{"NormalTurnedAround", "*NORMAL\n1,1,0,0,-1\n", "turn it around"},
        BadSection{"NoNormal", "*NORMAL\n1,1,0,0,0\n", "is zero"}),
    [](const auto& section) { return section.param.name; });

}  // namespace
}  // namespace simflex
