/** @file
Parts that a model gives by their decks: reduced as `simflex reduce` does, kept by content. **/

#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "BuiltModel.h"
#include "simflex/cli/model/PartCache.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex::test {
namespace {

using namespace SimTK;
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
        options.progress = [this](const std::string& phase, double) {
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
    makePart(plain + ", keep: {lowest: 1}");  // the choice of modes is no part of it
    EXPECT_FALSE(wasReduced());
    brick.rho *= 2;
    testing::writeText(folder / "material.inc", brick.materialText());
    makePart(plain);
    EXPECT_TRUE(wasReduced());
    testing::writeText(folder / "brick.inp",
                       brick.meshText() + "** a comment\n*INCLUDE, INPUT=material.inc\n");
    makePart(plain);
    EXPECT_TRUE(wasReduced());
    EXPECT_EQ(listCache().size(), 6u);
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

TEST_F(PartCacheTest, AFolderThatCannotBeWrittenIsNotedAndDoneWithout) {
    testing::writeText(folder / "cache", "a file");
    const auto part = makePart("deck: brick.inp, interfaces: {left: LEFT}, modes: 8");
    EXPECT_EQ(part->numModes, 2);
    EXPECT_THAT(notes, Contains(HasSubstr("not kept in the cache")));
}

TEST_F(PartCacheTest, ReductionStopsOnRequestAndItsErrorsNameTheFilesLine) {
    options.progress = [](const std::string&, double) { return false; };
    EXPECT_THROW(makePart(keys), Cancelled);
    EXPECT_FALSE(std::filesystem::exists(options.cacheFolder));
    options.progress = {};
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: brick.inp, interfaces: {left: LEFTT}}\n"),
                AllOf(HasSubstr("model.yaml:3:"), HasSubstr("LEFTT"), HasSubstr("LEFT")));
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: none.inp}\n"),
                AllOf(HasSubstr("model.yaml:3:"), HasSubstr("none.inp")));
    EXPECT_THAT(
        messageOf("parts:\n  beam: {deck: brick.inp, modes: 8, units: mm-t-s, stiffening: true}\n"),
        HasSubstr("CalculiX deck"));
    EXPECT_THAT(messageOf("parts:\n  beam: {deck: brick.inp, units: mm-t-x}\n"),
                HasSubstr("mm-t-s"));
    EXPECT_THAT(messageOf("parts:\n  beam: {file: none.h5}\n"), HasSubstr("no part file"));
    EXPECT_THAT(messageOf("parts:\n  beam: {file: brick.inp}\n"), HasSubstr("model.yaml:3:"));
}

TEST_F(PartCacheTest, GeometryScriptsThatCanStartProgramsAreRefused) {
    testing::writeText(folder / "inner.geo", "SystemCall \"touch ran\";\n");
    testing::writeText(folder / "outer.geo", "Include \"inner.geo\";\n");
    for (const char* file : {"inner.geo", "outer.geo"}) {
        EXPECT_THAT(
            messageOf(std::string("parts:\n  beam: {geometry: ") + file + ", material: steel}\n"),
            AllOf(HasSubstr("SystemCall"), HasSubstr("inner.geo")))
            << file;
    }
    EXPECT_FALSE(std::filesystem::exists("ran"));
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
