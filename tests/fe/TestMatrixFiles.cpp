/** @file
K and M from files of other programs: Matrix Market, Abaqus, Nastran. **/

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "fe/MatrixFiles.h"
#include "fe/TestDecks.h"
#include "simflex/fe/AbaqusMatrices.h"
#include "simflex/fe/ArrayMatrices.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/MatrixEntries.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/fe/NastranDmig.h"
#include "simflex/part/ArrayFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::MatrixText;

/** A brick assembled by CalculiX, and a folder for its matrices. **/
class MatrixFiles : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        testing::TestFolder once;
        testing::Brick brick;
        brick.elements = {4, 2, 1};
        brick.size = {0.2, 0.05, 0.02};
        testing::writeText(once / "brick.inp", brick.meshText(11, 7) + brick.materialText());
        model = new FeModel(readCalculixDeck(once / "brick.inp"));
    }
    static void TearDownTestSuite() { delete model; }

    void SetUp() override { testing::writeText(folder / "nodes.csv", MatrixText(*model).nodes()); }

    std::string write(const std::string& name, const std::string& text) {
        testing::writeText(folder / name, text);
        return folder / name;
    }

    template <class Read>
    static std::string errorOf(Read read) {
        try {
            read();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    /** Compares matrices entry by entry, and nodes. **/
    static void expectSame(const FeModel& found, double tolerance = 0) {
        EXPECT_EQ(found.mesh.nodeNumbers, model->mesh.nodeNumbers);
        EXPECT_EQ(found.mesh.positions, model->mesh.positions);
        for (const auto& [a, b] : {std::pair(&found.K, &model->K), {&found.m, &model->m}}) {
            ASSERT_EQ(a->columnStarts, b->columnStarts);
            ASSERT_EQ(a->rows, b->rows);
            const double largest = *std::max_element(b->values.begin(), b->values.end());
            for (size_t k = 0; k < a->values.size(); ++k)
                ASSERT_NEAR(a->values[k], b->values[k], tolerance * largest);
        }
    }

    FeModel readMarket() const {
        return readMatrixMarket(folder / "K.mtx", folder / "M.mtx", folder / "nodes.csv");
    }
    void writeMarket() {
        write("K.mtx", MatrixText(*model).market(model->K, 1));
        write("M.mtx", MatrixText(*model).market(model->m, 3));
    }

    testing::TestFolder folder;
    static FeModel* model;
};

FeModel* MatrixFiles::model = nullptr;

TEST_F(MatrixFiles, MatrixMarketReadsBackToTheSameBits) {
    writeMatrixMarket(*model, folder / "brick");
    const FeModel same = readMatrixMarket(folder / "brick_K.mtx", folder / "brick_M.mtx",
                                          folder / "brick_nodes.inp");
    expectSame(same);
    EXPECT_EQ(same.mesh.nodeSets, model->mesh.nodeSets);
    ASSERT_EQ(same.mesh.elements.size(), 1u);
    EXPECT_EQ(same.mesh.elements[0].nodes, model->mesh.elements[0].nodes);
}

TEST_F(MatrixFiles, MatrixMarketGeneralWithBothTrianglesIsTheSameModel) {
    writeMarket();
    write("K.mtx", MatrixText(*model).marketGeneral(model->K));
    expectSame(readMarket());
}

TEST_F(MatrixFiles, RowsFollowTheNodesInTheOrderOfTheirTable) {
    MatrixText text(*model);
    text.shuffleNodes(3);
    write("nodes.csv", text.nodes());
    write("K.mtx", text.market(model->K, 1));
    write("M.mtx", text.market(model->m, 3));
    expectSame(readMarket());
}

TEST_F(MatrixFiles, RowsFollowAFileOfTheDegreesOfFreedom) {
    MatrixText text(*model);
    write("nodes.csv", text.nodes());
    text.shuffleDofs(5);
    write("K.mtx", text.market(model->K, 1));
    write("M.mtx", text.market(model->m, 3));
    MatrixMarketOptions options;
    options.dofs = write("part.dof", text.dofs());
    expectSame(readMatrixMarket(folder / "K.mtx", folder / "M.mtx", folder / "nodes.csv", options));
}

TEST_F(MatrixFiles, AbaqusMatrixInputIsTheSameModel) {
    const MatrixText text(*model);
    write("job.inp", text.abaqusDeck());
    expectSame(readAbaqusMatrices(write("stif.mtx", text.abaqus(model->K, 1)),
                                  write("mass.mtx", text.abaqus(model->m, 3)), folder / "job.inp"));
}

TEST_F(MatrixFiles, AbaqusCoordinateFormatIsTheSameModel) {
    const MatrixText text(*model);
    expectSame(readAbaqusMatrices(write("stif.mtx", text.coordinate(model->K, 1)),
                                  write("mass.mtx", text.coordinate(model->m, 3)),
                                  folder / "nodes.csv"));
}

TEST_F(MatrixFiles, NodesThatTheMatricesLackAreLeftOutAndReported) {
    const MatrixText text(*model);
    write("nodes.csv", text.nodes() + "9001, 0, 0, 5\n9002 0 0 6\n");
    const FeModel read =
        readAbaqusMatrices(write("stif.mtx", text.abaqus(model->K, 1)),
                           write("mass.mtx", text.abaqus(model->m, 3)), folder / "nodes.csv");
    expectSame(read);
    ASSERT_EQ(read.notes.size(), 1u);
    EXPECT_THAT(read.notes[0], HasSubstr("2 nodes"));
}

TEST_F(MatrixFiles, NastranFreeFieldIsTheSameModel) {
    const MatrixText text(*model);
    write("part.bdf", text.gridsFree());
    write("part.pch", text.dmigFree("KAAX", model->K, 1) + text.dmigFree("MAAX", model->m, 3));
    expectSame(readNastranDmig(folder / "part.pch", folder / "part.bdf"));
}

TEST_F(MatrixFiles, NastranLargeFieldIsTheSameModelToItsTenDigits) {
    const MatrixText text(*model);
    write("part.bdf", text.gridsFree());
    write("part.pch", "$TITLE   = BRICK\n" + text.dmigLarge("kaax", model->K, 1));
    NastranDmigOptions options;
    options.massFile = write("mass.pch", text.dmigLarge("MEX", model->m, 3));
    options.massName = "mex";
    expectSame(readNastranDmig(folder / "part.pch", folder / "part.bdf", options), 1e-9);
}

TEST_F(MatrixFiles, NastranSmallFieldsAndNumbersWithoutAnEAreRead) {
    write("small.bdf",
          "GRID           1             0.0     -.0   0.0-1                        \n"
          "GRID*                  2                            +1.0             0.0\n"
          "*                    0.0\n"
          "GRID,3,,0.,1.D0,0.\nGRID\t4\t\t0.\t0.\t10.-1\n");
    // Springs of stiffness 2 along the edges of the tetrahedron; masses 3 at its corners.
    const double x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double K[12][12] = {};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) {
            double squared = 0;
            for (int a = 0; a < 3; ++a) squared += std::pow(x[i][a] - x[j][a], 2);
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b) {
                    const double k = 2 * (x[i][a] - x[j][a]) * (x[i][b] - x[j][b]) / squared;
                    K[3 * i + a][3 * i + b] += k;
                    K[3 * j + a][3 * j + b] += k;
                    K[3 * i + a][3 * j + b] -= k;
                    K[3 * j + a][3 * i + b] -= k;
                }
        }
    std::string text = "DMIG    KAAX           0       6       1       0\n";
    char line[100];
    for (int column = 0; column < 12; ++column) {
        std::snprintf(line, sizeof line, "DMIG    KAAX    %8d%8d        ", column / 3 + 1,
                      column % 3 + 1);
        text += line;
        int count = 1;
        for (int row = column; row < 12; ++row) {
            std::snprintf(line, sizeof line, "%8d%8d%5.0f.-1%s", row / 3 + 1, row % 3 + 1,
                          10 * K[row][column], count % 2 ? "\n        " : "        ");
            text += line;
            ++count;
        }
        text += "\n";
    }
    text += "DMIG    MAAX    0       6       2       0\n";
    for (int dof = 0; dof < 12; ++dof) {
        std::snprintf(line, sizeof line, "DMIG,MAAX,%d,%d,,%d,%d,.3+1\n", dof / 3 + 1, dof % 3 + 1,
                      dof / 3 + 1, dof % 3 + 1);
        text += line;
    }
    const FeModel tetrahedron = readNastranDmig(write("small.pch", text), folder / "small.bdf");
    EXPECT_EQ(tetrahedron.mesh.positions,
              (std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_DOUBLE_EQ(tetrahedron.calcMass(), 12);
    double found[12][12] = {};
    for (int column = 0; column < 12; ++column)
        for (auto k = tetrahedron.K.columnStarts[size_t(column)];
             k < tetrahedron.K.columnStarts[size_t(column) + 1]; ++k)
            found[tetrahedron.K.rows[size_t(k)]][column] = tetrahedron.K.values[size_t(k)];
    for (int column = 0; column < 12; ++column)
        for (int row = column; row < 12; ++row)
            EXPECT_DOUBLE_EQ(found[row][column], K[row][column]);

    write("small.pch", text + "DMIG    KAAX           9       1               9       1      1.\n");
    EXPECT_THAT(
        errorOf([&] { readNastranDmig(folder / "small.pch", folder / "small.bdf"); }),
        AllOf(ContainsRegex("small.pch:[0-9]+"), HasSubstr("node 9"), HasSubstr("not list")));
}

/** Every route gives the same reduced part as the CalculiX route. **/
TEST_F(MatrixFiles, EveryRouteGivesTheSameReducedBody) {
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    options.numModes = 20;
    const ReducedBody expected = reduce(*model, options);

    MatrixText text(*model);
    write("job.inp", text.abaqusDeck());
    write("stif.mtx", text.abaqus(model->K, 1));
    write("mass.mtx", text.abaqus(model->m, 3));
    write("part.pch", text.dmigFree("KAAX", model->K, 1) + text.dmigFree("MAAX", model->m, 3));
    text.shuffleDofs(1);
    write("K.mtx", text.market(model->K, 1));
    write("M.mtx", text.marketGeneral(model->m, 3));
    MatrixMarketOptions market;
    market.dofs = write("part.dof", text.dofs());

    const std::string deck = folder / "job.inp";
    for (const FeModel& route : {readMatrixMarket(folder / "K.mtx", folder / "M.mtx", deck, market),
                                 readAbaqusMatrices(folder / "stif.mtx", folder / "mass.mtx", deck),
                                 readNastranDmig(folder / "part.pch", deck)}) {
        const ReducedBody found = reduce(route, options);
        ASSERT_EQ(found.numModes, expected.numModes);
        const auto expectNear = [&](const std::vector<double>& a, const std::vector<double>& b) {
            double largest = 0;
            for (const double value : b) largest = std::max(largest, std::abs(value));
            ASSERT_EQ(a.size(), b.size());
            for (size_t k = 0; k < a.size(); ++k)
                ASSERT_NEAR(std::abs(a[k]), std::abs(b[k]), 1e-10 * largest) << route.source;
        };
        for (int i = 0; i < expected.numModes; ++i)
            EXPECT_NEAR(found.omegaSquared[size_t(i)] / expected.omegaSquared[size_t(i)], 1, 1e-10);
        expectNear(found.Phi, expected.Phi);
        expectNear(found.I1, expected.I1);
        for (size_t c = 0; c < 6; ++c) expectNear(found.I2[c], expected.I2[c]);
        for (size_t a = 0; a < 3; ++a) expectNear(found.N[a], expected.N[a]);
        EXPECT_NEAR(found.mass, expected.mass, 1e-10 * expected.mass);
        for (size_t c = 0; c < 6; ++c)
            EXPECT_NEAR(found.inertia[c], expected.inertia[c], 1e-10 * expected.inertia[1]);
    }
}

TEST_F(MatrixFiles, ArraysReadBackToTheSameBits) {
    for (const char* name : {"part.npz", "part.mat"}) {
        writeArrayMatrices(*model, folder / name);
        const FeModel same = readArrayMatrices(folder / name);
        EXPECT_EQ(same.K.values, model->K.values) << name;
        EXPECT_EQ(same.K.rows, model->K.rows) << name;
        EXPECT_EQ(same.m.values, model->m.values) << name;
        EXPECT_EQ(same.mesh.positions, model->mesh.positions) << name;
        EXPECT_EQ(same.mesh.nodeNumbers, model->mesh.nodeNumbers) << name;
        EXPECT_EQ(same.mesh.nodeSets, model->mesh.nodeSets) << name;
        const std::string bytes = testing::readText(folder / name);
        writeArrayMatrices(*model, folder / name);
        EXPECT_EQ(testing::readText(folder / name), bytes) << name;
    }
}

/** Runs a Python program in the folder. **/
void runPython(const testing::TestFolder& folder, const std::string& program) {
    testing::writeText(folder / "program.py", program);
    ASSERT_EQ(std::system(("cd '" + folder.path() + "' && /usr/bin/python3 program.py").c_str()),
              0);
}

TEST_F(MatrixFiles, ArraysOfNumPyAndSciPyAreTheSameModel) {
    writeArrayMatrices(*model, folder / "own.npz");
    runPython(
        folder,
        "import numpy as np, scipy.sparse as sp, scipy.io as io\n"
        "a = np.load('own.npz')\n"
        "K, M = [sp.csc_matrix((a[n + '_data'], a[n + '_indices'], a[n + '_indptr'])) for n in "
        "'KM']\n"
        "xyz, left = a['nodes'], a['LEFT'].ravel().astype(np.int32)\n"
        "assert abs(K - K.T).max() == 0 and M.sum() > 0\n"
        "np.savez('dense.npz', K=K.toarray(), M=M.toarray(), nodes=xyz, LEFT=left)\n"
        "R = K.tocsr()\n"
        "np.savez_compressed('packed.npz', K_data=R.data, K_indices=R.indices, K_indptr=R.indptr,\n"
        "    M=np.asfortranarray(M.toarray()), nodes=np.asfortranarray(xyz), LEFT=left, text='no "
        "number')\n"
        "io.savemat('sparse.mat', dict(K=K, M=M, nodes=xyz, LEFT=left, notes='text'))\n"
        "io.savemat('packed.mat', dict(K=K, M=M.toarray(), nodes=xyz, LEFT=left), "
        "do_compression=True)\n"
        "io.savemat('bomb.mat', dict(K=np.zeros((40000, 1000), np.int8)), do_compression=True)\n");
    EXPECT_THAT(errorOf([&] { readArrayFile(folder / "bomb.mat"); }),
                HasSubstr("it would fill the machine"));
    for (const char* name : {"dense.npz", "packed.npz", "sparse.mat", "packed.mat"}) {
        SourceOptions options;
        options.path = folder / name;
        const FeModel same = readModelSource(options);
        EXPECT_EQ(same.K.values, model->K.values) << name;
        EXPECT_EQ(same.m.values, model->m.values) << name;
        EXPECT_EQ(same.mesh.positions, model->mesh.positions) << name;
        EXPECT_EQ(same.mesh.nodeSets.at("LEFT"), model->mesh.nodeSets.at("LEFT")) << name;
    }
}

TEST_F(MatrixFiles, ArraysThatAreMissingOrDoNotFitAreRefusedWithTheirNames) {
    writeArrayMatrices(*model, folder / "own.npz");
    const std::vector<FileArray> good = readArrayFile(folder / "own.npz");
    const auto errorWith = [&](const char* name, const auto& change) {
        std::vector<FileArray> arrays = good;
        for (FileArray& array : arrays)
            if (array.name == name) change(array);
        std::string messages;
        for (const char* file : {"bad.npz", "bad.mat"}) {
            writeArrayFile(folder / file, arrays);
            messages += errorOf([&] { readArrayMatrices(folder / file); }) + "\n";
        }
        return messages;
    };
    const auto twice = [](const std::string& text) {
        return ContainsRegex("bad.npz: [^\n]*" + text + "[^\n]*\n[^\n]*bad.mat: [^\n]*" + text);
    };
    EXPECT_THAT(errorWith("K", [](FileArray& a) { a.name = "STIFF"; }),
                twice("no array K, the stiffness matrix; it has .*STIFF"));
    EXPECT_THAT(errorWith("nodes", [](FileArray& a) { a.values[0] = 1.5; }),
                twice("nodes numbers a node 1.5"));
    EXPECT_THAT(errorWith("nodes", [](FileArray& a) { a.values[1] = a.values[0]; }),
                twice("twice"));
    EXPECT_THAT(errorWith("nodes",
                          [](FileArray& a) {
                              a.shape = {a.shape[0] * 2, 2};
                          }),
                twice("must have a row x y z, or number x y z"));
    EXPECT_THAT(errorWith("M",
                          [](FileArray& a) {
                              a = makeArray("M", 2, 2, {1, 0, 0, 1});
                          }),
                twice("must have three rows and columns for each of the"));
    EXPECT_THAT(errorWith("K", [](FileArray& a) { a.values[1] *= 2; }), twice("not symmetric"));
    for (const char* name : {"cut.npz", "cut.mat"}) {
        writeArrayMatrices(*model, folder / name);
        const std::string bytes = testing::readText(folder / name);
        const size_t step = bytes.size() / 40 + 1;
        for (size_t size = 0; size < bytes.size(); size += step) {
            write(name, bytes.substr(0, size));
            EXPECT_THAT(errorOf([&] { readArrayMatrices(folder / name); }), HasSubstr(name))
                << size;
        }
    }
}

TEST_F(MatrixFiles, MatricesWithFewerNumbersThanTheirShapeAreRefused) {
    writeArrayFile(folder / "short.mat", {makeArray("nodes", 4, 3, std::vector<double>(12, 1.0))});
    std::string bytes = testing::readText(folder / "short.mat");
    const std::string shape("\4\0\0\0\3\0\0\0", 8);
    const size_t at = bytes.find(shape);
    ASSERT_NE(at, std::string::npos);
    bytes[at] = 5;
    write("short.mat", bytes);
    EXPECT_THAT(errorOf([&] { readArrayFile(folder / "short.mat"); }),
                HasSubstr("nodes has 12 numbers, not its 5×3"));
}

TEST_F(MatrixFiles, AModelWithoutElementsIsConnectedThroughItsStiffness) {
    writeMarket();
    EXPECT_TRUE(readMarket().mesh.elements.empty());

    // The brick twice, side by side: free, but two pieces.
    FeModel two = *model;
    const int n = model->mesh.numNodes();
    for (int node = 0; node < n; ++node) {
        two.mesh.nodeNumbers.push_back(1000 + node);
        for (int a = 0; a < 3; ++a)
            two.mesh.positions.push_back(model->mesh.positions[size_t(3 * node + a)] + 1);
    }
    two.mesh.elements.clear();
    two.mesh.nodeSets.clear();
    for (auto [A, size] : {std::pair(&two.K, 3 * n), {&two.m, n}}) {
        const auto starts = A->columnStarts;
        const auto entries = A->numEntries();
        for (int column = 1; column <= size; ++column)
            A->columnStarts.push_back(entries + starts[size_t(column)]);
        for (std::int64_t k = 0; k < entries; ++k) {
            A->rows.push_back(A->rows[size_t(k)] + size);
            A->values.push_back(A->values[size_t(k)]);
        }
        A->size *= 2;
    }
    EXPECT_THAT(errorOf([&] { two.validate(); }), HasSubstr("2 pieces"));
}

/** An error in a Matrix Market file and the expected message. **/
struct BadLine {
    const char *from, *to, *file, *message;
};

class BadMatrixMarket : public MatrixFiles, public ::testing::WithParamInterface<BadLine> {};

TEST_P(BadMatrixMarket, IsRefusedWithFileLineAndCure) {
    writeMarket();
    const BadLine& bad = GetParam();
    std::string text = testing::readText(folder / bad.file);
    const size_t at = text.find(bad.from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, std::string(bad.from).size(), bad.to);
    write(bad.file, text);
    EXPECT_THAT(errorOf([&] { readMarket(); }), ContainsRegex(bad.message));
}

INSTANTIATE_TEST_SUITE_P(
    Lines, BadMatrixMarket,
    ::testing::Values(
        BadLine{"%%MatrixMarket", "%MatrixMarket", "K.mtx", "K.mtx:1: this is no Matrix Market"},
        BadLine{"coordinate", "array", "K.mtx", "K.mtx:1: the matrix is stored as 'array'"},
        BadLine{"real", "complex", "M.mtx", "M.mtx:1: the matrix has entries of kind 'complex'"},
        BadLine{"symmetric", "hermitian", "K.mtx", "declared 'hermitian'.*symmetric"},
        BadLine{"\n90 90", "\n93 93", "K.mtx", "K.mtx:2: .*93 × 93, the nodes have 90 degrees"},
        BadLine{"\n1 1 ", "\n1 91 ", "K.mtx", "K.mtx:3: entry .1, 91. lies outside .* size 90"},
        BadLine{"\n1 1 ", "\n0 1 ", "K.mtx", "K.mtx:3: .*counted from 1"},
        BadLine{"\n1 1 ", "\n1 1 nan ", "K.mtx", "K.mtx:3: an entry has three fields"},
        BadLine{"\n1 1 ", "\n1 1 x", "K.mtx", "K.mtx:3: the value is 'x.*must be a finite number"},
        BadLine{"\n2 1 ", "\n1 2 ", "K.mtx", "K.mtx:[0-9]+: .*symmetric.*below and above"},
        BadLine{"\n1 1 ", "\n% ", "K.mtx", "K.mtx: the file has .* header says"},
        BadLine{"11, ", "11.5, ", "nodes.csv", "nodes.csv:2: the node number is '11.5'"},
        BadLine{"11, ", "12, ", "nodes.csv", "nodes.csv: node 12 is listed twice"},
        BadLine{"11, ", "", "nodes.csv", "nodes.csv:2: the line has 3 fields; it must have four"}));

TEST_F(MatrixFiles, AMatrixThatIsNotSymmetricIsRefusedWithItsNodes) {
    writeMarket();
    std::string text = MatrixText(*model).marketGeneral(model->K);
    const size_t at = text.find("\n1 2 ");
    text.replace(at, 5, "\n1 2 1");
    write("K.mtx", text);
    EXPECT_THAT(
        errorOf([&] { readMarket(); }),
        AllOf(HasSubstr("K.mtx"), HasSubstr("not symmetric"), HasSubstr("direction 1 of node 11")));
}

TEST_F(MatrixFiles, AHeldStiffnessIsRefused) {
    const MatrixText text(*model);
    write("stif.mtx", text.abaqus(model->K, 1) + "11,1, 11,1, 1e36\n");
    write("mass.mtx", text.abaqus(model->m, 3));
    EXPECT_THAT(errorOf([&] {
                    readAbaqusMatrices(folder / "stif.mtx", folder / "mass.mtx",
                                       folder / "nodes.csv");
                }),
                AllOf(HasSubstr("not free"), HasSubstr("node 11"), HasSubstr("supports")));
}

TEST_F(MatrixFiles, RotationsAreRefusedUnlessTheyAreZero) {
    const MatrixText text(*model);
    write("mass.mtx", text.abaqus(model->m, 3));
    const auto read = [&] {
        return readAbaqusMatrices(folder / "stif.mtx", folder / "mass.mtx", folder / "nodes.csv");
    };
    write("stif.mtx", text.abaqus(model->K, 1) + "11,4, 11,4, 0.\n");
    expectSame(read());
    write("stif.mtx", "** first line\n11,4, 11,1, 2e3\n" + text.abaqus(model->K, 1));
    EXPECT_THAT(errorOf(read), AllOf(HasSubstr("stif.mtx:2"), HasSubstr("direction 4 of node 11"),
                                     HasSubstr("rotation"), HasSubstr("solids")));
    write("stif.mtx", "-3,1, 11,1, 2e3\n" + text.abaqus(model->K, 1));
    EXPECT_THAT(errorOf(read), AllOf(HasSubstr("node -3"), HasSubstr("internal")));
}

TEST_F(MatrixFiles, AMassThatDiffersBetweenDirectionsIsRefused) {
    const MatrixText text(*model);
    write("stif.mtx", text.abaqus(model->K, 1));
    write("mass.mtx", text.abaqus(model->m, 3) + "11,3, 11,3, 0.01\n");
    EXPECT_THAT(errorOf([&] {
                    readAbaqusMatrices(folder / "stif.mtx", folder / "mass.mtx",
                                       folder / "nodes.csv");
                }),
                AllOf(HasSubstr("mass.mtx"), HasSubstr("directions 1 and 3"), HasSubstr("11")));
}

TEST_F(MatrixFiles, AbaqusDecksOfSeveralPartsAreRefused) {
    const MatrixText text(*model);
    write("job.inp", "*PART, NAME=A\n*END PART\n*PART, NAME=B\n" + text.abaqusDeck());
    write("stif.mtx", text.abaqus(model->K, 1));
    EXPECT_THAT(errorOf([&] {
                    readAbaqusMatrices(folder / "stif.mtx", folder / "stif.mtx",
                                       folder / "job.inp");
                }),
                AllOf(ContainsRegex("job.inp:[0-9]+"), HasSubstr("several parts")));
}

TEST_F(MatrixFiles, NastranSaysWhichMatricesAreThereAndRefusesOtherFrames) {
    const MatrixText text(*model);
    write("part.pch", text.dmigFree("KAAX", model->K, 1));
    write("part.bdf", text.gridsFree());
    const auto read = [&] { return readNastranDmig(folder / "part.pch", folder / "part.bdf"); };
    EXPECT_THAT(errorOf(read), AllOf(HasSubstr("no DMIG matrix MAAX"), HasSubstr("KAAX")));
    write("part.pch", "DMIG,KAAX,0,6,4\n");
    EXPECT_THAT(errorOf(read), AllOf(HasSubstr("part.pch:1"), HasSubstr("type 4")));
    write("part.pch", "DMIG,KAAX,0,9,2\n");
    EXPECT_THAT(errorOf(read), AllOf(HasSubstr("part.pch:1"), HasSubstr("form 9")));
    write("part.bdf", "GRID,11,,0.,0.,0.,7\n");
    EXPECT_THAT(errorOf(read),
                AllOf(HasSubstr("part.bdf:1"), HasSubstr("CD is 7"), HasSubstr("basic system")));
}

/** Round-off is judged relative to the largest entry: the same in tonnes as in milligrams. **/
TEST(NodalMass, RoundOffIsMeasuredByTheLargestMass) {
    Mesh mesh;
    mesh.nodeNumbers = {1};
    mesh.positions = {0, 0, 0};
    const auto take = [&](double mass, double coupling, double difference) {
        return takeNodalMass(
            SymmetricMatrix::fromEntries(3, {0, 1, 1, 2}, {0, 0, 1, 2},
                                         {mass, coupling * mass, mass, (1 + difference) * mass}),
            mesh);
    };
    for (const double mass : {1e-9, 1.0, 1e9}) {
        EXPECT_EQ(take(mass, 1e-13, 1e-13).values, std::vector<double>{mass});
        EXPECT_THROW(take(mass, 1e-6, 0), std::invalid_argument) << mass;
        EXPECT_THROW(take(mass, 0, 1e-6), std::invalid_argument) << mass;
    }
}

}  // namespace
}  // namespace simflex
