#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cmath>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
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

    /** The error that a deck gives; nothing may be left behind. **/
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

    /** A program that runs ccx and then a shell command in its folder. **/
    std::string makeProgram(const std::string& afterwards) {
        testing::writeText(folder / "fake-ccx",
                           "#!/bin/sh\nccx \"$@\" || exit\n" + afterwards + "\n");
        chmod((folder / "fake-ccx").c_str(), 0755);
        return folder / "fake-ccx";
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
    EXPECT_THAT(model.program, ContainsRegex("CalculiX [0-9]"));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Bricks, EverySolidElement,
                         ::testing::Values("C3D8", "C3D8R", "C3D20", "C3D20R"));

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
    const FeModel plain = read(brick.text());
    const test::GermanLocale german(folder.path());
    const FeModel same = read(brick.text());
    EXPECT_EQ(same.K.values, plain.K.values);
    EXPECT_EQ(same.m.values, plain.m.values);
    EXPECT_EQ(same.mesh.positions, plain.mesh.positions);
}

TEST_F(CalculixDeckTest, IncludedFilesAreFoundBesideTheDeck) {
    testing::writeText(folder / "Mesh of part.inp", brick.meshText());
    const FeModel model = read("*INCLUDE, INPUT=\"Mesh of part.inp\"\n" + brick.materialText());
    EXPECT_NEAR(model.calcMass(), brick.mass(), 1e-10);
}

TEST_F(CalculixDeckTest, StepsSupportsAndTiesAreLeftOutAndReported) {
    const FeModel plain = read(brick.text());
    std::vector<std::string> notes;
    CalculixOptions options;
    options.note = [&](const std::string& note) { notes.push_back(note); };
    const FeModel loaded =
        read(brick.text() +
                 "*NODE\n5000,0,0,0\n5001,0,0,0\n"
                 "*RIGID BODY,NSET=LEFT,REF NODE=5000,ROT NODE=5001\n"
                 "*BOUNDARY\n5000,1,3\n"
                 "*STEP\n*STATIC\n*CLOAD\n5,1,1.\n*EQUATION\n1\n3,1,1.\n*END STEP\n",
             options);
    EXPECT_EQ(loaded.K.values, plain.K.values);
    EXPECT_EQ(loaded.m.values, plain.m.values);
    EXPECT_EQ(loaded.notes, notes);
    std::string all;
    for (const std::string& note : notes) all += note + "\n";
    EXPECT_THAT(all, AllOf(HasSubstr("*STEP"), HasSubstr("*BOUNDARY"), HasSubstr("*RIGID BODY"),
                           HasSubstr("*CLOAD"), HasSubstr("2 nodes of no solid element")));
}

TEST_F(CalculixDeckTest, SurfaceElementsOfAMesherAreDropped) {
    const FeModel model =
        read(brick.text() +
             "*ELEMENT, TYPE=CPS4, ELSET=SKIN\n9001,1,2,11,10\n"
             "*ELEMENT, TYPE=T3D2, ELSET=EDGE\n9002,1,2\n*NSET, NSET=SEAT\n1,2,11,10\n");
    EXPECT_EQ(model.mesh.elements.size(), 1u);
    EXPECT_EQ(model.mesh.elements[0].numElements(), 32);
    EXPECT_EQ(model.mesh.nodeSets.at("SEAT").size(), 4u);
}

TEST_F(CalculixDeckTest, LongNumbersKeepTheirExponent) {
    // ccx reads 20 characters of a number: it would take these for 70 and 27.
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
    const std::string error = errorOf(text + GetParam().text);
    EXPECT_THAT(error, AllOf(HasSubstr(GetParam().message),
                             ContainsRegex("deck.inp:" + std::to_string(line) +
                                           ":|deck.inp:" + std::to_string(line + 1) + ":")));
}

INSTANTIATE_TEST_SUITE_P(
    Cards, RefusedCard,
    ::testing::Values(
        BadCard{"Mpc", "*MPC\nPLANE,1,2,3,4\n", "*MPC"},
        BadCard{"Tie", "*TIE, NAME=T\nA,B\n", "surface A"},
        BadCard{"TieOfCycles", "*TIE, NAME=T, CYCLIC SYMMETRY\nA,B\n", "CYCLICSYMMETRY"},
        BadCard{"Transform", "*TRANSFORM,NSET=ALL\n1,0,0,0,1,0\n", "axes"},
        BadCard{"Shell", "*SHELL SECTION,ELSET=BODY,MATERIAL=METAL\n0.01\n", "does not fit"},
        BadCard{"Membrane", "*MEMBRANE SECTION,ELSET=BODY,MATERIAL=METAL\n0.01\n", "hinged"},
        BadCard{"Spring", "*SPRING,ELSET=S\n1\n1e6\n", "*SPRING"},
        BadCard{"Mass", "*MASS,ELSET=S\n1\n", "point mass"},
        BadCard{"Contact", "*CONTACT PAIR,INTERACTION=I\nA,B\n", "contact"},
        BadCard{"Unknown", "*FLUX CAPACITOR\n", "not known to simflex"},
        BadCard{"ShellElement", "*ELEMENT,TYPE=S4\n9001,1,2,11,10\n", "S4R"},
        BadCard{"BeamElement", "*ELEMENT,TYPE=B31\n9001,1,2\n", "B32R"},
        BadCard{"ReducedBeamElement", "*ELEMENT,TYPE=B31R\n9001,1,2\n", "inertia"},
        BadCard{"ShellWithoutSection", "*ELEMENT,TYPE=S4R\n9001,1,2,11,10\n", "no section"},
        BadCard{"IncompatibleModes", "*ELEMENT,TYPE=C3D8I\n9001,1,2,11,10,28,29,38,37\n",
                "internal"},
        BadCard{"ShortElement", "*ELEMENT,TYPE=C3D8\n9001,1,2,11\n", "has 3 nodes"},
        BadCard{"TwiceElement", "*ELEMENT,TYPE=C3D8\n1,1,2,11,10,28,29,38,37\n", "twice"},
        BadCard{"UnknownNode", "*ELEMENT,TYPE=C3D4\n9001,1,2,11,77777\n", "77777"},
        BadCard{"UnknownSet", "*NSET,NSET=X\nNOWHERE\n", "NOWHERE"},
        BadCard{"NotANumber", "*NODE\n9001,1.0,abc,0\n", "'ABC' is not a finite number"},
        BadCard{"SectionOfNothing", "*SOLID SECTION,ELSET=GONE,MATERIAL=METAL\n", "GONE"}),
    [](const auto& card) { return card.param.name; });

TEST_F(CalculixDeckTest, CalculixOwnErrorTextIsReported) {
    std::string text = brick.text();
    text.replace(text.find("MATERIAL=METAL"), 14, "MATERIAL=WOOD ");
    EXPECT_THAT(errorOf(text),
                AllOf(HasSubstr("CalculiX refused"), HasSubstr("*ERROR"), HasSubstr("WOOD")));
}

TEST_F(CalculixDeckTest, AnElementTurnedInsideOutIsCalculixError) {
    EXPECT_THAT(
        errorOf(brick.text() + "*ELEMENT,TYPE=C3D8,ELSET=BODY\n9001,28,29,38,37,1,2,11,10\n"),
        AllOf(HasSubstr("*ERROR"), ContainsRegex("acobian")));
}

TEST_F(CalculixDeckTest, MissingDensityIsAnError) {
    Brick light;
    std::string text = light.text();
    text.erase(text.find("*DENSITY"), text.find("*SOLID SECTION") - text.find("*DENSITY"));
    EXPECT_THAT(errorOf(text), ::testing::AnyOf(HasSubstr("ensity"), HasSubstr("DENSITY")));
}

TEST_F(CalculixDeckTest, TwoLoosePiecesAreAnError) {
    EXPECT_THAT(errorOf(brick.meshText() + brick.meshText(1000, 1000) + brick.materialText()),
                AllOf(HasSubstr("2 pieces"), HasSubstr("nodes 1, 1000")));
}

TEST_F(CalculixDeckTest, NotANumberInTheStiffnessFileIsAnError) {
    CalculixOptions options;
    options.program = makeProgram("[ -f part.sti ] && sed -i '5s/[^ ]*$/NaN/' part.sti; true");
    EXPECT_THAT(errorOf(brick.text(), options), AllOf(HasSubstr("part.sti"), HasSubstr("nan")));
}

TEST_F(CalculixDeckTest, GarbageInAMatrixFileIsAnError) {
    CalculixOptions options;
    options.program = makeProgram("[ -f part.mas ] && echo '1 2 oops' >> part.mas; true");
    EXPECT_THAT(errorOf(brick.text(), options), AllOf(HasSubstr("part.mas"), HasSubstr("line")));
}

TEST_F(CalculixDeckTest, AMassMatrixThatDiffersBetweenAxesIsAnError) {
    CalculixOptions options;
    options.program = makeProgram("[ -f part.mas ] && sed -i '1s/[^ ]*$/1.0/' part.mas; true");
    EXPECT_THAT(errorOf(brick.text(), options), HasSubstr("differs between the directions"));
}

TEST_F(CalculixDeckTest, AMissingProgramIsAnErrorThatSaysHowToGetIt) {
    CalculixOptions options;
    options.program = "no-such-ccx";
    EXPECT_THAT(errorOf(brick.text(), options),
                AllOf(HasSubstr("no-such-ccx"), HasSubstr("calculix-ccx")));
}

TEST_F(CalculixDeckTest, AMissingDeckOrIncludeIsAnError) {
    EXPECT_THROW(readCalculixDeck(folder / "none.inp"), std::runtime_error);
    EXPECT_THAT(errorOf("*INCLUDE, INPUT=none.inp\n"),
                AllOf(HasSubstr("none.inp"), HasSubstr("deck.inp:1:")));
    EXPECT_THAT(errorOf("*INCLUDE, INPUT=deck.inp\n"), HasSubstr("include itself"));
}

TEST_F(CalculixDeckTest, ProgressCanStopTheWork) {
    CalculixOptions options;
    options.progress = [](const std::string& phase, double) {
        return phase.find("CalculiX") == std::string::npos;
    };
    EXPECT_THROW(read(brick.text(), options), Cancelled);
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

}  // namespace
}  // namespace simflex
