// Linear shells: patch tests, and the problems of MacNeal and Harder (Finite Elements in Analysis
// and Design 1, 1985, 3–20), whose results depend on E and ρ by scale only.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <random>

#include "fe/ThinDeck.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/elements/ElementStress.h"
#include "simflex/fe/elements/GeometricStiffness.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::ThinDeck;
using Point = ThinDeck::Point;
using Map = std::function<Vector3d(double, double)>;

constexpr double E = 70e9, Rho = 2700;  // of METAL

/** A patch of shells between its low and top nodes, which determine the displacements of the
others. **/
class Shell {
public:
    /** n×m shells over 0…1 × 0…1; inner nodes are displaced by up to a share of an edge. **/
    Shell(const std::string& type, int n, int m, double thickness, double nu, double skew,
          const Map& at) {
        ThinDeck deck;
        deck.nu = nu;
        std::mt19937 random(5);
        std::uniform_real_distribution<double> off(-skew, skew);
        std::map<std::pair<long, long>, std::array<double, 2>> moved;
        deck.addPatch(type, "SHELL", n, m, [&](double u, double v) -> Point {
            const bool isInner = u > 1e-9 && u < 1 - 1e-9 && v > 1e-9 && v < 1 - 1e-9;
            const auto key = std::pair(std::lround(u * 1e6), std::lround(v * 1e6));
            if (isInner && !moved.count(key)) moved[key] = {off(random) / n, off(random) / m};
            if (isInner) u += moved[key][0], v += moved[key][1];
            const Vector3d x = at(u, v);
            return {x[0], x[1], x[2]};
        });
        deck.addShellSection("SHELL", thickness);
        testing::writeText(folder / "deck.inp", deck.text());
        model = readCalculixDeck(folder / "deck.inp");
        const Index size = model.K.size;
        fixed.assign(size_t(size), 1);
        force = VectorXd::Zero(size);
        for (const ElementBlock& block : model.mesh.elements)
            for (const int node : block.nodes)
                for (int a = 0; a < 3; ++a) fixed[size_t(3 * node + a)] = 0;
    }

    Vector3d at(int node) const {
        return Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]);
    }
    /** Calls visit(low, top, midpoint) for each node. **/
    template <class Visit>
    void forNodes(const Visit& visit) const {
        for (const auto& [number, nodes] : model.mesh.expandedNodes)
            visit(nodes[1], nodes[2], (0.5 * (at(nodes[1]) + at(nodes[2]))).eval());
    }
    template <class IsHeld>
    void hold(const std::string& axes, const IsHeld& isHeld) {
        forNodes([&](int low, int top, const Vector3d& x) {
            if (!isHeld(x)) return;
            for (const char axis : axes)
                for (const int node : {low, top}) fixed[size_t(3 * node + (axis - 'x'))] = 1;
        });
    }
    template <class IsThere>
    void push(const Vector3d& f, const IsThere& isThere) {
        forNodes([&](int low, int top, const Vector3d& x) {
            if (!isThere(x)) return;
            for (const int node : {low, top}) force.segment<3>(3 * node) += 0.5 * f;
        });
    }
    /** Applies an acceleration as weight [m/s²]. **/
    void accelerate(const Vector3d& g) {
        for (int column = 0; column < model.m.size; ++column)
            for (auto k = model.m.columnStarts[size_t(column)];
                 k < model.m.columnStarts[size_t(column) + 1]; ++k) {
                const int row = model.m.rows[size_t(k)];
                force.segment<3>(3 * row) += model.m.values[size_t(k)] * g;
                if (row != column) force.segment<3>(3 * column) += model.m.values[size_t(k)] * g;
            }
    }

    VectorXd multiply(const VectorXd& u) const {
        return matrix().selfadjointView<Eigen::Lower>() * u;
    }

    /** Returns the midsurface displacement at a position under the loads. **/
    Vector3d solve(const Vector3d& where) const {
        std::vector<int> place(fixed.size(), -1);
        int count = 0;
        for (size_t dof = 0; dof < fixed.size(); ++dof)
            if (!fixed[dof]) place[dof] = count++;
        std::vector<Eigen::Triplet<double>> entries;
        VectorXd right(count);
        const auto K = matrix();
        for (int column = 0; column < K.outerSize(); ++column)
            for (Eigen::SparseMatrix<double>::InnerIterator it(K, column); it; ++it)
                if (place[size_t(it.row())] >= 0 && place[size_t(column)] >= 0)
                    entries.emplace_back(place[size_t(it.row())], place[size_t(column)],
                                         it.value());
        for (size_t dof = 0; dof < fixed.size(); ++dof)
            if (place[dof] >= 0) right[place[dof]] = force[Index(dof)];
        Eigen::SparseMatrix<double> reduced(count, count);
        reduced.setFromTriplets(entries.begin(), entries.end());
        const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(reduced);
        const VectorXd u = solver.solve(right);
        Vector3d result = Vector3d::Zero();
        double nearest = 1e300;
        forNodes([&](int low, int top, const Vector3d& x) {
            if ((x - where).norm() >= nearest) return;
            nearest = (x - where).norm();
            for (int a = 0; a < 3; ++a) {
                result[a] = 0;
                for (const int node : {low, top})
                    if (const int at = place[size_t(3 * node + a)]; at >= 0)
                        result[a] += 0.5 * u[at];
            }
        });
        return result;
    }

    FeModel model;
    std::vector<char> fixed;
    VectorXd force;

private:
    Eigen::SparseMatrix<double> matrix() const {
        std::vector<Eigen::Triplet<double>> entries;
        for (int column = 0; column < model.K.size; ++column)
            for (auto k = model.K.columnStarts[size_t(column)];
                 k < model.K.columnStarts[size_t(column) + 1]; ++k)
                entries.emplace_back(model.K.rows[size_t(k)], column, model.K.values[size_t(k)]);
        Eigen::SparseMatrix<double> K(model.K.size, model.K.size);
        K.setFromTriplets(entries.begin(), entries.end());
        return K;
    }

    testing::TestFolder folder;
};

class LinearShell : public ::testing::TestWithParam<const char*> {
protected:
    /** Triangles have constant membrane strain and need finer meshes. **/
    bool isTriangle() const { return GetParam() == std::string("S3"); }
    int chooseMesh(int ofQuadrilaterals) const {
        return isTriangle() ? 2 * ofQuadrilaterals : ofQuadrilaterals;
    }
};

/** Constant membrane strains, curvatures and shears load no inner node and have the energy of plate
theory. **/
TEST_P(LinearShell, PassesThePatchTests) {
    const double t = 0.05, nu = 0.3, a = 1.2, b = 0.8;
    const Shell shell(GetParam(), 4, 3, t, nu, 0.3,
                      [&](double u, double v) { return Vector3d(a * u, b * v, 0); });
    const double plane = E / (1 - nu * nu), G = E / (2 * (1 + nu));
    struct Case {
        const char* name;
        std::function<Vector3d(const Vector3d&)> u;  // z is the position in the thickness
        double energy;                               // twice, per area
    };
    const double D = plane * t * t * t / 12;
    const std::vector<Case> cases = {
        {"xx", [](const Vector3d& x) { return Vector3d(x[0], 0, 0); }, plane * t},
        {"yy", [](const Vector3d& x) { return Vector3d(0, x[1], 0); }, plane * t},
        {"xy", [](const Vector3d& x) { return Vector3d(x[1], 0, 0); }, G * t},
        {"bend x", [](const Vector3d& x) { return Vector3d(-x[2] * x[0], 0, 0.5 * x[0] * x[0]); },
         D},
        {"bend y", [](const Vector3d& x) { return Vector3d(0, -x[2] * x[1], 0.5 * x[1] * x[1]); },
         D},
        {"twist",
         [](const Vector3d& x) { return Vector3d(-x[2] * x[1], -x[2] * x[0], x[0] * x[1]); },
         2 * (1 - nu) * D}};
    for (const Case& test : cases) {
        VectorXd u = VectorXd::Zero(shell.model.K.size);
        std::vector<int> inner;
        shell.forNodes([&](int low, int top, const Vector3d& x) {
            for (const int node : {low, top}) {
                u.segment<3>(3 * node) = test.u(shell.at(node));
                if (x[0] > 1e-9 && x[0] < a - 1e-9 && x[1] > 1e-9 && x[1] < b - 1e-9)
                    inner.push_back(node);
            }
        });
        const VectorXd f = shell.multiply(u);
        EXPECT_NEAR(u.dot(f), test.energy * a * b, 1e-9 * test.energy * a * b) << test.name;
        for (const int node : inner)
            EXPECT_LT(f.segment<3>(3 * node).norm(), 1e-9 * f.cwiseAbs().maxCoeff()) << test.name;
    }
}

/** Sections that stay upright under a slope: pure shear, whose forces on the midsurface vanish; the
couples may cause bending. Triangles bend at their bubbles. **/
TEST_P(LinearShell, ShearsAsMindlinFound) {
    if (isTriangle()) GTEST_SKIP() << "triangles bend within";
    const double t = 0.05, nu = 0.3, a = 1.2, b = 0.8, G = E / (2 * (1 + nu));
    const Shell shell(GetParam(), 4, 3, t, nu, 0.3,
                      [&](double u, double v) { return Vector3d(a * u, b * v, 0); });
    for (const Index axis : {0, 1}) {
        VectorXd u = VectorXd::Zero(shell.model.K.size);
        shell.forNodes([&](int low, int top, const Vector3d& x) {
            for (const int node : {low, top}) u[3 * node + 2] = x[axis];
        });
        const VectorXd f = shell.multiply(u);
        const double energy = 5.0 / 6 * G * t * a * b;
        EXPECT_NEAR(u.dot(f), energy, 1e-9 * energy);
        shell.forNodes([&](int low, int top, const Vector3d& x) {
            const bool isInner = x[0] > 1e-9 && x[0] < a - 1e-9 && x[1] > 1e-9 && x[1] < b - 1e-9;
            if (!isInner) return;
            EXPECT_LT((f.segment<3>(3 * low) + f.segment<3>(3 * top)).norm(),
                      1e-9 * f.cwiseAbs().maxCoeff());
        });
    }
}

/** Under curvature and tension it has the stress of plate theory on both sides. **/
TEST_P(LinearShell, HasTheStressOfBendingOnBothSides) {
    const double t = 0.05, nu = 0.3, plane = E / (1 - nu * nu);
    const Shell shell(GetParam(), 4, 3, t, nu, 0.3,
                      [](double u, double v) { return Vector3d(1.2 * u, 0.8 * v, 0); });
    const double curvature = 1e-2, strain = 2e-4;
    std::vector<double> u(size_t(shell.model.K.size), 0);
    std::vector<int> nodes;
    shell.forNodes([&](int low, int top, const Vector3d&) {
        for (const int node : {low, top}) {
            const Vector3d x = shell.at(node);
            u[3 * size_t(node)] = strain * x[0] - curvature * x[2] * x[0];
            u[3 * size_t(node) + 2] = 0.5 * curvature * x[0] * x[0];
            nodes.push_back(node);
        }
    });
    std::vector<float> stress(6 * nodes.size()), strains(6 * nodes.size());
    ElementStress(shell.model).calcAtNodes(nodes, u.data(), 1, stress.data(), strains.data());
    for (size_t k = 0; k < nodes.size(); ++k) {
        const double xx = plane * (strain - curvature * shell.at(nodes[k])[2]);
        const double expected[6] = {xx, nu * xx, 0, 0, 0, 0};
        for (size_t c = 0; c < 6; ++c)
            EXPECT_NEAR(stress[6 * k + c], expected[c], 1e-6 * plane * curvature * t) << c;
        EXPECT_NEAR(strains[6 * k + 2], -nu / (1 - nu) * xx / plane, 1e-9);
    }
}

/** Tension resists slopes with energy N w'². **/
TEST_P(LinearShell, ThatIsPulledResistsSlopes) {
    const double t = 0.05, nu = 0.3, a = 1.2, b = 0.8, plane = E / (1 - nu * nu);
    const Shell shell(GetParam(), 4, 3, t, nu, 0.3,
                      [&](double u, double v) { return Vector3d(a * u, b * v, 0); });
    const double slope[2] = {0.3, -0.7};
    VectorXd u = VectorXd::Zero(shell.model.K.size), w = VectorXd::Zero(shell.model.m.size);
    shell.forNodes([&](int low, int top, const Vector3d& x) {
        for (const int node : {low, top}) {
            u[3 * node] = x[0];
            w[node] = slope[0] * x[0] + slope[1] * x[1];
        }
    });
    double energy = 0;
    calcGeometricStiffness(shell.model, u.data(), 1, {}, [&](int, const SymmetricMatrix& k) {
        for (int column = 0; column < k.size; ++column)
            for (auto e = k.columnStarts[size_t(column)]; e < k.columnStarts[size_t(column) + 1];
                 ++e)
                energy += (k.rows[size_t(e)] == column ? 1 : 2) * k.values[size_t(e)] * w[column] *
                          w[k.rows[size_t(e)]];
    });
    const double expected = plane * t * a * b * (slope[0] * slope[0] + nu * slope[1] * slope[1]);
    EXPECT_NEAR(energy, expected, 1e-9 * expected);
}

TEST_P(LinearShell, OfARoofSagsAsScordelisAndLoFound) {
    const double R = 25, L = 50, t = 0.25, edge = 40 * M_PI / 180, scale = E / 4.32e8;
    const int n = chooseMesh(16);
    Shell roof(GetParam(), n, n, t, 0, 0, [&](double u, double v) {
        return Vector3d(0.5 * L * u, R * std::sin(edge * v), R * std::cos(edge * v));
    });
    roof.hold("yz", [](const Vector3d& x) { return x[0] < 1e-6; });
    roof.hold("x", [&](const Vector3d& x) { return x[0] > 0.5 * L - 1e-6; });
    roof.hold("y", [](const Vector3d& x) { return x[1] < 1e-6; });
    roof.accelerate({0, 0, -90 * scale / (Rho * t)});
    const Vector3d u = roof.solve({0.5 * L, R * std::sin(edge), R * std::cos(edge)});
    EXPECT_NEAR(-u[2], 0.3024, 0.02 * 0.3024);
}

TEST_P(LinearShell, OfATwistedBeamBendsBothWays) {
    const double L = 12, w = 1.1, t = 0.32, scale = E / 29e6;
    const Map at = [&](double u, double v) {
        const double angle = 0.5 * M_PI * u, y = w * (v - 0.5);
        return Vector3d(L * u, y * std::cos(angle), y * std::sin(angle));
    };
    // Loads in the plane of the tip's width, which is along z, and across it.
    for (const auto& [axis, expected] : {std::pair(2, 0.005424), std::pair(1, 0.001754)}) {
        Shell beam(GetParam(), isTriangle() ? 72 : 24, isTriangle() ? 12 : 4, t, 0.22, 0, at);
        beam.hold("xyz", [](const Vector3d& x) { return x[0] < 1e-6; });
        const auto isMiddle = [&](const Vector3d& x) {
            return x[0] > L - 1e-6 && std::abs(x[2]) < 1e-6;
        };
        beam.push(scale * Vector3d::Unit(axis), isMiddle);
        EXPECT_NEAR(beam.solve({L, 0, 0})[axis], expected, 0.02 * expected) << "axis " << axis;
    }
}

TEST_P(LinearShell, OfAHemisphereIsPulledOpen) {
    const double R = 10, t = 0.04, hole = 18 * M_PI / 180, scale = E / 6.825e7;
    Shell dome(GetParam(), 16, 16, t, 0.3, 0, [&](double u, double v) {
        const double around = 0.5 * M_PI * u, up = (0.5 * M_PI - hole) * v;
        return Vector3d(R * std::cos(around) * std::cos(up), R * std::sin(around) * std::cos(up),
                        R * std::sin(up));
    });
    dome.hold("y", [](const Vector3d& x) { return std::abs(x[1]) < 1e-6; });
    dome.hold("x", [](const Vector3d& x) { return std::abs(x[0]) < 1e-6; });
    const auto isAt = [](const Vector3d& where) {
        return [where](const Vector3d& x) { return (x - where).norm() < 1e-6; };
    };
    // Vertical motion is fixed at one node of the two, so that its edge can rotate.
    dome.forNodes([&](int low, int, const Vector3d& x) {
        if (isAt({R, 0, 0})(x)) dome.fixed[size_t(3 * low + 2)] = 1;
    });
    dome.push({scale, 0, 0}, isAt({R, 0, 0}));
    dome.push({0, -scale, 0}, isAt({0, R, 0}));
    EXPECT_NEAR(dome.solve({R, 0, 0})[0], 0.0940, 0.02 * 0.0940);
}

INSTANTIATE_TEST_SUITE_P(Types, LinearShell, ::testing::Values("S3", "S4", "S4R"));

}  // namespace
}  // namespace simflex
