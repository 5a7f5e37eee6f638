/** @file
Decks with equations, multi-point constraints and surface ties against CalculiX's frequencies of the
same deck. **/

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "fe/FreeModes.h"
#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/FaceShapes.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::Brick;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::TestFolder;

class ConstraintsTest : public ::testing::Test {
protected:
    FeModel read(const std::string& text) {
        testing::writeText(folder / "deck.inp", text);
        return readCalculixDeck(folder / "deck.inp");
    }

    std::string errorOf(const std::string& text) {
        try {
            read(text);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    /** CalculiX prints 7 digits. **/
    void expectCalculixFrequencies(const std::string& text, double tolerance = 1e-5) {
        const FeModel model = read(text);
        constexpr int kNumModes = 16;
        const auto own = testing::calcFreeFrequencies(model, kNumModes);
        const auto reference =
            testing::calcCalculixFrequencies(folder, folder / "deck.inp", {}, kNumModes);
        for (int i = 0; i < 6; ++i) EXPECT_LT(own[i], 1e-3 * own[6]) << "rigid mode " << i + 1;
        for (int i = 6; i < kNumModes; ++i)
            EXPECT_NEAR(own[i], reference[i], tolerance * reference[i]) << "mode " << i + 1;
    }

    /** Returns two boxes end to end along x with different meshes; the first ends and the second
    begins at x = 0.1, plus a gap. The second is numbered from 1001. **/
    std::string twoBricks(const std::string& firstType, const std::string& secondType,
                          double gap = 0) {
        first.type = firstType;
        first.size = {0.1, 0.03, 0.02};
        first.elements = {4, 2, 2};
        second = first;
        second.type = secondType;
        second.elements = {3, 3, 3};
        std::istringstream lines(second.meshText(1001, 1001));
        std::string moved;
        bool isNode = false;
        for (std::string line; std::getline(lines, line);) {
            if (line[0] == '*') isNode = line == "*NODE";
            int number;
            double x, y, z;
            if (isNode && std::sscanf(line.c_str(), "%d,%lf,%lf,%lf", &number, &x, &y, &z) == 4) {
                char text[100];
                std::snprintf(text, sizeof text, "%d,%.14g,%.14g,%.14g", number, x + 0.1 + gap, y,
                              z);
                line = text;
            }
            const size_t set = line.find("SET=");
            if (set != std::string::npos && line.find("BODY") == std::string::npos)
                line.insert(set + 4, "X");
            moved += line + "\n";
        }
        return first.meshText() + moved + first.materialText();
    }

    /** Returns element surfaces on the facing ends: END of the first box, BEGIN of the second. **/
    std::string facingSurfaces() const {
        std::ostringstream text;
        text << "*SURFACE, NAME=END, TYPE=ELEMENT\n";
        for (int k = 0; k < 4; ++k) text << 4 * (k + 1) << ", S4\n";
        text << "*SURFACE, NAME=BEGIN, TYPE=ELEMENT\n";
        for (int k = 0; k < 9; ++k) text << 1001 + 3 * k << ", S6\n";
        return text.str();
    }

    TestFolder folder;
    Brick first, second;
};

TEST_F(ConstraintsTest, SurfacesBecomeNodeSetsOfTheirFaces) {
    const FeModel model = read(Brick().text() +
                               "*SURFACE, NAME=Front\n8, S4\n16,S4\n24,S4\n32,S4\n"
                               "*SURFACE, NAME=POINTS, TYPE=NODE\nCORNERS\n2\n");
    EXPECT_EQ(model.mesh.nodeSets.at("FRONT"), model.mesh.nodeSets.at("RIGHT"));
    EXPECT_EQ(model.mesh.nodeSets.at("POINTS").size(), 9u);
    EXPECT_TRUE(model.constraints.empty());
}

TEST_F(ConstraintsTest, ANodeSetKeepsItsNameBesideASurface) {
    first.type = "C3D8I";
    const FeModel model = read(first.text() + "*SURFACE, NAME=LEFT\n8, S4\n");
    EXPECT_EQ(model.mesh.nodeSets.at("LEFT").size(), 9u);
    EXPECT_THAT(model.warnings, ::testing::ElementsAre(HasSubstr("*NSET LEFT too")));
}

TEST_F(ConstraintsTest, BoxesJoinedByEquationsHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    std::string text = twoBricks("C3D8", "C3D8");
    // Apart from corners and edge midpoints, no nodes of the faces coincide: join the four corners.
    const int end[4] = {5, 15, 35, 45}, begin[4] = {1001, 1013, 1049, 1061};
    text += "*EQUATION\n";
    for (int k = 0; k < 4; ++k)
        for (int a = 1; a <= 3; ++a)
            text += "2\n" + std::to_string(begin[k]) + "," + std::to_string(a) + ",1.," +
                    std::to_string(end[k]) + "," + std::to_string(a) + ",-1.\n";
    expectCalculixFrequencies(text);
}

TEST_F(ConstraintsTest, EquationsThatCascadeHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    // 20 follows 2 and 11, 2 follows 1 and 3 (a straight edge): nodes 1, 2, 3 lie on a line.
    std::string text = Brick().text() + "*EQUATION\n";
    for (int a = 1; a <= 3; ++a) {
        const std::string d = "," + std::to_string(a) + ",";
        text += "3\n2" + d + "2.,1" + d + "-1.,3" + d + "-1.\n";
        text += "3\n11" + d + "1.,2" + d + "-.5,20" + d + "-.5\n";
    }
    expectCalculixFrequencies(text);
}

TEST_F(ConstraintsTest, EquationsThatGoInACircleSayTheLastOnceOnly) {
    const FeModel model = read(
        Brick().text() + "*EQUATION\n2\n1,1,1.,2,1,-1.\n2\n2,1,1.,3,1,-1.\n2\n3,1,1.,1,1,-1.\n");
    EXPECT_EQ(model.constraints.numCoordinates, model.K.size - 2);
    EXPECT_THAT(model.notes,
                ::testing::Contains(AllOf(HasSubstr("deck.inp:"), HasSubstr("already"))));
}

TEST_F(ConstraintsTest, EquationsThatHoldThePartAreRefusedWithTheirLine) {
    const std::string text = Brick().text();
    const long line = std::count(text.begin(), text.end(), '\n') + 2;
    const std::string where = "deck.inp:" + std::to_string(line) + ":";
    EXPECT_THAT(errorOf(text + "*EQUATION\n1\n1,1,1.\n"),
                AllOf(HasSubstr(where), HasSubstr("translation along x")));
    // Equal z of nodes separated along x: no rotation about y.
    EXPECT_THAT(errorOf(text + "*EQUATION\n2\n1,3,1.,9,3,-1.\n"),
                AllOf(HasSubstr(where), HasSubstr("rotation about y")));
}

TEST_F(ConstraintsTest, CoefficientsOfFiveDigitsAreCorrectedToTheLast) {
    const FeModel model = read(Brick().text() +
                               "*EQUATION\n3\n2,2,1.,1,2,-.66667,4,2,-.33333\n"
                               "3\n2,3,1.,1,3,-.66667,4,3,-.33333\n");
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("corrected")));
    EXPECT_EQ(model.constraints.numCoordinates, model.K.size - 2);
}

TEST_F(ConstraintsTest, EquationsOfRotationsAndUnfinishedOnesAreRefused) {
    EXPECT_THAT(errorOf(Brick().text() + "*EQUATION\n2\n1,4,1.,2,4,-1.\n"),
                HasSubstr("rotation 4"));
    EXPECT_THAT(errorOf(Brick().text() + "*EQUATION\n2\n1,1,1.\n"), HasSubstr("1 terms missing"));
    EXPECT_THAT(errorOf(Brick().text() + "*EQUATION\n1\n1,1\n"), HasSubstr("coefficient"));
    EXPECT_THAT(errorOf(Brick().text() + "*EQUATION\n1\n777,1,1.\n"), HasSubstr("node 777"));
}

// CalculiX itself takes *MPC for a nonlinear analysis, which it cannot do for a free part: compare
// with the equivalent equations.
TEST_F(ConstraintsTest, MultiPointConstraintsAreTheirLinearEquations) {
    SIMFLEX_NEEDS_CALCULIX();
    std::ostringstream equations;
    equations << "*EQUATION\n";
    for (const char* d : {",2,", ",3,"})  // nodes 1…9 along x
        for (int k = 2; k <= 6; k += 2)
            equations << "3\n" << k + 1 << d << "8.,1" << d << k - 8 << ".,9" << d << -k << ".\n";
    // Nodes of the plane z = 0, 28 and 36 along x, 28 and 46 along y.
    equations << "3\n29,3,8.,28,3,-7.,36,3,-1.\n3\n30,3,8.,28,3,-6.,36,3,-2.\n"
                 "4\n38,3,8.,28,3,-3.,36,3,-1.,46,3,-4.\n"
                 "4\n55,1,20.,55,2,3.,81,1,-20.,81,2,-3.\n";
    const FeModel model =
        read(Brick().text() + "*MPC\nSTRAIGHT,1,9,3,5,7\nPLANE,28,36,46,29,30,\n38\nBEAM,55,81\n");
    testing::writeText(folder / "equations.inp", Brick().text() + equations.str());
    const auto own = testing::calcFreeFrequencies(model, 16);
    const auto reference =
        testing::calcCalculixFrequencies(folder, folder / "equations.inp", {}, 16);
    for (size_t i = 6; i < own.size(); ++i) EXPECT_NEAR(own[i], reference[i], 1e-5 * reference[i]);
}

TEST_F(ConstraintsTest, NodesOffTheirLineOrUnknownKindsAreRefused) {
    EXPECT_THAT(errorOf(Brick().text() + "*MPC\nSTRAIGHT,1,9,12\n"), HasSubstr("off the line"));
    EXPECT_THAT(errorOf(Brick().text() + "*MPC\nPLANE,1,2,3,4\n"), HasSubstr("on a line"));
    EXPECT_THAT(errorOf(Brick().text() + "*MPC\nDIST,1,9,12\n"),
                HasSubstr("*MPC DIST keeps nodes no farther"));
    EXPECT_THAT(errorOf(Brick().text() + "*MPC\nMEANROT,1,9,12\n"),
                HasSubstr("something else uses that node"));
}

TEST_F(ConstraintsTest, EquationsInTheAxesOfTheirNodesHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    // Node 55 at (0, −0.015, 0.01), 81 at (0.2, 0.015, 0.01): their distance is constant.
    expectCalculixFrequencies(Brick().text() +
                              "*NSET,NSET=TURNED\n55,81\n"
                              "*TRANSFORM,NSET=TURNED,TYPE=R\n20.,3.,0.,-3.,20.,0.\n"
                              "*EQUATION\n2\n55,1,1.,81,1,-1.\n");
    // About the line through 55 along z, the radial motion of 81 equals that of 55 along x and y.
    expectCalculixFrequencies(
        Brick().text() +
        "*NSET,NSET=FAR\n81\n"
        "*TRANSFORM,NSET=FAR,TYPE=C\n0.,-0.015,0.,0.,-0.015,1.\n"
        "*EQUATION\n3\n81,1,-1.,55,1,0.98893635286830,55,2,0.14834045293025\n");
    const std::string error = errorOf(Brick().text() + "*TRANSFORM,NSET=NOWHERE\n1,0,0,0,1,0\n");
    EXPECT_THAT(error, AllOf(HasSubstr("NOWHERE"), ContainsRegex("deck.inp:[0-9]+:")));
}

TEST_F(ConstraintsTest, EquationsAndPlanesOfSetsAreThoseOfTheirNodes) {
    const std::string sets = Brick().text() +
                             "*NSET,NSET=A\n1,2,3\n*NSET,NSET=B\n4\n"
                             "*NSET,NSET=FLAT\n28,29,30,36,38,46\n";
    // Along x, on the same line: distances are constant.
    const FeModel model = read(sets + "*EQUATION\n2\nA,1,1.,B,1,-1.\n*MPC\nPLANE,FLAT\n");
    const FeModel plain = read(sets +
                               "*EQUATION\n2\n1,1,1.,4,1,-1.\n2\n2,1,1.,4,1,-1.\n2\n"
                               "3,1,1.,4,1,-1.\n*MPC\nPLANE,28,29,30,36,38,46\n");
    EXPECT_EQ(model.constraints.columns, plain.constraints.columns);
    EXPECT_EQ(model.constraints.coefficients, plain.constraints.coefficients);
    EXPECT_THAT(errorOf(sets + "*NSET,NSET=C\n5,6\n*EQUATION\n2\nA,1,1.,C,1,-1.\n"),
                HasSubstr("sets of 3 and 2 nodes"));
    EXPECT_THAT(errorOf(sets + "*EQUATION\n2\nA,1,1.,NOWHERE,1,-1.\n"), HasSubstr("NOWHERE"));
}

struct TiePair {
    const char *first, *second;
};

class TiedBoxes : public ConstraintsTest, public ::testing::WithParamInterface<TiePair> {};

TEST_P(TiedBoxes, HaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    expectCalculixFrequencies(twoBricks(GetParam().first, GetParam().second) + facingSurfaces() +
                              "*TIE, NAME=SEAM\nEND, BEGIN\n");
}

INSTANTIATE_TEST_SUITE_P(Types, TiedBoxes,
                         ::testing::Values(TiePair{"C3D8", "C3D8"}, TiePair{"C3D20R", "C3D20R"},
                                           TiePair{"C3D8I", "C3D8I"}, TiePair{"C3D8", "C3D20"},
                                           TiePair{"C3D20", "C3D8"}),
                         [](const auto& pair) {
                             return std::string(pair.param.first) + "_" + pair.param.second;
                         });

TEST_F(ConstraintsTest, ATiePullsSlaveNodesOntoTheMasterAsCalculixDoes) {
    SIMFLEX_NEEDS_CALCULIX();
    const std::string tie = "*TIE, NAME=SEAM, POSITION TOLERANCE=1e-3\nEND, BEGIN\n";
    expectCalculixFrequencies(twoBricks("C3D8I", "C3D8I", 2e-4) + facingSurfaces() + tie);
    const std::string text = twoBricks("C3D8", "C3D8", 2e-4) + facingSurfaces() + tie;
    expectCalculixFrequencies(text);
    const FeModel model = read(text);
    EXPECT_NEAR(model.mesh.position(model.mesh.indexOf(5))[0], 0.1 + 2e-4, 1e-12);
}

TEST_F(ConstraintsTest, ATieAcrossAGapTurnsWithItsMaster) {
    const FeModel model = read(twoBricks("C3D20", "C3D20", 2e-4) + facingSurfaces() +
                               "*TIE, NAME=SEAM, POSITION TOLERANCE=1e-3, ADJUST=NO\nEND, BEGIN\n");
    // validate() has checked that the rigid motions satisfy the tie.
    EXPECT_NEAR(model.mesh.position(model.mesh.indexOf(9))[0], 0.1, 1e-12);
    EXPECT_FALSE(model.constraints.empty());
}

TEST_F(ConstraintsTest, ATieThatReachesNoNodeIsAnErrorAndOneThatReachesSomeAWarning) {
    EXPECT_THAT(errorOf(twoBricks("C3D8", "C3D8", 5e-3) + facingSurfaces() +
                        "*TIE, NAME=SEAM\nEND, BEGIN\n"),
                AllOf(HasSubstr("SEAM ties no node"), HasSubstr("POSITION TOLERANCE")));
    const FeModel model =
        read(twoBricks("C3D8I", "C3D8I") + facingSurfaces() +
             "*SURFACE, NAME=MANY, TYPE=NODE\nALL\n*TIE, NAME=SEAM\nMANY, BEGIN\n");
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("ties 9 nodes")));
    EXPECT_THAT(model.warnings, ::testing::ElementsAre(AllOf(
                                    HasSubstr("SEAM"), HasSubstr("leaves 36 slave nodes free"))));
}

TEST_F(ConstraintsTest, ATieNamesASurfaceOrFaceThatIsNotThere) {
    EXPECT_THAT(errorOf(Brick().text() + "*TIE, NAME=T\nA, B\n"), HasSubstr("surface A"));
    EXPECT_THAT(errorOf(Brick().text() + "*SURFACE, NAME=A\n1, S7\n*TIE, NAME=T\nA, A\n"),
                HasSubstr("'S7' is not a face"));
}

// In comparisons with CalculiX, it solves the deck's own *RIGID BODY and *COUPLING.
TEST_F(ConstraintsTest, ARigidBodyHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    expectCalculixFrequencies(Brick().text() +
                              "*NODE\n5000,-0.05,0.01,0\n5001,0,0,0\n"
                              "*RIGID BODY, NSET=LEFT, REF NODE=5000, ROT NODE=5001\n");
}

TEST_F(ConstraintsTest, ARigidBodyOfElementsHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    expectCalculixFrequencies(Brick().text() +
                              "*ELSET, ELSET=TIP\n1,9,17,25\n*NODE\n5000,0,0,0\n5001,0,0,0\n"
                              "*RIGID BODY, ELSET=TIP, REF NODE=5000, ROT NODE=5001\n");
}

TEST_F(ConstraintsTest, BoxesJoinedByRigidBodiesOfOneReferenceHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    const std::string boxes = twoBricks("C3D8", "C3D8", 0.01) +
                              "*NODE\n5000,0.105,0,0\n5001,0.105,0,0\n5002,0.105,0,0\n"
                              "*RIGID BODY, NSET=RIGHT, REF NODE=5000, ROT NODE=5001\n";
    expectCalculixFrequencies(boxes + "*RIGID BODY, NSET=XLEFT, REF NODE=5000, ROT NODE=5001\n");
    // The same rotations by equations; 5001 and 5002 stand for rotations.
    expectCalculixFrequencies(boxes +
                              "*RIGID BODY, NSET=XLEFT, REF NODE=5000, ROT NODE=5002\n"
                              "*EQUATION\n2\n5002,1,1.,5001,1,-1.\n2\n5002,2,1.,5001,2,-1.\n"
                              "2\n5002,3,1.,5001,3,-1.\n");
}

TEST_F(ConstraintsTest, ABallOfTwoRigidBodiesLeavesThreeTurnsMore) {
    const FeModel model = read(twoBricks("C3D8", "C3D8", 0.01) +
                               "*NODE\n5000,0.105,0,0\n5001,0.105,0,0\n5002,0.105,0,0\n"
                               "*RIGID BODY, NSET=RIGHT, REF NODE=5000, ROT NODE=5001\n"
                               "*RIGID BODY, NSET=XLEFT, REF NODE=5000, ROT NODE=5002\n");
    const auto hertz = testing::calcFreeFrequencies(model, 12);
    EXPECT_LT(hertz[8], 1e-3 * hertz[9]);
    EXPECT_GT(hertz[9], 100);
}

TEST_F(ConstraintsTest, AKinematicCouplingHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    const std::string surface =
        "*SURFACE, NAME=TIP\n1,S6\n9,S6\n17,S6\n25,S6\n*NODE\n5000,-0.03,0,0\n"
        "*ORIENTATION, NAME=TURNED\n1,1,0,-1,1,0\n";
    const std::string coupling = "*COUPLING, REF NODE=5000, SURFACE=TIP, CONSTRAINT NAME=C";
    expectCalculixFrequencies(Brick().text() + surface + coupling + "\n*KINEMATIC\n1,3\n");
    // Held are the reference node's other motions, which have no stiffness in CalculiX's equations.
    const std::string held = "*BOUNDARY\n5000,2,4\n";
    expectCalculixFrequencies(Brick().text() + surface + coupling + "\n*KINEMATIC\n1\n" + held);
    expectCalculixFrequencies(Brick().text() + surface + coupling +
                              ", ORIENTATION=TURNED\n*KINEMATIC\n1\n" + held);
}

TEST_F(ConstraintsTest, ADistributingCouplingStiffensNothing) {
    const std::string cards =
        "*SURFACE, NAME=TIP, TYPE=NODE\nLEFT\n*NODE\n5000,-0.03,0,0\n5001,0,0,0\n"
        "*COUPLING, REF NODE=5000, SURFACE=TIP, CONSTRAINT NAME=C\n*DISTRIBUTING\n1,3\n";
    const FeModel model = read(Brick().text() + cards);
    EXPECT_TRUE(model.constraints.empty());
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("stiffens nothing")));
    EXPECT_THAT(
        errorOf(Brick().text() + cards + "*RIGID BODY, NSET=RIGHT, REF NODE=5000, ROT NODE=5001\n"),
        HasSubstr("something else uses that node"));
}

TEST_F(ConstraintsTest, NodesThatAreTheMeanOfOthersStiffenNothing) {
    const std::string node = "*NODE\n9001,0.3,0,0\n";
    const FeModel plain = read(Brick().text());
    for (const std::string& cards :
         {node + "*MPC\nMEANROT,1,1,1,9,9,9,18,18,18,9001\n",
          node + "*ELEMENT,TYPE=DCOUP3D,ELSET=D\n9001,9001\n*DISTRIBUTING COUPLING,ELSET=D\n"
                 "RIGHT,1.\n"}) {
        const FeModel model = read(Brick().text() + cards);
        EXPECT_EQ(model.K.values, plain.K.values);
        EXPECT_EQ(model.m.values, plain.m.values);
        EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("stiffens nothing")));
    }
}

TEST_F(ConstraintsTest, ARigidBodyOnALineTurnsAboutItFreely) {
    const FeModel plain = read(Brick().text());
    const FeModel model = read(Brick().text() +
                               "*NODE\n5000,0.3,0.1,0.2\n"
                               "*RIGID BODY, NSET=LINE, REF NODE=5000\n");
    EXPECT_EQ(model.constraints.numCoordinates, plain.K.size - 3 * 9 + 5);
}

TEST_F(ConstraintsTest, RigidBodiesThatCannotBeAreRefusedWithTheirLine) {
    const std::string text = Brick().text();
    const std::string where =
        "deck.inp:" + std::to_string(std::count(text.begin(), text.end(), '\n') + 1) + ": ";
    EXPECT_EQ(errorOf(text + "*RIGID BODY, NSET=LEFT, REF NODE=5000\n"),
              folder / where + "*RIGID BODY names node 5000, which the deck does not define");
    EXPECT_EQ(errorOf(text + "*RIGID BODY, NSET=GONE, REF NODE=1\n"),
              folder / where + "*RIGID BODY names node set GONE, which the deck does not have");
    EXPECT_EQ(errorOf(text + "*RIGID BODY, NSET=LEFT, REF NODE=1, ROT NODE=2\n"),
              folder / where + "ROT NODE 2 is a node of elements; give one of its own");
    EXPECT_EQ(errorOf(text + "*RIGID BODY, NSET=LEFT, REF NODE=1, PIN NSET=RIGHT\n"),
              folder / where +
                  "*RIGID BODY with PINNSET is not known to simflex, so it cannot tell what that "
                  "does to K and M; it knows none but ELSET, NSET, REFNODE, ROTNODE, TIENSET. Take "
                  "it out "
                  "of the deck.");
    EXPECT_EQ(errorOf(text + "*COUPLING, REF NODE=1, SURFACE=S, CONSTRAINT NAME=C\n"),
              folder / where + "*COUPLING needs *KINEMATIC or *DISTRIBUTING below it");
    EXPECT_EQ(errorOf(text + "*KINEMATIC\n1,3\n"),
              folder / where + "*KINEMATIC must stand below *COUPLING");
}

TEST_F(ConstraintsTest, AMaterialAtTheTemperatureOfItsNodesHasCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    std::string text = Brick().text();
    text.replace(text.find("7e+10,0.3"), 9, "70e9,0.3,20\n35e9,0.25,120\n20e9,0.2,500");
    expectCalculixFrequencies(text + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 260\n");
}

/** Returns the part of a deck between *PART and *END PART, and the material after it. **/
std::pair<std::string, std::string> dividePart(const Brick& brick) {
    const std::string text = brick.materialText();
    const size_t section = text.find("*SOLID SECTION");
    return {brick.meshText() + text.substr(section), text.substr(0, section)};
}

TEST_F(ConstraintsTest, AnAssemblyIsTheDeckFlattenedByHand) {
    twoBricks("C3D8", "C3D8");
    const auto [firstPart, material] = dividePart(first);
    const std::string secondPart = dividePart(second).first;
    const FeModel model = read(
        "*PART, NAME=A\n" + firstPart + "*END PART\n*PART, NAME=B\n" + secondPart +
        "*END PART\n*ASSEMBLY, NAME=ALL\n*INSTANCE, NAME=A-1, PART=A\n*END INSTANCE\n"
        "*INSTANCE, NAME=B-1, PART=B\n0.1, 0., 0.\n*END INSTANCE\n"
        "*ELSET, ELSET=LAST, INSTANCE=A-1, GENERATE\n4, 16, 4\n"
        "*ELSET, ELSET=FIRST, INSTANCE=B-1, GENERATE\n1, 25, 3\n"
        "*SURFACE, NAME=END\nLAST, S4\n*SURFACE, NAME=BEGIN\nFIRST, S6\n"
        "*NODE\n1, 0.3, 0., 0.\n*NSET, NSET=FAR\n1\n*RIGID BODY, NSET=B-1.RIGHT, REF NODE=FAR\n"
        "*NSET, NSET=MIXED, INSTANCE=A-1\n1, 2\n*NSET, NSET=MIXED, INSTANCE=B-1\n1\n"
        "*NSET, NSET=POINTED\nB-1.2, A-1.ONE\n"
        "*TIE, NAME=SEAM\nEND, BEGIN\n*END ASSEMBLY\n" +
        material);

    std::istringstream lines(second.meshText(46, 17));
    std::string moved;
    bool isNode = false;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] == '*') isNode = line == "*NODE";
        int number;
        double x[3];
        if (isNode && std::sscanf(line.c_str(), "%d,%lf,%lf,%lf", &number, x, x + 1, x + 2) == 4) {
            char text[100];
            std::snprintf(text, sizeof text, "%d,%.17g,%.17g,%.17g", number, x[0] + 0.1, x[1],
                          x[2]);
            line = text;
        }
        const size_t set = line.find("SET=");
        if (set != std::string::npos && line.find("BODY") == std::string::npos)
            line.insert(set + 4, "X");
        moved += line + "\n";
    }
    const FeModel plain =
        read(first.meshText() + moved + first.materialText() +
             "*ELSET, ELSET=LAST, GENERATE\n4, 16, 4\n*ELSET, ELSET=FIRST, GENERATE\n17, 41, 3\n"
             "*SURFACE, NAME=END\nLAST, S4\n*SURFACE, NAME=BEGIN\nFIRST, S6\n"
             "*NODE\n1000, 0.3, 0., 0.\n*RIGID BODY, NSET=XRIGHT, REF NODE=1000\n"
             "*TIE, NAME=SEAM\nEND, BEGIN\n");
    EXPECT_EQ(model.mesh.nodeNumbers, plain.mesh.nodeNumbers);
    EXPECT_EQ(model.mesh.positions, plain.mesh.positions);
    EXPECT_EQ(model.K.values, plain.K.values);
    EXPECT_EQ(model.m.values, plain.m.values);
    EXPECT_EQ(model.constraints.columns, plain.constraints.columns);
    EXPECT_EQ(model.constraints.coefficients, plain.constraints.coefficients);
    EXPECT_EQ(model.mesh.nodeSets.at("B-1.LEFT"), plain.mesh.nodeSets.at("XLEFT"));
    EXPECT_EQ(model.mesh.nodeSets.at("MIXED"), (std::vector<int>{0, 1, 45}));
    const int one = model.mesh.nodeSets.at("A-1.ONE").at(0);
    EXPECT_EQ(model.mesh.nodeSets.at("POINTED"), (std::vector<int>{one, 46}));
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("instance B-1 have their number + 45")));
}

TEST_F(ConstraintsTest, ATurnedInstanceHasTheFrequenciesOfItsPart) {
    const std::string wood =
        "*MATERIAL, NAME=WOOD\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
        "1e10, 1e9, 5e8, 0.3, 0.3, 0.3, 7e8, 6e8,\n5e8\n*DENSITY\n700.\n"
        "*MATERIAL, NAME=IRON\n*ELASTIC\n2e11, 0.3\n*DENSITY\n7800.\n";
    for (const char* axes : {"SYSTEM=RECTANGULAR\n1.,0.3,0.,0.,1.,0.\n3, 20.\n",
                             "SYSTEM=CYLINDRICAL\n0.,-0.1,0.,0.1,-0.1,0.\n"}) {
        const std::string part = Brick().meshText() + "*ORIENTATION, NAME=GRAIN, " + axes +
                                 "*SOLID SECTION, ELSET=BODY, MATERIAL=WOOD, ORIENTATION=GRAIN\n"
                                 "*NODE\n901,0.2,0.1,0.\n902,0.2,0.2,0.\n"
                                 "*ELEMENT, TYPE=B31, ELSET=ARM\n901,9,901\n902,901,902\n"
                                 "*BEAM SECTION, ELSET=ARM, MATERIAL=IRON, SECTION=RECT\n"
                                 "0.02,0.01\n0.,0.,1.\n";
        const auto plain = testing::calcFreeFrequencies(read(part + wood), 16);
        const FeModel model = read("*PART, NAME=P\n" + part +
                                   "*END PART\n*ASSEMBLY, NAME=A\n"
                                   "*INSTANCE, NAME=P-1, PART=P\n1., 2., 3.\n"
                                   "0., 1., 0., 1., 3., 0.5, 70.\n*END INSTANCE\n*END ASSEMBLY\n" +
                                   wood);
        const auto turned = testing::calcFreeFrequencies(model, 16);
        for (size_t i = 9; i < plain.size(); ++i)  // the arm rotates about its node
            EXPECT_NEAR(turned[i], plain[i], 1e-8 * plain[i]) << "mode " << i + 1;
        EXPECT_EQ(model.mesh.nodeSets.count("LEFT"), 1u);  // of one instance, unchanged
    }
}

TEST_F(ConstraintsTest, NodesOfASystemStandInTheAxesOfTheDeck) {
    const auto positionsOf = [&](const std::string& cards) {
        Brick brick;
        std::string text = brick.text();
        text.insert(0, cards);
        return read(text).mesh;
    };
    const auto expectAt = [](const Mesh& mesh, const std::array<double, 3>& expected) {
        const auto x = mesh.position(mesh.indexOf(1));
        for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(x[a], expected[a], 1e-14) << a;
    };
    // Node 1 of the brick, without a system.
    const auto x = positionsOf("").position(0);
    // x along the deck's y, y along its −x.
    expectAt(positionsOf("*SYSTEM\n1., 2., 3., 1., 5., 3.\n0., 2., 3.\n"),
             {1 - x[1], 2 + x[0], 3 + x[2]});
    expectAt(positionsOf("*SYSTEM\n1., 2., 3., 1., 5., 3.\n"), {1 - x[1], 2 + x[0], 3 + x[2]});
    expectAt(positionsOf("*SYSTEM\n1., 2., 3.\n"), {1 + x[0], 2 + x[1], 3 + x[2]});
    // z along the deck's −z.
    expectAt(positionsOf("*SYSTEM\n0., 0., 0., 1., 0., 0.\n0., -1., 0.\n"), {x[0], -x[1], -x[2]});
    // *SYSTEM without data ends it.
    expectAt(positionsOf("*SYSTEM\n1., 2., 3.\n*SYSTEM\n"), x);
    EXPECT_THAT(errorOf("*SYSTEM\n1., 2., 3., 1., 2., 3.\n" + Brick().text()),
                HasSubstr("deck.inp:1: points a and b of *SYSTEM are the same"));
    EXPECT_THAT(errorOf("*SYSTEM\n0., 0., 0., 1., 0., 0.\n2., 0., 0.\n" + Brick().text()),
                HasSubstr("are on a line"));
    EXPECT_THAT(errorOf("*SYSTEM\n0., 0., 0., 1., 0., 1.\n" + Brick().text()),
                HasSubstr("without its point c"));
}

TEST_F(ConstraintsTest, NodesMayHaveCylindricalCoordinates) {
    std::string text = Brick().text();
    const FeModel plain = read(text);
    std::ostringstream nodes;
    nodes.precision(17);
    nodes << "*SYSTEM\n0., 0., 1.\n*NODE, NSET=NALL, SYSTEM=C\n";
    for (int k = 0; k < plain.mesh.numNodes(); ++k) {
        const auto x = plain.mesh.position(k);
        nodes << plain.mesh.nodeNumbers[size_t(k)] << ", " << std::hypot(x[0], x[1]) << ", "
              << std::atan2(x[1], x[0]) * 180 / M_PI << ", " << x[2] - 1 << "\n";
    }
    const size_t begin = text.find("*NODE"), end = text.find('*', begin + 1);
    text.replace(begin, end - begin, nodes.str());
    const FeModel turned = read(text);
    ASSERT_EQ(turned.mesh.numNodes(), plain.mesh.numNodes());
    for (size_t k = 0; k < plain.mesh.positions.size(); ++k)
        EXPECT_NEAR(turned.mesh.positions[k], plain.mesh.positions[k], 1e-13);
}

TEST_F(ConstraintsTest, AssembliesThatCannotBeAreRefusedWithTheirLine) {
    const auto [part, material] = dividePart(Brick());
    const std::string text = "*PART, NAME=P\n" + part + "*END PART\n*ASSEMBLY, NAME=A\n";
    const auto refusal = [&, material = material](const std::string& cards) {
        const std::string error = errorOf(text + cards + "*END ASSEMBLY\n" + material);
        EXPECT_THAT(error, ContainsRegex("deck.inp:[0-9]+: "));
        return error;
    };
    EXPECT_THAT(refusal("*INSTANCE, NAME=I, PART=Q\n*END INSTANCE\n"), HasSubstr("no *PART Q"));
    EXPECT_THAT(refusal("*INSTANCE, NAME=I, PART=P, LIBRARY=L\n"), HasSubstr("LIBRARY"));
    EXPECT_THAT(refusal("*INSTANCE, NAME=I, PART=P\n1., 2.\n"), HasSubstr("translation"));
    EXPECT_THAT(refusal("*INSTANCE, NAME=I, PART=P\n0,0,0\n1,1,1,1,1,1,90\n"),
                HasSubstr("are the same"));
    const std::string instance =
        "*INSTANCE, NAME=I, PART=P\n0,0,0\n0,0,0,1,1,1,90\n*END INSTANCE\n";
    EXPECT_THAT(refusal(instance + instance), HasSubstr("given twice"));
    EXPECT_THAT(refusal(instance + "*NSET, NSET=N, INSTANCE=J\n1\n"), HasSubstr("instance J"));
    EXPECT_THAT(refusal(instance + "*RIGID BODY, NSET=LEFT, REF NODE=RIGHT\n"),
                HasSubstr("must have one"));
    EXPECT_THAT(errorOf("*PART, NAME=P\n" + part +
                        "*EQUATION\n1\n1,1,1.\n*END PART\n"
                        "*ASSEMBLY, NAME=A\n" +
                        instance + "*END ASSEMBLY\n" + material),
                HasSubstr("write it in the assembly"));
}

TEST_F(ConstraintsTest, LoosePiecesUnderATieAreConnected) {
    EXPECT_THAT(errorOf(twoBricks("C3D8", "C3D8")), HasSubstr("2 pieces"));
    EXPECT_EQ(
        errorOf(twoBricks("C3D8", "C3D8") + facingSurfaces() + "*TIE, NAME=SEAM\nEND, BEGIN\n"),
        "accepted");
}

TEST_F(ConstraintsTest, ANodeOfNoElementMustBeHeldByWhatItIsTiedTo) {
    EXPECT_THAT(errorOf(Brick().text() + "*NODE\n500,1,0,0\n501,1,0,0\n"
                                         "*EQUATION\n2\n500,1,1.,501,1,-1.\n2\n"
                                         "500,2,1.,501,2,-1.\n2\n500,3,1.,501,3,-1.\n"),
                AllOf(HasSubstr("node 500"), HasSubstr("leaves it free")));
}

/** Face shape functions: 1 at their own node, 0 at the others, sum 1, and their derivatives. **/
TEST(FaceShapes, InterpolateBetweenTheNodes) {
    for (const int numNodes : {3, 4, 6, 8}) {
        for (int node = 0; node < numNodes; ++node) {
            const auto at = getFaceNodeCoordinates(numNodes, node);
            EXPECT_TRUE(isOnFace(numNodes, at[0], at[1]));
            const FaceShapes shapes = calcFaceShapes(numNodes, at[0], at[1]);
            for (int k = 0; k < numNodes; ++k)
                EXPECT_NEAR(shapes.N[size_t(k)], k == node ? 1 : 0, 1e-15) << numNodes;
        }
        const double xi = 0.23, eta = 0.31, h = 1e-4;
        EXPECT_FALSE(isOnFace(numNodes, xi, 1.01));
        EXPECT_FALSE(isOnFace(numNodes, 1.01, eta));
        EXPECT_EQ(isOnFace(numNodes, 0.7, 0.7), numNodes % 4 == 0);
        const FaceShapes here = calcFaceShapes(numNodes, xi, eta);
        double sum = 0;
        for (size_t k = 0; k < size_t(numNodes); ++k) {
            sum += here.N[k];
            // At most quadratic in ξ and η: central differences are exact.
            EXPECT_NEAR(here.dXi[k],
                        (calcFaceShapes(numNodes, xi + h, eta).N[k] -
                         calcFaceShapes(numNodes, xi - h, eta).N[k]) /
                            (2 * h),
                        1e-11);
            EXPECT_NEAR(here.dEta[k],
                        (calcFaceShapes(numNodes, xi, eta + h).N[k] -
                         calcFaceShapes(numNodes, xi, eta - h).N[k]) /
                            (2 * h),
                        1e-11);
        }
        EXPECT_NEAR(sum, 1, 1e-15);
    }
}

/** Corners as in CalculiX's manual for S1, S2, …; mid-edge nodes as on the skin of the element. **/
TEST(FaceShapes, FacesOfSolidsAreThoseOfCalculixsManual) {
    struct Solid {
        ElementType linear, quadratic;
        int numCorners, numNodes;
        std::vector<std::set<int>> faces;
    };
    const std::vector<Solid> solids = {
        {ElementType::Tet4,
         ElementType::Tet10,
         4,
         10,
         {{1, 2, 3}, {1, 4, 2}, {2, 4, 3}, {3, 4, 1}}},
        {ElementType::Wedge6,
         ElementType::Wedge15,
         6,
         15,
         {{1, 2, 3}, {4, 5, 6}, {1, 2, 5, 4}, {2, 3, 6, 5}, {3, 1, 4, 6}}},
        {ElementType::Hex8,
         ElementType::Hex20,
         8,
         20,
         {{1, 2, 3, 4}, {5, 8, 7, 6}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 8, 4}, {4, 8, 5, 1}}},
    };
    for (const Solid& solid : solids) {
        Mesh mesh;
        mesh.elements.push_back({solid.quadratic, {}});
        for (int node = 0; node < solid.numNodes; ++node) {
            mesh.nodeNumbers.push_back(node + 1);
            mesh.elements[0].nodes.push_back(node);
        }
        mesh.positions.assign(3 * size_t(solid.numNodes), 0);
        std::map<std::set<int>, int> middles;  // of the edge between two corners
        for (const MeshFace& face : extractBoundaryFaces(mesh))
            for (int k = 0; k < face.numCorners(); ++k)
                middles[{face.corners[size_t(k)],
                         face.corners[size_t((k + 1) % face.numCorners())]}] =
                    face.middles[size_t(k)];
        const int numFaces = int(solid.faces.size());
        for (int f = 1; f <= numFaces; ++f) {
            const std::vector<int> linear = getFaceNodes(solid.linear, f);
            const std::vector<int> quadratic = getFaceNodes(solid.quadratic, f);
            std::set<int> numbers;
            for (const int node : linear) numbers.insert(node + 1);
            EXPECT_EQ(numbers, solid.faces[size_t(f - 1)]);
            const size_t n = linear.size();
            ASSERT_EQ(quadratic.size(), 2 * n);
            for (size_t k = 0; k < n; ++k) {
                EXPECT_EQ(quadratic[k], linear[k]);
                EXPECT_EQ(quadratic[n + k], middles.at({linear[k], linear[(k + 1) % n]}));
            }
        }
        EXPECT_TRUE(getFaceNodes(solid.linear, 0).empty());
        EXPECT_TRUE(getFaceNodes(solid.quadratic, numFaces + 1).empty());
    }
}

}  // namespace
}  // namespace simflex
