/** @file
Parts in other programs' formats: MBDyn's .fem, read and written; SID, MATLAB and NumPy arrays,
written. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "simflex/part/ArrayFile.h"
#include "simflex/part/MbdynFem.h"
#include "simflex/part/PartArrays.h"
#include "simflex/part/SidFile.h"
#include "simflex/part/VtuFile.h"
#include "support/GermanLocale.h"
#include "support/PointMassPart.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class Exchange : public ::testing::Test {
protected:
    Exchange() : part(test::makePointMassPart(options())) {}

    static test::PointMassPartOptions options() {
        test::PointMassPartOptions options;
        options.numModes = 9;
        options.numInterfaces = 2;
        return options;
    }

    std::string path(const std::string& name) const { return folder / name; }

    std::string read(const std::string& name) const {
        std::ifstream in(path(name));
        std::stringstream text;
        text << in.rdbuf();
        return text.str();
    }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(path(name)) << text;
    }

    static void expectNear(const std::vector<double>& found, const std::vector<double>& expected,
                           double tolerance, const char* what) {
        double largest = 0;
        for (const double value : expected) largest = std::max(largest, std::abs(value));
        ASSERT_EQ(found.size(), expected.size()) << what;
        for (size_t k = 0; k < found.size(); ++k)
            ASSERT_NEAR(found[k], expected[k], tolerance * std::max(largest, 1e-3)) << what << k;
    }

    /** Compares everything that the equations of motion use. **/
    static void expectSameMechanics(const ReducedBody& found, const ReducedBody& expected,
                                    double tolerance) {
        ASSERT_EQ(found.numModes, expected.numModes);
        EXPECT_NEAR(found.mass, expected.mass, tolerance * expected.mass);
        expectNear({found.centerOfMass.begin(), found.centerOfMass.end()},
                   {expected.centerOfMass.begin(), expected.centerOfMass.end()}, tolerance, "c");
        expectNear({found.inertia.begin(), found.inertia.end()},
                   {expected.inertia.begin(), expected.inertia.end()}, tolerance, "I0");
        expectNear(found.omegaSquared, expected.omegaSquared, tolerance, "omega2");
        expectNear(found.I1, expected.I1, tolerance, "I1");
        for (size_t c = 0; c < 6; ++c) expectNear(found.I2[c], expected.I2[c], tolerance, "I2");
        for (size_t a = 0; a < 3; ++a) expectNear(found.N[a], expected.N[a], tolerance, "N");
        ASSERT_EQ(found.interfaces.size(), expected.interfaces.size());
        for (size_t k = 0; k < found.interfaces.size(); ++k) {
            const auto &a = found.interfaces[k], &b = expected.interfaces[k];
            EXPECT_EQ(a.name, b.name);
            expectNear({a.position.begin(), a.position.end()},
                       {b.position.begin(), b.position.end()}, tolerance, "position");
            expectNear(a.Phi, b.Phi, tolerance, "Phi");
            expectNear(a.Psi, b.Psi, tolerance, "Psi");
        }
    }

    template <class Function>
    static std::string errorOf(Function function) {
        try {
            function();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    test::PointMassPart part;
    const testing::TestFolder folder;
};

TEST_F(Exchange, MbdynFemReadsBackToRoundOff) {
    writeMbdynFem(path("part.fem"), *part.body);
    const ReducedBody same = readMbdynFem(path("part.fem"));
    expectSameMechanics(same, *part.body, 1e-14);
    // The mesh nodes come first, then the masters.
    const size_t numNodes = part.body->mesh.nodeNumbers.size();
    ASSERT_EQ(same.mesh.nodeNumbers.size(), numNodes + 2);
    for (size_t i = 0; i < 9; ++i)
        for (size_t row = 0; row < 3 * numNodes; ++row)
            ASSERT_EQ(same.Phi[i * 3 * (numNodes + 2) + row],
                      part.body->Phi[i * 3 * numNodes + row]);
}

TEST_F(Exchange, MbdynFemOfInterfacesAloneHasTheSameMechanics) {
    writeMbdynFem(path("part.fem"), *part.body, ExchangeNodes::Interfaces);
    const ReducedBody same = readMbdynFem(path("part.fem"));
    EXPECT_EQ(same.mesh.numNodes(), 2);
    expectSameMechanics(same, *part.body, 1e-14);
}

/** Returns the text of a .fem file with lumped masses, modes Ψ = Φ A + rigid motions, and general M
and K.
**/
std::string lumpedFem(const test::PointMassPart& part, const MatrixXd& A, const MatrixXd& rigid) {
    const ReducedBody& body = *part.body;
    const int numNodes = body.mesh.numNodes(), n = int(A.cols());
    const Eigen::Map<const MatrixXd> Phi(body.Phi.data(), 3 * numNodes, body.numModes);
    MatrixXd U(6 * numNodes, n), Psi(3 * numNodes, n), K;
    for (int node = 0; node < numNodes; ++node) {
        const auto s = body.mesh.position(node);
        for (int i = 0; i < n; ++i) {
            const Vector3d a = rigid.col(i).head(3), b = rigid.col(i).tail(3);
            Psi.block<3, 1>(3 * node, i) =
                Phi.middleRows(3 * node, 3) * A.col(i) + a + b.cross(Vector3d(s[0], s[1], s[2]));
            U.block<3, 1>(6 * node, i) = Psi.block<3, 1>(3 * node, i);
            U.block<3, 1>(6 * node + 3, i) = b;
        }
    }
    MatrixXd M = MatrixXd::Zero(n, n);
    for (int node = 0; node < numNodes; ++node)
        M += part.masses[size_t(node)] * Psi.middleRows(3 * node, 3).transpose() *
             Psi.middleRows(3 * node, 3);
    const Eigen::Map<const Eigen::VectorXd> omegaSquared(body.omegaSquared.data(), body.numModes);
    K = A.transpose() * omegaSquared.asDiagonal() * A;

    std::ostringstream text;
    text.precision(17);
    const auto put = [&](const MatrixXd& B) {
        for (int i = 0; i < B.rows(); ++i)
            for (int j = 0; j < B.cols(); ++j) text << B(i, j) << (j + 1 < B.cols() ? " " : "\n");
    };
    text << "** MBDyn MODAL DATA FILE\n** NODE SET \"ALL\"\n**\n** RECORD GROUP 1, HEADER\n"
         << "**   REVISION,  NODE,  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.\n      REV0 "
         << numNodes << " 3 0 " << n - 3 << " 0\n**\n** RECORD GROUP 2, FINITE ELEMENT NODE LIST\n";
    for (const int number : body.mesh.nodeNumbers) text << number << " ";
    for (int a = 0; a < 3; ++a) {
        text << "\n** RECORD GROUP " << 5 + a << ", NODAL COORDINATES\n";
        for (int node = 0; node < numNodes; ++node)
            text << body.mesh.position(node)[size_t(a)] + body.centerOfMass[size_t(a)] << "\n";
    }
    text << "** RECORD GROUP 8, MODE SHAPES\n";
    for (int i = 0; i < n; ++i) {
        text << "**    NORMAL MODE SHAPE #  " << i + 1 << "\n";
        for (int node = 0; node < numNodes; ++node) put(U.block<6, 1>(6 * node, i).transpose());
    }
    text << "** RECORD GROUP 9, MODAL MASS MATRIX\n";
    put(M);
    text << "** RECORD GROUP 10, MODAL STIFFNESS MATRIX\n";
    put(K);
    text << "** RECORD GROUP 11, DIAGONAL OF LUMPED MASS MATRIX\n";
    for (const double mass : part.masses) text << mass << " " << mass << " " << mass << " 0 0 0\n";
    return text.str();
}

TEST_F(Exchange, ModesOfAnyFrameAndNormAreBroughtToTheMeanAxes) {
    MatrixXd A = MatrixXd::Random(9, 9), rigid = MatrixXd::Random(6, 9);
    write("part.fem", lumpedFem(part, A, rigid));
    const ReducedBody found = readMbdynFem(path("part.fem"));
    const ReducedBody& body = *part.body;
    ASSERT_EQ(found.numModes, 9);
    EXPECT_NEAR(found.mass, body.mass, 1e-12);
    expectNear({found.inertia.begin(), found.inertia.end()},
               {body.inertia.begin(), body.inertia.end()}, 1e-11, "I0");
    expectNear(found.omegaSquared, body.omegaSquared, 1e-8, "omega2");
    // Modes may have the opposite sign.
    const size_t rows = 3 * size_t(body.mesh.numNodes());
    std::vector<double> sign(9);
    for (size_t i = 0; i < 9; ++i) {
        double product = 0;
        for (size_t row = 0; row < rows; ++row)
            product += found.Phi[i * rows + row] * body.Phi[i * rows + row];
        sign[i] = product > 0 ? 1 : -1;
        for (size_t row = 0; row < rows; ++row)
            ASSERT_NEAR(found.Phi[i * rows + row], sign[i] * body.Phi[i * rows + row], 1e-7);
        for (size_t c = 0; c < 6; ++c)
            ASSERT_NEAR(found.I1[6 * i + c], sign[i] * body.I1[6 * i + c], 1e-7);
    }
    for (size_t j = 0; j < 9; ++j)
        for (size_t i = 0; i < 9; ++i) {
            for (size_t c = 0; c < 6; ++c)
                ASSERT_NEAR(found.I2[c][i + 9 * j], sign[i] * sign[j] * body.I2[c][i + 9 * j],
                            1e-7);
            for (size_t a = 0; a < 3; ++a)
                ASSERT_NEAR(found.N[a][i + 9 * j], sign[i] * sign[j] * body.N[a][i + 9 * j], 1e-7);
        }
}

TEST_F(Exchange, RigidModesAmongTheOthersAreLeftOut) {
    MatrixXd A = MatrixXd::Zero(9, 12), rigid = MatrixXd::Zero(6, 12);
    A.leftCols(9).setIdentity();
    rigid.rightCols(3) = MatrixXd::Random(6, 3);
    write("part.fem", lumpedFem(part, A, rigid));
    std::vector<std::string> notes;
    const ReducedBody found = readMbdynFem(path("part.fem"), {}, &notes);
    expectNear(found.omegaSquared, part.body->omegaSquared, 1e-9, "omega2");
    EXPECT_THAT(notes, ::testing::ElementsAre("left out 3 rigid modes"));
}

TEST_F(Exchange, RotationsOfAnInterfaceNodeLoseTheRigidRotation) {
    MatrixXd rigid = MatrixXd::Random(6, 9);
    write("part.fem", lumpedFem(part, MatrixXd::Identity(9, 9), rigid));
    MbdynFemOptions options;
    options.interfaces = {{"seat", part.body->mesh.nodeNumbers[2]}};
    const ReducedBody found = readMbdynFem(path("part.fem"), options);
    // The nodes of that file rotate with the rigid motion alone.
    for (const double psi : found.getInterface("seat").Psi) EXPECT_NEAR(psi, 0, 1e-7);
}

TEST_F(Exchange, FilesAreTheSameInAnyLocale) {
    const auto writeAll = [&](const std::string& name) {
        writeMbdynFem(path(name + ".fem"), *part.body);
        writeSid(path(name + ".sid_fem"), *part.body, ExchangeNodes::All);
        writeVtu(path(name + ".vtu"), *part.body);
    };
    writeAll("part");
    std::vector<double> frequencies;
    {
        const test::GermanLocale german(folder.path());
        writeAll("teil");
        frequencies = readMbdynFem(path("teil.fem")).omegaSquared;
    }
    EXPECT_EQ(frequencies, readMbdynFem(path("part.fem")).omegaSquared);
    for (const char* kind : {".fem", ".sid_fem", ".vtu"})
        EXPECT_TRUE(read(std::string("part") + kind) == read(std::string("teil") + kind)) << kind;
}

struct BadFem {
    const char *from, *to, *message;
};

class BadMbdynFem : public Exchange, public ::testing::WithParamInterface<BadFem> {};

TEST_P(BadMbdynFem, IsRefusedWithLineAndReason) {
    writeMbdynFem(path("part.fem"), *part.body, ExchangeNodes::Interfaces);
    std::string text = read("part.fem");
    const size_t at = text.find(GetParam().from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, std::string(GetParam().from).size(), GetParam().to);
    write("part.fem", text);
    EXPECT_THAT(errorOf([&] { readMbdynFem(path("part.fem")); }),
                ContainsRegex(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Lines, BadMbdynFem,
    ::testing::Values(
        BadFem{"REV0 2 9", "REV0 3 9",
               "part.fem:[0-9]+: record group 2 .nodes. has 2.*must have 3"},
        BadFem{"REV0 2 9", "REV0 2 8", "part.fem:[0-9]+: record group 8 .*must have 96"},
        BadFem{"REV0 2 9", "REV0 2 -9", "part.fem:[0-9]+: record group 1 has a number of modes"},
        BadFem{"REV0 2 9", "REV0 2 x", "part.fem:[0-9]+: an entry is 'x'"},
        BadFem{"GROUP 9,", "GROUP 8,", "part.fem:[0-9]+: record group 8 comes twice"},
        BadFem{"GROUP 10,", "GROUP 20,", "record group 10 .modal stiffness. is missing"},
        BadFem{"GROUP 12,", "GROUP 22,", "neither lumped masses .*invariants"},
        BadFem{"** MBDyn", "5\n** MBDyn", "part.fem:1: data before the first"},
        BadFem{"IS NODE 17", "IS NODE 1234", "interface 'A': the file has no node 1234"}));

TEST_F(Exchange, InterfacesWithoutRotationsAreRefused) {
    writeMbdynFem(path("part.fem"), *part.body);
    MbdynFemOptions options;
    options.interfaces = {{"seat", part.body->mesh.nodeNumbers[0]}};
    EXPECT_THAT(errorOf([&] { readMbdynFem(path("part.fem"), options); }),
                AllOf(HasSubstr("part.fem"), HasSubstr("'seat'"), HasSubstr("no rotations")));
}

TEST_F(Exchange, LumpedMassesThatDifferOrTurnAreRefused) {
    std::string text = lumpedFem(part, MatrixXd::Identity(9, 9), MatrixXd::Zero(6, 9));
    const size_t at = text.rfind(" 0 0 0\n");
    std::string other = text;
    write("part.fem", other.replace(at, 6, " 1 0 0"));
    EXPECT_THAT(errorOf([&] { readMbdynFem(path("part.fem")); }),
                AllOf(ContainsRegex("part.fem:[0-9]+"), HasSubstr("rotary inertia")));
}

// SID

/** Parses a SID file: every assignment by its path, "modal/J/m1( 1, 2, 1)". **/
std::map<std::string, std::string> parseSid(const std::string& text) {
    std::map<std::string, std::string> values;
    std::vector<std::string> levels;
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);
    values["header"] = line;
    const auto trim = [](std::string s) {
        const size_t begin = s.find_first_not_of(' ');
        return begin == std::string::npos ? std::string()
                                          : s.substr(begin, s.find_last_not_of(' ') - begin + 1);
    };
    while (std::getline(lines, line)) {
        const size_t equals = line.find('=');
        const std::string left = trim(line.substr(0, equals));
        if (left.compare(0, 4, "end ") == 0) {
            EXPECT_FALSE(levels.empty());
            const std::string name = left.substr(4);
            EXPECT_EQ(levels.back().compare(0, name.size(), name), 0) << left;
            levels.pop_back();
        } else if (left.compare(0, 4, "new ") == 0) {
            levels.push_back(left.substr(4) + trim(line.substr(equals + 1)));
        } else if (equals == std::string::npos) {
            levels.push_back(left);
        } else {
            std::string path;
            for (const auto& level : levels) path += level + "/";
            values[path + left] = trim(line.substr(equals + 1));
        }
    }
    EXPECT_TRUE(levels.empty());
    return values;
}

double toNumber(std::string text) {
    for (char& c : text)
        if (c == 'D') c = 'E';
    return std::stod(text);
}

class Sid : public Exchange {
protected:
    void load(const ReducedBody& body, ExchangeNodes nodes = ExchangeNodes::Interfaces) {
        writeSid(path("part.SID_FEM"), body, nodes);
        values = parseSid(read("part.SID_FEM"));
    }
    /** Returns an entry; zeros are omitted in the file. **/
    double get(const std::string& matrix, const char* series, std::vector<int> indices) const {
        std::string name = "part/modal/" + matrix + "/" + series + "(";
        for (size_t k = 0; k < indices.size(); ++k)
            name += (k ? ", " : " ") + std::to_string(indices[k] + 1);
        const auto found = values.find(name + ")");
        return found == values.end() ? 0 : toNumber(found->second);
    }
    double m0(const std::string& matrix, int i, int j) const { return get(matrix, "m0", {i, j}); }
    double m1(const std::string& matrix, int i, int q, int j) const {
        return get(matrix, "m1", {i, q, j});
    }
    std::map<std::string, std::string> values;
};

TEST_F(Sid, MatricesAreTheSumsOverTheMassesOfTheDefinition) {
    const ReducedBody& body = *part.body;
    load(body);
    constexpr double kDigits = 2e-11;
    const int n = body.numModes, numNodes = body.mesh.numNodes();
    const size_t rows = 3 * size_t(numNodes);
    const auto phi = [&](int i, int node) {
        return Vector3d(&body.Phi[size_t(i) * rows + 3 * size_t(node)]);
    };
    const auto x = [&](int node) {
        const auto s = body.mesh.position(node);
        return Vector3d(s[0] + body.centerOfMass[0], s[1] + body.centerOfMass[1],
                        s[2] + body.centerOfMass[2]);
    };
    const auto cross = [](const Vector3d& a) {
        Matrix3d A;
        A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
        return A;
    };
    constexpr int kProducts[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    constexpr int kInertia[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

    EXPECT_EQ(toNumber(values.at("part/modal/refmod/mass")), body.mass);
    Vector3d mc = Vector3d::Zero();
    Matrix3d J = Matrix3d::Zero();
    for (int k = 0; k < numNodes; ++k) {
        const double m = part.masses[size_t(k)];
        mc += m * x(k);
        J -= m * cross(x(k)) * cross(x(k));
    }
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(m0("mdCM", a, 0), mc[a], 1e-10);
    for (int c = 0; c < 6; ++c)
        EXPECT_NEAR(m0("J", c, 0), J(kInertia[c][0], kInertia[c][1]), 1e-10);
    for (int i = 0; i < n; ++i) {
        EXPECT_NEAR(m0("Ke", i, i) / body.omegaSquared[size_t(i)], 1, kDigits);
        Matrix3d J1 = Matrix3d::Zero(), Gr = Matrix3d::Zero();
        for (int k = 0; k < numNodes; ++k) {
            const double m = part.masses[size_t(k)];
            const Matrix3d product = m * cross(x(k)) * cross(phi(i, k));
            J1 -= product + product.transpose();
            Gr -= 2 * product;
        }
        for (int c = 0; c < 6; ++c)
            EXPECT_NEAR(m1("J", c, i, 0), J1(kInertia[c][0], kInertia[c][1]), 1e-10);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) EXPECT_NEAR(m0("Gr", a, 3 * i + b), Gr(a, b), 1e-10);
        // Oe·(ω products) = ∫ φᵀ ω×(ω×x): −½ of what ω J1 ω gives.
        for (int c = 0; c < 6; ++c)
            EXPECT_NEAR(m0("Oe", i, c), -(c < 3 ? 0.5 : 1.0) * J1(kProducts[c][0], kProducts[c][1]),
                        1e-10);
        for (int j = 0; j < n; ++j) {
            Vector3d C = Vector3d::Zero();
            Matrix3d J2 = Matrix3d::Zero();
            for (int k = 0; k < numNodes; ++k) {
                const double m = part.masses[size_t(k)];
                C += m * phi(j, k).cross(phi(i, k));
                const Matrix3d product = m * cross(phi(i, k)) * cross(phi(j, k));
                J2 -= 0.5 * (product + product.transpose());
            }
            for (int a = 0; a < 3; ++a) {
                EXPECT_NEAR(m1("Cr", i, j, a), C[a], 1e-10);
                EXPECT_NEAR(m0("Ge", i, 3 * j + a), 2 * C[a], 1e-10);
            }
            for (int c = 0; c < 6; ++c)
                EXPECT_NEAR(m1("Oe", i, j, c),
                            -(c < 3 ? 1.0 : 2.0) * J2(kProducts[c][0], kProducts[c][1]), 1e-10);
        }
    }
    EXPECT_EQ(values.at("part/modal/Me/structure"), "4");
    EXPECT_EQ(values.at("part/modal/Ct/structure"), "0");
    for (const char* matrix :
         {"mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"})
        EXPECT_EQ(values.at(std::string("part/modal/") + matrix + "/nq"), "9") << matrix;
}

TEST_F(Sid, NodesAreTheInterfacesWithTheirAttitude) {
    const ReducedBody& body = *part.body;
    load(body);
    EXPECT_THAT(values.at("header"), AllOf(HasSubstr("2 9 :"), HasSubstr("interface A is node")));
    int number = body.mesh.nodeNumbers.back();
    for (const auto& interface : body.interfaces) {
        const std::string node = "frame/node" + std::to_string(++number);
        EXPECT_EQ(values.at("part/modal/" + node + "/rframe"), "body ref");
        for (int a = 0; a < 3; ++a)
            EXPECT_NEAR(m0(node + "/origin", a, 0),
                        interface.position[size_t(a)] + body.centerOfMass[size_t(a)], 1e-11);
        for (int i = 0; i < body.numModes; ++i) {
            const Vector3d psi(&interface.Psi[3 * size_t(i)]);
            for (int a = 0; a < 3; ++a) {
                const double phi = interface.Phi[size_t(3 * i + a)];
                EXPECT_NEAR(m0(node + "/phi", a, i), phi, 1e-10);
                EXPECT_NEAR(m1(node + "/origin", a, i, 0), phi, 1e-10);
                EXPECT_NEAR(m0(node + "/psi", a, i), psi[a], 1e-10);
                // AP e_b rotates by psi: its change is psi × e_b.
                for (int b = 0; b < 3; ++b)
                    EXPECT_NEAR(m1(node + "/AP", a, i, b), psi.cross(Vector3d::Unit(b))[a], 1e-10);
            }
        }
    }
}

TEST_F(Sid, StiffeningByRotationIsPartOfOe) {
    auto options = Exchange::options();
    options.stiffening = 2;
    const auto stiff = test::makePointMassPart(options);
    ReducedBody soft = *stiff.body;
    soft.stiffening.reset();
    load(soft);
    std::vector<double> before;
    for (int c = 0; c < 6; ++c) before.push_back(m1("Oe", 1, 2, c));
    load(*stiff.body);
    constexpr size_t kComponents[6] = {0, 1, 2, 3, 5, 4};
    for (int c = 0; c < 6; ++c)
        EXPECT_NEAR(m1("Oe", 1, 2, c) - before[size_t(c)],
                    (c < 3 ? 1 : 2) * stiff.body->stiffening->turning[kComponents[c]][1 + 9 * 2],
                    1e-9);
}

TEST_F(Exchange, ArraysHaveTheEnergyOfTheMassesAndTheMotionOfInterfaces) {
    const ReducedBody& body = *part.body;
    const Eigen::Index n = body.numModes;
    for (const char* name : {"part.mat", "part.npz"}) {
        writePartArrays(path(name), body);
        std::map<std::string, MatrixXd> arrays;
        for (const FileArray& array : readArrayFile(path(name)))
            arrays[array.name] = Eigen::Map<const MatrixXd>(array.values.data(), array.numRows(),
                                                            array.numColumns());
        const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6 + n, -1, 0.7).array().sin();
        const MatrixXd &nodes = arrays.at("nodes"), &center = arrays.at("center_of_mass");
        const auto moveOf = [&](Eigen::Index node) {
            const Vector3d s = nodes.row(node).tail<3>().transpose() - center.transpose();
            return Vector3d(q.head<3>() + q.segment<3>(3).cross(s) +
                            arrays.at("Phi").middleRows(3 * node, 3) * q.tail(n));
        };
        double twice = 0;
        for (Eigen::Index node = 0; node < nodes.rows(); ++node)
            twice += part.masses[size_t(node)] * moveOf(node).squaredNorm();
        EXPECT_NEAR(q.dot(arrays.at("M") * q), twice, 1e-12 * twice);
        double energy = 0;
        for (Eigen::Index k = 0; k < n; ++k)
            energy += body.omegaSquared[size_t(k)] * q[6 + k] * q[6 + k];
        EXPECT_NEAR(q.dot(arrays.at("K") * q), energy, 1e-12 * energy);
        const Eigen::VectorXd moved = arrays.at("L") * q;
        for (size_t k = 0; k < body.interfaces.size(); ++k) {
            const auto& interface = body.interfaces[k];
            const auto row = Eigen::Index(6 * k);
            Eigen::Index at = 0;  // the node on which it sits
            (nodes.rightCols<3>().rowwise() - arrays.at("interface_positions").row(Eigen::Index(k)))
                .rowwise()
                .norm()
                .minCoeff(&at);
            EXPECT_LT((moved.segment<3>(row) - moveOf(at)).norm(), 1e-12);
            const Vector3d turn =
                q.segment<3>(3) +
                Eigen::Map<const MatrixXd>(interface.Psi.data(), 3, n) * q.tail(n);
            EXPECT_LT((moved.segment<3>(row + 3) - turn).norm(), 1e-12);
            for (Eigen::Index a = 0; a < 3; ++a)
                EXPECT_NEAR(nodes(at, 1 + a),
                            interface.position[size_t(a)] + body.centerOfMass[size_t(a)], 1e-12);
        }
    }
}

TEST_F(Exchange, AFolderThatIsMissingIsNamed) {
    for (const char* name : {"no/part.mat", "no/part.npz"})
        EXPECT_THAT(errorOf([&] { writePartArrays(path(name), *part.body); }), HasSubstr(name));
    EXPECT_THAT(errorOf([&] { writeMbdynFem(path("no/part.fem"), *part.body); }),
                HasSubstr("no/part.fem"));
    EXPECT_THAT(errorOf([&] { writeSid(path("no/part.SID_FEM"), *part.body); }),
                HasSubstr("no/part.SID_FEM"));
}

}  // namespace
}  // namespace simflex
