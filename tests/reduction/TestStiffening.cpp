// Geometric stiffness against closed forms: exactly known stresses, integrated over the mode
// shapes.

#include <gmock/gmock.h>
#include <omp.h>

#include <Eigen/Dense>
#include <filesystem>
#include <iomanip>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using ::testing::AllOf;
using testing::Brick;
using ::testing::HasSubstr;
using testing::TestFolder;

/** Returns a slender bar with zero Poisson's ratio, tied at both ends: its stresses have closed
forms. **/
Brick makeBar() {
    Brick bar;
    bar.size = {1.0, 0.03, 0.02};
    bar.elements = {20, 2, 2};
    bar.nu = 0;
    return bar;
}

ReducedBody reduceDeck(const TestFolder& folder, const std::string& text, int numModes = 16) {
    testing::writeText(folder / "bar.inp", text);
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    options.numModes = numModes;
    options.hasStiffening = true;
    return reduce(readCalculixDeck(folder / "bar.inp"), options);
}

Eigen::Map<const MatrixXd> asMatrix(const ReducedBody& part, const std::vector<double>& values) {
    return {values.data(), part.numModes, part.numModes};
}

/** Returns ∫ N(x)/A Σ_k (∂u_k/∂x)ᵢ (∂u_k/∂x)ⱼ dV with the trilinear shapes of 8-node bricks and
constant N per element: the work of an axial stress on the second-order strain. **/
template <class Force>
MatrixXd integrateTension(const ReducedBody& part, const Brick& bar, const Force& N) {
    const Eigen::Map<const MatrixXd> Phi(part.Phi.data(), 3 * part.mesh.numNodes(), part.numModes);
    const double dx = bar.size[0] / bar.elements[0];
    const double volume = bar.size[0] * bar.size[1] * bar.size[2] /
                          (bar.elements[0] * bar.elements[1] * bar.elements[2]);
    MatrixXd K = MatrixXd::Zero(part.numModes, part.numModes);
    const auto& nodes = part.mesh.elements.at(0).nodes;
    const double g = bar.type == "C3D8R" ? 0 : 1 / std::sqrt(3.0);
    for (size_t e = 0; e < nodes.size(); e += 8) {
        const double x = part.mesh.position(nodes[e])[0] + part.centerOfMass[0] + 0.5 * dx;
        for (double eta : {-g, g})
            for (double zeta : {-g, g}) {
                // ∂u/∂x is linear across the section and constant along x.
                MatrixXd slope = MatrixXd::Zero(3, part.numModes);
                static const int corner[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
                static const int front[4] = {1, 2, 5, 6}, back[4] = {0, 3, 4, 7};
                for (int k = 0; k < 4; ++k) {
                    const double weight =
                        0.25 * (1 + corner[k][0] * eta) * (1 + corner[k][1] * zeta) / dx;
                    slope += weight * (Phi.middleRows<3>(3 * nodes[e + size_t(front[k])]) -
                                       Phi.middleRows<3>(3 * nodes[e + size_t(back[k])]));
                }
                K += N(x) / (bar.size[1] * bar.size[2]) * 0.25 * volume * slope.transpose() * slope;
            }
    }
    return K;
}

/** Returns the deck of a bar rotated about z. **/
std::string turnDeck(const std::string& text, double angle) {
    std::istringstream in(text);
    std::ostringstream out;
    out << std::setprecision(14);
    bool inNodes = false;
    for (std::string line; std::getline(in, line);) {
        if (line[0] == '*') inNodes = line == "*NODE";
        int node = 0;
        double x = 0, y = 0, z = 0;
        if (inNodes && std::sscanf(line.c_str(), "%d,%lf,%lf,%lf", &node, &x, &y, &z) == 4)
            out << node << "," << std::cos(angle) * x - std::sin(angle) * y << ","
                << std::sin(angle) * x + std::cos(angle) * y << "," << z << "\n";
        else
            out << line << "\n";
    }
    return out.str();
}

/** Returns Σ_ab ω_aω_b K_ab. **/
MatrixXd turningStiffness(const ReducedBody& part, const Vector3d& omega) {
    const double products[6] = {omega[0] * omega[0],     omega[1] * omega[1],
                                omega[2] * omega[2],     2 * omega[0] * omega[1],
                                2 * omega[0] * omega[2], 2 * omega[1] * omega[2]};
    MatrixXd K = MatrixXd::Zero(part.numModes, part.numModes);
    for (size_t c = 0; c < 6; ++c) K += products[c] * asMatrix(part, part.stiffening->turning[c]);
    return K;
}

/** Returns the rotations θ_y and θ_z of the cross sections along x in a mode, from the axial
displacement of their corners. **/
std::vector<Vector3d> calcSectionRotations(const ReducedBody& part, const Brick& bar, int mode) {
    const Eigen::Map<const MatrixXd> Phi(part.Phi.data(), 3 * part.mesh.numNodes(), part.numModes);
    std::vector<Vector3d> rotations(size_t(bar.elements[0]) + 1, Vector3d::Zero());
    for (int node = 0; node < part.mesh.numNodes(); ++node) {
        const auto s = part.mesh.position(node);
        if (std::abs(s[1]) < 0.4 * bar.size[1] || std::abs(s[2]) < 0.4 * bar.size[2]) continue;
        const double x = (s[0] + part.centerOfMass[0]) / bar.size[0] * bar.elements[0];
        Vector3d& theta = rotations[size_t(std::lround(x))];
        theta[1] += 0.25 * Phi(3 * node, mode) / s[2];  // u_x = θ_y z − θ_z y
        theta[2] -= 0.25 * Phi(3 * node, mode) / s[1];
    }
    return rotations;
}

class StiffeningTest : public ::testing::Test {
protected:
    TestFolder folder;
};

TEST_F(StiffeningTest, PulledBarHasTheWorkOfItsTensionOnTheSlopes) {
    const Brick bar = makeBar();
    const ReducedBody part = reduceDeck(folder, bar.text());
    // Pulled at one end and balanced by inertia, N falls linearly to zero at the other.
    const MatrixXd expected =
        integrateTension(part, bar, [&](double x) { return x / bar.size[0]; });
    const auto K = asMatrix(part, part.stiffening->interfaces[1][0]);
    EXPECT_LT((K - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff());
}

TEST_F(StiffeningTest, TurningBarHasTheWorkOfItsCentrifugalTension) {
    const Brick bar = makeBar();
    const ReducedBody part = reduceDeck(folder, bar.text());
    const double rhoA = bar.rho * bar.size[1] * bar.size[2], L = bar.size[0];
    const double dx = L / bar.elements[0];
    const MatrixXd expected = integrateTension(part, bar, [&](double x) {
        const double s = x - 0.5 * L;  // mean over the element
        return 0.5 * rhoA * (0.25 * L * L - s * s - dx * dx / 12);
    });
    // Four bending modes; in a torsion mode the section's own centrifugal stress matters.
    const double largest = expected.topLeftCorner(4, 4).cwiseAbs().maxCoeff();
    for (int axis : {1, 2}) {
        const MatrixXd K = turningStiffness(part, Vector3d::Unit(axis));
        // The section's own centrifugal stress is (0.03/1)² of the axial one in the middle, and
        // more towards the ends.
        EXPECT_LT((K - expected).topLeftCorner(4, 4).cwiseAbs().maxCoeff(), 2e-3 * largest);
    }
    EXPECT_LT(turningStiffness(part, Vector3d::UnitX()).topLeftCorner(4, 4).cwiseAbs().maxCoeff(),
              2e-3 * largest);
}

TEST_F(StiffeningTest, MixedProductsTurnWithThePart) {
    const Brick bar = makeBar();
    const ReducedBody straight = reduceDeck(folder, bar.text());
    const double angle = 0.6;
    const ReducedBody turned = reduceDeck(folder, turnDeck(bar.text(), angle));
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
    // Signs of modes are arbitrary.
    const auto compare = [&](const MatrixXd& A, const MatrixXd& B) {
        EXPECT_LT((A.cwiseAbs() - B.cwiseAbs()).topLeftCorner(8, 8).cwiseAbs().maxCoeff(),
                  1e-5 * B.cwiseAbs().maxCoeff());
    };
    for (const Vector3d& omega : {Vector3d(1, 2, 3), Vector3d(-2, 1, 0.5), Vector3d(0, 1, -1)})
        compare(turningStiffness(turned, R * omega), turningStiffness(straight, omega));
    for (size_t interface : {0, 1})
        for (size_t first : {0, 3}) {  // forces, moments
            const auto& ofTurned = turned.stiffening->interfaces[interface];
            const auto& ofStraight = straight.stiffening->interfaces[interface];
            const Vector3d load = R * Vector3d(0, 1, 0);
            compare(load[0] * asMatrix(turned, ofTurned[first]) +
                        load[1] * asMatrix(turned, ofTurned[first + 1]),
                    asMatrix(straight, ofStraight[first + 1]));
        }
}

// Even without twist, sections of a rod bent in two planes rotate about its axis: with R' = R [κ]×
// the rotation vector is θ + ½∫θ×θ' ds to second order (Magnus).
TEST_F(StiffeningTest, MomentsOnInterfacesGiveTheSecondOrderRotationOfABentRod) {
    Brick bar = makeBar();
    bar.elements = {40, 2, 2};
    const ReducedBody part = reduceDeck(folder, bar.text());
    const auto secondOrder = [&](size_t interface, int i, int j) {
        // −½ξᵀKξ for ξ = e_i + e_j, without the squares.
        return -asMatrix(part, part.stiffening->interfaces[interface][3])(i, j);
    };
    int compared = 0;
    for (int i = 0; i < 5; ++i)
        for (int j = i + 1; j < 5; ++j) {
            const auto a = calcSectionRotations(part, bar, i),
                       b = calcSectionRotations(part, bar, j);
            // ½∫(θ_a+θ_b)×(θ_a+θ_b)' without a×a', b×b': exact for θ linear between sections.
            double twist = 0, size = 0;
            for (size_t k = 0; k + 1 < a.size(); ++k) {
                twist += 0.5 * (a[k].cross(b[k + 1]) + b[k].cross(a[k + 1]))[0];
                size = std::max(size, a[k].norm() * b[k].norm());
            }
            if (std::abs(twist) < 0.1 * size) continue;  // bent in one plane
            EXPECT_NEAR(secondOrder(1, i, j) - secondOrder(0, i, j), twist, 0.01 * size)
                << "modes " << i << " and " << j;
            ++compared;
        }
    EXPECT_GE(compared, 3);
}

TEST_F(StiffeningTest, PartFileKeepsGeometricStiffnessAndOlderFilesHaveNone) {
    const Brick bar = makeBar();
    ReducedBody part = reduceDeck(folder, bar.text());
    writeReducedBody(folder / "part.h5", part);
    const ReducedBody same = readReducedBody(folder / "part.h5");
    ASSERT_TRUE(same.stiffening);
    EXPECT_EQ(same.stiffening->turning, part.stiffening->turning);
    EXPECT_EQ(same.stiffening->interfaces, part.stiffening->interfaces);
    part.stiffening.reset();
    writeReducedBody(folder / "plain.h5", part);
    EXPECT_FALSE(readReducedBody(folder / "plain.h5").stiffening);
}

TEST_F(StiffeningTest, TheSameBitsForAnyNumberOfThreads) {
    Brick bar = makeBar();
    bar.elements = {60, 4, 4};  // many chunks of elements
    testing::writeText(folder / "bar.inp", bar.text());
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}};
    options.numModes = 12;
    options.hasStiffening = true;
    std::vector<FeModel> models;
    std::vector<ReducedBody> parts;
    for (int threads : {1, 2, 3}) {
        omp_set_num_threads(threads);
        models.push_back(readCalculixDeck(folder / "bar.inp"));
        parts.push_back(reduce(models.back(), options));
        EXPECT_EQ(models[0].K.values, models.back().K.values) << threads;
        EXPECT_EQ(models[0].m.values, models.back().m.values) << threads;
        EXPECT_EQ(parts[0].stiffening->turning, parts.back().stiffening->turning) << threads;
        EXPECT_EQ(parts[0].stiffening->interfaces, parts.back().stiffening->interfaces) << threads;
    }
}

TEST_F(StiffeningTest, TheSamePartInAnyUnits) {
    Brick si = makeBar(), mm = si;
    mm.size = {1000 * si.size[0], 1000 * si.size[1], 1000 * si.size[2]};
    mm.E = si.E * 1e-6;
    mm.rho = si.rho * 1e-12;
    testing::writeText(folder / "si.inp", si.text());
    testing::writeText(folder / "mm.inp", mm.text());
    std::vector<ReducedBody> parts;
    for (const auto& [file, units] :
         {std::pair("si.inp", "m-kg-s"), std::pair("mm.inp", "mm-t-s")}) {
        SourceOptions source;
        source.path = folder / file;
        source.units = units;
        ReductionOptions options;
        options.interfaces = {{"left", "LEFT"}};
        options.numModes = 12;
        options.hasStiffening = true;
        options.stress.emplace();
        parts.push_back(reduce(readModelSource(source), options));
    }
    const auto expectSame = [](const auto& a, const auto& b, double digits) {
        ASSERT_EQ(a.size(), b.size());
        double largest = 0;
        for (const auto value : a) largest = std::max(largest, double(std::abs(value)));
        for (size_t k = 0; k < a.size(); ++k)
            ASSERT_NEAR(std::abs(a[k]), std::abs(b[k]),
                        digits * largest);  // signs of modes are arbitrary
    };
    expectSame(parts[0].stiffening->turning[1], parts[1].stiffening->turning[1], 1e-6);
    expectSame(parts[0].stiffening->interfaces[0][0], parts[1].stiffening->interfaces[0][0], 1e-6);
    expectSame(parts[0].modalStress->stress, parts[1].modalStress->stress, 1e-4);
}

/** Columns with rigid pieces: a free bar 1 m long, pressed at both ends. **/
class RigidPieces : public StiffeningTest {
protected:
    RigidPieces() {
        bar.type = "C3D20R";
        bar.elements = {20, 2, 2};
    }

    /** Ascending loads P at which it bends away about its weaker axis. **/
    std::vector<double> calcLoads(const std::string& text, const char* right) const {
        testing::writeText(folder / "bar.inp", text);
        ReductionOptions options;
        options.interfaces = {{"left", "LEFT"}, {"right", right}};
        options.numModes = 24;
        options.hasStiffening = true;
        const ReducedBody part = reduce(readCalculixDeck(folder / "bar.inp"), options);
        const Eigen::Map<const Eigen::VectorXd> omegaSquared(part.omegaSquared.data(),
                                                             part.numModes);
        const Eigen::VectorXd inverse = omegaSquared.cwiseSqrt().cwiseInverse();
        // (Ω² + P (K_left − K_right)) x = 0, where the part as a whole turns by φ = −Δv/L, so that
        // its ends stay on the line of the forces: ½ P L φ² + P Δv φ.
        MatrixXd K = asMatrix(part, part.stiffening->interfaces[1][0]) -
                     asMatrix(part, part.stiffening->interfaces[0][0]);
        const auto &a = part.getInterface("left"), &b = part.getInterface("right");
        const double length = b.position[0] - a.position[0];
        for (const Eigen::Index axis : {1, 2}) {
            const Eigen::RowVectorXd across =
                Eigen::Map<const MatrixXd>(b.Phi.data(), 3, part.numModes).row(axis) -
                Eigen::Map<const MatrixXd>(a.Phi.data(), 3, part.numModes).row(axis);
            K -= across.transpose() * across / length;
        }
        const Eigen::VectorXd values =
            Eigen::SelfAdjointEigenSolver<MatrixXd>(inverse.asDiagonal() * K * inverse.asDiagonal())
                .eigenvalues();
        std::vector<double> loads;
        for (Eigen::Index k = values.size(); k-- > 0 && values[k] > 0;)
            loads.push_back(1 / values[k]);
        return loads;
    }

    /** EI k² with tan kL = −kc, the lowest. **/
    double calcLoadWithCap(double L, double c) const {
        double low = M_PI / 2 + 1e-9, high = M_PI;
        for (int step = 0; step < 60; ++step) {
            const double middle = 0.5 * (low + high);
            (std::tan(middle) < -middle * c / L ? low : high) = middle;
        }
        return stiffness() * std::pow(low / L, 2);
    }

    double stiffness() const { return bar.E * bar.size[1] * std::pow(bar.size[2], 3) / 12; }

    static void expectOneOf(const std::vector<double>& loads, double expected) {
        double nearest = 0;
        for (const double load : loads)
            if (std::abs(load - expected) < std::abs(nearest - expected)) nearest = load;
        EXPECT_NEAR(nearest, expected, 5e-3 * expected);
    }

    Brick bar = makeBar();
};

TEST_F(RigidPieces, AColumnWithARigidCapBucklesAtItsLoad) {
    for (const double c : {0.1, 0.5}) {
        std::ostringstream cap;
        const double y = 0.5 * bar.size[1], z = 0.5 * bar.size[2];
        cap << "*NODE\n9001," << 1 + c << "," << y << "," << z + 0.01 << "\n9002," << 1 + c << ","
            << y + 0.01 << "," << z - 0.005 << "\n9003," << 1 + c << "," << y - 0.01 << ","
            << z - 0.005 << "\n9004," << 1 << "," << y << "," << z
            << "\n9005,0,0,0\n*NSET,NSET=CAP\n9001,9002,9003\n*NSET,NSET=PIECE\nRIGHT,CAP\n"
               "*ELEMENT,TYPE=MASS,ELSET=M\n9001,9001\n9002,9002\n9003,9003\n*MASS,ELSET=M\n"
               "1e-3\n*RIGID BODY,NSET=PIECE,REF NODE=9004,ROT NODE=9005\n";
        const std::vector<double> loads = calcLoads(bar.text() + cap.str(), "CAP");
        const double expected = calcLoadWithCap(1, c);
        EXPECT_NEAR(loads.at(0), expected, 5e-3 * expected) << c;
    }
}

TEST_F(RigidPieces, AColumnWithARigidMiddleBucklesAtItsLoads) {
    testing::writeText(folder / "bar.inp", bar.text());
    const Mesh mesh = readCalculixMesh(folder / "bar.inp");
    std::ostringstream middle;
    middle << "*NODE\n9004,0.5,0,0\n9005,0.5,0,0\n*NSET,NSET=MIDDLE\n";
    for (int node = 0; node < mesh.numNodes(); ++node)
        if (std::abs(mesh.positions[3 * size_t(node)] - 0.5) < 0.2 + 1e-9)
            middle << mesh.nodeNumbers[size_t(node)] << "\n";
    middle << "*RIGID BODY,NSET=MIDDLE,REF NODE=9004,ROT NODE=9005\n";
    const std::vector<double> loads = calcLoads(bar.text() + middle.str(), "RIGHT");
    const double sideways = stiffness() * std::pow(M_PI / 2 / 0.3, 2);
    EXPECT_NEAR(loads.at(0), sideways, 5e-3 * sideways);
    expectOneOf(loads, calcLoadWithCap(0.3, 0.2));  // its middle turns
}

TEST_F(RigidPieces, ARigidBodyThatIsAnInterfaceChangesNothing) {
    const std::vector<double> plain = calcLoads(bar.text(), "RIGHT"),
                              same = calcLoads(bar.text() +
                                                   "*NODE\n9004,1.3,0,0\n9005,0,0,0\n*RIGID BODY,"
                                                   "NSET=RIGHT,REF NODE=9004,ROT NODE=9005\n",
                                               "RIGHT");
    for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(same.at(k), plain.at(k), 1e-6 * plain.at(k));
}

TEST_F(StiffeningTest, AModelOfMatricesIsRefused) {
    testing::writeText(folder / "bar.inp", makeBar().text());
    FeModel model = readCalculixDeck(folder / "bar.inp");
    model.elements = nullptr;
    ReductionOptions options;
    options.numModes = 12;
    options.hasStiffening = true;
    EXPECT_THAT([&] { reduce(model, options); },
                ::testing::ThrowsMessage<std::invalid_argument>(
                    HasSubstr("geometric stiffness needs the elements of the part")));
}

}  // namespace
}  // namespace simflex
