#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::Brick;
using ::testing::HasSubstr;
using testing::TestFolder;

class ReductionTest : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        TestFolder folder;
        testing::writeText(folder / "brick.inp", Brick().text());
        model = new FeModel(readCalculixDeck(folder / "brick.inp"));
    }
    static void TearDownTestSuite() { delete model; }

    static ReductionOptions twoEnds(int numModes) {
        ReductionOptions options;
        options.name = "brick";
        options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
        options.numModes = numModes;
        return options;
    }

    static std::string errorOf(const ReductionOptions& options, const FeModel& of) {
        try {
            reduce(of, options);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }
    static std::string errorOf(const ReductionOptions& options) { return errorOf(options, *model); }

    static FeModel* model;
};

FeModel* ReductionTest::model = nullptr;

TEST_F(ReductionTest, ModeCountIsCraigBamptonCountLessSix) {
    const ReducedBody body = reduce(*model, twoEnds(20));
    EXPECT_EQ(body.numModes, 14);
    EXPECT_EQ(body.interfaces.size(), 2u);
    EXPECT_EQ(body.name, "brick");
    EXPECT_EQ(body.getInterface("left").nodes.size(), 9u);
}

TEST_F(ReductionTest, WantOfMemoryIsSeenBeforeFactoring) {
    ReductionOptions options = twoEnds(20);
    options.memoryLimit = 1e5;
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("memory"), HasSubstr("free degrees of freedom"),
                                        HasSubstr("20 modes"), HasSubstr("coarser mesh")));
    options.memoryLimit = 1e9;
    EXPECT_EQ(errorOf(options), "accepted");
}

TEST_F(ReductionTest, ConstraintModesAloneAreEnough) {
    EXPECT_EQ(reduce(*model, twoEnds(12)).numModes, 6);
}

TEST_F(ReductionTest, WithoutInterfacesModesAreFreeFree) {
    ReductionOptions options;
    options.numModes = 16;
    const ReducedBody free = reduce(*model, options);
    EXPECT_EQ(free.numModes, 10);
    EXPECT_TRUE(free.interfaces.empty());
    // Rigid end faces only stiffen the part.
    const ReducedBody tied = reduce(*model, twoEnds(60));
    for (int i = 0; i < free.numModes; ++i)
        EXPECT_LT(free.omegaSquared[i], tied.omegaSquared[i] * (1 + 1e-9));
}

TEST_F(ReductionTest, MasterIsTheMeanOfItsNodesUnlessGiven) {
    ReductionOptions options = twoEnds(20);
    options.interfaces[1].master = {0.25, 0.01, 0};
    const ReducedBody body = reduce(*model, options);
    const auto left = body.getInterface("left").position,
               right = body.getInterface("right").position;
    EXPECT_NEAR(left[0] + body.centerOfMass[0], 0, 1e-12);
    EXPECT_NEAR(right[0] + body.centerOfMass[0], 0.25, 1e-12);
    EXPECT_NEAR(right[1], 0.01, 1e-12);
}

TEST_F(ReductionTest, MoreModesNeverRaiseAFrequency) {
    const ReducedBody few = reduce(*model, twoEnds(18)), many = reduce(*model, twoEnds(40));
    for (int i = 0; i < few.numModes; ++i)
        EXPECT_LE(many.omegaSquared[i], few.omegaSquared[i] * (1 + 1e-9));
}

TEST_F(ReductionTest, SameDeckGivesTheSameFileBitForBit) {
    TestFolder folder;
    const std::string deck = testing::meshExamplePart(folder, "crank", "C3D8R", 0.003);
    ReductionOptions options;
    options.interfaces = {{"shaft", "SHAFT"}, {"pin", "PIN"}};
    for (const char* name : {"a.h5", "b.h5"})
        writeReducedBody(folder / name, reduce(readCalculixDeck(deck), options));
    EXPECT_TRUE(testing::readText(folder / "a.h5") == testing::readText(folder / "b.h5"));
}

TEST_F(ReductionTest, TimingsCoverTheWork) {
    ReductionTimings timings;
    reduce(*model, twoEnds(30), {}, &timings);
    EXPECT_EQ(timings.numDofs, model->K.size);
    EXPECT_GT(timings.numFactorEntries, 0);
    EXPECT_GE(timings.total, timings.factor + timings.constraintModes + timings.normalModes +
                                 timings.orthonormalize + timings.invariants);
}

TEST_F(ReductionTest, ProgressCanStopTheWork) {
    EXPECT_THROW(reduce(*model, twoEnds(30),
                        [](const std::string& phase, double) { return phase != "normal modes"; }),
                 Cancelled);
}

TEST_F(ReductionTest, AnUnknownNodeSetIsNamedWithThoseThatExist) {
    ReductionOptions options = twoEnds(20);
    options.interfaces[0].nodes = "SHAFT";
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("'brick'"), HasSubstr("'left'"),
                                        HasSubstr("'SHAFT'"), HasSubstr("RIGHT (9)")));
}

TEST_F(ReductionTest, AnInterfaceNeedsThreeNodesThatAreNotCollinear) {
    ReductionOptions options = twoEnds(20);
    options.interfaces[0].nodes = "ONE";
    EXPECT_THAT(errorOf(options),
                AllOf(HasSubstr("'left'"), HasSubstr("only 1 node"), HasSubstr("three nodes")));
    options.interfaces[0].nodes = "TWO";
    EXPECT_THAT(errorOf(options), HasSubstr("only 2 nodes"));
    options.interfaces[0].nodes = "LINE";
    EXPECT_THAT(errorOf(options), HasSubstr("collinear"));
}

TEST_F(ReductionTest, InterfacesMustNotOverlapOrShareAName) {
    ReductionOptions options = twoEnds(20);
    options.interfaces[1].nodes = "CORNERS";
    EXPECT_THAT(errorOf(options),
                AllOf(HasSubstr("'left'"), HasSubstr("'right'"), HasSubstr("overlap")));
    options = twoEnds(20);
    options.interfaces[1].name = "left";
    EXPECT_THAT(errorOf(options), HasSubstr("two interfaces"));
}

TEST_F(ReductionTest, TooFewAndTooManyModesSayWhatIsPossible) {
    EXPECT_THAT(errorOf(twoEnds(11)), AllOf(HasSubstr("too few"), HasSubstr("at least 12")));
    EXPECT_THAT(errorOf(twoEnds(1000)), AllOf(HasSubstr("too many"), HasSubstr("at most 201")));
    ReductionOptions free;
    free.numModes = 6;
    EXPECT_THAT(errorOf(free), HasSubstr("at least 7"));
    free.numModes = 100000;
    EXPECT_THAT(errorOf(free), HasSubstr("243"));
}

TEST_F(ReductionTest, MoreModesThanAOnePointMassHasAreRefused) {
    TestFolder folder;
    Brick brick;
    brick.type = "C3D8R";
    testing::writeText(folder / "brick.inp", brick.text());
    const FeModel onePoint = readCalculixDeck(folder / "brick.inp");
    EXPECT_THAT(errorOf(twoEnds(150), onePoint),
                AllOf(HasSubstr("modes are asked for"), HasSubstr("has only")));
}

TEST_F(ReductionTest, NotANumberIsRefused) {
    FeModel broken = *model;
    broken.K.values[11] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(errorOf(twoEnds(20), broken), HasSubstr("stiffness matrix has nan"));
}

/** Returns two bricks end to end that share `shared` nodes: one forms a ball joint, two a
hinge. **/
FeModel readHinged(int shared) {
    Brick brick;
    brick.elements = {2, 1, 1};
    std::string text = brick.meshText();
    Brick second = brick;
    std::string other = second.meshText(101, 101);
    // Place the second brick behind the first by shifting x in its node lines.
    std::string moved;
    std::istringstream lines(other);
    bool inNodes = false;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] == '*') {
            inNodes = line == "*NODE";
            moved += (line.compare(0, 5, "*NSET") == 0
                          ? "*NSET, NSET=SECOND_" + line.substr(line.find('=') + 1)
                          : line) +
                     "\n";
            continue;
        }
        if (inNodes) {
            const size_t comma = line.find(',') + 1, end = line.find(',', comma);
            line = line.substr(0, comma) +
                   std::to_string(std::stod(line.substr(comma)) + brick.size[0]) + line.substr(end);
        } else {
            // Node 101 + 3k of the second brick's left face is node 3 + 3k of the first's right
            // face.
            for (int k = 0; k < shared; ++k) {
                const std::string from = std::to_string(101 + 3 * k),
                                  to = std::to_string(3 + 3 * k);
                const size_t first = line.find(',');
                for (size_t at = line.find("," + from, first); at != std::string::npos;
                     at = line.find("," + from, at + 1))
                    line.replace(at + 1, from.size(), to);
            }
        }
        moved += line + "\n";
    }
    TestFolder folder;
    testing::writeText(folder / "hinged.inp", text + moved + brick.materialText());
    return readCalculixDeck(folder / "hinged.inp");
}

TEST_F(ReductionTest, AHingeInsideThePartIsRefused) {
    for (const int shared : {1, 2}) {
        const FeModel hinged = readHinged(shared);
        ReductionOptions both;
        both.interfaces = {{"a", "LEFT"}, {"b", "SECOND_RIGHT"}};
        both.numModes = 15;
        EXPECT_THAT(errorOf(both, hinged), HasSubstr(std::to_string(shared == 1 ? 9 : 7) +
                                                     " rigid modes; it must have 6"));
        ReductionOptions one = both;
        one.interfaces.pop_back();
        // Found by the factorization or by a mode, as round-off decides.
        EXPECT_THAT(errorOf(one, hinged), HasSubstr("singular beyond the six rigid motions"));
        ReductionOptions none = both;
        none.interfaces.clear();
        EXPECT_THAT(errorOf(none, hinged), HasSubstr("singular beyond the six rigid motions"));
    }
}

TEST_F(ReductionTest, AHingeIsNamedHoweverManyModesAreAskedFor) {
    // Two cubes that share an edge, with so few nodes that round-off hides the singularity of K.
    std::string text = "*NODE\n";
    int number = 0;
    for (const char* place : {"0,0,0", "1,0,0", "1,1,0", "0,1,0", "0,0,1", "1,0,1", "1,1,1",
                              "0,1,1", "2,1,0", "2,2,0", "1,2,0", "2,1,1", "2,2,1", "1,2,1"})
        text += std::to_string(++number) + "," + place + "\n";
    text += "*ELEMENT, TYPE=C3D8, ELSET=BODY\n1,1,2,3,4,5,6,7,8\n2,3,9,10,11,7,12,13,14\n" +
            Brick().materialText();
    TestFolder folder;
    testing::writeText(folder / "cubes.inp", text);
    const FeModel cubes = readCalculixDeck(folder / "cubes.inp");
    for (const int numModes : {10, 20, 30}) {
        ReductionOptions options;
        options.numModes = numModes;
        EXPECT_THAT(errorOf(options, cubes), HasSubstr("singular beyond the six rigid motions"))
            << numModes;
    }
}

// The stiffest shapes of the basis lie 13 or more decades above the slowest mode. For a blade of
// half a millimetre, the 14 digits of K written by CalculiX leave at most 1e-4.
TEST_F(ReductionTest, ThinBladesHaveSixRigidMotionsAndCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    for (const double thickness : {1e-3, 6e-4}) {
        Brick blade;
        blade.size = {1, 0.02, thickness};
        blade.elements = {60, 2, 1};
        blade.type = "C3D20R";
        TestFolder folder;
        testing::writeText(folder / "blade.inp", blade.text());
        const ReducedBody body = reduce(readCalculixDeck(folder / "blade.inp"), twoEnds(30));
        const std::vector<double> expected = testing::calcCalculixFrequencies(
            folder, folder / "blade.inp", {{"LEFT", {0, 0, 0}}, {"RIGHT", {1, 0, 0}}}, 10);
        for (size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(std::sqrt(body.omegaSquared[k]) / (2 * M_PI), expected[6 + k],
                        1e-4 * expected[6 + k])
                << "mode " << k + 1 << ", " << thickness << " m";
        EXPECT_LT(body.report->massOrthogonality, 1e-9);
    }
}

/** A square bar has equal bending modes in two planes. **/
TEST(Reduction, KeepsModesOfEqualFrequencyTogether) {
    const testing::TestFolder folder;
    Brick bar;
    bar.size = {0.4, 0.02, 0.02};
    bar.elements = {12, 2, 2};
    bar.type = "C3D20R";
    testing::writeText(folder / "bar.inp", bar.text());
    const FeModel model = readCalculixDeck(folder / "bar.inp");
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    for (const auto& [wanted, kept] : {std::pair(1, 2), std::pair(2, 2), std::pair(3, 4)}) {
        options.numModes = 12 + wanted;
        const ReducedBody body = reduce(model, options);
        EXPECT_EQ(body.numModes, 6 + kept);
        EXPECT_EQ(describeEqualModes(body, options).empty(), wanted == kept);
    }
}

}  // namespace
}  // namespace simflex
