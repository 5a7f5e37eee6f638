/** @file
Gmsh parts with a material, units, and the choice of a reader by the file's name. **/

#include <gmock/gmock.h>

#include <cmath>

#include "fe/MatrixFiles.h"
#include "fe/TestDecks.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/fe/ModelSource.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::Brick;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/** A box of 60 × 20 × 10 with its ends as physical groups, in whatever unit. **/
constexpr const char* kBox =
    "SetFactory(\"OpenCASCADE\");\n"
    "Box(1) = {0, 0, 0, 60*u, 20*u, 10*u};\n"
    "Physical Volume(\"BODY\") = {1};\n"
    "Physical Surface(\"left end\") = {1};\n"
    "Physical Surface(\"RIGHT\") = {2};\n";

class ModelSource : public ::testing::Test {
protected:
    std::string write(const std::string& name, const std::string& text) {
        testing::writeText(folder / name, text);
        return folder / name;
    }

    std::string errorOf(const SourceOptions& options) {
        std::string message = "accepted";
        try {
            readModelSource(options);
        } catch (const std::exception& error) {
            message = error.what();
        }
        EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
        return message;
    }

    SourceOptions box(const std::string& unit = "0.001") {
        SourceOptions options;
        options.path = write("box.geo", "u = " + unit + ";\n" + kBox);
        options.material = "aluminium";
        options.gmsh.meshSize = 0.01 * std::stod(unit) / 0.001;
        return options;
    }

    testing::TestFolder folder;
};

TEST_F(ModelSource, AGeometryAndAMaterialMakeAModel) {
    const FeModel model = readModelSource(box());
    EXPECT_NEAR(model.calcMass(), 0.06 * 0.02 * 0.01 * 2700, 1e-9);
    ASSERT_EQ(model.mesh.elements.size(), 1u);
    EXPECT_EQ(model.mesh.elements[0].type, ElementType::Tet10);
    EXPECT_EQ(model.mesh.nodeSets.count("RIGHT"), 1u);
    EXPECT_THAT(model.notes, Contains(HasSubstr("material aluminium: E 7e+10 Pa")));
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

TEST_F(ModelSource, LengthsInMillimetresAreConverted) {
    SourceOptions options = box("1");
    options.gmsh.lengthUnit = 1e-3;
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), 0.06 * 0.02 * 0.01 * 2700, 1e-9);
    for (const int node : model.mesh.nodeSets.at("RIGHT"))
        EXPECT_NEAR(model.mesh.position(node)[0], 0.06, 1e-9);
}

TEST_F(ModelSource, AMeshKeepsItsOrderAndACustomMaterial) {
    const std::string geo = write("box.geo", std::string("u = 0.001;\n") + kBox);
    ASSERT_EQ(std::system(("cd '" + folder.path() +
                           "' && gmsh -3 -clmax 0.01 box.geo -o box.msh >gmsh.log 2>&1")
                              .c_str()),
              0);
    SourceOptions options;
    options.path = folder / "box.msh";
    options.material = "E=3e9, nu=0.4, rho=1000";
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), 0.06 * 0.02 * 0.01 * 1000, 1e-9);
    EXPECT_EQ(model.mesh.elements[0].type, ElementType::Tet4);
    EXPECT_THAT(model.warnings, Contains(HasSubstr("order 2")));
}

TEST_F(ModelSource, AStepFileIsReadInItsOwnUnit) {
    write("box.geo", std::string("u = 1;\n") + kBox);
    ASSERT_EQ(
        std::system(
            ("cd '" + folder.path() + "' && gmsh -0 box.geo -o box.step >gmsh.log 2>&1").c_str()),
        0);
    SourceOptions options;
    options.path = folder / "box.step";
    options.material = "steel";
    options.gmsh.meshSize = 0.01;
    // OpenCASCADE writes millimetres.
    EXPECT_NEAR(readModelSource(options).calcMass(), 0.06 * 0.02 * 0.01 * 7850, 1e-9);
}

// Six bilinear patches without a solid, as many programs write IGES: 100 × 20 × 30 mm.
TEST_F(ModelSource, AnIgesFileOfSurfacesIsReadInItsOwnUnit) {
    const std::string text = testing::readText(SIMFLEX_SOURCE_DIR "/tests/data/box.iges");
    SourceOptions options;
    options.material = "steel";
    options.gmsh.meshSize = 0.01;
    for (const char* name : {"box.iges", "BOX.IGS"}) {
        options.path = write(name, text);
        EXPECT_NEAR(readModelSource(options).calcMass(), 0.1 * 0.02 * 0.03 * 7850, 1e-9);
    }
    std::string metres = text;  // the unit's flag and name
    metres.replace(metres.find("1.,2,2HMM,"), 10, "1.,6,1HM, ");
    options.path = write("metres.iges", metres);
    options.gmsh.meshSize = 10;
    EXPECT_NEAR(readModelSource(options).calcMass() / (100. * 20 * 30 * 7850), 1, 1e-9);
}

TEST_F(ModelSource, GmshsOwnErrorIsShown) {
    SourceOptions options = box();
    write("box.geo", "Box(1) = {0, 0, 0 1};\n");
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("box.geo"), HasSubstr("Gmsh could not"),
                                        HasSubstr("syntax error")));
    write("box.geo", "Point(1) = {0, 0, 0};\n");
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("box.geo"), HasSubstr("no solid elements")));
    options.gmsh.program = "no-such-gmsh";
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("no-such-gmsh"), HasSubstr("Install")));
}

TEST_F(ModelSource, AKeptDeckGivesTheSameModel) {
    SourceOptions options = box();
    options.gmsh.keepDeck = folder / "kept.inp";
    const FeModel model = readModelSource(options);
    EXPECT_EQ(model.source, folder / "kept.inp");
    const FeModel same = readCalculixDeck(folder / "kept.inp");
    EXPECT_EQ(same.K.values, model.K.values);
    EXPECT_EQ(same.mesh.nodeSets, model.mesh.nodeSets);
}

TEST_F(ModelSource, EachKindOfFileAsksForWhatItNeeds) {
    SourceOptions options;
    options.path = "part.stl";
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("'.stl'"), HasSubstr(".inp")));
    options.path = write("K.mtx", "%%MatrixMarket matrix coordinate real symmetric\n");
    EXPECT_THAT(errorOf(options), HasSubstr("needs --mass-matrix"));
    options.massMatrix = "M.mtx";
    EXPECT_THAT(errorOf(options), HasSubstr("needs --nodes"));
    options = box();
    options.material.clear();
    EXPECT_THAT(errorOf(options), HasSubstr("needs --material"));
    options = box();
    options.units = "mm-t-s";
    EXPECT_THAT(errorOf(options), HasSubstr("--length-unit"));
    options = SourceOptions();
    options.path = write("part.inp", "*NODE\n");
    options.material = "steel";
    EXPECT_THAT(errorOf(options), HasSubstr("--material belongs to Gmsh"));
}

TEST(Materials, AreFoundByNameOrGivenByNumbers) {
    EXPECT_EQ(findMaterial("Stainless Steel").rho, 8000);
    EXPECT_EQ(parseMaterial("aluminum").E, 70e9);
    const Material custom = parseMaterial("rho=1e3, E=2e9,nu=0.3");
    EXPECT_EQ(custom.E, 2e9);
    EXPECT_EQ(custom.nu, 0.3);
    EXPECT_EQ(custom.rho, 1000);
    const auto errorOf = [](const std::string& text) -> std::string {
        try {
            parseMaterial(text);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_THAT(errorOf("unobtainium"), AllOf(HasSubstr("unobtainium"), HasSubstr("steel")));
    EXPECT_THAT(errorOf("E=2e9,nu=0.3"), HasSubstr("lacks rho"));
    EXPECT_THAT(errorOf("E=2e9,nu=0.5,rho=1"), HasSubstr("nu is 0.5"));
    EXPECT_THAT(errorOf("E=2e9,nu=x,rho=1"), HasSubstr("'nu=x'"));
    EXPECT_THAT(errorOf("E=2e9,G=1,rho=1"), HasSubstr("'G=1'"));
}

/** A steel brick written in another system of units. **/
class Units : public ModelSource, public ::testing::WithParamInterface<const char*> {
protected:
    std::string deckIn(const UnitSystem& units) {
        Brick brick;
        brick.elements = {4, 2, 2};
        for (double& length : brick.size) length /= units.length;
        char material[300];
        std::snprintf(material, sizeof material,
                      "*MATERIAL, NAME=STEEL\n*ELASTIC\n%.12g, 0.3\n*DENSITY\n%.12g\n"
                      "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n",
                      210e9 / units.stress(), 7850 / units.density());
        return write("brick.inp", brick.meshText() + material);
    }
};

TEST_P(Units, AreConvertedToTheSameModelAndNamedWhereTheyWereForgotten) {
    const UnitSystem& units = findUnitSystem(GetParam());
    SourceOptions options;
    options.path = deckIn(findUnitSystem("m-kg-s"));
    const FeModel metres = readModelSource(options);
    EXPECT_THAT(metres.notes, IsEmpty());

    options.path = deckIn(units);
    options.units = units.name;
    const FeModel converted = readModelSource(options);
    EXPECT_EQ(converted.notes.size(), 1u);
    EXPECT_NEAR(converted.calcMass() / metres.calcMass(), 1, 1e-10);
    for (size_t k = 0; k < metres.mesh.positions.size(); ++k)
        EXPECT_NEAR(converted.mesh.positions[k], metres.mesh.positions[k], 1e-12);
    // Round-off decides which entries are exact zeros: compare products with a vector.
    const auto multiply = [](const SymmetricMatrix& A) {
        std::vector<double> product(size_t(A.size), 0.0);
        for (int column = 0; column < A.size; ++column)
            for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1];
                 ++k) {
                const int row = A.rows[size_t(k)];
                product[size_t(row)] += A.values[size_t(k)] * std::sin(column);
                if (row != column) product[size_t(column)] += A.values[size_t(k)] * std::sin(row);
            }
        return product;
    };
    const auto found = multiply(converted.K), expected = multiply(metres.K);
    for (size_t k = 0; k < expected.size(); ++k)
        ASSERT_NEAR(found[k], expected[k], 1e-9 * std::abs(metres.K.values[0]));

    options.units = "m-kg-s";
    EXPECT_THAT(readModelSource(options).warnings,
                Contains(AllOf(HasSubstr("hardly"), HasSubstr("--units " + units.name))));

    // While it reads it tells what the model says afterwards, once.
    std::vector<std::string> notes, warnings;
    options.calculix.note = [&](const std::string& text) { notes.push_back(text); };
    options.calculix.warn = [&](const std::string& text) { warnings.push_back(text); };
    for (const std::string& name : {std::string("m-kg-s"), units.name}) {
        notes.clear(), warnings.clear();
        options.units = name;
        const FeModel told = readModelSource(options);
        EXPECT_EQ(notes, told.notes);
        EXPECT_EQ(warnings, told.warnings);
    }
}

INSTANTIATE_TEST_SUITE_P(Systems, Units,
                         ::testing::Values("mm-t-s", "mm-kg-s", "mm-kg-ms", "mm-g-ms", "cm-g-s",
                                           "in-lbf-s"));

TEST_F(ModelSource, APartOfTwoHundredKilometresIsRefused) {
    Brick brick;
    brick.elements = {2, 1, 1};
    for (double& length : brick.size) length *= 1e6;
    SourceOptions options;
    options.path = write("brick.inp", brick.text());
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("brick.inp"), HasSubstr("km long")));
}

TEST_F(ModelSource, FiguresOfABrickAreItsOwn) {
    Brick brick;
    const FeModel model = readModelSource([&] {
        SourceOptions options;
        options.path = write("brick.inp", brick.text());
        return options;
    }());
    PartFigures figures = calcFigures(model);
    EXPECT_NEAR(figures.size, std::hypot(0.2, 0.03, 0.02), 1e-12);
    EXPECT_NEAR(figures.density, brick.rho, 1e-6);
    // A rough figure: within a factor of three.
    EXPECT_NEAR(std::log(figures.waveSpeed / std::sqrt(brick.E / brick.rho)), 0, std::log(3));
}

}  // namespace
}  // namespace simflex
