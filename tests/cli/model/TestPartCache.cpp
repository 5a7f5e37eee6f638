/** @file
Parts given by their decks: reduced as by `simflex reduce`, cached by content. **/

#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "BuiltModel.h"
#include "simflex/base/Sandbox.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/model/parts/FileLock.h"
#include "simflex/model/parts/PartCache.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using namespace model;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class PartCacheTest : public BuiltModelTest {
protected:
    void SetUp() override {
        BuiltModelTest::SetUp();
        brick.elements = {4, 1, 1};
        brick.type = "C3D20";
        testing::writeText(folder / "brick.inp", brick.text());
        options.listener.progress = [this](const std::string& phase, double, const auto&) {
            phases.push_back(phase);
            return true;
        };
    }

    std::shared_ptr<const ReducedBody> makePart(const std::string& text) {
        notes.clear();
        phases.clear();
        const auto model = build("parts: {beam: {" + text + "}}\nbodies: {a: {part: beam}}\n");
        return model->getBodies()[0].flexible->getPartHandle();
    }
    FeModel readDeck(const std::string& name) const {
        SourceOptions source;
        source.path = folder / name;
        return readModelSource(source);
    }
    bool wasReduced() const { return !phases.empty(); }
    std::vector<std::string> listCache() const { return testing::listFiles(options.cacheFolder); }

    testing::Brick brick;
    std::vector<std::string> phases;
    const std::string keys =
        "deck: brick.inp, interfaces: {left: LEFT, right: {nodes: RIGHT, tie: distributing, "
        "master: [0.21, 0, 0]}}, modes: 20, load_points: ['plane:0.1,0,0,1,0,0', {nodes: "
        "'plane:0.05,0,0,1,0,0', axes: z}], "
        "stress: [ALL]";
};

TEST_F(PartCacheTest, ADeckIsReducedAsTheProgramDoesAndTakenFromTheCacheAfterwards) {
    const auto part = makePart(keys);
    EXPECT_TRUE(wasReduced());
    EXPECT_THAT(phases[0], HasSubstr("beam: "));
    SourceOptions source;
    source.path = folder / "brick.inp";
    ReductionOptions reduction;
    reduction.interfaces = {{"left", "LEFT"}, {"right", "RIGHT", TieType::Distributing}};
    reduction.interfaces[1].master = {0.21, 0, 0};
    reduction.loadPoints = {{"plane:0.1,0,0,1,0,0"}, {"plane:0.05,0,0,1,0,0", "z"}};
    reduction.numModes = 20;
    reduction.stress.emplace();
    reduction.stress->nodes = StressOptions::Nodes::Sets;
    reduction.stress->sets = {"ALL"};
    const ReducedBody direct = reduce(readModelSource(source), reduction);
    EXPECT_EQ(part->omegaSquared, direct.omegaSquared);
    EXPECT_EQ(part->Phi, direct.Phi);
    EXPECT_EQ(part->modalStress->stress, direct.modalStress->stress);
    EXPECT_EQ(part->name, "beam");

    const auto again = makePart(keys);
    EXPECT_FALSE(wasReduced());
    EXPECT_THAT(notes, Contains(HasSubstr("'beam' is taken from the cache")));
    EXPECT_EQ(again->omegaSquared, part->omegaSquared);
    EXPECT_EQ(again->Phi, part->Phi);
    EXPECT_EQ(again->I2, part->I2);
    EXPECT_EQ(listCache().size(), 1u);
}

TEST_F(PartCacheTest, AnyByteOfTheDeckOrOfWhatItIncludesAndAnyOptionMakesANewEntry) {
    testing::writeText(folder / "material.inc", brick.materialText());
    testing::writeText(folder / "brick.inp", brick.meshText() + "*INCLUDE, INPUT=material.inc\n");
    const std::string plain = "deck: brick.inp, interfaces: {left: LEFT}, modes: 8";
    makePart(plain);
    makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 9");
    EXPECT_TRUE(wasReduced());
    makePart("deck: brick.inp, interfaces: {link: LEFT}, modes: 8");
    EXPECT_TRUE(wasReduced());
    makePart("deck: brick.inp, interfaces: {left: {nodes: LEFT, tie: distributing}}, modes: 8");
    EXPECT_TRUE(wasReduced());
    for (const char* more :
         {"", ", inertia_relief: true", ", at_frequency: 900", ", at_frequency: [900, 1200]"}) {
        makePart(std::string("deck: brick.inp, interfaces: {left: LEFT}, modes: 30") + more);
        EXPECT_TRUE(wasReduced()) << more;
    }
    makePart(plain);
    makePart(plain + ", keep: {lowest: 1}");  // the mode selection is not part of it
    EXPECT_FALSE(wasReduced());
    brick.rho *= 2;
    testing::writeText(folder / "material.inc", brick.materialText());
    makePart(plain);
    EXPECT_TRUE(wasReduced());
    testing::writeText(folder / "brick.inp",
                       brick.meshText() + "** a comment\n*INCLUDE, INPUT=material.inc\n");
    makePart(plain);
    EXPECT_TRUE(wasReduced());
    EXPECT_EQ(listCache().size(), 10u);
}

TEST_F(PartCacheTest, DamagedEntriesAreMadeAnew) {
    const std::string plain = "deck: brick.inp, interfaces: {left: LEFT}, modes: 8";
    const auto part = makePart(plain);
    ASSERT_EQ(listCache().size(), 1u);
    const std::string entry = options.cacheFolder + "/" + listCache()[0];
    std::filesystem::resize_file(entry, std::filesystem::file_size(entry) / 2);
    const auto again = makePart(plain);
    EXPECT_TRUE(wasReduced());
    EXPECT_THAT(notes, Contains(HasSubstr("made anew")));
    EXPECT_EQ(again->omegaSquared, part->omegaSquared);
    makePart(plain);
    EXPECT_FALSE(wasReduced());
}

TEST_F(PartCacheTest, WhoNeedsAPartThatAnotherReducesWaitsForItAndTakesIt) {
    const std::string text =
        "simflex: 1\nparts: {beam: {" + keys + "}}\nbodies: {a: {part: beam}}\n";
    const std::string path = folder / "model.yaml";
    const auto make = [&](const ModelOptions& wishes) {
        const Model model(readModel({path, text, {}}), wishes);
        return model.getBodies()[0].flexible->getPartHandle();
    };
    std::set<std::string> phasesOfSecond;
    std::promise<void> isWaiting;
    ModelOptions second = options;
    second.listener.progress = [&](const std::string& phase, double, const auto&) {
        if (phasesOfSecond.insert(phase).second) isWaiting.set_value();
        return true;
    };
    std::shared_ptr<const ReducedBody> taken;
    std::thread other;
    options.listener.progress = [&](const std::string&, double, const auto&) {
        if (other.joinable()) return true;
        other = std::thread([&] { taken = make(second); });
        isWaiting.get_future().wait();
        return true;
    };
    const auto reduced = make(options);
    other.join();
    EXPECT_THAT(phasesOfSecond,
                ::testing::ElementsAre("waiting for another run that reduces part 'beam'"));
    EXPECT_EQ(taken->Phi, reduced->Phi);
    EXPECT_EQ(taken->omegaSquared, reduced->omegaSquared);
    EXPECT_EQ(listCache().size(), 1u);
}

TEST_F(PartCacheTest, WaitingCanBeStopped) {
    bool isTried = false;
    ModelOptions second = options;
    second.listener.progress = [&](const std::string& phase, double, const auto&) {
        EXPECT_THAT(phase, HasSubstr("waiting"));
        return false;
    };
    options.listener.progress = [&](const std::string&, double, const auto&) {
        if (isTried) return true;
        isTried = true;
        const std::string text = "simflex: 1\nparts: {beam: {" + keys + "}}\n";
        EXPECT_THROW(Model(readModel({folder / "model.yaml", text, {}}), second), Cancelled);
        return true;
    };
    makePart(keys);
    EXPECT_TRUE(isTried);
}

TEST_F(PartCacheTest, TheLockOfAKilledProcessIsFree) {
    const std::string path = folder / "part.lock";
    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        FileLock lock(path);
        const char state = lock.tryToHold() == FileLock::State::Held ? 'h' : '-';
        if (write(ready[1], &state, 1) == 1) pause();
        _exit(1);
    }
    char state = 0;
    ASSERT_EQ(::read(ready[0], &state, 1), 1);
    EXPECT_EQ(state, 'h');
    {
        FileLock lock(path);
        EXPECT_EQ(lock.tryToHold(), FileLock::State::Busy);
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        EXPECT_EQ(lock.tryToHold(), FileLock::State::Held);
        EXPECT_EQ(FileLock(path).tryToHold(), FileLock::State::Busy);
    }
    EXPECT_FALSE(std::filesystem::exists(path));
    EXPECT_EQ(FileLock(folder / "none/part.lock").tryToHold(), FileLock::State::Impossible);
    close(ready[0]);
    close(ready[1]);
}

TEST_F(PartCacheTest, EntriesAreListedAndRemovedButNotThoseBeingMade) {
    makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 8");
    makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 9");
    const PartCache cache(options.cacheFolder, {});
    const auto entries = cache.list();
    ASSERT_EQ(entries.size(), 2u);
    EXPECT_EQ(entries[0].part, "beam");
    EXPECT_GE(entries[0].used, entries[1].used);
    const std::string first = options.cacheFolder + "/" + entries[0].key;
    EXPECT_EQ(entries[0].size, std::filesystem::file_size(first + ".h5"));

    testing::writeText(options.cacheFolder + "/notes.txt", "of somebody else");
    testing::writeText(first + ".h5.part-1", "of a killed run");
    const std::string gone = options.cacheFolder + "/" + std::string(32, 'a');
    testing::writeText(gone + ".h5.part-2", "of a killed run");
    testing::writeText(gone + ".lock", "");
    {
        FileLock lock(first + ".lock");
        ASSERT_EQ(lock.tryToHold(), FileLock::State::Held);
        EXPECT_FALSE(cache.remove(entries[0].key));
        cache.removeLeftovers();
    }
    EXPECT_THAT(listCache(), ::testing::UnorderedElementsAre(entries[0].key + ".h5",
                                                             entries[0].key + ".h5.part-1",
                                                             entries[1].key + ".h5", "notes.txt"));
    EXPECT_TRUE(cache.remove(entries[0].key));
    EXPECT_THAT(listCache(), ::testing::UnorderedElementsAre(entries[1].key + ".h5", "notes.txt"));
    makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 9");
    EXPECT_TRUE(wasReduced());
}

TEST_F(PartCacheTest, AFolderThatCannotBeWrittenIsNotedAndDoneWithout) {
    testing::writeText(folder / "cache", "a file");
    const auto part = makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 8");
    EXPECT_EQ(part->numModes, 2);
    EXPECT_THAT(notes, Contains(HasSubstr("not kept in the cache")));
}

TEST_F(PartCacheTest, ReductionStopsOnRequestAndItsErrorsNameTheFilesLine) {
    options.listener.progress = [](const std::string&, double, const auto&) { return false; };
    EXPECT_THROW(makePart(keys), Cancelled);
    EXPECT_TRUE(listCache().empty());
    options.listener.progress = {};
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: brick.inp, interfaces: {left: LEFTT}}\n"),
                AllOf(HasSubstr("model.yaml:3:46: parts.beam.interfaces.left"),
                      HasSubstr("no node set 'LEFTT'"), HasSubstr("Did you mean 'LEFT'?")));
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: brick.inp, load_points: [{nodes: ONEE}]}\n"),
                HasSubstr("Did you mean 'ONE'?"));
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: none.inp}\n"),
                AllOf(HasSubstr("model.yaml:3:"), HasSubstr("none.inp")));
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: brick.inp, units: mm-t-x}\n"),
                HasSubstr("mm-t-s"));
    EXPECT_THAT(messageOf("parts:\n  beam: {file: none.h5}\n"), HasSubstr("no part file"));
    EXPECT_THAT(messageOf("parts:\n  beam: {file: brick.inp}\n"), HasSubstr("model.yaml:3:"));
}

TEST_F(PartCacheTest, APartOfMatricesIsThatOfItsDeck) {
    writeMatrixMarket(readDeck("brick.inp"), folder / "brick");
    const std::string more = ", interfaces: {left: LEFT, right: RIGHT}, modes: 20";
    const auto deck = makePart("deck: brick.inp" + more);
    const std::string matrices =
        "matrices: {stiffness: brick_K.mtx, mass: brick_M.mtx, nodes: brick_nodes.inp}" + more;
    const auto part = makePart(matrices);
    EXPECT_TRUE(wasReduced());
    ASSERT_EQ(part->numModes, deck->numModes);
    for (size_t i = 0; i < deck->omegaSquared.size(); ++i)
        EXPECT_NEAR(part->omegaSquared[i] / deck->omegaSquared[i], 1, 1e-9) << i;
    EXPECT_NEAR(part->mass, brick.mass(), 1e-9 * brick.mass());
    EXPECT_EQ(part->provenance.program, "Matrix Market");
    makePart(matrices);
    EXPECT_FALSE(wasReduced());
    // Every file counts as content.
    brick.rho *= 2;
    testing::writeText(folder / "heavy.inp", brick.text());
    writeMatrixMarket(readDeck("heavy.inp"), folder / "heavy");
    std::filesystem::rename(folder / "heavy_M.mtx", folder / "brick_M.mtx");
    EXPECT_NEAR(makePart(matrices)->mass, brick.mass(), 1e-9 * brick.mass());
    EXPECT_THAT(messageOf("parts:\n  beam: {matrices: {stiffness: brick_K.mtx, mass: none.mtx, "
                          "nodes: brick_nodes.inp}}\n"),
                AllOf(HasSubstr("model.yaml:3:"), HasSubstr("none.mtx")));
    EXPECT_THAT(messageOf("parts:\n  beam: {" + matrices + ", stress: skin}\n"),
                HasSubstr("it needs the elements of a deck or geometry"));
}

TEST_F(PartCacheTest, APartThatHangsOnOneNodeIsNamedWithWhatToLookFor) {
    // Two cubes that share a corner: the second can rotate about it.
    std::string nodes = "*NODE\n";
    for (int k = 0; k < 15; ++k) {
        const int corner = k < 8 ? k : k - 7;  // the eighth node belongs to both cubes
        const double shift = k < 8 ? 0 : 0.1;
        nodes += std::to_string(k + 1);
        for (int axis = 0; axis < 3; ++axis)
            nodes += "," + std::to_string(shift + (corner >> axis & 1 ? 0.1 : 0));
        nodes += "\n";
    }
    testing::writeText(folder / "two.inp",
                       nodes +
                           "*ELEMENT, TYPE=C3D8, ELSET=BODY\n1,1,2,4,3,5,6,8,7\n"
                           "2,8,9,11,10,12,13,15,14\n*NSET, NSET=LEFT\n1,3,5,7\n" +
                           brick.materialText());
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: two.inp, interfaces: {left: LEFT}, modes: 8}\n"),
                AllOf(HasSubstr("model.yaml:3:"), HasSubstr("'beam'"),
                      HasSubstr("look for pieces that hang on a single node or edge")));
    EXPECT_TRUE(listCache().empty());
}

TEST_F(PartCacheTest, GeometryScriptsStartNoProgramsUnlessTheyAreAllowedTo) {
    if (!findSandboxObstacle().empty()) GTEST_SKIP() << findSandboxObstacle();
    const std::string ran = folder / "ran";
    testing::writeText(folder / "inner.geo", "SystemCall \"touch '" + ran + "'\";\n");
    testing::writeText(folder / "outer.geo", "Include \"inner.geo\";\n");
    for (const char* file : {"inner.geo", "outer.geo"})
        EXPECT_THAT(
            messageOf(std::string("parts:\n  beam: {geometry: ") + file + ", material: steel}\n"),
            AllOf(HasSubstr("Could not find /bin/sh"), HasSubstr(file)));
    EXPECT_FALSE(std::filesystem::exists(ran));
    options.code.scripts = true;
    messageOf("parts:\n  beam: {geometry: outer.geo, material: steel}\n");
    EXPECT_TRUE(std::filesystem::exists(ran));
    EXPECT_THAT(messageOf("parts:\n  beam: {geometry: inner.geo}\n"),
                HasSubstr("needs its material"));
}

TEST_F(PartCacheTest, GeometryIsMeshedWithItsSettingsAndMayHaveStiffeningAndStress) {
    testing::writeText(folder / "block.geo", R"(
SetFactory("OpenCASCADE");
DefineConstant[ length = 0.1 ];
Box(1) = {0, 0, 0, length, 0.02, 0.01};
Physical Volume("BODY") = {1};
Physical Surface("LEFT") = {1};
)");
    const auto part = makePart(
        "geometry: block.geo, material: {youngs_modulus: 70e9, poissons_ratio: 0.3, "
        "density: 2700}, mesh_size: 0.02, order: 2, settings: {length: 0.2}, "
        "interfaces: {left: LEFT}, modes: 8, stress: skin");
    EXPECT_NEAR(part->mass, 2700 * 0.2 * 0.02 * 0.01, 1e-9);
    EXPECT_TRUE(part->modalStress.has_value());
    EXPECT_TRUE(folder.listTemporaryFiles().empty());
    makePart(
        "geometry: block.geo, material: {youngs_modulus: 70e9, poissons_ratio: 0.3, density: "
        "2700}, "
        "mesh_size: 0.02, order: 2, settings: {length: 0.2}, interfaces: {left: LEFT}, modes: 8, "
        "stress: skin");
    EXPECT_FALSE(wasReduced());
}

}  // namespace
}  // namespace simflex::test
