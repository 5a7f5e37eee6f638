#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <functional>
#include <iomanip>
#include <sstream>

#include "fe/FreeModes.h"
#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/NodeSelection.h"
#include "simflex/fe/decks/DeckVocabulary.h"
#include "support/GermanLocale.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::Brick;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TestFolder;

class CalculixDeckTest : public ::testing::Test {
protected:
    FeModel read(const std::string& text, CalculixOptions options = {}) {
        testing::writeText(folder / "deck.inp", text);
        return readCalculixDeck(folder / "deck.inp", options);
    }

    /** Returns the error for a deck and checks that no files remain. **/
    std::string errorOf(const std::string& text, CalculixOptions options = {}) {
        std::string message = "accepted";
        try {
            read(text, options);
        } catch (const std::exception& error) {
            message = error.what();
        }
        EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
        return message;
    }

    TestFolder folder;
    Brick brick;
};

class EverySolidElement : public CalculixDeckTest,
                          public ::testing::WithParamInterface<const char*> {};

TEST_P(EverySolidElement, GivesTheMassOfTheBoxAndAFreeStiffness) {
    brick.type = GetParam();
    const FeModel model = read(brick.text());  // validate() has checked K R = 0
    EXPECT_NEAR(model.calcMass(), brick.mass(), 1e-10 * brick.mass());
    EXPECT_EQ(model.K.size, 3 * model.mesh.numNodes());
    EXPECT_EQ(model.m.size, model.mesh.numNodes());
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Bricks, EverySolidElement,
                         ::testing::Values("C3D8", "C3D8I", "C3D8R", "C3D20", "C3D20R"));

TEST_F(CalculixDeckTest, IncompatibleModesOfElementsInAnyOrderAreTheirOwn) {
    // Element numbers do not ascend, so those of the internal nodes do not either.
    read(
        "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1.1,0\n4,0,1,0\n5,0,0,1\n6,1,0.1,1\n7,1.2,1,1\n8,0,1,1.3\n"
        "21,2,0,0\n22,2,1,0\n23,2,0,1\n24,2,1,1\n31,3,0,0.1\n32,3,1.2,0\n33,3,0,1\n34,3,1,1\n"
        "*ELEMENT,TYPE=C3D8I,ELSET=E\n5,1,2,3,4,5,6,7,8\n2,2,21,22,3,6,23,24,7\n"
        "9,21,31,32,22,23,33,34,24\n"
        "*MATERIAL,NAME=M\n*ELASTIC\n1e9,0.3\n*DENSITY\n1000\n"
        "*SOLID "
        "SECTION,ELSET=E,MATERIAL=M\n*NSET,NSET=BASE\n1,4,5,8\n*NSET,NSET=TOP\n31,32,33,34\n");
    const FeModel model = readCalculixDeck(folder / "deck.inp");
    EXPECT_EQ(model.mesh.numInternalNodes, 9);
    EXPECT_THROW(selectNodes(model.mesh, "sphere:0.5,0.5,0.5,0.2"), std::invalid_argument);
    // For any order of the nodes, K and M match those with the elements in another order.
    std::string text = testing::readText(folder / "deck.inp");
    const std::string second = "2,2,21,22,3,6,23,24,7\n";
    text.erase(text.find(second), second.size());
    text.insert(text.find("5,1,2,3,4,5,6,7,8"), second);
    const auto own = testing::calcFreeFrequencies(model, 12),
               other = testing::calcFreeFrequencies(read(text), 12);
    for (size_t i = 6; i < 12; ++i) EXPECT_NEAR(own[i], other[i], 1e-9 * own[i]);
}

TEST_F(CalculixDeckTest, AnyEncodingAndEndOfLineAreRead) {
    const std::string text = "title of no card\n" + brick.text() +
                             "*NSET,NSET=\"Two Nodes\"\n1,2,\n"
                             "*NSET,NSET=AGAIN\n\"two nodes\"\n";
    testing::writeText(folder / "plain.inp", text);
    const Mesh plain = readCalculixMesh(folder / "plain.inp");
    EXPECT_EQ(plain.nodeSets.at("AGAIN"), (std::vector<int>{0, 1}));
    std::string windows, mac, little("\xFF\xFE"), big("\xFE\xFF");
    for (const char c : text) {
        windows += c == '\n' ? "\r\n" : std::string(1, c);
        mac += c == '\n' ? '\r' : c;
        little += {c, '\0'};
        big += {'\0', c};
    }
    for (const std::string& other : {"\xEF\xBB\xBF" + text, windows, mac, little, big}) {
        testing::writeText(folder / "other.inp", other);
        const Mesh mesh = readCalculixMesh(folder / "other.inp");
        EXPECT_EQ(mesh.positions, plain.positions);
        EXPECT_EQ(mesh.nodeSets, plain.nodeSets);
    }
}

TEST_F(CalculixDeckTest, NumbersAreReadInEveryNotationOfFortran) {
    const FeModel model = read(brick.meshText() +
                               "*MATERIAL,NAME=METAL\n*ELASTIC\n7.+10,3.0D-1\n*DENSITY\n.27E4\n"
                               "*SOLID SECTION,ELSET=BODY,MATERIAL=METAL\n*NSET,NSET=E\n2.0E0\n");
    EXPECT_EQ(model.K.values, read(brick.text()).K.values);
    EXPECT_EQ(model.mesh.nodeSets.at("E"), std::vector<int>{1});
    EXPECT_THAT(errorOf("*NODE\n3000000000,0,0,0\n"), HasSubstr("up to 2147483647"));
}

TEST_F(CalculixDeckTest, ElementsOfAbaqusAreTakenAsTheirNearest) {
    brick.type = "C3D20R";
    const std::string text = brick.text();
    std::string other = text;
    other.replace(other.find("C3D20R"), 6, "C3D20RH");
    const FeModel model = read(other);
    EXPECT_THAT(model.warnings, ::testing::Contains(HasSubstr("C3D20RH are taken as C3D20R")));
    EXPECT_EQ(model.K.values, read(text).K.values);
}

TEST_F(CalculixDeckTest, TetrahedraAndWedgesGiveTheirVolume) {
    const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n6,0,1,1\n";
    const std::string material =
        "*MATERIAL,NAME=M\n*ELASTIC\n1e9,0.3\n*DENSITY\n1000\n*SOLID SECTION,ELSET=E,MATERIAL=M\n";
    EXPECT_NEAR(read(nodes + "*ELEMENT,TYPE=C3D4,ELSET=E\n1,1,2,3,4\n" + material).calcMass(),
                1000. / 6, 1e-9);
    EXPECT_NEAR(read(nodes + "*ELEMENT,TYPE=C3D6,ELSET=E\n1,1,2,3,4,5,6\n" + material).calcMass(),
                500., 1e-9);
}

TEST_F(CalculixDeckTest, NodesAndSetsKeepTheirNumbers) {
    const FeModel model = read(brick.meshText(100, 7) + brick.materialText() +
                               "*NSET, NSET=Odd, GENERATE\n101, 105, 2\n"
                               "*nset, nset=both\nODD, One\n103\n");
    EXPECT_EQ(model.mesh.nodeNumbers.front(), 100);
    EXPECT_EQ(model.mesh.nodeSets.at("ODD"), (std::vector<int>{1, 3, 5}));
    EXPECT_EQ(model.mesh.nodeSets.at("BOTH"), (std::vector<int>{0, 1, 3, 5}));
    EXPECT_EQ(model.mesh.nodeSets.at("LEFT").size(), 9u);
    EXPECT_EQ(model.mesh.nodeSets.at("CORNERS").size(), 8u);
    EXPECT_DOUBLE_EQ(model.mesh.positions[0], 0);
}

TEST_F(CalculixDeckTest, MatricesAreTheSameInAnyLocale) {
    const std::string deck = brick.text();
    const FeModel plain = read(deck);
    const test::GermanLocale german(folder.path());
    const FeModel same = read(deck);
    EXPECT_EQ(same.K.values, plain.K.values);
    EXPECT_EQ(same.m.values, plain.m.values);
    EXPECT_EQ(same.mesh.positions, plain.mesh.positions);
}

TEST_F(CalculixDeckTest, IncludedFilesAreFoundBesideTheDeck) {
    testing::writeText(folder / "Mesh of part.inp", brick.meshText());
    const FeModel model = read("*INCLUDE, INPUT=\"Mesh of part.inp\"\n" + brick.materialText());
    EXPECT_NEAR(model.calcMass(), brick.mass(), 1e-10);
}

TEST_F(CalculixDeckTest, StepsAndSupportsAreLeftOutAndReported) {
    const FeModel plain = read(brick.text());
    std::vector<std::string> notes;
    CalculixOptions options;
    options.note = [&](const std::string& note) { notes.push_back(note); };
    const FeModel loaded =
        read(brick.text() +
                 "*NODE\n5000,0,0,0\n5001,0,0,0\n*BOUNDARY\n5000,1,3\n"
                 "*INITIAL CONDITIONS, TYPE=VELOCITY\nALL,1,2.\n"
                 "*STEP\n*STATIC\n*CLOAD\n5,1,1.\n*EQUATION\n1\n3,1,1.\n*END STEP\n",
             options);
    EXPECT_EQ(loaded.K.values, plain.K.values);
    EXPECT_EQ(loaded.m.values, plain.m.values);
    EXPECT_EQ(loaded.notes, notes);
    std::string all;
    for (const std::string& note : notes) all += note + "\n";
    EXPECT_THAT(all, AllOf(HasSubstr("*STEP"), HasSubstr("*BOUNDARY"), HasSubstr("TYPE=VELOCITY"),
                           HasSubstr("*CLOAD"), HasSubstr("2 nodes of no solid element")));
}

TEST_F(CalculixDeckTest, DampingAndYieldingThatAreLeftOutAreWarnedOf) {
    std::vector<std::string> warnings;
    CalculixOptions options;
    options.warn = [&](const std::string& warning) { warnings.push_back(warning); };
    brick.type = "C3D8I";
    std::string text = brick.text();
    const size_t place = text.find("*DENSITY");
    ASSERT_NE(place, std::string::npos);
    text.insert(place, "*EXPANSION\n1e-5\n*DAMPING, ALPHA=3.\n*PLASTIC\n2e8,0.\n3e8,0.1\n");
    const FeModel model = read(text, options);
    EXPECT_THAT(warnings, ::testing::UnorderedElementsAre(
                              AllOf(HasSubstr("left out *DAMPING"), HasSubstr("no damping")),
                              AllOf(HasSubstr("left out *PLASTIC"), HasSubstr("elastic"))));
    EXPECT_EQ(model.warnings, warnings);
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("left out *EXPANSION")));
    EXPECT_EQ(model.K.values, read(brick.text()).K.values);
}

TEST_F(CalculixDeckTest, HourglassControlThatIsLeftOutIsWarnedOf) {
    const FeModel model =
        read(brick.text() + "*SECTION CONTROLS, NAME=C, HOURGLASS=ENHANCED\n1.\n");
    EXPECT_THAT(model.warnings, ::testing::Contains(HasSubstr("CalculiX's own hourglass")));
}

TEST_F(CalculixDeckTest, SurfaceElementsOfAMesherAreDropped) {
    const FeModel model =
        read(brick.text() +
             "*ELEMENT, TYPE=CPS4, ELSET=SKIN\n9001,1,2,11,10\n"
             "*ELEMENT, TYPE=T3D2, ELSET=EDGE\n9002,1,2\n*NSET, NSET=SEAT\n1,2,11,10\n"
             "*NSET, NSET=TWIN, ELSET=SKIN\n");
    EXPECT_EQ(model.mesh.elements.size(), 1u);
    EXPECT_EQ(model.mesh.elements[0].numElements(), 32);
    EXPECT_EQ(model.mesh.nodeSets.at("SEAT").size(), 4u);
    // Sets of other elements define node sets, as Gmsh writes physical groups.
    EXPECT_EQ(model.mesh.nodeSets.at("SKIN"), model.mesh.nodeSets.at("SEAT"));
    EXPECT_EQ(model.mesh.nodeSets.at("TWIN"), model.mesh.nodeSets.at("SEAT"));
    EXPECT_EQ(model.mesh.nodeSets.at("EDGE").size(), 2u);
    EXPECT_EQ(model.mesh.nodeSets.count("BODY"), 0u);
}

TEST_F(CalculixDeckTest, LongNumbersKeepTheirExponent) {
    // ccx reads 20 characters of a number, so it would read 70 and 27.
    const std::string longNumbers =
        "*MATERIAL, NAME=METAL\n*ELASTIC\n7.00000000000000000000E+10,0.3\n*DENSITY\n"
        "27.00000000000000000000E+02\n*SOLID SECTION, ELSET=BODY, MATERIAL=METAL\n";
    const FeModel plain = read(brick.text()), model = read(brick.meshText() + longNumbers);
    EXPECT_EQ(model.K.values, plain.K.values);
    EXPECT_EQ(model.m.values, plain.m.values);
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("20 characters")));
}

TEST_F(CalculixDeckTest, NodePositionsKeepTheirExponent) {
    // Gmsh writes 17 digits: 1.2345678901234567e-05 has 22 characters.
    std::string text = brick.text();
    text.replace(text.find("1,0,"), 4, "1,1.2345678901234567e-05,");
    EXPECT_NEAR(read(text).mesh.positions[0], 1.2345678901234567e-05, 1e-18);
}

TEST_F(CalculixDeckTest, SameDeckGivesTheSameBits) {
    const FeModel a = read(brick.text()), b = read(brick.text());
    EXPECT_EQ(a.K.values, b.K.values);
    EXPECT_EQ(a.K.rows, b.K.rows);
    EXPECT_EQ(a.m.values, b.m.values);
}

struct BadCard {
    const char* name;
    const char* text;
    const char* message;
};

class RefusedCard : public CalculixDeckTest, public ::testing::WithParamInterface<BadCard> {};

TEST_P(RefusedCard, IsNamedWithFileLineAndReason) {
    const std::string text = brick.text();
    const long line = std::count(text.begin(), text.end(), '\n') + 1;
    const std::string card = GetParam().text, error = errorOf(text + card);
    std::string lines = std::to_string(line);
    for (long k = 1; k < std::max(2L, long(std::count(card.begin(), card.end(), '\n'))); ++k)
        lines += "|" + std::to_string(line + k);
    EXPECT_THAT(error,
                AllOf(HasSubstr(GetParam().message), ContainsRegex("deck.inp:(" + lines + "):")));
}

INSTANTIATE_TEST_SUITE_P(
    Cards, RefusedCard,
    ::testing::Values(
        BadCard{"Mpc", "*MPC\nPLANE,1,2,3,4\n", "*MPC"},
        BadCard{"Tie", "*TIE, NAME=T\nA,B\n", "surface A"},
        BadCard{"TieOfCycles", "*TIE, NAME=T, CYCLIC SYMMETRY\nA,B\n", "CYCLICSYMMETRY"},
        BadCard{"Transform", "*TRANSFORM,NSET=ALL\n1,0,0,2,0,0\n", "on one line"},
        BadCard{"Shell", "*SHELL SECTION,ELSET=BODY,MATERIAL=METAL\n0.01\n", "does not fit"},
        BadCard{"Membrane", "*MEMBRANE SECTION,ELSET=BODY,MATERIAL=METAL\n0.01\n",
                "does not fit element 1"},
        BadCard{"Spring", "*SPRING,ELSET=S\n1\n1e6\n", "*SPRING"},
        BadCard{"Mass", "*MASS,ELSET=S\n1\n", "element set S"},
        BadCard{"Contact", "*CONTACT PAIR,INTERACTION=I\nA,B\n", "contact"},
        BadCard{"ContactOfAll", "*CONTACT\n", "*TIE"},
        BadCard{"Unknown", "*FLUX CAPACITOR\n", "not known to simflex"},
        BadCard{"Misspelt", "*SOLID SECTON,ELSET=BODY\n", "did you mean *SOLID SECTION?"},
        BadCard{"Axisymmetric", "*ELEMENT,TYPE=CAX4\n9001,1,2,11,10\n", "axisymmetric"},
        BadCard{"Plane", "*ELEMENT,TYPE=CPE4H\n9001,1,2,11,10\n", "plane elements"},
        BadCard{"SpringElement", "*ELEMENT,TYPE=SPRINGA\n9001,1,2\n", "has no *SPRING"},
        BadCard{"SpringNonlinear", "*SPRING,ELSET=S,NONLINEAR\n1.,1.\n", "*SPRING"},
        BadCard{"MisspeltElement", "*ELEMENT,TYPE=C3D20T\n9001,1,2\n", "did you mean C3D10T?"},
        BadCard{"ContactWithoutIt", "*CLEARANCE,MASTER=A,SLAVE=B\n", "--without-contact"},
        BadCard{"SpringAcross",
                "*ELEMENT,TYPE=SPRING2,ELSET=S\n9001,1,9\n*SPRING,ELSET=S\n2,2\n1e6\n",
                "resists a rotation of the whole part"},
        BadCard{"SpringOfTwoAxes",
                "*ELEMENT,TYPE=SPRING2,ELSET=S\n9001,1,9\n*SPRING,ELSET=S\n1,2\n1e6\n",
                "holds the part to the ground"},
        BadCard{"InertiaOfASolid",
                "*ELEMENT,TYPE=ROTARYI,ELSET=S\n9001,1\n*ROTARY INERTIA,ELSET=S\n1,1,1\n",
                "has no rotation"},
        BadCard{"GeneratorSteps", "*NGEN\n1,9,3\n", "a whole number of steps"},
        BadCard{"GeneratorNode", "*NGEN\n1,9001\n", "names node 9001"},
        BadCard{"GeneratorCurve", "*NGEN,LINE=C\n1,9\n", "along a curve"},
        BadCard{"FillSizes", "*NFILL\nLEFT,TWO,2,100\n", "sets of 9 and 2 nodes"},
        BadCard{"CopyOfNothing", "*ELCOPY,OLD SET=GONE,ELEMENT SHIFT=1,SHIFT NODES=1\n", "GONE"},
        BadCard{"CopyReflected", "*NCOPY,OLD SET=ALL,CHANGE NUMBER=1000,REFLECT=LINE\n",
                "REFLECT is not known"},
        BadCard{"GenerationOfMass", "*ELGEN\n77777,2\n", "copies element 77777"},
        BadCard{"Mapping", "*NMAP\n1,2\n", "make nodes"},
        BadCard{"AxesOfOthers", "*ORIENTATION,NAME=O,DEFINITION=NODES\n1,2,3\n", "COORDINATES"},
        BadCard{"ReducedBeamElement", "*ELEMENT,TYPE=B31R\n9001,1,2\n", "inertia"},
        BadCard{"ShellWithoutSection", "*ELEMENT,TYPE=S4R\n9001,1,2,11,10\n", "no section"},
        BadCard{"ShortElement", "*ELEMENT,TYPE=C3D8\n9001,1,2,11\n", "has 3 nodes"},
        BadCard{"TwiceElement", "*ELEMENT,TYPE=C3D8\n1,1,2,11,10,28,29,38,37\n", "twice"},
        BadCard{"UnknownNode", "*ELEMENT,TYPE=C3D4\n9001,1,2,11,77777\n", "77777"},
        BadCard{"UnknownSet", "*NSET,NSET=X\nNOWHERE\n", "NOWHERE"},
        BadCard{"NotANumber", "*NODE\n9001,1.0,abc,0\n", "'ABC' is not a finite number"},
        BadCard{"NodeTwice", "*NODE\n5,0.1,0.2,0.3\n",
                "node 5 is given twice, at (0.1, -0.015, -0.01) and at (0.1, 0.2, 0.3)"},
        BadCard{"CommaForPoint", "*NODE\n9001,0,1,0,25,3\n", "behind its three coordinates"},
        BadCard{"UnknownParameter", "*NSET,NSET=X,INSTANCE=I\n1\n", "*NSET with INSTANCE"},
        BadCard{"DistributionOverNodes", "*DISTRIBUTION,NAME=D,LOCATION=NODE\n",
                "LOCATION=NODE is not known"},
        BadCard{"InitialStress", "*INITIAL CONDITIONS,TYPE=STRESS\n1,1,0\n", "stiffer or softer"},
        BadCard{"ModelChange", "*STEP\n*MODEL CHANGE,TYPE=ELEMENT,REMOVE\n1\n*END STEP\n",
                "cannot be left out"},
        BadCard{"PropertyTwice", "*MATERIAL,NAME=METAL\n*DENSITY\n1.\n", "given twice"},
        BadCard{"SectionOfNothing", "*SOLID SECTION,ELSET=GONE,MATERIAL=METAL\n", "GONE"}),
    [](const auto& card) { return card.param.name; });

TEST_F(CalculixDeckTest, AMaterialThatIsNotThereIsNamedWithItsSection) {
    std::string text = brick.text();
    const auto line = std::count(text.begin(), text.end(), '\n');
    text.replace(text.find("MATERIAL=METAL"), 14, "MATERIAL=WOOD");
    EXPECT_EQ(errorOf(text),
              folder / "deck.inp:" + std::to_string(line) + ": the deck has no material WOOD");
}

// CalculiX only checks the integration points. C3D8R has one, where swapped nodes may not show.
class SwappedNodes : public CalculixDeckTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(SwappedNodes, AreAnErrorThatNamesTheElement) {
    testing::DistortedCube cube(GetParam());
    std::swap(cube.elements[0][0], cube.elements[0][1]);
    EXPECT_THAT(errorOf(cube.text()),
                AllOf(HasSubstr("deck.inp: element 1, a " + std::string(GetParam()) +
                                ", is turned inside out at node"),
                      HasSubstr("are its nodes in CalculiX's order?")));
}

INSTANTIATE_TEST_SUITE_P(Types, SwappedNodes,
                         ::testing::Values("C3D4", "C3D6", "C3D8", "C3D8R", "C3D10", "C3D15",
                                           "C3D20", "C3D20R"));

class SwappedMiddles : public CalculixDeckTest,
                       public ::testing::WithParamInterface<const char*> {};

TEST_P(SwappedMiddles, AreAnErrorThatNamesTheElement) {
    testing::DistortedCube cube(GetParam());
    EXPECT_EQ(errorOf(cube.text()), "accepted");
    auto& nodes = cube.elements[0];
    std::swap(nodes[nodes.size() - 1], nodes[nodes.size() - 2]);
    EXPECT_THAT(errorOf(cube.text()), AllOf(HasSubstr("deck.inp: element 1, a "),
                                            HasSubstr("edge lengths off the middle of the edge")));
}

INSTANTIATE_TEST_SUITE_P(Types, SwappedMiddles,
                         ::testing::Values("C3D10", "C3D15", "C3D20", "C3D20R"));

TEST_F(CalculixDeckTest, AnElementTurnedInsideOutIsAnError) {
    EXPECT_THAT(
        errorOf(brick.text() + "*ELEMENT,TYPE=C3D8,ELSET=BODY\n9001,28,29,38,37,1,2,11,10\n"),
        HasSubstr("element 9001, a C3D8, is turned inside out at node 28 (scaled Jacobian -1"));
}

TEST_F(CalculixDeckTest, AMaterialWithoutDensityIsAnErrorAlsoBesideOneThatHasIt) {
    const std::string text = brick.text() +
                             "*ELSET, ELSET=TIP\n1,2\n*MATERIAL, NAME=WOOD\n*ELASTIC\n1e9,0.3\n" +
                             "*SOLID SECTION, ELSET=TIP, MATERIAL=WOOD\n";
    const auto line = std::count(text.begin(), text.end(), '\n') - 3;
    EXPECT_EQ(errorOf(text), folder / "deck.inp:" + std::to_string(line) +
                                 ": material WOOD has no *DENSITY, so that its elements have no "
                                 "mass");
}

TEST_F(CalculixDeckTest, AMaterialWithoutElasticityIsAnError) {
    std::string text = brick.text();
    text.erase(text.find("*ELASTIC"), text.find("*DENSITY") - text.find("*ELASTIC"));
    EXPECT_THAT(errorOf(text), HasSubstr(": material METAL has no *ELASTIC, so that its elements "
                                         "have no stiffness"));
}

TEST_F(CalculixDeckTest, AMaterialThatNoElementUsesNeedsNothing) {
    const FeModel plain = read(brick.text());
    EXPECT_EQ(read(brick.text() + "*MATERIAL, NAME=AIR\n*DENSITY\n1.2\n").K.values, plain.K.values);
}

TEST_F(CalculixDeckTest, AnElementWithoutSectionIsAnError) {
    EXPECT_EQ(errorOf(brick.text() + "*ELEMENT,TYPE=C3D8\n9001,1,2,11,10,28,29,38,37\n"),
              folder /
                  "deck.inp: element 9001 has no material; give every element one by a *SOLID "
                  "SECTION of its element set");
}

TEST_F(CalculixDeckTest, ConstantsWithoutTheirCommaAreRefused) {
    for (const char* constants : {"70e9", "70e9,", "70e9 0.3", "70e9.0.3", "70e9,0.3,20,5"}) {
        std::string text = brick.text();
        text.replace(text.find("7e+10,0.3"), 9, constants);
        EXPECT_THAT(
            errorOf(text),
            AllOf(
                HasSubstr("deck.inp:"),
                ::testing::AnyOf(
                    HasSubstr(
                        "*ELASTIC needs Young's modulus and Poisson's ratio, with a comma between"),
                    HasSubstr("' is not a finite number"), HasSubstr("is a comma too many?"))))
            << constants;
    }
    std::string text = brick.text();
    text.replace(text.find("7e+10,0.3"), 9, "7e+10,0");
    EXPECT_EQ(errorOf(text), "accepted");
}

std::string twoTemperatures(const Brick& brick) {
    std::string text = brick.text();
    text.replace(text.find("7e+10,0.3"), 9, "80e9,0.3,0\n60e9,0.3,100");
    return text.replace(text.find("*DENSITY\n2700"), 13, "*DENSITY\n2700,0\n2500,100\n2000,200");
}

TEST_F(CalculixDeckTest, AMaterialIsTakenAtTheTemperatureOfItsNodes) {
    const std::string table = twoTemperatures(brick);
    const auto at = [&](const char* value) {
        return read(table + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, " + value + "\n");
    };
    brick.rho = 2600;
    const FeModel plain = read(brick.text()), model = at("50.");
    EXPECT_EQ(model.K.values, plain.K.values);
    EXPECT_EQ(model.m.values, plain.m.values);
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("METAL is taken at temperature 50")));
    EXPECT_NEAR(at("150.").calcMass(), brick.mass() * 2250 / 2600, 1e-9);
    EXPECT_NEAR(at("-273.").calcMass(), brick.mass() * 2700 / 2600, 1e-9);
    EXPECT_NEAR(at("1e4").calcMass(), brick.mass() * 2000 / 2600, 1e-9);
}

TEST_F(CalculixDeckTest, AMaterialWithoutOneTemperatureIsRefused) {
    const std::string table = twoTemperatures(brick);
    EXPECT_THAT(errorOf(table), HasSubstr("material METAL depends on temperature, but node 1 of "
                                          "element 1 has none"));
    EXPECT_THAT(errorOf(table + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50\n3, 60\n"),
                HasSubstr("its elements have several: 50 at node"));
    EXPECT_THAT(errorOf(table + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50\n"
                                "*STEP\n*STATIC\n*TEMPERATURE\nALL, 90\n*END STEP\n"),
                HasSubstr("*TEMPERATURE of a step, but material METAL depends on temperature"));
    EXPECT_EQ(errorOf(brick.text() + "*STEP\n*STATIC\n*TEMPERATURE\nALL, 90\n*END STEP\n"),
              "accepted");
}

/** Keywords of CalculiX 2.20, from chapter 7 of its manual and from the `ccx` source. **/
constexpr const char* kKeywords =
    "AMPLITUDE BASEMOTION BEAMGENERALSECTION BEAMSECTION BOUNDARY BOUNDARYF BUCKLE CFD CFLUX "
    "CHANGEFRICTION CHANGEMATERIAL CHANGEPLASTIC CHANGESOLIDSECTION CHANGESURFACEBEHAVIOR "
    "CLEARANCE CLOAD COMPLEXFREQUENCY CONDUCTIVITY CONSTRAINT CONTACTDAMPING CONTACTFILE "
    "CONTACTOUTPUT CONTACTPAIR CONTACTPRINT CONTROLS CORRELATIONLENGTH "
    "COUPLEDTEMPERATURE-DISPLACEMENT COUPLING CRACKPROPAGATION CREEP CYCLICHARDENING "
    "CYCLICSYMMETRYMODEL DAMPING DASHPOT DEFORMATIONPLASTICITY DENSITY DEPVAR DESIGNRESPONSE "
    "DESIGNVARIABLES DFLUX DISTRIBUTING DISTRIBUTINGCOUPLING DISTRIBUTION DLOAD DSLOAD DYNAMIC "
    "ELASTIC ELECTRICALCONDUCTIVITY ELECTROMAGNETICS ELEMENT ELEMENTOUTPUT ELFILE ELPRINT ELSET "
    "ENDSTEP EQUATION EXPANSION FEASIBLEDIRECTION FILM FILTER FLUIDCONSTANTS FLUIDSECTION "
    "FREQUENCY FRICTION GAP GAPCONDUCTANCE GAPHEATGENERATION GEOMETRICCONSTRAINT "
    "GEOMETRICTOLERANCE GREEN HCF HEADING HEATTRANSFER HYPERELASTIC HYPERFOAM INCLUDE "
    "INITIALCONDITIONS INITIALSTRAININCREASE KINEMATIC MAGNETICPERMEABILITY MASS MASSFLOW MATERIAL "
    "MATRIXASSEMBLE MEMBRANESECTION MODALDAMPING MODALDYNAMIC MODELCHANGE MOHRCOULOMB "
    "MOHRCOULOMBHARDENING MPC NETWORKMPC NOANALYSIS NODALTHICKNESS NODE NODEFILE NODEOUTPUT "
    "NODEPRINT NORMAL NSET OBJECTIVE ORIENTATION OUTPUT PHYSICALCONSTANTS PLASTIC "
    "PRE-TENSIONSECTION RADIATE RANDOMFIELD REFINEMESH RESTART RETAINEDNODALDOFS RIGIDBODY "
    "ROBUSTDESIGN SECTIONPRINT SELECTCYCLICSYMMETRYMODES SENSITIVITY SHELLSECTION SOLIDSECTION "
    "SPECIFICGASCONSTANT SPECIFICHEAT SPRING STATIC STEADYSTATEDYNAMICS STEP SUBMODEL "
    "SUBSTRUCTUREGENERATE SUBSTRUCTUREMATRIXOUTPUT SURFACE SURFACEBEHAVIOR SURFACEINTERACTION "
    "TEMPERATURE TIE TIMEPOINTS TRANSFORM TRANSFORMF UNCOUPLEDTEMPERATURE-DISPLACEMENT USERELEMENT "
    "USERMATERIAL USERSECTION VALUESATINFINITY VIEWFACTOR VISCO";

TEST_F(CalculixDeckTest, ContactIsLeftOutWhereThatIsAskedFor) {
    const std::string contact =
        "*SURFACE,NAME=A\n1,S1\n*SURFACE,NAME=B\n2,S2\n*CONTACT PAIR,INTERACTION=I\nA,B\n"
        "*SURFACE INTERACTION,NAME=I\n*ELEMENT,TYPE=GAPUNI,ELSET=G\n9001,1,9\n*GAP,ELSET=G\n0.\n";
    CalculixOptions options;
    options.leavesContactOut = true;
    const FeModel model = read(brick.text() + contact, options);
    EXPECT_EQ(model.K.values, read(brick.text()).K.values);
    EXPECT_THAT(model.warnings, ::testing::Contains(AllOf(HasSubstr("left out *CONTACT PAIR"),
                                                          HasSubstr("penetrate each other"))));
    EXPECT_THAT(model.warnings, ::testing::Contains(HasSubstr("left out *GAP")));
    EXPECT_THAT(errorOf(brick.text() + contact), HasSubstr("--without-contact"));
}

TEST_F(CalculixDeckTest, SpringsToTheGroundAndSectionsOfNoSolidsAreLeftOut) {
    const FeModel plain = read(brick.text());
    const FeModel model = read(brick.text() +
                               "*NODE\n9001,0,0,-1\n9002,0,0,-2\n"
                               "*ELEMENT,TYPE=SPRINGA,ELSET=S\n9001,1,9001\n9002,9001,9002\n"
                               "*SPRING,ELSET=S\n\n1.e6\n*BOUNDARY\n9002,1,3\n"
                               "*ELEMENT,TYPE=SPRING1,ELSET=T\n9003,1\n*SPRING,ELSET=T\n3\n1.e6\n"
                               "*ELEMENT,TYPE=DCOUP3D,ELSET=D\n9004,9001\n"
                               "*DISTRIBUTING COUPLING,ELSET=D\nRIGHT,1.\n"
                               "*SOLID SECTION,ELSET=D,MATERIAL=METAL\n");
    EXPECT_EQ(model.K.values, plain.K.values);
    EXPECT_EQ(model.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    for (const char* text : {"spring from node 9001 to 9002: node 9002 belongs to nothing else",
                             "spring from node 1 to 9001", "left out *SPRING of SPRING1"})
        EXPECT_THAT(model.warnings, ::testing::Contains(HasSubstr(text)));
}

TEST_F(CalculixDeckTest, AnInertiaOfAPointIsThatOfMassesWhichHaveIt) {
    const std::string place = "0.3,0.01,0.02",
                      head = "*NODE\n9001," + place + "\n9002," + place + "\n",
                      body = "*RIGID BODY,NSET=RIGHT,REF NODE=9001,ROT NODE=9002\n";
    const double mass = 0.24, J[3] = {1e-3, 2e-3, 1.5e-3};  // about x, y, z
    const std::string own = head + body +
                            "*ELEMENT,TYPE=MASS,ELSET=M\n9001,9001\n*MASS,ELSET=M\n0.24\n"
                            "*ORIENTATION,NAME=O,SYSTEM=RECTANGULAR\n0,1,0,0,0,1\n"
                            "*ELEMENT,TYPE=ROTARYI,ELSET=R\n9002,9001\n"
                            "*ROTARY INERTIA,ELSET=R,ORIENTATION=O\n2e-3,1.5e-3,1e-3\n";
    std::ostringstream masses, elements;
    masses.precision(17);
    for (int k = 0; k < 6; ++k) {
        const int axis = k / 2, number = 9011 + k;
        double x[3] = {0.3, 0.01, 0.02};
        x[axis] +=
            (k % 2 ? 1 : -1) * std::sqrt((J[0] + J[1] + J[2] - 2 * J[axis]) / (4 * mass / 6));
        masses << number << "," << x[0] << "," << x[1] << "," << x[2] << "\n";
        elements << number << "," << number << "\n";
    }
    const std::string other = head + masses.str() + "*NSET,NSET=RIGHT,GENERATE\n9011,9016\n" +
                              body + "*ELEMENT,TYPE=MASS,ELSET=M\n" + elements.str() +
                              "*MASS,ELSET=M\n0.04\n";
    const auto one = testing::calcFreeFrequencies(read(brick.text() + own), 16),
               two = testing::calcFreeFrequencies(read(brick.text() + other), 16);
    for (size_t k = 6; k < one.size(); ++k) EXPECT_NEAR(one[k], two[k], 1e-8 * two[k]) << k;
    EXPECT_THAT(errorOf(brick.text() + head + body +
                        "*ELEMENT,TYPE=ROTARYI,ELSET=R\n9002,9001\n"
                        "*ROTARY INERTIA,ELSET=R\n1.,1.,3.\n"),
                HasSubstr("*ROTARY INERTIA has principal moments 1, 1, 3, which no body has"));
}

TEST_F(CalculixDeckTest, ElementsHaveTheAxesOfTheirDistribution) {
    SIMFLEX_NEEDS_CALCULIX();
    const std::string ply =
        "*MATERIAL, NAME=PLY\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "140e9,10e9,9e9,.3,.25,.4,5e9,4e9,\n3e9\n*DENSITY\n1600\n";
    brick.type = "C3D20R";
    const std::string mesh = brick.meshText() + ply;
    const std::string distributed =
        mesh +
        "*ELSET, ELSET=HALF, GENERATE\n1,4\n*DISTRIBUTION, NAME=D, LOCATION=ELEMENT\n"
        ", 1., 0., 0., 0., 1., 0.\nHALF, 1., 1., 0., -1., 1., .5\n"
        "6, 0., 1., 0., -1., 0., 0.\n"
        "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\nD\n3, 20.\n"
        "*SOLID SECTION, ELSET=BODY, MATERIAL=PLY, ORIENTATION=O\n";
    const FeModel model = read(distributed);
    const FeModel divided =
        read(mesh +
             "*ELSET, ELSET=HALF, GENERATE\n1,4\n*ELSET, ELSET=SIX\n6\n"
             "*ORIENTATION, NAME=A\n1,0,0,0,1,0\n3,20.\n*ORIENTATION, NAME=B\n1,1,0,-1,1,.5\n"
             "3,20.\n*ORIENTATION, NAME=C\n0,1,0,-1,0,0\n3,20.\n"
             "*SOLID SECTION, ELSET=BODY, MATERIAL=PLY, ORIENTATION=A\n"
             "*SOLID SECTION, ELSET=HALF, MATERIAL=PLY, ORIENTATION=B\n"
             "*SOLID SECTION, ELSET=SIX, MATERIAL=PLY, ORIENTATION=C\n");
    EXPECT_EQ(model.K.values, divided.K.values);

    // CalculiX 2.20 rotates only the first line by the angle.
    std::string straight = distributed;
    straight.erase(straight.find("3, 20.\n"), 7);
    const auto own = testing::calcFreeFrequencies(read(straight), 12);
    const auto calculix = testing::calcCalculixFrequencies(folder, folder / "deck.inp", {}, 12);
    for (size_t k = 6; k < 12; ++k) EXPECT_NEAR(own[k], calculix[k], 1e-5 * calculix[k]);
}

TEST_F(CalculixDeckTest, ParametersStandForTheirValues) {
    const FeModel plain = read(brick.text());
    std::string text = brick.text();
    const auto replace = [&](const std::string& what, const std::string& with) {
        const size_t at = text.find(what);
        ASSERT_NE(at, std::string::npos) << what;
        text.replace(at, what.size(), with);
    };
    replace("*ELASTIC\n", "*ELASTIC\n<modulus>, <Nu>\n*CUT\n");
    const size_t cut = text.find("*CUT\n"), end = text.find('\n', cut + 5);
    std::istringstream numbers(text.substr(cut + 5, end - cut - 5));
    std::string E, nu;
    std::getline(numbers, E, ',');
    std::getline(numbers, nu);
    text.erase(cut, end + 1 - cut);
    replace("MATERIAL=METAL", "MATERIAL=<name>");
    text = "*PARAMETER\n# of the metal\nhalf = " + nu + "/2.\nNu = 2*(half + 0*max(3, 4, 7/2.))\n" +
           "modulus = -(-" + E + ")*2**3/8. # Pa\nname = 'METAL'\nx_1 = sqrt(abs(-4.)) - 8/4\n" +
           text;
    EXPECT_EQ(read(text).K.values, plain.K.values);
}

TEST_F(CalculixDeckTest, NodesThatAreHeldByTheirEquationsAloneAreLeftOut) {
    const FeModel plain = read(brick.text());
    // One node follows the brick along x; another connects three of its nodes along z.
    const FeModel loose = read(brick.text() +
                               "*NODE\n9001,0.,0.,0.\n*EQUATION\n"
                               "3\n9001,1,1.,1,1,-.5,2,1,-.5\n");
    EXPECT_EQ(loose.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    EXPECT_TRUE(loose.constraints.empty());
    const FeModel joined = read(brick.text() +
                                "*NODE\n9002,0.,0.,0.\n*EQUATION\n3\n9002,3,1.,1,3,-.5,3,3,-.5\n"
                                "2\n9002,3,2.,2,3,-2.\n"),
                  direct = read(brick.text() + "*EQUATION\n3\n1,3,1.,3,3,1.,2,3,-2.\n");
    EXPECT_EQ(joined.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    EXPECT_EQ(joined.constraints.numCoordinates, direct.constraints.numCoordinates);
}

TEST_F(CalculixDeckTest, OfMoreNodesThanATypeHasTheFirstAreTaken) {
    std::string warnings;
    CalculixOptions options;
    options.warn = [&](const std::string& text) { warnings += text; };
    std::string text = brick.text();
    const size_t first = text.find("*ELEMENT"), begin = text.find('\n', first) + 1;
    for (size_t at = begin; at < text.size() && text[at] != '*';) {
        const size_t end = text.find('\n', at);
        text.insert(end, ", 1, 2");
        at = text.find('\n', end) + 1;
    }
    EXPECT_EQ(read(text, options).K.values, read(brick.text()).K.values);
    EXPECT_THAT(warnings, HasSubstr("as in CalculiX the first 8 are taken"));
}

/** Contributions of cards to K and m of the brick. **/
struct AddedMatrices {
    FeModel with, without;

    double energyOf(
        const std::function<std::array<double, 3>(const std::array<double, 3>&)>& u) const {
        double energy = 0;
        for (const FeModel* model : {&with, &without}) {
            std::vector<double> x;
            for (int node = 0; node < model->mesh.numNodes(); ++node)
                for (const double value : u(model->mesh.position(node))) x.push_back(value);
            const SymmetricMatrix& K = model->K;
            double sum = 0;
            for (int column = 0; column < K.size; ++column)
                for (auto k = K.columnStarts[size_t(column)];
                     k < K.columnStarts[size_t(column) + 1]; ++k)
                    sum += (K.rows[size_t(k)] == column ? 0.5 : 1.0) * K.values[size_t(k)] *
                           x[size_t(column)] * x[size_t(K.rows[size_t(k)])];
            energy += model == &with ? sum : -sum;
        }
        return energy;
    }
};

class EveryMembrane : public CalculixDeckTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(EveryMembrane, HasTheEnergyOfPlaneStressAndItsMass) {
    const std::string type = GetParam();
    // A face of the brick at z = 0 of 0.02 × 0.01, with new nodes that are not tied to any others.
    constexpr double E = 70e9, nu = 0.3, t = 0.002, rho = 2700, a = 0.02, b = 0.01;
    const double x[8][2] = {{0, 0},     {a, 0},     {a, b},     {0, b},
                            {a / 2, 0}, {a, b / 2}, {a / 2, b}, {0, b / 2}};
    const bool isTriangle = type[3] == '3' || type[3] == '6';
    std::ostringstream cards;
    cards << "*NODE\n";
    for (int k = 0; k < 9; ++k)
        cards << 9001 + k << "," << (k < 8 ? x[k][0] : a / 2) << "," << (k < 8 ? x[k][1] : b / 2)
              << ",0.\n";
    cards << "*ELEMENT, TYPE=" << type << ", ELSET=SKIN\n";
    if (type == "M3D3") cards << "901,9001,9002,9003\n902,9001,9003,9004\n";
    if (type == "M3D6")
        cards << "901,9001,9002,9003,9005,9006,9009\n902,9001,9003,9004,9009,9007,9008\n";
    if (!isTriangle && type[3] == '4') cards << "901,9001,9002,9003,9004\n";
    if (!isTriangle && type[3] == '8') cards << "901,9001,9002,9003,9004,9005,9006,9007,9008\n";
    cards << "*MATERIAL, NAME=FOIL\n*ELASTIC\n70e9,.3\n*DENSITY\n2700.\n"
             "*MEMBRANE SECTION, ELSET=SKIN, MATERIAL=FOIL\n.002\n";
    // Springs to the brick make it a single piece.
    for (int k = 0; k < 9; ++k)
        cards << "*ELEMENT, TYPE=SPRINGA, ELSET=JOIN\n" << 950 + k << ",27," << 9001 + k << "\n";
    cards << "*SPRING, ELSET=JOIN\n\n1e-9\n";
    AddedMatrices added;
    added.with = read(brick.text() + cards.str());
    added.without = read(brick.text());
    EXPECT_NEAR(added.with.calcMass() - added.without.calcMass(), rho * t * a * b, 1e-12);
    const double plane = E / (1 - nu * nu) * t * a * b / 2;
    const double exx = 1e-3, eyy = -4e-4, gxy = 7e-4;
    const double energy = added.energyOf([&](const std::array<double, 3>& at) {
        return std::array<double, 3>{exx * at[0] + gxy * at[1], eyy * at[1], 3e-3 * at[0]};
    });
    const double turning = added.energyOf([&](const std::array<double, 3>& at) {
        return std::array<double, 3>{0, 0, 1e-3 * at[0] - 2e-3 * at[1]};
    });
    EXPECT_NEAR(energy,
                plane * (exx * exx + eyy * eyy + 2 * nu * exx * eyy + (1 - nu) / 2 * gxy * gxy),
                1e-9 * plane * exx * exx);
    EXPECT_NEAR(turning, 0, 1e-9 * plane * exx * exx);
}

class EveryTruss : public CalculixDeckTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(EveryTruss, IsASpringWithAMass) {
    // From the brick's first node to its last, EA/L.
    const std::string type = GetParam();
    const FeModel plain = read(brick.text());
    const int last = plain.mesh.nodeNumbers.back();
    const auto from = plain.mesh.position(0), to = plain.mesh.position(plain.mesh.numNodes() - 1);
    const double length = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    std::ostringstream truss, spring;
    truss << "*NODE\n9001," << (from[0] + to[0]) / 2 << "," << (from[1] + to[1]) / 2 << ","
          << (from[2] + to[2]) / 2 << "\n*ELEMENT, TYPE=" << type << ", ELSET=TIES\n901,1,"
          << (type == "T3D3" ? "9001," : "") << last
          << "\n*SOLID SECTION, ELSET=TIES, MATERIAL=METAL\n1e-4\n";
    spring << "*ELEMENT, TYPE=SPRINGA, ELSET=TIES\n901,1," << last << "\n*SPRING, ELSET=TIES\n\n"
           << std::setprecision(17) << brick.E * 1e-4 / length << "\n";
    AddedMatrices added;
    added.with = read(brick.text() + truss.str());
    added.without = read(brick.text() + spring.str());
    EXPECT_NEAR(added.with.calcMass() - added.without.calcMass(), brick.rho * 1e-4 * length, 1e-12);
    const double scale = brick.E * 1e-4 * length * 1e-6;
    EXPECT_NEAR(added.energyOf([&](const std::array<double, 3>& at) {
        return std::array<double, 3>{1e-3 * at[0] + 3e-4 * at[1], 2e-3 * at[2], -5e-4 * at[1]};
    }),
                0, 1e-9 * scale);
}

INSTANTIATE_TEST_SUITE_P(Types, EveryTruss, ::testing::Values("T3D2", "T3D3"));

INSTANTIATE_TEST_SUITE_P(Types, EveryMembrane,
                         ::testing::Values("M3D3", "M3D4", "M3D4R", "M3D6", "M3D8", "M3D8R"));

TEST(DeckVocabulary, DecidesOnEveryKeywordOfCalculix) {
    std::istringstream keywords(kKeywords);
    for (std::string keyword; keywords >> keyword;)
        EXPECT_NE(findCardUse(keyword), CardUse::Unknown) << keyword;
    EXPECT_EQ(findCardUse("FLUXCAPACITOR"), CardUse::Unknown);
}

TEST_F(CalculixDeckTest, TwoLoosePiecesAreAnError) {
    EXPECT_THAT(errorOf(brick.meshText() + brick.meshText(1000, 1000) + brick.materialText()),
                AllOf(HasSubstr("2 pieces"), HasSubstr("nodes 1, 1000")));
}

/** An entry of tests/decks/mistakes.txt. **/
struct Mistake {
    std::string name, out, in, message;
};

std::vector<Mistake> readMistakes() {
    std::vector<Mistake> mistakes;
    std::istringstream lines(testing::readText(SIMFLEX_SOURCE_DIR "/tests/decks/mistakes.txt"));
    std::string* at = nullptr;
    for (std::string line; std::getline(lines, line);) {
        if (line.compare(0, 3, "== ") == 0) {
            mistakes.push_back({line.substr(3), "", "", ""});
            at = nullptr;
        } else if (!mistakes.empty() && line.compare(0, 2, "! ") == 0) {
            mistakes.back().message = line.substr(2);
        } else if (!mistakes.empty() && !at && line[0] == '-') {
            *(at = &mistakes.back().out) = line.substr(1);
        } else if (!mistakes.empty() && at != &mistakes.back().in && line[0] == '+') {
            *(at = &mistakes.back().in) = line.substr(1);
        } else if (at) {
            *at += "\n" + line;
        }
    }
    return mistakes;
}

TEST_F(CalculixDeckTest, MistakesAreAnsweredWithWhatAPersonNeeds) {
    const std::vector<Mistake> mistakes = readMistakes();
    EXPECT_GT(mistakes.size(), 200u);
    for (const Mistake& mistake : mistakes) {
        std::string text = brick.text(), answer;
        const size_t at = mistake.out.empty() ? text.size() : text.find(mistake.out);
        ASSERT_NE(at, std::string::npos) << mistake.name;
        text.replace(at, mistake.out.size(), mistake.in + (mistake.out.empty() ? "\n" : ""));
        CalculixOptions options;
        options.warn = [&](const std::string& warning) { answer += warning + "\n"; };
        answer += errorOf(text, options);
        EXPECT_THAT(answer, HasSubstr(mistake.message)) << mistake.name;
    }
}

TEST_F(CalculixDeckTest, AMissingDeckOrIncludeIsAnError) {
    EXPECT_THROW(readCalculixDeck(folder / "none.inp"), std::runtime_error);
    EXPECT_THAT(errorOf("*INCLUDE, INPUT=none.inp\n"),
                AllOf(HasSubstr("none.inp"), HasSubstr("deck.inp:1:")));
    EXPECT_THAT(errorOf("*INCLUDE, INPUT=deck.inp\n"), HasSubstr("include itself"));
    // Each of five files includes the next one 100 times.
    for (int k = 1; k <= 5; ++k) {
        std::string text;
        for (int line = 0; line < 100; ++line)
            text += "*INCLUDE, INPUT=fan" + std::to_string(k + 1) + ".inp\n";
        testing::writeText(folder / ("fan" + std::to_string(k) + ".inp"),
                           k < 5 ? text : "** end\n");
    }
    EXPECT_THAT(errorOf("*INCLUDE, INPUT=fan1.inp\n"), HasSubstr("more than 10000 files"));
}

TEST_F(CalculixDeckTest, NodesAndElementsAreGenerated) {
    // 8×2×2 elements: a line, then a face of lines, then a body of faces.
    const std::string made =
        "*NODE\n1,0,-.015,-.01\n9,.2,-.015,-.01\n19,0,.015,-.01\n27,.2,.015,-.01\n"
        "*NGEN,NSET=LOW\n1,9\n*NGEN,NSET=HIGH\n19,27,1\n*NFILL,NSET=FACE\nLOW,HIGH,2,9\n"
        "*NCOPY,OLD SET=FACE,CHANGE NUMBER=54,NEW SET=TOP,SHIFT\n0,0,.02\n"
        "*NFILL,NSET=ALL\nFACE,TOP,2,27\n*NSET,NSET=LEFT,GENERATE\n1,73,9\n"
        "*ELEMENT,TYPE=C3D8,ELSET=BODY\n1,1,2,11,10,28,29,38,37\n"
        "*ELGEN,ELSET=BODY\n1,8,1,1,2,9,8\n"
        "*ELCOPY,OLD SET=BODY,ELEMENT SHIFT=16,SHIFT NODES=27,NEW SET=BODY\n" +
        brick.materialText();
    const FeModel own = read(made), plain = read(brick.text());
    EXPECT_EQ(own.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    ASSERT_EQ(own.mesh.positions.size(), plain.mesh.positions.size());
    for (size_t k = 0; k < own.mesh.positions.size(); ++k)
        EXPECT_NEAR(own.mesh.positions[k], plain.mesh.positions[k], 1e-16);
    ASSERT_EQ(own.mesh.elements.size(), 1u);
    EXPECT_EQ(own.mesh.elements[0].nodes, plain.mesh.elements[0].nodes);
    EXPECT_EQ(own.mesh.nodeSets.at("ALL"), plain.mesh.nodeSets.at("ALL"));
    EXPECT_EQ(own.mesh.nodeSets.at("LEFT"), plain.mesh.nodeSets.at("LEFT"));
    const double size = 70e9;
    std::map<std::pair<int, int>, double> difference;  // either may omit a zero
    for (const auto& [model, sign] : {std::pair(&own, 1), std::pair(&plain, -1)})
        for (int column = 0; column < model->K.size; ++column)
            for (auto k = model->K.columnStarts[size_t(column)];
                 k < model->K.columnStarts[size_t(column) + 1]; ++k)
                difference[{model->K.rows[size_t(k)], column}] += sign * model->K.values[size_t(k)];
    for (const auto& [entry, value] : difference) ASSERT_NEAR(value, 0, 1e-12 * size);
    // Copies may also be rotated: node 9 at (0.2, −0.015) about (0.2, 0) after a shift along x.
    const FeModel turned =
        read(brick.text() +
             "*NCOPY,OLD SET=ALL,CHANGE NUMBER=1000,SHIFT\n0.01,0,0\n0.2,0,0,0.2,0,1,90\n"
             "*ELCOPY,OLD SET=BODY,ELEMENT SHIFT=100,SHIFT NODES=1000,NEW SET=BODY\n"
             "*RIGID BODY,NSET=CORNERS,REF NODE=9001\n*NODE\n9001,0,0,0\n"
             "*NSET,NSET=CORNERS\n1001,1009,1081\n");
    const auto x = turned.mesh.position(turned.mesh.indexOf(1009));
    EXPECT_NEAR(x[0], 0.2 + 0.015, 1e-15);
    EXPECT_NEAR(x[1], 0.01, 1e-15);
    EXPECT_NEAR(turned.calcMass(), 2 * brick.mass(), 1e-9);
}

TEST_F(CalculixDeckTest, ElementsMayStandBeforeTheirNodes) {
    const std::string mesh = brick.meshText();
    const size_t elements = mesh.find("*ELEMENT");
    const size_t end = std::min(mesh.find("*NSET", elements), mesh.size());
    ASSERT_LT(elements, end);
    const FeModel model = read(mesh.substr(elements, end - elements) + mesh.substr(0, elements) +
                               mesh.substr(end) + brick.materialText()),
                  plain = read(brick.text());
    EXPECT_EQ(model.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    EXPECT_EQ(model.K.values, plain.K.values);
}

TEST_F(CalculixDeckTest, RigidBodiesHaveAReferenceOfTheirOwn) {
    const std::string nodes = brick.text() + "*NODE\n9001,0.3,0.01,0.02\n9002,0,0,0\n";
    const auto calc = [&](const std::string& named) {
        return testing::calcFreeFrequencies(read(nodes + "*RIGID BODY,NSET=RIGHT" + named + "\n"),
                                            12);
    };
    const auto wanted = calc(",REF NODE=9001,ROT NODE=9002");
    for (const char* named : {"", ",ROT NODE=9002", ",REF NODE=9001"}) {
        const auto found = calc(named);
        for (size_t k = 6; k < wanted.size(); ++k)
            EXPECT_NEAR(found[k], wanted[k], 1e-8 * wanted[k]) << named << k;
    }
    EXPECT_GT(wanted[6], (1 + 1e-6) * testing::calcFreeFrequencies(read(brick.text()), 12)[6]);
}

TEST_F(CalculixDeckTest, ReadingTellsHowFarItIs) {
    std::string text = brick.text();
    for (int k = 0; k < 100000; ++k) text += "** nothing\n";
    std::vector<double> fractions;
    CalculixOptions options;
    options.progress = [&](const std::string& phase, double fraction) {
        if (phase == "reading the deck") fractions.push_back(fraction);
        return true;
    };
    read(text, options);
    ASSERT_GE(fractions.size(), 6u);
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    EXPECT_NEAR(fractions[2] - fractions[1], fractions[3] - fractions[2], 0.01);
    options.progress = [](const std::string&, double fraction) { return fraction < 0.2; };
    EXPECT_THROW(read(text, options), Cancelled);
}

TEST_F(CalculixDeckTest, ContinuedKeywordLinesCanBeCancelled) {
    constexpr int NumLines = 60000;
    std::string keyword = "*NODE, NSET=ALL,\n";
    for (int k = 1; k <= NumLines; ++k) keyword += "NSET=ALL,\n";
    int numReports = 0;
    CalculixOptions options;
    options.progress = [&](const std::string&, double fraction) {
        numReports += fraction > 0 && fraction < 0.6;
        return true;
    };
    read(keyword + "NSET=ALL\n" + brick.text(), options);
    EXPECT_EQ(numReports, 3);
}

/** Cards of an assembly of many bricks of one element. **/
std::string makeInstances(int number) {
    std::string text =
        "*PART,NAME=P\n*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=V\n"
        "1,1,2,3,4\n*SOLID SECTION,ELSET=V,MATERIAL=S\n*END PART\n*MATERIAL,NAME=S\n*ELASTIC\n"
        "2e11,0.3\n*DENSITY\n7850\n*ASSEMBLY,NAME=A\n";
    for (int k = 0; k < number; ++k)
        text += "*INSTANCE,NAME=I" + std::to_string(k) + ",PART=P\n*END INSTANCE\n";
    return text + "*NSET,NSET=ENDS\nI0.1\n*END ASSEMBLY\n";
}

TEST_F(CalculixDeckTest, ManyInstancesCanBeCancelled) {
    int numReports = 0;
    CalculixOptions options;
    options.progress = [&](const std::string& phase, double) {
        numReports += phase == "reading the deck";
        return phase != "K and M";
    };
    EXPECT_THROW(read(makeInstances(32000), options), Cancelled);
    EXPECT_GT(numReports, 8);
}

TEST_F(CalculixDeckTest, GeneratorsMakeNoMoreThanALimitTogether) {
    const std::string ranges =
        "*NSET,NSET=A,GENERATE\n1,15000000\n*NSET,NSET=B,GENERATE\n1,15000000\n";
    EXPECT_THAT(errorOf(brick.text() + ranges),
                AllOf(HasSubstr("GENERATE makes more than 20000000 numbers, together with those "
                                "made before it 30000000; is a digit too many?"),
                      HasSubstr("deck.inp:")));
    EXPECT_THAT(errorOf(brick.text() + "*ELGEN,ELSET=BODY\n1,6000000,0,100,4,0,1000000000\n"),
                HasSubstr("*ELGEN makes more than 20000000 of them; is a digit too many?"));
    // What the memory cannot hold is refused before it is made.
    rlimit before{};
    getrlimit(RLIMIT_AS, &before);
    const rlimit small{rlim_t(4000000000), before.rlim_max};
    setrlimit(RLIMIT_AS, &small);
    const std::string message = errorOf(brick.text() + "*ELGEN,ELSET=BODY\n1,15000000,0,100\n");
    setrlimit(RLIMIT_AS, &before);
    EXPECT_THAT(message,
                ContainsRegex("[*]ELGEN makes 15000000 of them, for which there is not enough "
                              "memory: about 7.0 GiB, of which .* are available"));
}

TEST_F(CalculixDeckTest, ProgressCanStopTheWork) {
    CalculixOptions options;
    options.progress = [](const std::string& phase, double) { return phase != "K and M"; };
    EXPECT_THROW(read(brick.text(), options), Cancelled);
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

}  // namespace
}  // namespace simflex
