#include "simflex/solver/StateSpace.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/NumberText.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/equilibrium/Differences.h"
#include "simflex/solver/equilibrium/SimbodyMatrix.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** Relative coupling of modes that is round-off or noise of differences. **/
constexpr double SmallCoupling = 1e-10;
/** Largest relative error of a drive. **/
constexpr double MissedDrive = 1e-8;
/** Round-off of an output, relative to its size. **/
constexpr double SameNumber = 64 * std::numeric_limits<double>::epsilon();
constexpr double RelativeStep = 1e-4;  // of states, relative to their size
/** Up to this number, coordinates are differenced without testing for an effect. **/
constexpr Eigen::Index FewCoordinates = 8;
/** Inertia that restrains free motions, relative to the slowest vibration's ω². **/
constexpr double InertiaHold = 1e-3;

/** Step of multipliers, relative to the largest. **/
constexpr double MultiplierStep = 1e-3;
/** Largest relative sensitivity of a transfer function to s; beyond it s is at a pole. **/
constexpr double SharpestPole = 1e7;
/** Growth rate, relative to a pole, above which it is unstable. **/
constexpr double SlowestGrowth = 1e-7;

/** Differences of a function along coordinates, some of which have no effect. **/
class SparseDifferences {
public:
    using Values = std::vector<double>;
    using Function = std::function<Values(const VectorXd& displacement)>;

    /** @param steps  of coordinates; 0: left out **/
    SparseDifferences(Function function, VectorXd steps)
        : m_function(std::move(function)),
          m_steps(std::move(steps)),
          m_middle(m_function(VectorXd::Zero(m_steps.size()))),
          m_derivative(MatrixXd::Zero(Eigen::Index(m_middle.size()), m_steps.size())) {
        if (m_middle.empty()) return;
        search(0, m_steps.size());
        differentiate(
            [this](const Values& delta, VectorXd& f) {
                const Values values =
                    m_function(Eigen::Map<const VectorXd>(delta.data(), m_steps.size()));
                f = Eigen::Map<const VectorXd>(values.data(), Eigen::Index(values.size()));
            },
            Values(m_steps.data(), m_steps.data() + m_steps.size()),
            Eigen::Map<const VectorXd>(m_middle.data(), m_derivative.rows()), m_columns);
    }
    const MatrixXd& get() const { return m_derivative; }
    /** Indices of the values without a derivative. **/
    const std::set<int>& getKinks() const { return m_kinks; }

private:
    /** @returns whether displacing coordinates from `first` on, to either side, has an effect **/
    bool depends(Eigen::Index first, Eigen::Index end) const {
        VectorXd displacement = VectorXd::Zero(m_steps.size());
        for (Eigen::Index i = first; i < end; ++i)
            displacement[i] = m_steps[i] * (0.6 + 0.4 * std::cos(1.7 * double(i)));
        return isAnother(m_function(displacement)) || isAnother(m_function(-displacement));
    }
    bool isAnother(const Values& moved) const {
        for (size_t k = 0; k < moved.size(); ++k)
            if (!(std::abs(moved[k] - m_middle[k]) <= SameNumber * std::abs(m_middle[k])))
                return true;
        return false;
    }
    void search(Eigen::Index first, Eigen::Index end) {
        if (first == end || m_steps.segment(first, end - first).maxCoeff() == 0) return;
        if (end - first > FewCoordinates) {
            if (!depends(first, end)) return;
            const Eigen::Index middle = (first + end) / 2;
            search(first, middle);
            search(middle, end);
            return;
        }
        for (Eigen::Index i = first; i < end; ++i)
            if (m_steps[i] > 0 && depends(i, i + 1))
                m_columns.push_back(
                    {{int(i),
                      {{0, int(m_derivative.rows())}},
                      [this, i](const VectorXd& slopes, const std::vector<Kink>& kinks) {
                          m_derivative.col(i) = slopes;
                          for (const Kink& kink : kinks) m_kinks.insert(kink.value);
                      }}});
    }

    Function m_function;
    VectorXd m_steps;
    Values m_middle;
    MatrixXd m_derivative;
    std::vector<std::vector<DifferenceColumn>> m_columns;
    std::set<int> m_kinks;
};

/** Undamped modes, of unit modal mass, and their ω². **/
struct ModalBasis {
    MatrixXd X;
    VectorXd omegaSquared;
};

ModalBasis calcModalBasis(const Linearization& linear) {
    Linearization undamped = linear;
    const int n = linear.M.nrow();
    undamped.D.setTo(0);
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) undamped.K(i, j) = 0.5 * (linear.K(i, j) + linear.K(j, i));
    undamped.B.resize(n, 0);
    undamped.C.resize(0, n);
    undamped.E.resize(0, n);
    undamped.F.resize(0, 0);
    ModalBasis basis;
    std::vector<VectorXd> shapes;
    std::vector<double> squares;
    for (const Eigenmode& mode : calcEigenmodes(undamped)) {
        if (mode.eigenvalue.real() > 0) continue;  // its twin decays
        VectorXd shape(n);
        for (int i = 0; i < n; ++i) shape[i] = mode.shape[i].real();
        shapes.push_back(shape);
        squares.push_back(-std::real(mode.eigenvalue * mode.eigenvalue));
    }
    basis.X.resize(n, Eigen::Index(shapes.size()));
    basis.omegaSquared.resize(Eigen::Index(shapes.size()));
    for (size_t k = 0; k < shapes.size(); ++k) {
        basis.X.col(Eigen::Index(k)) = shapes[k];
        basis.omegaSquared[Eigen::Index(k)] = squares[k];
    }
    return basis;
}

/** XᵀKX: ω² on the diagonal, off it the antisymmetric part above noise. **/
MatrixXd calcModalStiffness(const ModalBasis& basis, const MatrixXd& K) {
    const MatrixXd sizes = basis.X.cwiseAbs();
    const MatrixXd parts = sizes.transpose() * (K.cwiseAbs() * sizes);
    MatrixXd modal = basis.X.transpose() * (K * basis.X);
    const MatrixXd skew = 0.5 * (modal - modal.transpose());
    for (Eigen::Index j = 0; j < modal.cols(); ++j)
        for (Eigen::Index i = 0; i < modal.rows(); ++i)
            modal(i, j) =
                i == j ? basis.omegaSquared[i]
                       : (std::abs(skew(i, j)) > SmallCoupling * parts(i, j) ? skew(i, j) : 0);
    return modal;
}

void requireShape(const Matrix& matrix, int rows, int columns, const char* name) {
    if (matrix.nrow() == rows && matrix.ncol() == columns) return;
    throw std::invalid_argument(std::string("calcStateSpace(): ") + name + " is " +
                                std::to_string(matrix.nrow()) + "×" +
                                std::to_string(matrix.ncol()) + ", not " + std::to_string(rows) +
                                "×" + std::to_string(columns));
}

/** The motions by which constraints follow drives, orthogonal to the modes. **/
MatrixXd calcDriven(const Linearization& linear, const MatrixXd& M, const MatrixXd& X,
                    const MatrixXd& drives) {
    const Eigen::Index n = M.rows();
    MatrixXd P = MatrixXd::Zero(n, drives.cols());
    if (drives.size() == 0 || drives.cwiseAbs().maxCoeff() == 0) return P;
    MatrixXd G = toDense(linear.G);
    VectorXd scale(n);
    for (Eigen::Index i = 0; i < n; ++i)
        scale[i] = linear.isHeld[unsigned(i)] ? 0 : 1 / std::sqrt(M(i, i));
    const TangentSpace space(G * scale.asDiagonal());
    for (Eigen::Index k = 0; k < P.cols(); ++k) {
        P.col(k) = scale.asDiagonal() * space.solveForMotion(drives.col(k));
        const double missed = (G * P.col(k) - drives.col(k)).norm();
        if (!(missed <= MissedDrive * drives.col(k).norm()))
            throw std::invalid_argument("calcStateSpace(): constraints do not let input " +
                                        std::to_string(k + 1) + " be followed");
    }
    P -= X * (X.transpose() * (M * P));
    return P;
}

}  // namespace

NoDerivative::NoDerivative(std::vector<int> numbers)
    : std::invalid_argument("output " + std::to_string(numbers.at(0) + 1) +
                            " has no derivative at this State"),
      outputs(std::move(numbers)) {}

LinearOutputs differentiateOutputs(
    const MultibodySystem& system, const OperatingPoint& point,
    const std::function<std::vector<double>(const State& state, const Vector& uDot,
                                            const Vector& multipliers)>& observe) {
    const StandardArithmetic standard;
    const Evaluation equations(system, point.state, Topology::Setting::Linearize);
    const Topology& topology = equations.getTopology();
    const Eigen::Index n = topology.numU, m = topology.numMultipliers;
    std::vector<double> q(size_t(topology.numQ)), u(size_t(n), 0);
    equations.getBlocks().getFromState(point.state, q.data(), u.data());
    const CoordinateScales scales(equations.getBlocks());
    VectorXd steps = VectorXd::Zero(n), rates = VectorXd::Zero(n), inertias = VectorXd::Zero(n);
    for (const int i : listFreeSpeeds(equations)) {
        const size_t own = size_t(i);
        steps[i] = scales.step[own];
        rates[i] = scales.step[own] * scales.rate[own];
        inertias[i] = scales.step[own] * square(scales.rate[own]);
    }
    State moved = copyState(point.state);
    const auto observeAt = [&](const VectorXd& delta, const VectorXd& deltaU) {
        std::vector<double> changedQ = q, changedU = u;
        equations.getBlocks().moveQ(delta.data(), changedQ.data());
        for (Eigen::Index i = 0; i < n; ++i) changedU[size_t(i)] += deltaU[i];
        equations.getBlocks().putIntoState(point.state.getTime(), changedQ.data(), changedU.data(),
                                           moved);
        system.realize(moved, Stage::Velocity);
        return observe(moved, point.uDot, point.multipliers);
    };
    const VectorXd none = VectorXd::Zero(n);
    LinearOutputs outputs;
    const auto put = [&](const MatrixXd& own) {
        Matrix result(int(own.rows()), int(n));
        for (int i = 0; i < result.nrow(); ++i) {
            const VectorXd row = own.row(i);
            result[i] = ~equations.getBlocks().calcSimbodyUDot(q.data(), row.data());
        }
        return result;
    };
    std::set<int> kinks;
    const auto calcSlopes = [&](const SparseDifferences::Function& function,
                                const VectorXd& along) {
        const SparseDifferences differences(function, along);
        for (const int kink : differences.getKinks()) kinks.insert(kink);
        return differences.get();
    };
    outputs.byQ = put(calcSlopes([&](const VectorXd& d) { return observeAt(d, none); }, steps));
    outputs.byU = put(calcSlopes([&](const VectorXd& d) { return observeAt(none, d); }, rates));
    outputs.byUDot = put(calcSlopes(
        [&](const VectorXd& d) {
            const Vector change = equations.getBlocks().calcSimbodyUDot(q.data(), d.data());
            return observe(point.state, point.uDot + change, point.multipliers);
        },
        inertias));
    double largest = 0;
    for (int k = 0; k < int(m); ++k) largest = std::max(largest, std::abs(point.multipliers[k]));
    outputs.byMultipliers = toSimbody(calcSlopes(
        [&](const VectorXd& d) {
            Vector multipliers = point.multipliers;
            for (int k = 0; k < int(m); ++k) multipliers[k] += d[k];
            return observe(point.state, point.uDot, multipliers);
        },
        VectorXd::Constant(m, largest > 0 ? MultiplierStep * largest : 1)));
    const std::vector<int> states = topology.listOwnStates();
    VectorXd stateSteps(Eigen::Index(states.size()));
    for (size_t i = 0; i < states.size(); ++i)
        stateSteps[Eigen::Index(i)] =
            RelativeStep *
            std::max(topology.states[size_t(states[i] - topology.firstZ)].equation->getScale(),
                     std::abs(point.state.getZ()[states[i]]));
    outputs.byStates = toSimbody(calcSlopes(
        [&](const VectorXd& d) {
            moved.updZ() = point.state.getZ();
            for (size_t i = 0; i < states.size(); ++i)
                moved.updZ()[states[i]] += d[Eigen::Index(i)];
            return observeAt(none, none);
        },
        stateSteps));
    if (!kinks.empty()) throw NoDerivative({kinks.begin(), kinks.end()});
    return outputs;
}

int StateSpace::countUnstable() const {
    if (A.nrow() == 0) return 0;
    const MatrixXd a = toDense(A);
    const GeneralEigen eigen = calcGeneralEigen(a);
    if (!eigen.hasConverged)
        throw std::runtime_error("the poles of the linear model are not found");
    // Double zeros with one eigenvector appear as the square root of round-off.
    const double zero = 10 * std::sqrt(std::numeric_limits<double>::epsilon() * a.norm());
    return int(std::count_if(eigen.values.begin(), eigen.values.end(), [&](const Complex& pole) {
        return pole.real() > zero && pole.real() > SlowestGrowth * std::abs(pole);
    }));
}

StateSpace calcStateSpace(const Linearization& linear, const LinearInputs& inputs,
                          const LinearOutputs& outputs) {
    const StandardArithmetic standard;
    const int n = linear.M.nrow(), m = linear.G.nrow(), p = inputs.forces.ncol(),
              o = outputs.byQ.nrow(), s = linear.F.nrow();
    requireShape(inputs.forces, n, p, "inputs.forces");
    requireShape(inputs.drives, m, p, "inputs.drives");
    requireShape(inputs.direct, o, p, "inputs.direct");
    if (inputs.states.nelt() > 0) requireShape(inputs.states, s, p, "inputs.states");
    requireShape(outputs.byQ, o, n, "outputs.byQ");
    requireShape(outputs.byU, o, n, "outputs.byU");
    requireShape(outputs.byUDot, o, n, "outputs.byUDot");
    requireShape(outputs.byMultipliers, o, m, "outputs.byMultipliers");
    requireShape(outputs.byStates, o, s, "outputs.byStates");

    const ModalBasis basis = calcModalBasis(linear);
    const MatrixXd& X = basis.X;
    const Eigen::Index k = X.cols();
    const MatrixXd M = toDense(linear.M), D = toDense(linear.D), K = toDense(linear.K);
    const MatrixXd forces = toDense(inputs.forces);
    const MatrixXd P = calcDriven(linear, M, X, toDense(inputs.drives));
    const MatrixXd modalK = calcModalStiffness(basis, K), modalD = X.transpose() * (D * X);
    const MatrixXd B = toDense(linear.B), C = toDense(linear.C), E = toDense(linear.E),
                   F = toDense(linear.F);
    // η̈ = −modalK η − modalD η̇ − XᵀB δz + force p − rate ṗ
    const MatrixXd rate = X.transpose() * (D * P);
    const MatrixXd drivenStates = E * P;
    const MatrixXd force = X.transpose() * (forces - K * P);

    StateSpace result;
    const Eigen::Index size = 2 * k + s;
    MatrixXd a = MatrixXd::Zero(size, size), b = MatrixXd::Zero(size, p);
    a.block(0, k, k, k).setIdentity();
    b.topRows(k) = -rate;
    a.block(k, 0, k, k) = -modalK;
    a.block(k, k, k, k) = -modalD;
    a.block(k, 2 * k, k, s) = -(X.transpose() * B);
    b.middleRows(k, k) = force + modalD * rate - X.transpose() * (B * drivenStates);
    a.block(2 * k, 0, s, k) = C * X;
    a.block(2 * k, k, s, k) = E * X;
    a.block(2 * k, 2 * k, s, s) = F;
    b.bottomRows(s) = C * P - E * (X * rate) + F * drivenStates;
    if (inputs.states.nelt() > 0) b.bottomRows(s) += toDense(inputs.states);

    // Multipliers follow from the equations of motion; in a motion, speeds vary with positions.
    MatrixXd byQ = toDense(outputs.byQ), byU = toDense(outputs.byU),
             byUDot = toDense(outputs.byUDot), byStates = toDense(outputs.byStates),
             direct = toDense(inputs.direct);
    if (linear.speedsByQ.nrow() > 0) {
        byQ += byU * toDense(linear.speedsByQ) + byUDot * toDense(linear.accelerationsByQ);
        byU += byUDot * toDense(linear.accelerationsByU);
    }
    const MatrixXd byMultipliers = toDense(outputs.byMultipliers);
    if (m > 0 && byMultipliers.size() > 0 && byMultipliers.cwiseAbs().maxCoeff() > 0) {
        VectorXd scale(n);
        for (int i = 0; i < n; ++i)
            scale[i] = linear.isHeld[unsigned(i)] ? 0 : 1 / std::sqrt(M(i, i));
        const TangentSpace space(toDense(linear.G) * scale.asDiagonal());
        MatrixXd byForces(o, n);
        for (int i = 0; i < n; ++i)
            byForces.col(i) =
                byMultipliers * space.solveForMultipliers(scale[i] * VectorXd::Unit(n, i));
        byQ -= byForces * K;
        byU -= byForces * D;
        byUDot -= byForces * M;
        byStates -= byForces * B;
        direct += byForces * forces;
    }
    const MatrixXd inertial = byUDot * X;
    MatrixXd c(o, size);
    c << byQ * X - inertial * modalK, byU * X - inertial * modalD,
        byStates - inertial * (X.transpose() * B);
    const MatrixXd d = byQ * P - byU * (X * rate) + inertial * b.middleRows(k, k) +
                       byStates * drivenStates + direct;
    const MatrixXd d1 = byU * P - inertial * rate, d2 = byUDot * P;
    result.A = toSimbody(a);
    result.B = toSimbody(b);
    result.C = toSimbody(c);
    result.D = toSimbody(d);
    result.D1 = toSimbody(d1);
    result.D2 = toSimbody(d2);
    return result;
}

Matrix_<Complex> StateSpace::calcTransfer(Complex s) const {
    const Eigen::Index size = A.nrow();
    Eigen::MatrixXcd x = -toDense(A).cast<Complex>();
    for (Eigen::Index i = 0; i < size; ++i) x(i, i) += s;
    const Eigen::MatrixXcd b = toDense(B).cast<Complex>();
    Eigen::MatrixXcd y = (toDense(D).cast<Complex>() + s * toDense(D1).cast<Complex>() +
                          s * s * toDense(D2).cast<Complex>());
    if (size > 0) {
        // At a pole the response is too sensitive to s.
        const Eigen::MatrixXcd response = solveEach(x, b), change = solveEach(x, response);
        if (!response.allFinite() || std::abs(s) * change.norm() > SharpestPole * response.norm())
            throw std::runtime_error(
                "at " + writeGeneral(std::abs(s) / (2 * Pi), 6) +
                " Hz there is a pole: without damping there is no harmonic motion in resonance; "
                "choose another frequency, or add damping");
        y += toDense(C).cast<Complex>() * response;
    }
    Matrix_<Complex> transfer(int(y.rows()), int(y.cols()));
    for (int j = 0; j < transfer.ncol(); ++j)
        for (int i = 0; i < transfer.nrow(); ++i) transfer(i, j) = y(i, j);
    return transfer;
}

std::string describeImbalance(const MultibodySystem& system, const Linearization& linear) {
    const StandardArithmetic standard;
    const int n = linear.M.nrow();
    VectorXd uDot(n);
    for (int i = 0; i < n; ++i) uDot[i] = linear.uDot[i];
    const ModalBasis basis = calcModalBasis(linear);
    if (basis.X.cols() == 0) return "";
    double slowest = 0;
    for (Eigen::Index k = 0; k < basis.omegaSquared.size(); ++k) {
        const double size = std::abs(basis.omegaSquared[k]);
        if (size > 0 && (slowest == 0 || size < slowest)) slowest = size;
    }
    const double inertia = slowest > 0 ? InertiaHold * slowest : InertiaHold;
    const VectorXd forces = toDense(linear.M) * uDot;
    VectorXd y = basis.X.transpose() * forces;
    for (Eigen::Index k = 0; k < y.size(); ++k) y[k] /= std::abs(basis.omegaSquared[k]) + inertia;
    const VectorXd departure = basis.X * y;

    const Evaluation equations(system, linear.state, Topology::Setting::Linearize);
    std::vector<double> q(size_t(equations.getTopology().numQ)), u(size_t(n), 0);
    equations.getBlocks().getFromState(linear.state, q.data(), u.data());
    const CoordinateScales scales(equations.getBlocks());
    const MatrixXd T = calcSimbodyNumbering(equations, q.data());
    const VectorXd own = T.transpose() * departure, ownForces = T.transpose() * forces;
    return describeDeparture(equations, scales, own, ownForces);
}

}  // namespace simflex
