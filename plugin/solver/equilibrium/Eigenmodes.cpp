#include "simflex/solver/Eigenmodes.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/body/Assembly.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/StateSpace.h"
#include "simflex/solver/equations/StateImage.h"
#include "simflex/solver/equilibrium/ModeReport.h"
#include "simflex/solver/equilibrium/SecondOrderPencil.h"
#include "simflex/solver/equilibrium/SimbodyMatrix.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"
#include "simflex/solver/equilibrium/SlowModes.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr double RoundOff = 1e-11;  // of scaled matrices, whose entries are of order 1
constexpr double ZeroRate = 1e-12;  // |ν| that counts as zero
/** |ν| of zero eigenvalues, which are defective: roots of round-off. **/
constexpr double NearestZero = 1e-6;
/** Least number of speeds, in total and per mode, for block elimination. **/
constexpr int LeastSpeeds = 300, LeastSpeedsOfMode = 6;
/** Relative stiffness of a motion that may be free. **/
constexpr double SoftDirection = 1e-6;

/** λ²M + λD + K in coordinates y with λ = s·ν, where all matrices have entries of order 1 or less.
States follow as coordinates without mass: λz = C δ + λE δ + F z. **/
struct ReducedPencil {
    MatrixXd M, D, K;
    MatrixXd basis;  ///< δ = basis·y, all speeds
    MatrixXd fullK;  ///< all speeds; zero for held ones
    double rate;     ///< s [1/s]
    double zero;     ///< ν² that counts as zero
    int numStates = 0;
};

MatrixXd select(const Matrix& from, const std::vector<int>& rows, const std::vector<int>& columns) {
    MatrixXd to(rows.size(), columns.size());
    for (size_t j = 0; j < columns.size(); ++j)
        for (size_t i = 0; i < rows.size(); ++i) to(i, j) = from(rows[i], columns[j]);
    return to;
}

/** Squared rate of reference for the modes of interest: of the softest mode of a flexible part, or
of a rigid system's largest ratio of stiffness or damping to inertia. **/
double chooseReference(const MatrixXd& M, const MatrixXd& D, const MatrixXd& K,
                       const std::vector<char>& isModal) {
    double lowest = 0, largest = 0;
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
        const double ratio = std::abs(K(i, i)) / M(i, i);
        largest = std::max(largest, ratio);
        for (Eigen::Index j = 0; j < M.rows(); ++j)
            largest = std::max(largest, D(i, j) * D(i, j) / (M(i, i) * M(j, j)));
        if (isModal[size_t(i)] && ratio > 0 && (lowest == 0 || ratio < lowest)) lowest = ratio;
    }
    return lowest > 0 ? lowest : largest > 0 ? largest : 1;
}

/** Units of states, chosen for an effect of order 1: on the motion; for a state that affects only
other states, on these; for one without effect, of the motion on it. **/
VectorXd chooseStateUnits(const MatrixXd& B, const MatrixXd& C, const MatrixXd& F, double rate) {
    const Eigen::Index count = F.rows();
    VectorXd units = VectorXd::Zero(count);
    for (Eigen::Index i = 0; i < count; ++i)
        if (B.col(i).norm() > 0) units[i] = 1 / B.col(i).norm();
    for (Eigen::Index pass = 0; pass < count; ++pass)
        for (Eigen::Index j = 0; j < count; ++j) {
            if (units[j] > 0) continue;
            double effect = 0;
            for (Eigen::Index i = 0; i < count; ++i)
                if (units[i] > 0) effect = std::max(effect, std::abs(F(i, j)) / (rate * units[i]));
            if (effect > 0) units[j] = 1 / effect;
        }
    for (Eigen::Index i = 0; i < count; ++i)
        if (units[i] == 0) units[i] = C.row(i).norm() > 0 ? C.row(i).norm() / rate : 1;
    return units;
}

void addStates(const Linearization& linear, const std::vector<int>& free, const MatrixXd& Z,
               ReducedPencil& pencil) {
    const Eigen::Index n = Z.cols(), count = linear.F.nrow();
    pencil.numStates = int(count);
    if (count == 0) return;
    std::vector<int> all;
    for (int i = 0; i < count; ++i) all.push_back(i);
    const MatrixXd B = select(linear.B, free, all), C = select(linear.C, all, free),
                   E = select(linear.E, all, free), F = select(linear.F, all, all);
    for (MatrixXd* matrix : {&pencil.M, &pencil.D, &pencil.K})
        matrix->conservativeResizeLike(MatrixXd::Zero(n + count, n + count));
    pencil.basis.conservativeResizeLike(MatrixXd::Zero(pencil.basis.rows(), n + count));
    const VectorXd units = chooseStateUnits(Z.transpose() * B, C * Z, F, pencil.rate);
    for (Eigen::Index i = 0; i < count; ++i) {
        const double unit = units[i];
        pencil.K.col(n + i).head(n) = unit * (Z.transpose() * B.col(i));
        pencil.D(n + i, n + i) = unit;
        pencil.K.row(n + i).head(n) = -(C.row(i) * Z) / pencil.rate;
        pencil.D.row(n + i).head(n) = -(E.row(i) * Z);
        for (Eigen::Index j = 0; j < count; ++j)
            pencil.K(n + j, n + i) = -F(j, i) * unit / pencil.rate;
    }
    for (Eigen::Index i = n; i < n + count; ++i) {
        const double size = std::max(
            {pencil.K.row(i).cwiseAbs().maxCoeff(), pencil.D.row(i).cwiseAbs().maxCoeff()});
        pencil.K.row(i) /= size;
        pencil.D.row(i) /= size;
    }
}

ReducedPencil reducePencil(const Linearization& linear) {
    std::vector<int> free, rows;
    const int n = linear.M.nrow();
    std::vector<char> isModal;
    for (int i = 0; i < n; ++i) {
        if (linear.isHeld[unsigned(i)]) continue;
        free.push_back(i);
        isModal.push_back(linear.isModal[unsigned(i)] != 0);
    }
    for (int k = 0; k < linear.G.nrow(); ++k) rows.push_back(k);
    const MatrixXd M = select(linear.M, free, free), D = select(linear.D, free, free),
                   K = select(linear.K, free, free), G = select(linear.G, rows, free);

    ReducedPencil pencil;
    // The factor avoids an eigenvalue, at which the shift would be singular.
    const double reference = 0.37 * chooseReference(M, D, K, isModal);
    pencil.rate = std::sqrt(reference);
    pencil.zero = std::max(square(ZeroRate),
                           square(SlowestMotion * linear.state.getU().normInf()) / reference);
    const VectorXd scale =
        (K.diagonal().cwiseAbs() + reference * M.diagonal()).cwiseSqrt().cwiseInverse();
    const MatrixXd Z = scale.asDiagonal() * TangentSpace(G * scale.asDiagonal()).getBasis();
    pencil.M = reference * calcCongruent(Z, M);
    pencil.D = pencil.rate * calcCongruent(Z, D);
    pencil.K = calcCongruent(Z, K);
    pencil.basis = MatrixXd::Zero(n, Z.cols());
    pencil.fullK = MatrixXd::Zero(n, n);
    for (size_t i = 0; i < free.size(); ++i) {
        pencil.basis.row(free[i]) = Z.row(Eigen::Index(i));
        for (size_t j = 0; j < free.size(); ++j)
            pencil.fullK(free[i], free[j]) = K(Eigen::Index(i), Eigen::Index(j));
    }
    addStates(linear, free, Z, pencil);
    return pencil;
}

/** ν² = −ω² from (K + M)⁻¹M, whose largest eigenvalues 1/(1 + ω²) belong to the slowest modes:
these are the most accurate. @returns false if a mode grows too fast for K + M to be positive. **/
bool solveSymmetric(const ReducedPencil& pencil, std::vector<PencilMode>& pairs) {
    const MatrixXd K = 0.5 * (pencil.K + pencil.K.transpose());
    const MatrixXd M = 0.5 * (pencil.M + pencil.M.transpose());
    if (!isPositiveDefinite(K + M)) return false;
    const SymmetricEigen eigen = calcSymmetricEigen(M, K + M);
    if (!eigen.hasConverged) return false;
    for (Eigen::Index k = K.rows(); k-- > 0;) {
        const double mu = eigen.values[k];
        if (!(mu > 0)) continue;  // no mass
        const VectorXd y = eigen.vectors.col(k);
        // The Rayleigh quotient over all speeds resolves a pendulum's 10 1/s² beside 1e12 1/s².
        const VectorXd x = pencil.basis * y;
        const double modalMass = y.dot(M * y), work = x.dot(pencil.fullK * x);
        const double parts = x.cwiseAbs().dot(pencil.fullK.cwiseAbs() * x.cwiseAbs());
        const double omegaSquared = work / modalMass;
        if (std::abs(work) <= RoundOffOfSum * parts || std::abs(omegaSquared) < pencil.zero)
            pairs.push_back({0, y.cast<Complex>()});
        else if (omegaSquared > 0)
            pairs.push_back({Complex(0, std::sqrt(omegaSquared)), y.cast<Complex>()});
        else
            for (const double sign : {-1.0, 1.0})
                pairs.push_back({sign * std::sqrt(-omegaSquared), y.cast<Complex>()});
    }
    return true;
}

/** Whether only round-off restores a motion. **/
bool isFree(const ReducedPencil& pencil, const VectorXcd& y) {
    if (pencil.numStates > 0) {
        // States must not change either, so all equations are checked.
        const double parts = (pencil.K.cwiseAbs() * y.cwiseAbs()).maxCoeff();
        return (pencil.K * y).cwiseAbs().maxCoeff() <= RoundOffOfSum * parts;
    }
    const VectorXcd x = pencil.basis * y;
    const VectorXd sizes = x.cwiseAbs();
    const double work = std::abs(Complex(x.dot(pencil.fullK * x)));
    const double parts = sizes.dot(pencil.fullK.cwiseAbs() * sizes);
    const double modalMass = std::real(Complex(y.dot(pencil.M * y)));
    return work <= RoundOffOfSum * parts + pencil.zero * modalMass;
}

/** Directions that span all free motions. **/
MatrixXd findSoftDirections(const ReducedPencil& pencil) {
    const double largest = pencil.K.rowwise().norm().maxCoeff();
    return largest > 0 ? calcColumnSpace(pencil.K.transpose(), SoftDirection / largest).complement
                       : MatrixXd::Identity(pencil.K.rows(), pencil.K.rows());
}

/** Finds free motions: in the softest directions, those of least stiffness over mass. **/
std::vector<VectorXcd> findFreeMotions(const ReducedPencil& pencil) {
    std::vector<VectorXcd> motions;
    const MatrixXd V = findSoftDirections(pencil);
    if (V.cols() == 0) return motions;
    if (pencil.numStates > 0) {
        const MatrixXd KV = pencil.K * V;
        const SymmetricEigen eigen =
            calcSymmetricEigen(KV.transpose() * KV, MatrixXd::Identity(V.cols(), V.cols()));
        for (Eigen::Index k = 0; k < V.cols(); ++k) {
            const VectorXcd y = (V * eigen.vectors.col(k)).cast<Complex>();
            if (isFree(pencil, y)) motions.push_back(y);
        }
        return motions;
    }
    const MatrixXd K = calcCongruent(V, pencil.K);
    const SymmetricEigen eigen =
        calcSymmetricEigen(0.5 * (K + K.transpose()), calcCongruent(V, pencil.M));
    for (Eigen::Index k = 0; k < V.cols(); ++k) {
        const VectorXcd y = (V * eigen.vectors.col(k)).cast<Complex>();
        if (isFree(pencil, y)) motions.push_back(y);
    }
    return motions;
}

/** First-order equations of coordinates, states and speeds (y, z, v), with one eigenvalue for each,
none of which is infinite. **/
InvertedPencil invertFirstOrder(const ReducedPencil& pencil) {
    const Eigen::Index s = pencil.numStates, c = pencil.M.rows(), n = c - s;
    MatrixXd rates = MatrixXd::Zero(c + n, c + n), inertia = MatrixXd::Zero(c + n, c + n);
    rates.block(0, c, n, n).setIdentity();
    inertia.topLeftCorner(n, n).setIdentity();
    rates.block(n, 0, s, c) = -pencil.K.bottomRows(s);
    rates.block(n, c, s, n) = -pencil.D.bottomLeftCorner(s, n);
    inertia.block(n, n, s, s) = pencil.D.bottomRightCorner(s, s);
    rates.block(c, 0, n, c) = -pencil.K.topRows(n);
    rates.block(c, c, n, n) = -pencil.D.topLeftCorner(n, n);
    inertia.block(c, c, n, n) = pencil.M.topLeftCorner(n, n);
    return {SquareSystem(rates - inertia).solveEach(inertia), 0};
}

void solveGeneral(const ReducedPencil& pencil, std::vector<PencilMode>& pairs) {
    const Eigen::Index n = pencil.M.rows();
    if (n == 0) return;
    const std::vector<PencilMode> others =
        solveInverted(pencil.numStates > 0 ? invertFirstOrder(pencil)
                                           : invertSecondOrder(pencil.M, pencil.D, pencil.K),
                      n);
    const std::vector<VectorXcd> free = findFreeMotions(pencil);
    for (const VectorXcd& y : free) pairs.push_back({0, y});
    for (size_t k = 0; k < others.size(); ++k) {
        const PencilMode& pair = others[k];
        const double size = std::abs(pair.nu);
        if (k < 2 * free.size() &&
            (size < NearestZero || (size < NearZero && isFree(pencil, pair.y))))
            continue;
        if (pair.nu.imag() >= 0) pairs.push_back(pair);
    }
}

/** Fastest rate of the motions without states, because filters may be arbitrarily fast. **/
double calcStiffestRate(const ReducedPencil& pencil) {
    const Eigen::Index n = pencil.M.rows() - pencil.numStates;
    const MatrixXd K = pencil.K.topLeftCorner(n, n);
    if (n == 0) return 0;
    const SymmetricEigen eigen =
        calcSymmetricEigen(0.5 * (K + K.transpose()), pencil.M.topLeftCorner(n, n));
    return pencil.rate * std::sqrt(eigen.values.cwiseAbs().maxCoeff());
}

std::vector<Eigenmode> makeModes(const Linearization& linear, const ReducedPencil& pencil,
                                 const std::vector<PencilMode>& pairs) {
    const Eigen::Index count = Eigen::Index(pairs.size());
    Eigen::MatrixXcd Y(pencil.basis.cols(), count);
    for (Eigen::Index k = 0; k < count; ++k) Y.col(k) = pairs[size_t(k)].y;
    const auto multiply = [](const MatrixXd& A, const Eigen::MatrixXcd& X) {
        Eigen::MatrixXcd product(A.rows(), X.cols());
        product.real() = A * X.real();
        product.imag() = A * X.imag();
        return product;
    };
    const Eigen::MatrixXcd shapes = multiply(pencil.basis, Y),
                           momenta = multiply(toDense(linear.M), shapes);
    Eigen::MatrixXcd later;
    if (linear.later) later = multiply(toDense(linear.carried), shapes);
    std::vector<Eigenmode> modes;
    for (Eigen::Index k = 0; k < count; ++k) {
        modes.push_back(makeEigenmode(pencil.rate * pairs[size_t(k)].nu, shapes.col(k),
                                      momenta.col(k), linear.metres));
        modes.back().isSeenTurning =
            linear.later && isTurned(shapes.col(k), later.col(k), linear.metres);
    }
    return modes;
}

}  // namespace

std::vector<Eigenmode> calcEigenmodes(const Linearization& linearization) {
    const StandardArithmetic standard;
    if (!linearization.unsteady.empty()) refuseUnsteadiness(linearization.unsteady);
    const ReducedPencil pencil = reducePencil(linearization);
    std::vector<PencilMode> pairs;
    if (pencil.K.rows() == 0) return {};
    const double asymmetry = (pencil.K - pencil.K.transpose()).cwiseAbs().maxCoeff();
    const bool isSymmetric =
        pencil.numStates == 0 && pencil.D.cwiseAbs().maxCoeff() < RoundOff && asymmetry < RoundOff;
    if (!isSymmetric || !solveSymmetric(pencil, pairs)) {
        pairs.clear();
        solveGeneral(pencil, pairs);
    }
    std::stable_sort(pairs.begin(), pairs.end(), [](const PencilMode& a, const PencilMode& b) {
        return std::abs(a.nu) < std::abs(b.nu);
    });
    std::vector<Eigenmode> modes = makeModes(linearization, pencil, pairs);
    const double stiffest =
        pencil.numStates > 0 ? calcStiffestRate(pencil) / (2 * Pi) : modes.back().frequency;
    const double noise =
        linearization.later ? NearZero * linearization.state.getU().normInf() / (2 * Pi) : 0;
    for (Eigenmode& mode : modes) mode.resolution = std::max(LeastFrequency * stiffest, noise);
    return modes;
}

void requireEquilibrium(const MultibodySystem& system, const Linearization& linearization) {
    if (linearization.later) return;
    const std::string imbalance = describeImbalance(system, linearization);
    if (!imbalance.empty()) refuseImbalance(imbalance);
}

std::vector<Eigenmode> calcSlowestEigenmodes(const MultibodySystem& system, const State& state,
                                             int count, EigenMethod method,
                                             const std::function<void()>& observer) {
    const StandardArithmetic standard;
    requireTopology(system, state, "calcSlowestEigenmodes()");
    if (count < 1)
        throw std::invalid_argument("calcSlowestEigenmodes(): at least 1 mode, not " +
                                    std::to_string(count));
    const int n = state.getNU();
    if (method == EigenMethod::Blocks ||
        (method == EigenMethod::Automatic && n >= LeastSpeeds && n / LeastSpeedsOfMode >= count)) {
        SlowModes modes(system, state, observer);
        if (modes.getObstacle().empty()) return modes.calc(count);
        if (method == EigenMethod::Blocks)
            throw std::invalid_argument("calcSlowestEigenmodes(): not by block elimination: " +
                                        modes.getObstacle());
    }
    const Linearization linear = calcLinearization(system, state, observer);
    requireEquilibrium(system, linear);
    std::vector<Eigenmode> modes = calcEigenmodes(linear);
    const auto firstElastic = std::find_if(
        modes.begin(), modes.end(), [](const Eigenmode& mode) { return !mode.isRigidMotion(); });
    if (modes.end() - firstElastic > count) modes.erase(firstElastic + count, modes.end());
    return modes;
}

std::vector<Eigenmode> calcGrowingModes(const MultibodySystem& system, const State& state,
                                        const std::function<void()>& observer) {
    constexpr int MostSpeeds = 500, FewModes = 30;
    constexpr double LeastGrowth = 1e-6;  // relative to |λ|; less is round-off
    const bool isLarge = state.getNU() > MostSpeeds;
    if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
        isLarge && flexible)
        for (const auto& equation : flexible->getGuts().states())
            if (!equation->followsMotion()) return {};
    std::vector<Eigenmode> modes, growing;
    if (isLarge) {
        modes = calcSlowestEigenmodes(system, state, FewModes, EigenMethod::Automatic, observer);
    } else {
        const Linearization linear = calcLinearization(system, state, observer);
        requireEquilibrium(system, linear);
        modes = calcEigenmodes(linear);
    }
    for (Eigenmode& mode : modes)
        if (!mode.isUncertain() && mode.dampingRatio < -LeastGrowth)
            growing.push_back(std::move(mode));
    return growing;
}

std::vector<State> calcModeStates(const MultibodySystem& system, const OperatingPoint& about,
                                  const Eigenmode& mode, Real amplitude, int numFrames) {
    const StandardArithmetic standard;
    const Evaluation equations(system, about.state, Topology::Setting::Linearize);
    const int n = equations.getTopology().numU;
    if (mode.shape.size() != n)
        throw std::invalid_argument("calcModeStates(): the mode has " +
                                    std::to_string(mode.shape.size()) + " speeds, the system has " +
                                    std::to_string(n));
    if (!(amplitude > 0) || numFrames < 1)
        throw std::invalid_argument("calcModeStates(): amplitude " + std::to_string(amplitude) +
                                    " m and number of frames " + std::to_string(numFrames) +
                                    " must be positive");
    std::vector<double> q(size_t(equations.getTopology().numQ)), u(size_t(n), 0), moved;
    equations.getBlocks().getFromState(about.state, q.data(), u.data());
    State moving = copyState(about.state);
    std::vector<VectorXd> displacements;
    double largest = 0;
    for (int frame = 0; frame < numFrames; ++frame) {
        const Complex turn = std::polar(1.0, 2 * Pi * frame / numFrames);
        Vector delta(n);
        for (int i = 0; i < n; ++i) delta[i] = std::real(mode.shape[i] * turn);
        displacements.push_back(takeFromSimbody(equations, moving, delta));
        largest =
            std::max(largest, equations.getBlocks().calcDisplacement(displacements.back().data()));
    }
    std::vector<State> states;
    for (VectorXd& delta : displacements) {
        if (largest > 0) delta *= amplitude / largest;
        moved = q;
        equations.getBlocks().moveQ(delta.data(), moved.data());
        State state = copyState(about.state);
        equations.getBlocks().putIntoState(state.getTime(), moved.data(), u.data(), state);
        system.realize(state, Stage::Velocity);
        states.push_back(std::move(state));
    }
    return states;
}

}  // namespace simflex
