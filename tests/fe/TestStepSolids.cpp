/** @file
Assemblies in STEP files: names, positions and materials of their solids. **/

#include <gmock/gmock.h>

#include <cstdlib>
#include <regex>

#include "../../plugin/fe/StepSolids.h"
#include "fe/FreeModes.h"
#include "fe/MatrixFiles.h"
#include "simflex/fe/ModelSource.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kInch = 0.0254;

TEST(StepSolids, StandWhereTheirOccurrencesPutThem) {
    // One tetrahedron twice; the second relation is written in the opposite order.
    const auto solids =
        readStepSolids(SIMFLEX_SOURCE_DIR "/tests/fuzz/corpus/step_solids/two_occurrences.step");
    ASSERT_EQ(solids.size(), 2u);
    EXPECT_THAT(solids[0].names, ElementsAre("MACHINE", "LEFT", "PIN", "TIP"));
    EXPECT_THAT(solids[1].names, ElementsAre("MACHINE", "RIGHT", "PIN", "TIP"));
    const std::vector<Vec3d> own{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}},
        placed{{10, -2.5, 3}, {10, -2.5, 4}, {10, -4.5, 3}, {13, -2.5, 3}};
    const auto inMetres = [](std::vector<Vec3d> points) {
        for (Vec3d& point : points) point = scaled(point, kInch);
        return points;
    };
    EXPECT_TRUE(haveSameCorners(solids[0].corners, inMetres(own)));
    EXPECT_TRUE(haveSameCorners(solids[1].corners, inMetres(placed)));
    EXPECT_FALSE(haveSameCorners(solids[1].corners, inMetres(own)));
    EXPECT_THAT(matchSolids(solids, {inMetres(placed), inMetres(own)}), ElementsAre(1, 0));
    EXPECT_THAT(matchSolids(solids, {inMetres(placed)}), ElementsAre(-1, 0));
}

/** Three boxes of 100 × 20 × 10 mm: ROD, PIN at its end, FRAME apart. **/
class StepAssembly : public ::testing::Test {
protected:
    void SetUp() override {
        testing::writeText(folder / "boxes.geo",
                           "SetFactory(\"OpenCASCADE\");\n"
                           "Box(1) = {0, 0, 0, 100, 20, 10};\nBox(2) = {100, 0, 0, 100, 20, 10};\n"
                           "Box(3) = {300, 0, 0, 50, 20, 10};\n");
        ASSERT_EQ(run("gmsh -0 boxes.geo -o boxes.step"), 0);
        std::string text = testing::readText(folder / "boxes.step");
        int k = 1;
        for (const char* name : {"ROD", "Pin one", "FRAME"})
            text = std::regex_replace(
                text, std::regex("'Open CASCADE[^']*1\\." + std::to_string(k++) + "'"),
                std::string("'") + name + "'");
        write(text);
        options.path = folder / "boxes.step";
        options.gmsh.meshSize = 0.01;
    }

    void write(const std::string& text) { testing::writeText(folder / "boxes.step", text); }

    int run(const std::string& command) {
        return std::system(
            ("cd '" + folder.path() + "' && " + command + " >gmsh.log 2>&1").c_str());
    }

    std::string errorOf() {
        try {
            readModelSource(options);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    /** ∑ m x / ∑ m **/
    static double calcCentre(const FeModel& model) {
        double mass = 0, moment = 0;
        for (int column = 0; column < model.mesh.numNodes(); ++column)
            for (auto k = model.m.columnStarts[size_t(column)];
                 k < model.m.columnStarts[size_t(column) + 1]; ++k) {
                const int row = model.m.rows[size_t(k)];
                const double value = model.m.values[size_t(k)], x = model.mesh.position(row)[0],
                             y = model.mesh.position(column)[0];
                mass += row == column ? value : 2 * value;
                moment += row == column ? value * x : value * (x + y);
            }
        return moment / mass;
    }

    static constexpr double kVolume = 0.1 * 0.02 * 0.01;
    testing::TestFolder folder;
    SourceOptions options;
};

TEST_F(StepAssembly, SolidsThatTouchAreOnePartOfTheirMaterials) {
    options.gmsh.solids = {"ROD", "Pin one"};
    options.material = "steel; pin ONE=aluminium; FRAME=brass";
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), kVolume * (7850 + 2700), 1e-9);
    EXPECT_NEAR(calcCentre(model), (0.05 * 7850 + 0.15 * 2700) / (7850 + 2700), 1e-9);
    EXPECT_THAT(model.notes, Contains("PIN_ONE: material aluminium: E 7e+10 Pa, nu 0.33, rho 2700 "
                                      "kg/m³"));
    for (const int node : model.mesh.nodeSets.at("PIN_ONE"))
        EXPECT_GE(model.mesh.position(node)[0], 0.1 - 1e-9);
    // The same for a script whose volumes have these names.
    testing::writeText(folder / "named.geo",
                       "SetFactory(\"OpenCASCADE\");\n"
                       "Box(1) = {0, 0, 0, .1, .02, .01};\nBox(2) = {.1, 0, 0, .1, .02, .01};\n"
                       "BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }\n"
                       "Physical Volume(\"ROD\") = {1};\nPhysical Volume(\"Pin one\") = {2};\n"
                       "Physical Volume(\"FRAME\") = {};\n");
    SourceOptions script = options;
    script.path = folder / "named.geo";
    script.gmsh.solids.clear();
    script.material = "steel; PIN_ONE=aluminium";
    const FeModel named = readModelSource(script);
    EXPECT_NEAR(named.calcMass(), model.calcMass(), 1e-12);
    const auto own = testing::calcFreeFrequencies(model, 12),
               other = testing::calcFreeFrequencies(named, 12);
    EXPECT_LT(own[5], 1e-3 * own[6]);  // one piece
    for (size_t k = 6; k < own.size(); ++k) EXPECT_NEAR(own[k], other[k], 1e-3 * other[k]) << k;
}

TEST_F(StepAssembly, PartsAreChosenByNameAndShareAMapOfMaterials) {
    options.material = "ROD=steel; Pin one=aluminium; FRAME=brass";
    const std::map<std::string, double> masses = {
        {"ROD", kVolume * 7850}, {"Pin one", kVolume * 2700}, {"FRAME", kVolume / 2 * 8500}};
    for (const auto& [name, mass] : masses) {
        options.gmsh.solids = {name};
        EXPECT_NEAR(readModelSource(options).calcMass(), mass, 1e-9) << name;
    }
    options.gmsh.solids = {"ROD", "PIN TWO"};
    EXPECT_THAT(errorOf(), HasSubstr("boxes.step: it has no solid or physical group PIN_TWO; there "
                                     "are FRAME, "));
    options.gmsh.solids.clear();
    options.material = "ROD=steel; Pin one=aluminium";
    EXPECT_THAT(errorOf(), AllOf(HasSubstr("no material is given to the solid FRAME"),
                                 HasSubstr("give that of all others, too")));
}

TEST_F(StepAssembly, OccurrencesThatAreTurnedAndMovedAreFound) {
    // The third placement of the assembly is that of the pin: beside the rod, along y.
    std::string text = testing::readText(folder / "boxes.step");
    const size_t shape = text.find("SHAPE_REPRESENTATION('',(#11,#15,#19,#23)");
    ASSERT_NE(shape, std::string::npos);
    const auto replace = [&](const std::string& entity, const std::string& with) {
        const size_t at = text.find(entity);
        ASSERT_NE(at, std::string::npos) << entity;
        text.replace(at, text.find(';', at) - at, with);
    };
    replace("#20 = CARTESIAN_POINT", "#20 = CARTESIAN_POINT('',(20.,20.,-100.))");
    replace("#21 = DIRECTION", "#21 = DIRECTION('',(1.,0.,0.))");
    replace("#22 = DIRECTION", "#22 = DIRECTION('',(0.,0.,1.))");
    write(text);
    // Local x, y, z along z, −y, x: 100…200, 0…20, 0…10 come to z 0…100, y 20…0, x 20…30.
    options.gmsh.solids = {"Pin one"};
    options.material = "steel; ROD=aluminium";
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), kVolume * 7850, 1e-9);
    double low[3] = {1, 1, 1}, high[3] = {-1, -1, -1};
    for (int node = 0; node < model.mesh.numNodes(); ++node)
        for (size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], model.mesh.position(node)[a]);
            high[a] = std::max(high[a], model.mesh.position(node)[a]);
        }
    const double from[3] = {0.02, 0, 0}, to[3] = {0.03, 0.02, 0.1};
    for (size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(low[a], from[a], 1e-9);
        EXPECT_NEAR(high[a], to[a], 1e-9);
    }
}

TEST_F(StepAssembly, SolidsThatOverlapAreRefused) {
    std::string text = testing::readText(folder / "boxes.step");
    const size_t at = text.find("#20 = CARTESIAN_POINT");
    text.replace(at, text.find(';', at) - at, "#20 = CARTESIAN_POINT('',(-50.,0.,0.))");
    write(text);
    options.material = "steel";
    EXPECT_THAT(errorOf(), HasSubstr("its solids overlap: 3 of them make 4 pieces"));
}

TEST(NamedMaterials, AreGivenWithTheirNames) {
    const auto materials = parseMaterials("steel; PIN=brass ;HUB=E=1e9,nu=.3,rho=900;");
    ASSERT_EQ(materials.size(), 3u);
    EXPECT_EQ(materials[0].name, "");
    EXPECT_EQ(materials[1].name, "PIN");
    EXPECT_EQ(materials[1].material.rho, 8500);
    EXPECT_EQ(materials[2].material.E, 1e9);
    EXPECT_EQ(parseMaterials("E=1e9,nu=.3,rho=900")[0].name, "");
    EXPECT_THROW(parseMaterials("PIN=brass;pin=steel"), std::invalid_argument);
    EXPECT_THROW(parseMaterials("brass;steel"), std::invalid_argument);
    EXPECT_THROW(parseMaterials("PIN=brasss"), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
