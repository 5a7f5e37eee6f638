/** @file
Gmsh parts with a material, units, and the choice of a reader by file name. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iomanip>
#include <sstream>

#include "fe/FreeModes.h"
#include "fe/MatrixFiles.h"
#include "fe/TestDecks.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/fe/ModelSource.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using testing::Brick;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/** A box of 60 × 20 × 10 with its ends as physical groups, in any unit. **/
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

TEST_F(ModelSource, ElementsThatGmshTurnsInsideOutAreUntangled) {
    // A closed tube whose walls are thinner than the element size.
    testing::writeText(folder / "tube.geo",
                       "SetFactory(\"OpenCASCADE\");\n"
                       "Cylinder(1) = {0, 0, 0, 0, 0.4, 0, 0.014};\n"
                       "Cylinder(2) = {0, 0.04, 0, 0, 0.32, 0, 0.007};\n"
                       "BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n"
                       "Physical Volume(\"TUBE\") = {3};\n");
    SourceOptions options;
    options.path = folder / "tube.geo";
    options.material = "aluminium";
    options.gmsh.meshSize = 0.01;
    const FeModel model = readModelSource(options);
    const double volume = M_PI * (0.014 * 0.014 * 0.4 - 0.007 * 0.007 * 0.32);
    EXPECT_NEAR(model.calcMass(), 2700 * volume, 0.02 * 2700 * volume);
    EXPECT_THAT(model.notes, ::testing::Contains(HasSubstr("Mesh.HighOrderOptimize")));
    // With this setting changed, the error names the element.
    options.gmsh.settings = {{"Mesh.HighOrderOptimize", 0}};
    EXPECT_THAT([&] { readModelSource(options); },
                ::testing::ThrowsMessage<std::invalid_argument>(HasSubstr("inside out")));
}

TEST_F(ModelSource, GeometryOfAStrangeSizeIsReportedWithTheCure) {
    EXPECT_THAT(readModelSource(box()).warnings, IsEmpty());
    // 60 mm × 20 mm × 10 mm, read in metres.
    SourceOptions options = box("1");
    EXPECT_THAT(readModelSource(options).warnings,
                ElementsAre(AllOf(HasSubstr("64 m long and has 3.24e+07 kg"),
                                  HasSubstr("--length-unit mm"), HasSubstr("length_unit: 1e-3"))));
    options.gmsh.lengthUnit = 1;  // explicitly metres
    EXPECT_THAT(readModelSource(options).warnings, IsEmpty());
    options = box();
    options.gmsh.meshSize = 10;
    EXPECT_THAT(readModelSource(options).warnings,
                ElementsAre(HasSubstr("elements of 10 m are larger than the part, which is 0.064 "
                                      "m long")));
    options = box("1");
    options.gmsh.lengthUnit = 1e-3;
    options.gmsh.meshSize = 70;
    EXPECT_THAT(readModelSource(options).warnings,
                ElementsAre(HasSubstr("elements of 0.07 m are larger than the part")));
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

TEST_F(ModelSource, VolumesOfAMeshInNoPhysicalGroupAreNamed) {
    write("two.geo",
          "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 0.1, 0.02, 0.02};\n"
          "Box(2) = {0.1, 0, 0, 0.1, 0.02, 0.02};\nCoherence;\n"
          "Physical Volume(\"FIRST\") = {1};\n");
    SourceOptions options;
    options.path = folder / "two.msh";
    options.material = "E=3e9, nu=0.4, rho=1000";
    const auto mesh = [&](const std::string& savesAll) {
        return std::system(("cd '" + folder.path() +
                            "' && gmsh -3 -order 2 -clmax 0.01 -setnumber Mesh.SaveAll " +
                            savesAll + " two.geo -o two.msh >gmsh.log 2>&1")
                               .c_str());
    };
    ASSERT_EQ(mesh("1"), 0);
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), 0.1 * 0.02 * 0.02 * 1000, 1e-9);  // the first
    EXPECT_THAT(model.warnings, Contains(HasSubstr("volume 2 (from 0.1, ")));
    EXPECT_THAT(model.warnings, Contains(HasSubstr("is in no physical group, and left out")));
    ASSERT_EQ(mesh("0"), 0);
    try {
        readModelSource(options);
        ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("those that are in no physical group"));
    }
}

TEST_F(ModelSource, AUniversalFileHasTheFrequenciesAndGroupsOfItsMesh) {
    write("box.geo", std::string("u = 0.001;\n") + kBox);
    ASSERT_EQ(std::system(("cd '" + folder.path() +
                           "' && gmsh -3 -order 2 -clmax 0.01 box.geo -o box.msh >gmsh.log 2>&1 && "
                           "gmsh -3 box.msh -o box.unv -setnumber Mesh.SaveGroupsOfNodes 1 "
                           ">>gmsh.log 2>&1")
                              .c_str()),
              0);
    SourceOptions options;
    options.material = "steel";
    options.path = folder / "box.msh";
    const FeModel plain = readModelSource(options);
    options.path = folder / "box.unv";
    const FeModel model = readModelSource(options);
    EXPECT_EQ(model.mesh.nodeSets.at("RIGHT").size(), plain.mesh.nodeSets.at("RIGHT").size());
    const auto own = testing::calcFreeFrequencies(model, 12),
               other = testing::calcFreeFrequencies(plain, 12);
    for (size_t i = 6; i < own.size(); ++i) EXPECT_NEAR(own[i], other[i], 1e-8 * other[i]);
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
    EXPECT_THAT(readModelSource(options).warnings, IsEmpty());
    options.gmsh.lengthUnit = 1;  // relative to the millimetres of the file
    options.gmsh.meshSize = 10;
    EXPECT_THAT(readModelSource(options).warnings, ElementsAre(HasSubstr("or leave it out")));
}

// Six bilinear patches without a solid, as many programs export to IGES: 100 × 20 × 30 mm.
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

/** Returns an entry of bulk data in free field. **/
std::string bulkEntry(const std::string& name, const std::vector<std::string>& fields) {
    std::string text = name;
    for (size_t k = 0; k < fields.size(); ++k) text += (k && k % 8 == 0 ? "\n," : ",") + fields[k];
    return text + "\n";
}

std::string bulkGrids(const std::vector<std::array<double, 3>>& positions) {
    std::ostringstream text;
    text << std::setprecision(12);
    for (size_t k = 0; k < positions.size(); ++k)
        text << "GRID," << k + 1 << ",," << positions[k][0] << "," << positions[k][1] << ","
             << positions[k][2] << "\n";
    return text.str();
}

struct BulkSolid {
    const char *type, *name;
    std::vector<size_t> order;  ///< of CalculiX's nodes in Nastran's element
};

class NastranSolid : public ModelSource, public ::testing::WithParamInterface<BulkSolid> {};

TEST_P(NastranSolid, HasTheMatricesOfItsDeck) {
    const BulkSolid& solid = GetParam();
    const std::string type = solid.type;
    const testing::DistortedCube cube(type == "C3D8I" ? "C3D8" : type);
    std::string text = cube.text();
    if (type == "C3D8I") text.replace(text.find("C3D8"), 4, type);
    SourceOptions deck, bulk;
    deck.path = write("cube.inp", text);
    std::string data =
        "SOL 103\nCEND\n  SPC = 1\nBEGIN BULK\n$ a comment\n" + bulkGrids(cube.nodes);
    for (size_t e = 0; e < cube.elements.size(); ++e) {
        std::vector<std::string> fields = {std::to_string(e + 1), "3"};
        for (size_t k = 0; k < cube.elements[e].size(); ++k)
            fields.push_back(
                std::to_string(cube.elements[e][solid.order.empty() ? k : solid.order[k]] + 1));
        data += bulkEntry(solid.name, fields);
    }
    bulk.path = write(
        "cube.bdf", data +
                        "PSOLID         3       5\n"
                        "MAT1*                  5          7.0+10                              .3\n"
                        "*                 2.7E+3\n"
                        "SPC1,1,123,1,THRU,4\nENDDATA\nwhat follows\n");
    const FeModel model = readModelSource(bulk), plain = readModelSource(deck);
    EXPECT_EQ(model.K.rows, plain.K.rows);
    for (size_t k = 0; k < model.K.values.size(); ++k)
        EXPECT_NEAR(model.K.values[k], plain.K.values[k], 1e-9 * plain.K.values[0]);
    EXPECT_NEAR(model.calcMass(), plain.calcMass(), 1e-12 * plain.calcMass());
    EXPECT_EQ(model.mesh.nodeSets.at("PID_3").size(), cube.nodes.size());
    EXPECT_THAT(model.notes, Contains(HasSubstr("left out SPC1")));
}

INSTANTIATE_TEST_SUITE_P(
    Types, NastranSolid,
    ::testing::Values(BulkSolid{"C3D4", "CTETRA", {}}, BulkSolid{"C3D10", "CTETRA", {}},
                      BulkSolid{"C3D6", "CPENTA", {}},
                      BulkSolid{
                          "C3D15", "CPENTA", {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11}},
                      BulkSolid{"C3D8I", "CHEXA", {}},
                      BulkSolid{"C3D20R", "CHEXA", {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,
                                                    10, 11, 16, 17, 18, 19, 12, 13, 14, 15}}),
    [](const auto& solid) { return std::string(solid.param.type); });

std::string bulkPlate(const std::string& more);

struct BadAnsys {
    const char *name, *text, *message;
};

/** Writes a model in CDWRITE's format. **/
class AnsysModel {
public:
    explicit AnsysModel(const std::vector<std::array<double, 3>>& nodes) {
        m_text << "/COM,ANSYS RELEASE\n/PREP7\nNBLOCK,6,SOLID,9,9\n(3i9,6e21.13e3)\n";
        for (size_t k = 0; k < nodes.size(); ++k) {
            char line[120];
            std::snprintf(line, sizeof line, "%9zu%9d%9d%21.13e%21.13e%21.13e\n", k + 1, 0, 0,
                          nodes[k][0], nodes[k][1], nodes[k][2]);
            m_text << line;
        }
        m_text << "N,R5.3,LOC,       -1,\n";
    }

    void beginElements() { m_text << "EBLOCK,19,SOLID,9,9\n(19i9)\n"; }
    void addElement(int number, int type, int section, const std::vector<int>& nodes) {
        const std::vector<int> head = {2, type, section,           section, 0,     0,
                                       0, 0,    int(nodes.size()), 0,       number};
        size_t column = 0;
        const auto add = [&](int value) {
            if (column == 19) m_text << "\n", column = 0;
            m_text << std::setw(9) << value;
            ++column;
        };
        for (const int value : head) add(value);
        for (const int node : nodes) add(node);
        m_text << "\n";
    }
    void endElements() { m_text << "       -1\n"; }
    void add(const std::string& text) { m_text << text; }
    std::string text() const { return m_text.str(); }

private:
    std::ostringstream m_text;
};

constexpr const char* kAnsysMetal =
    "MPTEMP,R5.0, 1, 1,  0.00000000    ,\nMPDATA,R5.0, 1,EX  ,       2, 1,  70000000000.0    ,\n"
    "MPDATA,R5.0, 1,PRXY,       2, 1, 0.300000000    ,\nMP,DENS,2,2700\nMP,ALPX,2,1e-5\n";

struct AnsysSolid {
    const char* type;
    int kind;
    std::vector<size_t> order;  ///< of CalculiX's nodes in Ansys' element
};

class AnsysSolids : public ModelSource, public ::testing::WithParamInterface<AnsysSolid> {};

TEST_P(AnsysSolids, HaveTheMatricesOfTheirDeck) {
    const AnsysSolid& solid = GetParam();
    const std::string type = solid.type;
    const testing::DistortedCube cube(type == "C3D8I" ? "C3D8" : type);
    std::string text = cube.text();
    if (type == "C3D8I") text.replace(text.find("C3D8"), 4, type);
    SourceOptions deck, ansys;
    deck.path = write("cube.inp", text);
    AnsysModel model(cube.nodes);
    model.add("ET,3," + std::to_string(solid.kind) + "\n");
    model.beginElements();
    for (size_t e = 0; e < cube.elements.size(); ++e) {
        std::vector<int> nodes;
        for (size_t k = 0; k < (solid.order.empty() ? cube.elements[e].size() : solid.order.size());
             ++k)
            nodes.push_back(cube.elements[e][solid.order.empty() ? k : solid.order[k]] + 1);
        model.addElement(int(e) + 1, 3, 1, nodes);
    }
    model.endElements();
    model.add(std::string(kAnsysMetal) +
              "CMBLOCK,FEW     ,NODE,       3  ! users node component definition\n(8i10)\n"
              "         1        -3         4\nCMBLOCK,BODY,ELEM,1\n(8i10)\n         "
              "1\nD,1,UX,0\nFINISH\n");
    ansys.path = write("cube.cdb", model.text());
    const FeModel own = readModelSource(ansys), plain = readModelSource(deck);
    ASSERT_EQ(own.K.rows, plain.K.rows);
    for (size_t k = 0; k < own.K.values.size(); ++k)
        ASSERT_NEAR(own.K.values[k], plain.K.values[k], 1e-9 * plain.K.values[0]);
    // The deck has 12 digits, the block 13.
    EXPECT_NEAR(own.calcMass(), plain.calcMass(), 1e-11 * plain.calcMass());
    EXPECT_EQ(own.mesh.nodeSets.at("FEW"), (std::vector<int>{0, 1, 2, 3}));
    EXPECT_THAT(own.notes, Contains(HasSubstr("left out D ")));
}

INSTANTIATE_TEST_SUITE_P(
    Types, AnsysSolids,
    ::testing::Values(AnsysSolid{"C3D8I", 185, {}}, AnsysSolid{"C3D20R", 186, {}},
                      AnsysSolid{"C3D10", 187, {}},
                      AnsysSolid{"C3D4", 185, {0, 1, 2, 2, 3, 3, 3, 3}},
                      AnsysSolid{"C3D6", 185, {0, 1, 2, 2, 3, 4, 5, 5}},
                      AnsysSolid{"C3D15", 186, {0, 1, 2, 2,  3, 4,  5,  5,  6,  7,
                                                2, 8, 9, 10, 5, 11, 12, 13, 14, 14}}),
    [](const auto& solid) { return std::string(solid.param.type); });

TEST_F(ModelSource, DegenerateTetrahedraOfAnsysAreThoseOfTheirDeck) {
    const testing::DistortedCube cube("C3D10");
    SourceOptions deck, ansys;
    deck.path = write("cube.inp", cube.text());
    AnsysModel model(cube.nodes);
    model.add("ET,3,186\n");
    model.beginElements();
    for (size_t e = 0; e < cube.elements.size(); ++e) {
        std::vector<int> nodes;
        for (const size_t k : {0, 1, 2, 2, 3, 3, 3, 3, 4, 5, 2, 6, 3, 3, 3, 3, 7, 8, 9, 9})
            nodes.push_back(cube.elements[e][k] + 1);
        model.addElement(int(e) + 1, 3, 1, nodes);
    }
    model.endElements();
    ansys.path = write("cube.cdb", model.text() + kAnsysMetal);
    const FeModel own = readModelSource(ansys), plain = readModelSource(deck);
    EXPECT_EQ(own.mesh.elements[0].nodes, plain.mesh.elements[0].nodes);
}

/** Returns a plate of 4 × 2 SHELL181 of section 5 and additional commands. **/
std::string ansysPlate(const std::string& more) {
    std::vector<std::array<double, 3>> nodes;
    for (int j = 0; j <= 2; ++j)
        for (int i = 0; i <= 4; ++i) nodes.push_back({0.05 * i, 0.05 * j, 0});
    AnsysModel model(nodes);
    model.add("ET,1,181\nET,2,21\nKEYOPT,2,3,2\n");
    model.beginElements();
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 4; ++i) {
            const int first = 1 + i + 5 * j;
            model.addElement(1 + i + 4 * j, 1, 5, {first, first + 1, first + 6, first + 5});
        }
    model.addElement(101, 2, 9, {15});
    model.endElements();
    model.add(kAnsysMetal);
    return model.text() + more;
}

TEST_F(ModelSource, ShellsAndMassesOfAnsysAreThoseOfNastran) {
    SourceOptions ansys, bulk;
    ansys.path = write("plate.cdb",
                       ansysPlate("SECTYPE,5,SHELL\nSECOFFSET,BOT\nSECBLOCK,1\n 0.004, 2, 0.0, 3\n"
                                  "SECCONTROLS, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0\n"
                                  "RLBLOCK,1,9,1,7\n(2i8,6g16.9)\n(7g16.9)\n"
                                  "       9       1 0.250000000    \n"));
    std::string data =
        bulkPlate("PSHELL,7,1,0.004,1,,1\nMAT1,1,7.+10,,.3,2700.\nCONM2,101,15,,.25\n");
    for (size_t at = data.find("0.001"); at != std::string::npos; at = data.find("0.001", at + 1))
        data.replace(at, 5, "0.002");
    bulk.path = write("plate.bdf", data);
    const FeModel ownModel = readModelSource(ansys), otherModel = readModelSource(bulk);
    const auto own = testing::calcFreeFrequencies(ownModel, 14),
               other = testing::calcFreeFrequencies(otherModel, 14);
    for (size_t i = 6; i < own.size(); ++i)
        EXPECT_NEAR(own[i], other[i], 1e-8 * other[i]) << "mode " << i + 1;
}

TEST_F(ModelSource, SpringsTrussesAndMembranesOfAnsysAreThoseOfADeck) {
    const testing::DistortedCube cube("C3D8");
    AnsysModel model(cube.nodes);
    model.add(
        "ET,1,185\nET,2,14\nET,3,180\nET,4,181\nKEYOPT,4,1,1\n"
        "R,5,1e6,3.\nR,6,1e-4\nR,7,.002\n");
    model.beginElements();
    std::string deck = cube.meshText();
    deck.replace(deck.find("C3D8"), 4, "C3D8I");
    for (size_t e = 0; e < cube.elements.size(); ++e) {
        std::vector<int> nodes;
        for (const int node : cube.elements[e]) nodes.push_back(node + 1);
        model.addElement(int(e) + 1, 1, 1, nodes);
    }
    const auto& n = cube.elements[0];
    model.addElement(101, 2, 5, {n[0] + 1, n[6] + 1});
    model.addElement(102, 3, 6, {n[1] + 1, n[7] + 1});
    model.addElement(103, 4, 7, {n[0] + 1, n[1] + 1, n[2] + 1, n[3] + 1});
    model.endElements();
    model.add(kAnsysMetal);
    const auto line = [&](const char* type, const char* set, int number, std::vector<size_t> of) {
        deck += std::string("*ELEMENT, TYPE=") + type + ", ELSET=" + set + "\n" +
                std::to_string(number);
        for (const size_t k : of) deck += "," + std::to_string(n[k] + 1);
        deck += "\n";
    };
    line("SPRINGA", "S", 101, {0, 6});
    line("T3D2", "T", 102, {1, 7});
    line("M3D4", "M", 103, {0, 1, 2, 3});
    deck += testing::Brick().materialText() +
            "*SPRING, ELSET=S\n\n1e6\n*SOLID SECTION, ELSET=T, MATERIAL=METAL\n1e-4\n"
            "*MEMBRANE SECTION, ELSET=M, MATERIAL=METAL\n.002\n";
    SourceOptions ansys, plain;
    ansys.path = write("cube.cdb", model.text());
    plain.path = write("cube.inp", deck);
    const FeModel a = readModelSource(ansys), b = readModelSource(plain);
    ASSERT_EQ(a.K.rows, b.K.rows);
    for (size_t k = 0; k < b.K.values.size(); ++k)
        EXPECT_NEAR(a.K.values[k], b.K.values[k], 1e-9 * b.K.values[0]);
    EXPECT_NEAR(a.calcMass(), b.calcMass(), 1e-12 * b.calcMass());
    EXPECT_THAT(a.notes, Contains(HasSubstr("left out damping of COMBIN14")));
}

TEST_F(ModelSource, SurfacesWithAThicknessAreTheShellsOfADeck) {
    SIMFLEX_NEEDS_CALCULIX();
    SourceOptions options;
    options.path = write("bracket.geo",
                         "SetFactory(\"OpenCASCADE\");\n"
                         "Rectangle(1) = {0, 0, 0, 200, 100};\n"
                         "Rectangle(2) = {0, 0, 0, 200, 50};\n"
                         "Rotate {{1, 0, 0}, {0, 0, 0}, Pi/2} { Surface{2}; }\n"
                         "BooleanFragments{ Surface{1}; Delete; }{ Surface{2}; Delete; }\n"
                         "Physical Surface(\"SHEET\") = Surface{:};\n"
                         "Physical Curve(\"EDGE\") = Curve In BoundingBox{-1,-1,-1,1,101,61};\n");
    options.material = "steel";
    options.gmsh.meshSize = 25;
    options.gmsh.lengthUnit = 1e-3;
    options.gmsh.thickness = 0.002;
    options.gmsh.keepDeck = folder / "kept.inp";
    const FeModel model = readModelSource(options);
    EXPECT_NEAR(model.calcMass(), 0.2 * 0.15 * 0.002 * 7850, 1e-3 * 0.471);
    EXPECT_GT(model.mesh.nodeSets.at("EDGE").size(), 5u);
    // The part is free and flexible: CalculiX has the same frequencies.
    const auto own = testing::calcFreeFrequencies(model, 12),
               reference = testing::calcCalculixFrequencies(folder, folder / "kept.inp", {}, 12);
    for (size_t k = 6; k < own.size(); ++k)
        EXPECT_NEAR(own[k], reference[k], 1e-5 * reference[k]) << k;
    options.gmsh.thickness = 0;
    EXPECT_THAT(errorOf(options), HasSubstr("of sheets, give the thickness"));
    options.gmsh.thickness = -1;
    EXPECT_THAT(errorOf(options), HasSubstr("the thickness is -1; it must be positive"));
}

class RefusedAnsys : public ModelSource, public ::testing::WithParamInterface<BadAnsys> {};

TEST_P(RefusedAnsys, IsNamedWithFileLineAndReason) {
    SourceOptions ansys;
    ansys.path = write("plate.cdb", ansysPlate(GetParam().text));
    EXPECT_THAT(errorOf(ansys), AllOf(HasSubstr(GetParam().message),
                                      ::testing::ContainsRegex("plate.cdb:[0-9]+: ")));
}

INSTANTIATE_TEST_SUITE_P(
    Commands, RefusedAnsys,
    ::testing::Values(
        BadAnsys{"NoThickness", "", "no thickness"},
        BadAnsys{"Layers", "SECTYPE,5,SHELL\nSECDATA,.1,2\nSECDATA,.1,2\n", "layers"},
        BadAnsys{"Offset", "SECTYPE,5,SHELL\nSECDATA,.1,2\nSECOFFSET,USER,.3\n", "TOP or BOT"},
        BadAnsys{"ShearStiffness", "SECTYPE,5,SHELL\nSECDATA,.1,2\nSECCONTROLS,1e6\n",
                 "a shear stiffness or mass of their own"},
        BadAnsys{"AddedMass", "SECTYPE,5,SHELL\nSECDATA,.1,2\nSECCONTROLS,0,0,0,2,1,1,1\n",
                 "a shear stiffness or mass of their own"},
        BadAnsys{"Equations", "CE,R5.0,DEFI,1,2\n", "*EQUATION"},
        BadAnsys{"Coupled", "CP,R5.0,DEFI,UX,1,2\n", "*EQUATION"},
        BadAnsys{"Orthotropic", "MP,EY,2,1e9\nR,5,.1\nR,9,1\n", "not isotropic by EY"},
        BadAnsys{"TwoTemperatures", "MPDATA,R5.0,2,EX,2,1,1e9,2e9\n", "temperature"},
        BadAnsys{"Table", "TB,HYPE,2\n", "TB,HYPE"},
        BadAnsys{"Inertia", "R,5,.1\nKEYOPT,2,3,0\nR,9,1,1,1,.1\n", "inertia"},
        BadAnsys{"NoDensity",
                 "R,5,.1\nR,9,1\nEBLOCK,19,SOLID\n(19i9)\n"
                 "        3        1        5        5        0        0        0        "
                 "0        4        0      200        1        2        7        6\n"
                 "       -1\nMP,EX,3,1e9\n",
                 "no DENS"},
        BadAnsys{"Beam",
                 "R,5,.1\nR,9,1\nET,7,188\nEBLOCK,19,SOLID\n(19i9)\n"
                 "        2        7        5        5        0        0        0        "
                 "0        2        0      200        1        2\n       -1\n",
                 "type 188"},
        BadAnsys{"ShortBlock", "EBLOCK,19,SOLID\n(19i9)\n        2        7\n       -1\n",
                 "11 numbers"},
        BadAnsys{"NoFormat", "EBLOCK,19,SOLID\n        2        7\n", "format"},
        BadAnsys{"Compact", "EBLOCK,10,COMPACT\n", "CDWRITE"}),
    [](const auto& command) { return command.param.name; });

/** Returns a plate of 4 × 2 quadrilaterals, 0.2 × 0.1 m, in the plane z = 0. **/
std::string bulkPlate(const std::string& more) {
    std::string data;
    std::vector<std::array<double, 3>> grids;
    for (int j = 0; j <= 2; ++j)
        for (int i = 0; i <= 4; ++i) grids.push_back({0.05 * i, 0.05 * j, 0});
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 4; ++i) {
            const int first = 1 + i + 5 * j;
            data += bulkEntry("CQUAD4", {std::to_string(1 + i + 4 * j), "7", std::to_string(first),
                                         std::to_string(first + 1), std::to_string(first + 6),
                                         std::to_string(first + 5), "", "0.001"});
        }
    return bulkGrids(grids) + data + more;
}

/** Returns the same plate as S4 of the set PLATE.
@param nodes  additional lines of *NODE **/
std::string deckPlate(const std::string& nodes = "") {
    std::string text = "*NODE\n";
    for (int j = 0; j <= 2; ++j)
        for (int i = 0; i <= 4; ++i)
            text += std::to_string(1 + i + 5 * j) + "," + std::to_string(0.05 * i) + "," +
                    std::to_string(0.05 * j) + ",0\n";
    text += nodes + "*ELEMENT,TYPE=S4,ELSET=PLATE\n";
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 4; ++i) {
            const int first = 1 + i + 5 * j;
            for (const int number : {1 + i + 4 * j, first, first + 1, first + 6, first + 5})
                text += std::to_string(number) + ",";
            text += "\n";
        }
    return text;
}

void expectSameMatrices(const FeModel& a, const FeModel& b) {
    ASSERT_EQ(a.K.rows, b.K.rows);
    const double largest = *std::max_element(b.K.values.begin(), b.K.values.end());
    for (size_t k = 0; k < b.K.values.size(); ++k)
        ASSERT_NEAR(a.K.values[k], b.K.values[k], 1e-12 * largest);
    ASSERT_EQ(a.m.rows, b.m.rows);
    for (size_t k = 0; k < b.m.values.size(); ++k)
        ASSERT_NEAR(a.m.values[k], b.m.values[k], 1e-12 * b.m.values[0]);
}

/** Returns the lowest frequencies [rad/s] of a model of linear shells. `heldAt` returns the
constrained axes for a node's position. **/
std::vector<double> calcHeldOmegas(const FeModel& model,
                                   const std::function<std::string(double, double)>& heldAt,
                                   int count) {
    std::vector<int> place(size_t(model.K.size), -1);
    int size = 0;
    for (const auto& [number, nodes] : model.mesh.expandedNodes)
        for (const size_t side : {size_t(1), size_t(2)}) {
            const auto x = model.mesh.position(nodes[side]);
            for (int a = 0; a < 3; ++a)
                if (heldAt(x[0], x[1]).find("xyz"[a]) == std::string::npos)
                    place[size_t(3 * nodes[side] + a)] = size++;
        }
    std::vector<Eigen::Triplet<double>> ofK, ofM;
    const auto add = [&](auto& entries, int row, int column, double value) {
        const int i = place[size_t(row)], j = place[size_t(column)];
        if (i < 0 || j < 0) return;
        entries.emplace_back(i, j, value);
        if (i != j) entries.emplace_back(j, i, value);
    };
    for (int column = 0; column < model.K.size; ++column)
        for (auto k = size_t(model.K.columnStarts[size_t(column)]);
             k < size_t(model.K.columnStarts[size_t(column) + 1]); ++k)
            add(ofK, model.K.rows[k], column, model.K.values[k]);
    for (int column = 0; column < model.m.size; ++column)
        for (auto k = size_t(model.m.columnStarts[size_t(column)]);
             k < size_t(model.m.columnStarts[size_t(column) + 1]); ++k)
            for (int a = 0; a < 3; ++a)
                add(ofM, 3 * model.m.rows[k] + a, 3 * column + a, model.m.values[k]);
    Eigen::SparseMatrix<double> K(size, size), M(size, size);
    K.setFromTriplets(ofK.begin(), ofK.end());
    M.setFromTriplets(ofM.begin(), ofM.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(K);
    Eigen::MatrixXd X(size, 3 * count);
    for (Eigen::Index j = 0; j < X.cols(); ++j)
        for (Eigen::Index i = 0; i < size; ++i) X(i, j) = std::sin(double(1 + i * (2 * j + 1)));
    Eigen::VectorXd squares;
    for (int step = 0; step < 12; ++step) {  // subspace iteration
        const Eigen::MatrixXd Y = solver.solve(M * X);
        const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> pencil(
            Y.transpose() * (K * Y), Y.transpose() * (M * Y));
        squares = pencil.eigenvalues();
        X = Y * pencil.eigenvectors();
    }
    std::vector<double> omegas;
    for (int k = 0; k < count; ++k) omegas.push_back(std::sqrt(squares[k]));
    return omegas;
}

/** Returns Σ m (x·x 1 − x xᵀ) about the origin. **/
std::array<std::array<double, 3>, 3> calcInertia(const FeModel& model) {
    std::array<std::array<double, 3>, 3> J{};
    for (int column = 0; column < model.m.size; ++column)
        for (auto k = model.m.columnStarts[size_t(column)];
             k < model.m.columnStarts[size_t(column) + 1]; ++k) {
            const int row = model.m.rows[size_t(k)];
            const auto x = model.mesh.position(row), y = model.mesh.position(column);
            const double m = (row == column ? 1 : 2) * model.m.values[size_t(k)];
            for (size_t a = 0; a < 3; ++a)
                for (size_t b = 0; b < 3; ++b) {
                    J[a][b] -= 0.5 * m * (x[a] * y[b] + x[b] * y[a]);
                    if (a == b) J[a][a] += m * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
                }
        }
    return J;
}

// In Nastran TS/T and MID3 are the plate's flexibility in transverse shear.
TEST_F(ModelSource, ShearOfAPshellIsThatOfALawWithItsModuli) {
    const auto read = [&](const std::string& property) {
        SourceOptions bulk;
        bulk.path = write("plate.bdf", bulkPlate(property));
        return readModelSource(bulk);
    };
    // E, ν, G = E/2(1+ν); G1Z, G2Z = G·TS/T·6/5.
    const std::string G = "2.6923076923077+10", law = "MAT8,3,7.+10,7.+10,.3," + G + ",";
    const FeModel plain = read("PSHELL,7,1,0.004,1,,1\nMAT1,1,7.+10,,.3,2700.\n"),
                  usual = read("PSHELL,7,1,0.004,1,,1,.833333\nMAT1,1,7.+10,,.3,2700.\n"),
                  soft = read("PSHELL,7,1,0.004,1,,1,.0833333333\nMAT1,1,7.+10,,.3,2700.\n"),
                  other = read(
                      "PSHELL,7,1,0.004,1,,2\nMAT1,1,7.+10,,.3,2700.\n"
                      "MAT1,2,7.+9,,.3,2700.\n"),
                  same = read("PSHELL,7,3,0.004,3\n" + law +
                              "2.6923076923077+9,2.6923076923077+9,2700.\n");
    expectSameMatrices(usual, plain);
    // Where one has zeros the other may have rounding.
    const auto multiply = [](const SymmetricMatrix& A) {
        std::vector<double> y(size_t(A.size), 0.0);
        for (int column = 0; column < A.size; ++column)
            for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1];
                 ++k) {
                const int row = A.rows[size_t(k)];
                y[size_t(row)] += A.values[size_t(k)] * std::sin(column);
                if (row != column) y[size_t(column)] += A.values[size_t(k)] * std::sin(row);
            }
        return y;
    };
    const auto expected = multiply(same.K), stiff = multiply(plain.K);
    const double largest = *std::max_element(expected.begin(), expected.end());
    double change = 0;
    for (size_t k = 0; k < expected.size(); ++k) {
        for (const auto& found : {multiply(soft.K), multiply(other.K)})
            EXPECT_NEAR(found[k], expected[k], 1e-9 * largest);  // the digits of TS/T
        change = std::max(change, std::abs(stiff[k] - expected[k]));
    }
    EXPECT_GT(change, 0.01 * largest);
    EXPECT_THAT(
        [&] { read("PSHELL,7,1,0.004,2,,1\nMAT1,1,7.+10,,.3,2700.\nMAT1,2,7.+9,,.3,2700.\n"); },
        ::testing::ThrowsMessage<std::invalid_argument>(HasSubstr("MID2")));
}

TEST_F(ModelSource, MassesOfNastranHaveTheirOffsetAndInertia) {
    const std::string property = "PSHELL,7,1,0.004,1,,1\nMAT1,1,2.1+11,,.3,7850.\n",
                      body = "GRID,90,,-0.05,0.05,0.02\nRBE2,17,90,123456,1,6,11\n",
                      // x along −y, y along x: at (-0.03, 0.04, 0.05) of the basic system
        system = "CORD2R,5,,1.,0.,0.,1.,0.,1.\n,1.,-1.,0.\n",
                      inertia = "\n,3.-4,1.-5,2.-4,2.-5,-3.-5,4.-4\n";
    const auto read = [&](const std::string& more) {
        SourceOptions bulk;
        bulk.path = write("plate.bdf", bulkPlate(property + body + system + more));
        return readModelSource(bulk);
    };
    const FeModel bare = read(""), heavy = read("CONM2,30,90,5,0.5,0.01,0.02,0.03," + inertia),
                  massless = read("CONM2,30,90,5,0.,0.01,0.02,0.03," + inertia),
                  absolute = read("CONM2,30,90,-1,0.5,-0.03,0.04,0.05");
    // The node at the offset does not belong to the interface.
    const auto listPlaces = [](const FeModel& model) {
        std::vector<std::array<double, 3>> places;
        for (const int node : model.mesh.nodeSets.at("RBE2_17")) {
            const auto x = model.mesh.position(node);
            places.push_back({x[0], x[1], x[2]});
        }
        std::sort(places.begin(), places.end());
        return places;
    };
    EXPECT_EQ(listPlaces(heavy), listPlaces(bare));
    EXPECT_NEAR(heavy.calcMass() - bare.calcMass(), 0.5, 1e-12);
    EXPECT_NEAR(massless.calcMass() - bare.calcMass(), 0, 1e-12);
    const auto J0 = calcInertia(bare), J = calcInertia(heavy), J1 = calcInertia(massless),
               J2 = calcInertia(absolute);
    const double x[3] = {-0.05 + 0.02, 0.05 - 0.01, 0.02 + 0.03};
    // The tensor in the mass's axes, with products of inertia converted to tensor signs.
    const double own[3][3] = {{2e-4, 1e-5, 3e-5}, {1e-5, 3e-4, 2e-5}, {3e-5, 2e-5, 4e-4}};
    for (size_t a = 0; a < 3; ++a)
        for (size_t b = 0; b < 3; ++b) {
            const double apart =
                0.5 * ((a == b ? x[0] * x[0] + x[1] * x[1] + x[2] * x[2] : 0) - x[a] * x[b]);
            EXPECT_NEAR(J2[a][b] - J0[a][b], apart, 1e-9) << a << b;
            EXPECT_NEAR(J[a][b] - J0[a][b], apart + own[a][b], 1e-9) << a << b;
            EXPECT_NEAR(J1[a][b] - J0[a][b], own[a][b], 1e-9) << a << b;
        }
    SourceOptions loose;
    loose.path = write("plate.bdf", bulkPlate(property + "CONM2,30,15,,0.5,0.01\n"));
    EXPECT_THAT(errorOf(loose), HasSubstr("has an offset or inertia, but its grid 15 has no "
                                          "rotation; tie it to the part by RBE2"));
}

TEST_F(ModelSource, ShellsRigidBodiesAndMassesOfNastranAreThoseOfTheDeck) {
    SourceOptions bulk, deck;
    bulk.path = write("plate.bdf", bulkPlate("PSHELL,7,1,0.004,1,,1,,5.\nMAT1,1,2.1+11,,.3,7850.\n"
                                             "GRID,90,,-0.05,0.05,0.02\nRBE2,17,90,123456,1,6,11\n"
                                             "CONM2,30,90,,0.5\nCONM2,31,15,,0.25\n"
                                             "PARAM,POST,-1\nPARAM,WTMASS,2.\n"));
    const FeModel model = readModelSource(bulk);
    std::string text = deckPlate("90,-0.05,0.05,0.02\n91,-0.05,0.05,0.02\n");
    // The middle of the shell is 1 mm above its nodes: a quarter of its thickness.
    text +=
        "*MATERIAL,NAME=M\n*ELASTIC\n2.1e11,.3\n*DENSITY\n18200.\n"
        "*SHELL SECTION,ELSET=PLATE,MATERIAL=M,OFFSET=-.25\n.004\n"
        "*ELEMENT,TYPE=MASS,ELSET=HUB\n101,90\n*ELEMENT,TYPE=MASS,ELSET=TIP\n102,15\n"
        "*MASS,ELSET=HUB\n1.\n*MASS,ELSET=TIP\n.5\n"
        "*NSET,NSET=EDGE\n1,6,11\n*RIGID BODY,NSET=EDGE,REF NODE=90,ROT NODE=91\n";
    deck.path = write("plate.inp", text);
    const FeModel plain = readModelSource(deck);
    EXPECT_NEAR(model.calcMass(), 18200 * 0.2 * 0.1 * 0.004 + 1.5, 1e-9);
    const auto z = model.mesh.position(
        model.mesh.indexOf(model.mesh.nodeNumbers.back() - model.mesh.numInternalNodes));
    EXPECT_NEAR(std::abs(z[2] - 0.001), 0.002, 1e-12);
    const auto own = testing::calcFreeFrequencies(model, 14),
               other = testing::calcFreeFrequencies(plain, 14);
    for (size_t i = 6; i < own.size(); ++i)
        EXPECT_NEAR(own[i], other[i], 1e-8 * other[i]) << "mode " << i + 1;
    EXPECT_EQ(model.mesh.nodeSets.at("RBE2_17"), plain.mesh.nodeSets.at("EDGE"));
    EXPECT_THAT(plain.warnings, Contains(HasSubstr("is a hinge")));
    EXPECT_THAT(model.warnings, Not(Contains(HasSubstr("is a hinge"))));
}

constexpr const char* kPlyOfNastran = "MAT8,3,1.4+11,1.+10,.3,5.+9,4.+9,3.5+9,1600.\n";

TEST_F(ModelSource, LayersOfNastranAreThoseOfADeck) {
    // Six layers of 10 mm in total, from 3 mm below the plane that ZOFFS puts 1 mm above the grids.
    SourceOptions deck;
    deck.path =
        write("plate.inp", deckPlate() +
                               "*MATERIAL,NAME=PLY\n*ELASTIC,TYPE=ENGINEERING CONSTANTS\n"
                               "1.4e11,1e10,1e10,.3,0,0,5e9,4e9\n3.5e9\n*DENSITY\n1750.\n"
                               "*MATERIAL,NAME=METAL\n*ELASTIC\n7e10,.33\n*DENSITY\n2850.\n"
                               "*ORIENTATION,NAME=X\n1,0,0,0,1,0\n"
                               "*SHELL SECTION,ELSET=PLATE,COMPOSITE,ORIENTATION=X,OFFSET=-.3\n"
                               ".001,,PLY,30.\n.002,,METAL,0.\n.002,,METAL,90.\n.002,,METAL,90.\n"
                               ".002,,METAL,0.\n.001,,PLY,30.\n");
    const FeModel plain = readModelSource(deck);
    const std::string free = std::string(kPlyOfNastran) +
                             "MAT1,2,7.+10,,.33,2700.\n"
                             "PCOMP,7,-.003,1.5,,,,,SYM\n,3,.001,30.,YES,2,.002,,NO\n,,,90.\n";
    const std::string small =
        "MAT8           3  1.4+11   1.+10      .3    5.+9    4.+9   3.5+9   1600.\n"
        "MAT1           2   7.+10             .33   2700.\n"
        "PCOMP          7   -.003     1.5                                     SYM+PC1\n"
        "+PC1           3    .001     30.     YES       2    .002              NO+PC2\n"
        "+PC2                         90.\n";
    const std::string large =
        "MAT8*                  3        1.40D+11         1.0D+10              .3\n"
        "*                  5.0+9           4.0+9           3.5+9           1600.\n"
        "MAT1,2,7.+10,,.33,2700.\n"
        "PCOMP*                 7           -.003             1.5                \n"
        "*                                                                    SYM\n"
        "*                      3            .001             30.             YES\n"
        "*                      2            .002                              NO\n"
        "*                                                    90.                \n*\n";
    const std::string global =
        std::string(kPlyOfNastran) +
        "MAT1,2,7.+10,,.33,2700.\nPCOMPG,7,-.003,1.5\n,11,3,.001,30.,YES\n,12,2,.002\n"
        ",13,2,,90.\n,14,,,90.\n,15,,,0.\n,16,3,.001,30.\n";
    for (const std::string& property : {free, small, large, global}) {
        SourceOptions bulk;
        bulk.path = write("plate.bdf", bulkPlate(property));
        const FeModel model = readModelSource(bulk);
        expectSameMatrices(model, plain);
        EXPECT_NEAR(model.calcMass(), 0.02 * (2 * 1.6 + 8 * 2.7 + 1.5), 1e-12);
        EXPECT_TRUE(model.mesh.nodeSets.count("PID_7"));
    }
}

TEST_F(ModelSource, AxesOfAMaterialOfNastranAreTheElementsOrASystems) {
    const auto read = [&](const std::string& axes, const std::string& property) {
        std::string text = bulkPlate(kPlyOfNastran + property);
        for (size_t at = 0; (at = text.find(",,0.001\n", at)) != std::string::npos; ++at)
            text.replace(at, 1, "," + axes);
        SourceOptions bulk;
        bulk.path = write("plate.bdf", text);
        return readModelSource(bulk);
    };
    const FeModel byLayers = read("", "PCOMP,7\n,3,.001,75.,,3,.002,-15.\n");
    const std::string fromAxes = "PCOMP,7\n,3,.001,45.,,3,.002,-45.\n";
    expectSameMatrices(read("30.", fromAxes), byLayers);
    // x is (cos 30°, sin 30°, 0).
    const FeModel bySystem =
        read("5", fromAxes + "CORD2R,5,,1.,2.,3.,1.,2.,4.\n,1.8660254037844386,2.5,3.\n");
    expectSameMatrices(bySystem, byLayers);
    expectSameMatrices(read("30.", "PSHELL,7,3,.002,3\n"), read("", "PCOMP,7\n,3,.002,30.\n"));
    expectSameMatrices(read("30.", "PSHELL,7,3,.002,3\n"), read("10.", "PCOMP,7\n,3,.002,20.\n"));
}

/** Stiffnesses A, B, D of layers of one material at 0° or 90°, and frequencies by Navier's series
(R. M. Jones, Mechanics of Composite Materials, 2nd ed., 5.3 and 5.4). **/
class CrossPly {
public:
    CrossPly(const std::vector<double>& angles, double thickness) {
        const double h = thickness * double(angles.size()), nu21 = Nu12 * E2 / E1,
                     Q[2] = {E1 / (1 - Nu12 * nu21), E2 / (1 - Nu12 * nu21)};
        for (size_t k = 0; k < angles.size(); ++k) {
            const double low = thickness * double(k) - h / 2, top = low + thickness;
            const double moments[3] = {top - low, (top * top - low * low) / 2,
                                       (top * top * top - low * low * low) / 3};
            for (int order = 0; order < 3; ++order) {
                const double m = moments[order];
                S11[order] += m * Q[angles[k] == 0 ? 0 : 1];
                S22[order] += m * Q[angles[k] == 0 ? 1 : 0];
                S12[order] += m * Nu12 * Q[1];
                S66[order] += m * G12;
            }
        }
    }

    /** Returns ω √(ρh) of m × n half waves in a square of 1 m. **/
    double calcFactor(int m, int n) const {
        const double a = m * M_PI, b = n * M_PI;
        Eigen::Matrix2d T;
        T << S11[0] * a * a + S66[0] * b * b, (S12[0] + S66[0]) * a * b, (S12[0] + S66[0]) * a * b,
            S66[0] * a * a + S22[0] * b * b;
        const double mixed = S12[1] + 2 * S66[1];
        const Eigen::Vector2d t(-S11[1] * a * a * a - mixed * a * b * b,
                                -S22[1] * b * b * b - mixed * a * a * b);
        const double bending = S11[2] * std::pow(a, 4) + 2 * (S12[2] + 2 * S66[2]) * a * a * b * b +
                               S22[2] * std::pow(b, 4);
        return std::sqrt(bending - t.dot(T.inverse() * t));
    }

    static constexpr double E1 = 1.4e11, E2 = 1e10, Nu12 = 0.3, G12 = 5e9;

private:
    double S11[3] = {}, S12[3] = {}, S22[3] = {}, S66[3] = {};
};

TEST_F(ModelSource, CrossPlyPlatesOfNastranVibrateAsNavierFound) {
    constexpr int N = 24;
    constexpr double Thickness = 0.001;  // of a layer
    std::vector<std::array<double, 3>> grids;
    for (int j = 0; j <= N; ++j)
        for (int i = 0; i <= N; ++i) grids.push_back({double(i) / N, double(j) / N, 0});
    std::string elements;
    for (int j = 0; j < N; ++j)
        for (int i = 0; i < N; ++i) {
            const int first = 1 + i + (N + 1) * j;
            elements +=
                bulkEntry("CQUAD4", {std::to_string(1 + i + N * j), "7", std::to_string(first),
                                     std::to_string(first + 1), std::to_string(first + N + 2),
                                     std::to_string(first + N + 1)});
        }
    const std::string material = "MAT8,3,1.4+11,1.+10,.3,5.+9,5.+10,5.+10,1600.\n";
    // Edges slide along their normals and carry no moment.
    const auto heldAt = [](double x, double y) {
        const auto isEdge = [](double at) { return at < 1e-6 || at > 1 - 1e-6; };
        return std::string(isEdge(x) ? "yz" : "") + (isEdge(y) ? "xz" : "");
    };
    for (const auto& angles : {std::vector<double>{0, 90, 90, 0}, {0, 90}, {0, 90, 0, 90}}) {
        std::vector<std::string> fields = {"7", "", "", "", "", "", "", ""};
        for (const double angle : angles)
            for (const char* field : {"3", ".001", angle == 0 ? "0." : "90.", ""})
                fields.push_back(field);
        const std::string property = bulkEntry("PCOMP", fields);
        SourceOptions bulk;
        bulk.path = write("square.bdf", bulkGrids(grids) + elements + material + property);
        const auto omegas = calcHeldOmegas(readModelSource(bulk), heldAt, 3);
        const CrossPly theory(angles, Thickness);
        std::vector<double> expected;
        for (int m = 1; m < 4; ++m)
            for (int n = 1; n < 4; ++n)
                expected.push_back(theory.calcFactor(m, n) /
                                   std::sqrt(1600 * Thickness * double(angles.size())));
        std::sort(expected.begin(), expected.end());
        for (size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(omegas[k], expected[k], 0.015 * expected[k])
                << angles.size() << " layers, mode " << k + 1;
    }
}

TEST_F(ModelSource, MassesInNodesOfSolidsHaveCalculixFrequencies) {
    SIMFLEX_NEEDS_CALCULIX();
    SourceOptions deck;
    deck.path =
        write("brick.inp", Brick().text() +
                               "*ELEMENT,TYPE=MASS,ELSET=TIP\n901,9\n902,1\n"
                               "*MASS,ELSET=TIP\n.05\n*NODE\n900,0.25,0,0\n"
                               "*RIGID BODY,NSET=RIGHT,REF NODE=900\n"
                               "*ELEMENT,TYPE=MASS,ELSET=HUB\n903,900\n*MASS,ELSET=HUB\n.2\n");
    const FeModel model = readModelSource(deck);
    EXPECT_NEAR(model.calcMass(), Brick().mass() + 0.3, 1e-12);
    const auto own = testing::calcFreeFrequencies(model, 14),
               reference = testing::calcCalculixFrequencies(folder, deck.path, {}, 14);
    for (size_t i = 6; i < own.size(); ++i)
        EXPECT_NEAR(own[i], reference[i], 1e-5 * reference[i]) << "mode " << i + 1;
}

TEST_F(ModelSource, GridsOfNastranStandWhereTheirSystemsSay) {
    const std::string brick =
        "PSOLID,1,1\nMAT1,1,1.+9,,.3,1000.\nCHEXA,1,1,1,2,3,4,5,6\n,7,8\n"
        "GRID,2,,1.,0.,0.\nGRID,3,,1.,1.,0.\nGRID,4,,0.,1.,0.\nGRID,5,,0.,0.,1.\n"
        "GRID,6,,1.,0.,1.\nGRID,8,,0.,1.,1.\n";
    SourceOptions bulk;
    // A cylindrical system about y through (0, 0, 2), and a spherical one in the axes of grids 2, 5
    // and 3.
    bulk.path =
        write("brick.bdf",
              brick +
                  "CORD2C,4,,0.,0.,2.,0.,1.,2.\n,0.,0.,3.\n"
                  "CORD1S,9,2,5,3\nGRID,1,4,2.,180.,0.\nGRID,7,9,1.4142135623730951,45.,0.\n");
    const Mesh mesh = readModelSource(bulk).mesh;
    const auto expectAt = [&](int number, const std::array<double, 3>& x) {
        for (size_t a = 0; a < 3; ++a)
            EXPECT_NEAR(mesh.position(mesh.indexOf(number))[a], x[a], 1e-12) << number;
    };
    expectAt(1, {0, 0, 0});  // θ from z, then back by 180°
    // e3 from 2 to 5: (−1, 0, 1)/√2; e2 = e3 × (0, 1, 0), e1 = (0, 1, 0).
    expectAt(7, {1 - std::sqrt(0.5), 1, std::sqrt(0.5)});
}

TEST_F(ModelSource, RodsOfNastranAreTheTrussesOfADeck) {
    const std::string grids[8] = {"0.,0.,0.", "1.,0.,0.", "1.,1.,0.", "0.,1.,0.",
                                  "0.,0.,1.", "1.,0.,1.", "1.,1.,1.", "0.,1.,1."};
    std::string text =
                    "PSOLID,1,1\nMAT1,1,1.+9,,.3,1000.\nCHEXA,1,1,1,2,3,4,5,6\n,7,8\n"
                    "MAT1,2,2.+11,,.3,7800.\nPROD,5,2,.01,.002,,3.\nCROD,10,5,1,7\n"
                    "CONROD,11,2,8,2,.02\n",
                deck = "*NODE\n";
    for (int k = 0; k < 8; ++k) {
        text += "GRID," + std::to_string(k + 1) + ",," + grids[k] + "\n";
        deck += std::to_string(k + 1) + "," + grids[k] + "\n";
    }
    deck +=
        "*ELEMENT,TYPE=C3D8I,ELSET=B\n1,1,2,3,4,5,6,7,8\n*ELEMENT,TYPE=T3D2,ELSET=R\n10,1,7\n"
        "*ELEMENT,TYPE=T3D2,ELSET=S\n11,2,8\n*MATERIAL,NAME=M\n*ELASTIC\n1e9,.3\n*DENSITY\n"
        "1000.\n*MATERIAL,NAME=N\n*ELASTIC\n2e11,.3\n*DENSITY\n8100.\n*MATERIAL,NAME=O\n"
        "*ELASTIC\n2e11,.3\n*DENSITY\n7800.\n*SOLID SECTION,ELSET=B,MATERIAL=M\n"
        "*SOLID SECTION,ELSET=R,MATERIAL=N\n.01\n*SOLID SECTION,ELSET=S,MATERIAL=O\n.02\n";
    SourceOptions bulk, plain;
    bulk.path = write("rods.bdf", text);
    plain.path = write("rods.inp", deck);
    const FeModel a = readModelSource(bulk), b = readModelSource(plain);
    EXPECT_EQ(a.K.values, b.K.values);
    EXPECT_EQ(a.m.values, b.m.values);
    EXPECT_NEAR(a.calcMass(), 1000 + std::sqrt(3) * (0.01 * 7800 + 3 + 0.02 * 7800), 1e-9);
    EXPECT_EQ(a.mesh.nodeSets.at("PID_5"), (std::vector<int>{0, 6}));
    EXPECT_EQ(a.mesh.nodeSets.at("CONROD_11"), (std::vector<int>{1, 7}));
    EXPECT_THAT(a.notes, Contains(HasSubstr("left out J of rods")));
}

TEST_F(ModelSource, AGeneralBeamSectionMayHaveItsMaterialInItself) {
    const std::string beams =
        "*NODE\n1,0,0,0\n2,.1,0,0\n3,.2,0,0\n4,.2,.1,0\n5,.2,.2,0\n"
        "*ELEMENT,TYPE=B32R,ELSET=B\n1,1,2,3\n2,3,4,5\n";
    SourceOptions own, plain;
    own.path = write("own.inp", beams +
                                    "*BEAM GENERAL SECTION,ELSET=B,SECTION=RECT,DENSITY=7800.\n"
                                    ".01,.02\n0,0,1\n2.08e11,8e10\n");
    plain.path = write("plain.inp", beams +
                                        "*MATERIAL,NAME=M\n*ELASTIC\n2.08e11,.3\n*DENSITY\n7800.\n"
                                        "*BEAM SECTION,ELSET=B,SECTION=RECT,MATERIAL=M\n"
                                        ".01,.02\n0,0,1\n");
    const FeModel a = readModelSource(own), b = readModelSource(plain);
    ASSERT_EQ(a.K.rows, b.K.rows);
    for (size_t k = 0; k < b.K.values.size(); ++k)
        EXPECT_NEAR(a.K.values[k], b.K.values[k], 1e-12 * b.K.values[0]);
    EXPECT_EQ(a.m.values, b.m.values);
}

/** Each system lies in the next one, 1 m above or below it in turn. **/
TEST_F(ModelSource, BulkCoordinateSystemsMayBeInEachOtherWithoutLimit) {
    const std::string plain = bulkPlate("PSHELL,7,1,0.004,1\nMAT1,1,2.1+11,,.3,7850.\n");
    std::string chained = plain;
    chained.replace(chained.find("GRID,1,,"), 8, "GRID,1,1,");
    constexpr int Count = 20000;
    for (int i = 1; i <= Count; ++i) {
        const std::string z = i % 2 ? "1." : "-1.", above = i % 2 ? "2." : "0.";
        chained += "CORD2R," + std::to_string(i) + "," + std::to_string(i < Count ? i + 1 : 0) +
                   ",0.,0.," + z + ",0.,0.," + above + "\n,1.,0.," + z + "\n";
    }
    SourceOptions options;
    options.path = write("plain.bdf", plain);
    const FeModel expected = readModelSource(options);
    options.path = write("chained.bdf", chained);
    const FeModel found = readModelSource(options);
    ASSERT_EQ(found.mesh.positions.size(), expected.mesh.positions.size());
    for (size_t i = 0; i < expected.mesh.positions.size(); ++i)
        EXPECT_NEAR(found.mesh.positions[i], expected.mesh.positions[i], 1e-12);
}

struct BadBulk {
    const char *name, *text, *message;
};

class RefusedBulk : public ModelSource, public ::testing::WithParamInterface<BadBulk> {};

TEST_P(RefusedBulk, IsNamedWithFileLineAndReason) {
    const std::string text = bulkPlate("PSHELL,7,1,0.004,1\nMAT1,1,2.1+11,,.3,7850.\n");
    SourceOptions bulk;
    bulk.path = write("plate.bdf", text + GetParam().text);
    EXPECT_THAT(errorOf(bulk), AllOf(HasSubstr(GetParam().message),
                                     ::testing::ContainsRegex("plate.bdf:[0-9]+: ")));
}

INSTANTIATE_TEST_SUITE_P(
    Entries, RefusedBulk,
    ::testing::Values(
        BadBulk{"Beam", "CBAR,40,9,1,2\n", "B32R of a deck"},
        BadBulk{"BeamOfAShape", "PBARL,9,1,,BOX\n,.1,.1,.01,.01\n", "B32R of a deck"},
        BadBulk{"NoLayers", "PCOMP,9\nCQUAD4,40,9,1,2,7,6\n", "has no layers"},
        BadBulk{"LayerWithoutThickness", "PCOMP,9\n,1\nCQUAD4,40,9,1,2,7,6\n",
                "needs a material MID and a thickness T"},
        BadBulk{"ThinLayer", "PCOMP,9\n,1,-.1\nCQUAD4,40,9,1,2,7,6\n", "must be positive"},
        BadBulk{"SmearedLayers", "PCOMP,9,,,,,,,SMEAR\n,1,.1\nCQUAD4,40,9,1,2,7,6\n",
                "LAM is 'SMEAR'; simflex knows SYM"},
        BadBulk{"LayersOfASolid", "PCOMP,9\n,1,.1\nCTETRA,40,9,1,2,7,6\n", "does not fit"},
        BadBulk{"PlysModulus", "MAT8,9,1.+9,,.3,1.+9,,,1.\nPCOMP,9\n,9,.1\nCQUAD4,40,9,1,2,7,6\n",
                "E2 must be positive"},
        BadBulk{"PlysMass", "MAT8,9,1.+9,1.+9,.3,1.+9\nPCOMP,9\n,9,.1\nCQUAD4,40,9,1,2,7,6\n",
                "no density RHO"},
        BadBulk{"RodOfAPly", "MAT8,9,1.+9,1.+9,.3,1.+9,,,1.\nPROD,9,9,.1\nCROD,40,9,1,2\n",
                "shells alone can have"},
        BadBulk{"TurningAxes",
                "MAT8,9,1.+9,1.+9,.3,1.+9,,,1.\nPCOMP,9\n,9,.1\nCQUAD4,40,9,1,2,7,6,4\n"
                "CORD2C,4,,0.,0.,2.,0.,1.,2.\n,0.,0.,3.\n",
                "whose axes turn"},
        BadBulk{"LawInThePlane", "MAT2,9\n", "by MAT8"},
        BadBulk{"RodWithoutProperty", "CROD,40,9,1,2\n", "do not have as PROD"},
        BadBulk{"RodWithAPlatesProperty", "CROD,40,7,1,2\n", "do not have as PROD"},
        BadBulk{"RodWithoutArea", "CONROD,40,1,2,1\n", "area A must be positive"},
        BadBulk{"RodOfNoGrid", "CONROD,40,1,99,1,.1\n", "node 99"},
        BadBulk{"PlateOfARodsProperty", "PROD,9,1,.1\nCQUAD4,40,9,1,2,7,6\n", "does not fit"},
        BadBulk{"Spring", "CELAS2,40,1e5,1,1,2,1\n", "multibody"},
        BadBulk{"Unknown", "CQUAD5,40,7,1,2,7,6\n", "did you mean CQUAD"},
        BadBulk{"Pyramid", "CPYRAM,40,7,1,2,7,6,3\n", "no pyramids"},
        BadBulk{"NoGrid", "CQUAD4,40,7,1,2,7,99\n", "node 99"},
        BadBulk{"NoProperty", "CQUAD4,40,8,1,2,7,6\n", "property 8"},
        BadBulk{"WrongProperty", "CTETRA,40,7,1,2,7,6\n", "does not fit"},
        BadBulk{"HalfQuadratic", "CTETRA,40,7,1,2,7,6,3\n", "all or none"},
        BadBulk{"CornerThickness", "CQUAD4,40,7,1,2,7,6\n,,,.1\n", "thicknesses of its own"},
        BadBulk{"System", "GRID,80,3,0.,0.,0.\n", "coordinate system 3"},
        BadBulk{"SystemOfItself", "GRID,80,3,0.,0.,0.\nCORD2R,3,3,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n",
                "goes back to itself"},
        BadBulk{"FlatSystem", "GRID,80,3,0.,0.,0.\nCORD2R,3,,0.,0.,0.,0.,0.,1.\n,0.,0.,2.\n",
                "on one line"},
        BadBulk{"Partial", "GRID,80,,0.,0.,0.\nRBE2,40,80,12,1,2\n", "all translations"},
        BadBulk{"Pinned", "GRID,80,,0.,0.,0.\nRBE2,40,80,123,1,2\n", "of a shell free"},
        BadBulk{"Chain",
                "GRID,80,,0.,0.,0.\nGRID,81,,0.,0.,0.\nRBE2,40,80,123456,1,2,81\n"
                "RBE2,41,81,123456,14,15\n",
                "write both as one"},
        BadBulk{"MassOnMean", "GRID,80,,0.,0.,0.\nRBE3,40,,80,123456,1.,123,1,2\nCONM2,50,80,,1.\n",
                "hangs on RBE3"},
        BadBulk{"MeanInPart", "RBE3,40,,1,123456,1.,123,2,3\n", "something else uses"},
        BadBulk{"Inertia", "CONM2,50,1,,1.,0.1\n", "offset or inertia"},
        BadBulk{"ManyFields", "GRID,80,,1.,0.,0.,,,,,7\n", "more than the 8 fields"},
        BadBulk{"Twice", "GRID,1,,5.,0.,0.\n", "given twice"},
        BadBulk{"NotANumber", "GRID,80,,1.,x,0.\n", "must be a finite number"}),
    [](const auto& entry) { return entry.param.name; });

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

/** Writes a steel brick in another system of units. **/
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
    // Round-off decides which entries are exact zeros, so compare products with a vector.
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

    // Messages while reading are the model's notes and warnings, each once.
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
    // A rough estimate: within a factor of three.
    EXPECT_NEAR(std::log(figures.waveSpeed / std::sqrt(brick.E / brick.rho)), 0, std::log(3));
}

}  // namespace
}  // namespace simflex
