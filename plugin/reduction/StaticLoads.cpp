#include "StaticLoads.h"

#include <cmath>
#include <stdexcept>

#include "FixedInterfaces.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/NodeSelection.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int ProductAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

/** Relative residual of the motion at a frequency, and the iteration limit; the iterations grow
with the number of normal modes below the frequency. **/
constexpr double FrequencyAccuracy = 1e-12;
constexpr int MostFrequencySteps = 2000;

[[noreturn]] void refuseLoadPoint(const ReductionOptions& options, const LoadPoint& point,
                                  const std::string& what) {
    throw std::invalid_argument("part '" + options.name + "': load point '" + point.nodes +
                                "': " + what);
}

std::vector<int> readAxes(const ReductionOptions& options, const LoadPoint& point) {
    if (point.axes.empty()) refuseLoadPoint(options, point, "has no direction; give some of xyz");
    std::vector<int> axes;
    for (const char letter : point.axes) {
        const size_t axis = std::string("xyz").find(toLower(letter));
        if (axis == std::string::npos)
            refuseLoadPoint(options, point,
                            "'" + point.axes + "' are no directions; give some of xyz");
        axes.push_back(int(axis));
    }
    return axes;
}

Vector3d findArm(const FeModel& model, const RigidMotion& rigid, int node) {
    return Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]) - rigid.center;
}

/** Returns −ω×(ω×s) for a unit of ω_aω_b, both orders included. **/
Vector3d calcCentrifugalAcceleration(int a, int b, const Vector3d& s) {
    if (a == b) return s - s[a] * Vector3d::Unit(a);
    return -(s[b] * Vector3d::Unit(a) + s[a] * Vector3d::Unit(b));
}

/** Solves (1 − ω²ΘᵀMΘ) z = b column by column with MINRES (C. C. Paige, M. A. Saunders, Solution of
sparse indefinite systems of linear equations, SIAM J. Numer. Anal. 12 (1975) 617–629). High modes
are eigenvalues close to 1, so only those near and below ω cost iterations. **/
class ShiftedSolver {
public:
    ShiftedSolver(const FixedInterfaces& held, const FullRows& m, double omega)
        : m_held(held), m_m(m), m_omegaSquared(omega * omega) {}

    /** @returns whether it has converged **/
    bool solve(const Vectors& b, Vectors& z, const ProgressCallback& progress,
               const std::string& phase) const {
        const Index count = b.cols();
        const auto zeros = [&] { return Vectors(Vectors::Zero(b.rows(), count)); };
        z = zeros();
        Vectors vOld = zeros(), w = zeros(), wOld = zeros(), v = b;
        Eigen::ArrayXd beta = b.colwise().norm().transpose();
        const Eigen::ArrayXd size = beta;
        const auto invert = [](double x) { return x > 0 ? 1 / x : 0.0; };
        v = v * beta.unaryExpr(invert).matrix().asDiagonal();
        Eigen::ArrayXd eta = beta, c = Eigen::ArrayXd::Ones(count), cOld = c,
                       s = Eigen::ArrayXd::Zero(count), sOld = s;
        for (int step = 0; step < MostFrequencySteps; ++step) {
            if ((eta.abs() <= FrequencyAccuracy * size).all()) return true;
            reportProgress(progress, phase, -1);
            Vectors next =
                v - m_omegaSquared * m_held.fromForces(m_m.multiplyPerAxis(m_held.toShapes(v))) -
                vOld * beta.matrix().asDiagonal();
            const Eigen::ArrayXd alpha = (v.array() * next.array()).colwise().sum().transpose();
            next -= v * alpha.matrix().asDiagonal();
            const Eigen::ArrayXd betaNew = next.colwise().norm().transpose();
            const Eigen::ArrayXd rho0 = c * alpha - cOld * s * beta,
                                 rho1 = (rho0.square() + betaNew.square()).sqrt(),
                                 rho2 = s * alpha + cOld * c * beta, rho3 = sOld * beta;
            const Eigen::ArrayXd inverse = rho1.unaryExpr(invert);
            cOld = c;
            sOld = s;
            c = rho0 * inverse;
            s = betaNew * inverse;
            Vectors wNew =
                (v - wOld * rho3.matrix().asDiagonal() - w * rho2.matrix().asDiagonal()) *
                inverse.matrix().asDiagonal();
            wOld.swap(w);
            w.swap(wNew);
            // Converged columns stay unchanged.
            const Eigen::ArrayXd along =
                (eta.abs() > FrequencyAccuracy * size).select(c * eta, Eigen::ArrayXd::Zero(count));
            z += w * along.matrix().asDiagonal();
            eta = (eta.abs() > FrequencyAccuracy * size).select(-s * eta, eta);
            vOld.swap(v);
            v = next * betaNew.unaryExpr(invert).matrix().asDiagonal();
            beta = betaNew;
        }
        return false;
    }

private:
    const FixedInterfaces& m_held;
    const FullRows& m_m;
    const double m_omegaSquared;
};

}  // namespace

Shapes makePointLoads(const FeModel& model, const InterfaceTies& ties,
                      const ReductionOptions& options) {
    std::vector<std::pair<std::vector<int>, int>> loads;
    for (const LoadPoint& point : options.loadPoints) {
        std::vector<int> nodes;
        try {
            nodes = selectNodes(model.mesh, point.nodes);
        } catch (const std::invalid_argument& error) {
            refuseLoadPoint(options, point, error.what());
        }
        // If a face touches an interface, the constraint modes carry that part of the load.
        const int first = nodes[0];
        nodes.erase(std::remove_if(nodes.begin(), nodes.end(),
                                   [&](int node) { return ties.rigidTieOf(node) >= 0; }),
                    nodes.end());
        if (nodes.empty())
            refuseLoadPoint(options, point,
                            "node " + std::to_string(model.mesh.nodeNumbers[size_t(first)]) +
                                " is tied to interface '" +
                                ties.ties()[size_t(ties.rigidTieOf(first))].name +
                                "', whose constraint modes carry loads already");
        for (const int axis : readAxes(options, point)) loads.emplace_back(nodes, axis);
    }
    Shapes f = Shapes::Zero(model.K.size, Index(loads.size()));
    for (size_t k = 0; k < loads.size(); ++k)
        for (const int node : loads[k].first)
            f(3 * node + loads[k].second, Index(k)) = 1 / double(loads[k].first.size());
    return f;
}

std::vector<std::string> listPointLoads(const ReductionOptions& options) {
    std::vector<std::string> names;
    for (const LoadPoint& point : options.loadPoints)
        for (const int axis : readAxes(options, point))
            names.push_back(std::string("force ") + "xyz"[axis] + " at load point '" + point.nodes +
                            "'");
    return names;
}

int countInertiaLoads(bool hasInterfaces) {
    return hasInterfaces ? 12 : 6;
}

Shapes makeInertiaLoads(const FeModel& model, const FeProducts& products, const RigidMotion& rigid,
                        bool hasInterfaces) {
    Shapes a = Shapes::Zero(model.K.size, countInertiaLoads(hasInterfaces));
    for (int node = 0; node < model.mesh.numNodes(); ++node) {
        const Vector3d arm = findArm(model, rigid, node);
        for (int c = 0; c < 6; ++c)
            a.block<3, 1>(3 * node, c) =
                calcCentrifugalAcceleration(ProductAxes[c][0], ProductAxes[c][1], arm);
        if (hasInterfaces) a.block<3, 6>(3 * node, 6) = calcRigidMotion(arm);
    }
    return products.m.multiplyPerAxis(a);
}

Shapes makeFrequencyLoads(const std::string& part, const FeProducts& products,
                          const FixedInterfaces& held, const Shapes& constraint,
                          const Shapes& pointLoads, double hertz,
                          const ProgressCallback& progress) {
    const double omega = 2 * M_PI * hertz;
    Shapes f(products.m.size() * 3, constraint.cols() + pointLoads.cols());
    f << omega * omega * products.m.multiplyPerAxis(constraint), pointLoads;
    Vectors z;
    if (!ShiftedSolver(held, products.m, omega)
             .solve(held.fromForces(f), z, progress, "modes at a frequency"))
        throw std::invalid_argument(
            "part '" + part + "': no modes at " + writeGeneral(hertz) +
            " Hz can be found: with its interfaces held the part is in resonance there; choose a "
            "frequency beside it, or take normal modes beyond it");
    return f + omega * omega * products.m.multiplyPerAxis(held.toShapes(z));
}

EquilibriumLoads makeEquilibriumLoads(const FeModel& model, const FeProducts& products,
                                      const RigidMotion& rigid, const InterfaceTies& ties,
                                      const Shapes& others,
                                      const std::vector<std::string>& otherNames) {
    const int numTies = int(ties.ties().size()), numOwn = 6 + 6 * numTies,
              count = numOwn + int(otherNames.size());
    EquilibriumLoads loads;
    Shapes acceleration = Shapes::Zero(model.K.size, count);
    MatrixXd resultant = MatrixXd::Zero(6, count);  // about the centre of mass
    loads.onTies = MatrixXd::Zero(6 * numTies, count);
    for (int c = 0; c < 6; ++c) {
        const int a = ProductAxes[c][0], b = ProductAxes[c][1];
        loads.names.push_back(std::string("turning ") + "xyz"[a] + "xyz"[b]);
        for (int node = 0; node < model.mesh.numNodes(); ++node)
            acceleration.block<3, 1>(3 * node, c) =
                calcCentrifugalAcceleration(a, b, findArm(model, rigid, node));
    }
    for (int k = 0; k < 6 * numTies; ++k) {
        const auto& tie = ties.ties()[size_t(k / 6)];
        loads.names.push_back(std::string(k % 6 < 3 ? "force " : "moment ") + "xyz"[k % 3] +
                              " on interface '" + tie.name + "'");
        if (tie.type == TieType::Distributing) continue;
        loads.onTies(k, 6 + k) = 1;
        Eigen::Matrix<double, 6, 6> atMaster = Eigen::Matrix<double, 6, 6>::Identity();
        atMaster.topRows<3>() =
            calcRigidMotion(Eigen::Map<const Vector3d>(tie.master.data()) - rigid.center);
        resultant.col(6 + k) = atMaster.row(k % 6).transpose();
    }
    loads.applied = products.m.multiplyPerAxis(acceleration);
    for (int k = 0; k < numTies; ++k) {
        const auto& tie = ties.ties()[size_t(k)];
        if (tie.type == TieType::Rigid) continue;
        const MatrixXd D = ties.calcMean(model.mesh, tie);
        for (size_t i = 0; i < tie.nodes.size(); ++i)
            loads.applied.block<3, 6>(3 * tie.nodes[i], 6 + 6 * k) =
                D.middleCols<3>(3 * Index(i)).transpose();
    }
    if (!otherNames.empty()) loads.applied.rightCols(others.cols()) = others;
    loads.names.insert(loads.names.end(), otherNames.begin(), otherNames.end());
    const Shapes MR = products.m.multiplyPerAxis(rigid.R);
    const Eigen::LDLT<MatrixXd> RMR(MatrixXd(rigid.R.transpose() * MR));
    for (int pass = 0; pass < 2; ++pass) {  // twice because of round-off
        const MatrixXd rest = rigid.R.transpose() * loads.applied + resultant;
        const MatrixXd accelerations = RMR.solve(rest);
        loads.applied -= MR * accelerations;
    }
    return loads;
}

EquilibriumShapes solveEquilibrium(const FeProducts& products, const InterfaceTies& ties,
                                   const ModeBasis& basis, const EquilibriumLoads& loads) {
    const Index numBoundary = ties.numBoundaryDofs(), count = loads.applied.cols();
    EquilibriumShapes shapes{basis.held->solve(loads.applied), MatrixXd::Zero(numBoundary, count)};
    // Hold the first interface: self-equilibrated loads cause no reaction there.
    if (numBoundary > 6) {
        const Shapes constraint = basis.Psi.leftCols(numBoundary);
        const Index rest = numBoundary - 6;
        const MatrixXd stiffness = constraint.transpose() * products.K.multiply(constraint);
        const MatrixXd force = constraint.transpose() * loads.applied + loads.onTies;
        const Eigen::LDLT<MatrixXd> factors(stiffness.bottomRightCorner(rest, rest));
        shapes.boundary.bottomRows(rest) = factors.solve(MatrixXd(force.bottomRows(rest)));
        const MatrixXd motions = shapes.boundary.bottomRows(rest);
        shapes.u += constraint.rightCols(rest) * motions;
    }
    return shapes;
}

}  // namespace simflex
