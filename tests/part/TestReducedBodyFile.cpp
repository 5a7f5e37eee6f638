#include <gmock/gmock.h>
#include <hdf5.h>
#include <sys/stat.h>

#include <filesystem>
#include <limits>

#include "fe/TestDecks.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TestFolder;

/** Returns a part with two modes on a tetrahedron, with all numbers different. **/
ReducedBody makePart() {
    double next = 0.1;
    auto fill = [&next](size_t count) {
        std::vector<double> values(count);
        for (double& value : values) value = next += 1.0 / 3.0;
        return values;
    };
    ReducedBody body;
    body.name = "Pleuel größer";
    body.mass = 1.0 / 3.0;
    body.centerOfMass = {0.1, -1e-300, 3e17};
    body.inertia = {1, 2, 3, -0.1, 0.2, -0.3};
    body.numModes = 2;
    body.omegaSquared = {2e6 / 7, 1e6};
    body.I1 = fill(12);
    for (auto& I2 : body.I2) {
        I2 = fill(4);
        I2[1] = I2[2];
    }
    for (size_t k = 0; k < 4; ++k)  // modal masses of 1
        body.I2[2][k] = (k % 3 == 0 ? 2 : 0) - body.I2[0][k] - body.I2[1][k];
    for (auto& N : body.N) {
        const double value = fill(1)[0];
        N = {0, value, -value, 0};
    }
    body.mesh.nodeNumbers = {3, 7, 9, 20};
    body.mesh.positions = fill(12);
    body.mesh.elements = {{ElementType::Tet4, {0, 1, 2, 3}}, {ElementType::Wedge6, {}, true}};
    body.mesh.nodeSets = {{"A/B.C", {0, 2}}, {"EMPTY", {}}};
    body.mesh.expandedNodes = {{3, {0, 2, 3}}, {7, {1}}, {12, {}}};
    body.Phi = fill(24);
    ReducedBody::Interface seat;
    seat.name = "seat / 1";
    seat.position = {1, 2, 3};
    seat.Phi = fill(6);
    seat.Psi = fill(6);
    seat.nodes = {0, 1, 3};
    body.interfaces = {seat, seat};
    body.interfaces[1].name = "other";
    body.provenance = {"deck.inp", "simflex", "", "m kg s"};
    return body;
}

void expectSame(const ReducedBody& a, const ReducedBody& b) {
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.mass, b.mass);
    EXPECT_EQ(a.centerOfMass, b.centerOfMass);
    EXPECT_EQ(a.inertia, b.inertia);
    EXPECT_EQ(a.numModes, b.numModes);
    EXPECT_EQ(a.omegaSquared, b.omegaSquared);
    EXPECT_EQ(a.I1, b.I1);
    EXPECT_EQ(a.I2, b.I2);
    EXPECT_EQ(a.N, b.N);
    EXPECT_EQ(a.Phi, b.Phi);
    EXPECT_EQ(a.mesh.nodeNumbers, b.mesh.nodeNumbers);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.mesh.nodeSets, b.mesh.nodeSets);
    EXPECT_EQ(a.mesh.expandedNodes, b.mesh.expandedNodes);
    ASSERT_EQ(a.mesh.elements.size(), b.mesh.elements.size());
    for (size_t k = 0; k < a.mesh.elements.size(); ++k) {
        EXPECT_EQ(a.mesh.elements[k].type, b.mesh.elements[k].type);
        EXPECT_EQ(a.mesh.elements[k].nodes, b.mesh.elements[k].nodes);
        EXPECT_EQ(a.mesh.elements[k].isShell, b.mesh.elements[k].isShell);
    }
    ASSERT_EQ(a.interfaces.size(), b.interfaces.size());
    for (size_t k = 0; k < a.interfaces.size(); ++k) {
        EXPECT_EQ(a.interfaces[k].name, b.interfaces[k].name);
        EXPECT_EQ(a.interfaces[k].position, b.interfaces[k].position);
        EXPECT_EQ(a.interfaces[k].Phi, b.interfaces[k].Phi);
        EXPECT_EQ(a.interfaces[k].Psi, b.interfaces[k].Psi);
        EXPECT_EQ(a.interfaces[k].nodes, b.interfaces[k].nodes);
    }
    EXPECT_EQ(a.provenance.source, b.provenance.source);
    EXPECT_EQ(a.provenance.program, b.provenance.program);
    EXPECT_EQ(a.provenance.created, b.provenance.created);
    EXPECT_EQ(a.provenance.units, b.provenance.units);
}

class ReducedBodyFileTest : public ::testing::Test {
protected:
    std::string errorOf(const std::string& path) {
        try {
            readReducedBody(path);
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr(path));
            return error.what();
        }
        return "accepted";
    }

    /** Writes the part, then changes one integer attribute or removes one object. **/
    void writeChanged(const char* attribute, int value, const char* removed = nullptr) {
        writeReducedBody(file, makePart());
        const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
        if (removed) {
            H5Ldelete(id, removed, H5P_DEFAULT);
        } else {
            const hid_t number = H5Aopen(id, attribute, H5P_DEFAULT);
            H5Awrite(number, H5T_NATIVE_INT, &value);
            H5Aclose(number);
        }
        H5Fclose(id);
    }

    /** Writes the part, then overwrites the first number of a data set. **/
    void writeWithNumber(const char* data, double value) {
        writeReducedBody(file, makePart());
        const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
        const hid_t set = H5Dopen2(id, data, H5P_DEFAULT);
        std::vector<double> values(1000);
        H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        values[0] = value;
        H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        H5Dclose(set);
        H5Fclose(id);
    }

    TestFolder folder;
    std::string file = folder / "part.h5";
};

TEST_F(ReducedBodyFileTest, RoundTripIsExact) {
    writeReducedBody(file, makePart());
    expectSame(readReducedBody(file), makePart());
}

TEST_F(ReducedBodyFileTest, APartWithoutInterfacesRoundTrips) {
    ReducedBody body = makePart();
    body.interfaces.clear();
    body.mesh.nodeSets.clear();
    writeReducedBody(file, body);
    expectSame(readReducedBody(file), body);
}

TEST_F(ReducedBodyFileTest, TheFinerTwinAndStaticErrorsComeBack) {
    ReducedBody body = makePart(), finer = makePart();
    finer.name = "finer";
    finer.further = {{1, 2, 3, 4, 5, 1.0 / 3}, {0.1, 0.2, 0.3}};
    body.finer = std::make_shared<const ReducedBody>(finer);
    body.report.emplace();
    body.report->staticErrors = {{"force x on interface 'seat / 1'", 0.25}, {"turning xx", 1e-3}};
    writeReducedBody(file, body);
    const ReducedBody read = readReducedBody(file);
    expectSame(read, body);
    ASSERT_TRUE(read.finer && read.finer->further && read.report);
    expectSame(*read.finer, finer);
    EXPECT_EQ(read.finer->further->coordinates, finer.further->coordinates);
    EXPECT_EQ(read.finer->further->displacements, finer.further->displacements);
    ASSERT_EQ(read.report->staticErrors.size(), 2u);
    EXPECT_EQ(read.report->staticErrors[0].load, "force x on interface 'seat / 1'");
    EXPECT_EQ(read.report->staticErrors[1].error, 1e-3);
    finer.further->coordinates.pop_back();
    body.finer = std::make_shared<const ReducedBody>(finer);
    EXPECT_THROW(writeReducedBody(file, body), std::invalid_argument);
    finer.finer = body.finer;
    body.finer = std::make_shared<const ReducedBody>(finer);
    EXPECT_THROW(body.validate(), std::invalid_argument);
}

TEST_F(ReducedBodyFileTest, DerivativesComeBackAndAreSymmetricOfEachParameterOne) {
    ReducedBody body = makePart();
    const size_t n = size_t(body.numModes);
    ReducedBody::Derivative derivative{"thickness:SKIN / 1", "m", 0.004, {}, {}};
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i < n; ++i) {
            derivative.K.push_back(1e9 / double(1 + i + j));
            derivative.M.push_back(1.0 / double(3 + i * j));
        }
    body.derivatives = {derivative, derivative};
    EXPECT_THROW(writeReducedBody(file, body), std::invalid_argument);
    body.derivatives[1].parameter = "density:STEEL";
    writeReducedBody(file, body);
    const ReducedBody read = readReducedBody(file);
    expectSame(read, body);
    ASSERT_EQ(read.derivatives.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(read.derivatives[k].parameter, body.derivatives[k].parameter);
        EXPECT_EQ(read.derivatives[k].unit, "m");
        EXPECT_EQ(read.derivatives[k].value, 0.004);
        EXPECT_EQ(read.derivatives[k].K, derivative.K);
        EXPECT_EQ(read.derivatives[k].M, derivative.M);
    }
    EXPECT_EQ(&read.getDerivative("density:STEEL"), &read.derivatives[1]);
    EXPECT_THROW(read.getDerivative("density:LEAD"), std::out_of_range);
    body.derivatives[0].K[1] *= 2;
    EXPECT_THROW(body.validate(), std::invalid_argument);
    body.derivatives[0] = derivative;
    body.derivatives[0].M.pop_back();
    EXPECT_THROW(body.validate(), std::invalid_argument);
}

/** Returns the message of reading a part file changed in place. **/
template <class Change>
std::string readChanged(const Change& change) {
    const TestFolder folder;
    const std::string path = folder / "part.h5";
    ReducedBody body = makePart();
    body.finer = std::make_shared<const ReducedBody>(makePart());
    writeReducedBody(path, body);
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    change(file);
    H5Fclose(file);
    try {
        readReducedBody(path);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(ReducedBodyFile, APartWithinItselfIsRefused) {
    for (const bool isSoft : {true, false})
        EXPECT_THAT(readChanged([&](hid_t file) {
                        H5Ldelete(file, "finer", H5P_DEFAULT);
                        if (isSoft)
                            H5Lcreate_soft("/", file, "finer", H5P_DEFAULT, H5P_DEFAULT);
                        else
                            H5Lcreate_hard(file, "/", file, "finer", H5P_DEFAULT, H5P_DEFAULT);
                    }),
                    HasSubstr("its finer twin has a finer twin"));
}

TEST(ReducedBodyFile, ContentsOfOtherFilesAreRefused) {
    EXPECT_THAT(readChanged([](hid_t file) {
                    H5Lcreate_external("other.h5", "/", file, "elsewhere", H5P_DEFAULT,
                                       H5P_DEFAULT);
                }),
                HasSubstr("'elsewhere' is a link to another file"));
    EXPECT_THAT(readChanged([](hid_t file) {
                    H5Ldelete(file, "omega_squared", H5P_DEFAULT);
                    const hsize_t size = 2;
                    const hid_t space = H5Screate_simple(1, &size, nullptr);
                    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
                    H5Pset_external(creation, "/etc/passwd", 0, 16);
                    H5Dclose(H5Dcreate2(file, "omega_squared", H5T_IEEE_F64LE, space, H5P_DEFAULT,
                                        creation, H5P_DEFAULT));
                    H5Pclose(creation);
                    H5Sclose(space);
                }),
                HasSubstr("'omega_squared' is stored in another file"));
}

TEST_F(ReducedBodyFileTest, SamePartGivesTheSameBytes) {
    writeReducedBody(file, makePart());
    const std::string first = testing::readText(file);
    writeReducedBody(file, makePart());
    EXPECT_TRUE(testing::readText(file) == first);
}

TEST_F(ReducedBodyFileTest, TruncatedAtAnyLengthIsAnError) {
    writeReducedBody(file, makePart());
    const std::string whole = testing::readText(file);
    const std::string cut = folder / "cut.h5";
    const size_t data = whole.size() - 16;  // the trailer contains no part data
    for (size_t length = 0; length < data; length += 1 + data / 400) {
        testing::writeText(cut, whole.substr(0, length));
        ASSERT_THAT(errorOf(cut), HasSubstr("cannot be used"))
            << "cut to " << length << " of " << whole.size();
    }
    testing::writeText(cut, whole.substr(0, data - 1));
    EXPECT_THAT(errorOf(cut), HasSubstr("cut short"));
}

TEST_F(ReducedBodyFileTest, OneChangedByteAnywhereIsAnError) {
    writeReducedBody(file, makePart());
    const std::string whole = testing::readText(file);
    const std::string damaged = folder / "damaged.h5";
    const size_t trailer = whole.size() - 16;
    for (size_t at = 0; at < trailer; at += 1 + trailer / 500) {
        std::string text = whole;
        text[at] = char(text[at] ^ 4);
        testing::writeText(damaged, text);
        ASSERT_THAT(errorOf(damaged), HasSubstr("damaged")) << "byte " << at;
    }
}

TEST_F(ReducedBodyFileTest, OtherFilesAreNamedForWhatTheyAre) {
    EXPECT_THAT(errorOf(folder / "none.h5"), HasSubstr("does not exist"));
    testing::writeText(file, "this is no part");
    EXPECT_THAT(errorOf(file), HasSubstr("another kind"));
    const hid_t other = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(other);
    EXPECT_THAT(errorOf(file), HasSubstr("not of a reduced part"));
}

TEST_F(ReducedBodyFileTest, OnlyPartFilesAreReplaced) {
    const auto refusalOf = [&]() -> std::string {
        try {
            writeReducedBody(file, makePart());
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    const hid_t results = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(results);
    for (const std::string& foreign :
         {testing::readText(file), std::string("*NODE\n1, 0, 0, 0\n"), std::string("\x89")}) {
        testing::writeText(file, foreign);
        EXPECT_THAT(refusalOf(), HasSubstr("is there and is no part file"));
        EXPECT_TRUE(testing::readText(file) == foreign);
    }
    // A part, an empty file, half a part.
    testing::writeText(file, "");
    EXPECT_EQ(refusalOf(), "");
    const std::string whole = testing::readText(file);
    EXPECT_EQ(refusalOf(), "");
    testing::writeText(file, whole.substr(0, whole.size() / 2));
    EXPECT_EQ(refusalOf(), "");
    EXPECT_TRUE(testing::readText(file) == whole);
}

TEST_F(ReducedBodyFileTest, ModalDataOfMbdynAreToldHowToBecomeAPartFile) {
    const std::string modal = folder / "crank.fem";
    testing::writeText(modal, "** MBDyn MODAL DATA FILE\n");
    EXPECT_THAT(errorOf(modal), HasSubstr("simflex export " + modal));
}

TEST_F(ReducedBodyFileTest, WarningsGoWithThePart) {
    const std::vector<std::string> warnings{"the numbers are hardly metres", "größer\nals eins",
                                            std::string(100000, 'x')};
    writeReducedBody(file, makePart());
    const std::string plain = testing::readText(file);
    EXPECT_THAT(readPartWarnings(file), ::testing::IsEmpty());
    writeReducedBody(file, makePart(), warnings);
    EXPECT_EQ(readPartWarnings(file), warnings);
    expectSame(makePart(), readReducedBody(file));
    writeReducedBody(file, makePart(), {});
    EXPECT_TRUE(testing::readText(file) == plain);
}

TEST_F(ReducedBodyFileTest, MassesOfAnotherModelThanTheModesAreDoubted) {
    const ReducedBody body = makePart();
    EXPECT_THAT(listPartDoubts(body), ::testing::IsEmpty());
    for (const double factor : {0.93, 1.002, 1.08}) {
        ReducedBody other = body;
        for (auto& component : other.I2)
            for (double& value : component) value *= factor;
        EXPECT_NO_THROW(other.validate());
        EXPECT_THAT(listPartDoubts(other),
                    ::testing::ElementsAre(::testing::HasSubstr("are not of one model")))
            << factor;
    }
}

TEST_F(ReducedBodyFileTest, UnitsThatAreNotReadAreRefused) {
    ReducedBody body = makePart();
    body.provenance.units = "mm t s";
    EXPECT_THROW(writeReducedBody(folder / "part.h5", body), std::invalid_argument);
}

TEST_F(ReducedBodyFileTest, ANewerVersionIsAnErrorThatSaysSo) {
    writeChanged("version", ReducedBodyFileVersion + 1);
    EXPECT_THAT(errorOf(file),
                AllOf(HasSubstr("version " + std::to_string(ReducedBodyFileVersion + 1)),
                      HasSubstr("newer simflex")));
}

TEST_F(ReducedBodyFileTest, AMissingQuantityIsNamed) {
    for (const char* name : {"mass", "Phi", "N", "mesh", "interfaces"}) {
        writeChanged(nullptr, 0, name);
        EXPECT_THAT(errorOf(file), HasSubstr("'" + std::string(name) + "'"));
    }
}

TEST_F(ReducedBodyFileTest, NotANumberIsRefusedOnReading) {
    for (const char* name :
         {"omega_squared", "I1", "Phi", "I2", "mesh/positions", "interfaces/0/Phi"}) {
        writeWithNumber(name, std::numeric_limits<double>::quiet_NaN());
        EXPECT_NE(errorOf(file), "accepted") << name;
    }
}

TEST_F(ReducedBodyFileTest, AnInvalidPartIsNotWrittenAndLeavesNoFile) {
    ReducedBody body = makePart();
    body.Phi[3] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(writeReducedBody(file, body), std::invalid_argument);
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("tmp"));
}

TEST_F(ReducedBodyFileTest, AFailedWriteLeavesTheOldFileAndNothingElse) {
    // The name belongs to a nonempty folder: the final rename fails.
    std::filesystem::create_directories(file + "/inside");
    EXPECT_THROW(writeReducedBody(file, makePart()), std::runtime_error);
    EXPECT_THAT(testing::listFiles(folder.path()), ElementsAre("part.h5", "tmp"));
    EXPECT_THROW(writeReducedBody(folder / "no/such/folder.h5", makePart()), std::runtime_error);
}

}  // namespace
}  // namespace simflex
