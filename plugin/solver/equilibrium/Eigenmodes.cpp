#include "simflex/solver/Eigenmodes.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/body/Assembly.h"
#include "simflex/solver/StateSpace.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/StateImage.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"
#include "simflex/solver/equilibrium/TangentElimination.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr double RoundOff = 1e-11;  // of scaled matrices, whose entries are of order 1
constexpr double ZeroRate = 1e-12;  // the same, of ν
/** Of a sum's parts: what differences of forces leave of a motion that nothing holds. **/
constexpr double RoundOffOfSum = 1e-10;
/** Of the fastest speed: what is slower in a steady motion, a matter of differences too, is free.
 * **/
constexpr double SlowestMotion = 1e-5;
/** |ν| of its eigenvalues, which are defective: roots of round-off, and of noise in differences.
 * **/
constexpr double NearestZero = 1e-6, NearZero = 1e-4;
/** Of the stiffest motion's frequency: the root of round-off in λ². **/
constexpr double LeastFrequency = 1e-7;
/** Where a few modes are not found among all of them: so many speeds, and as many for each. **/
constexpr int LeastSpeeds = 300, LeastSpeedsOfMode = 6;
/** What resists a motion that may be free. **/
constexpr double SoftDirection = 1e-6;

/** λ²M + λD + K in coordinates y with λ = s·ν, where all matrices have entries of order 1 or less.
States follow as coordinates without mass: λz = C δ + λE δ + F z. **/
struct ReducedPencil {
    MatrixXd M, D, K;
    MatrixXd basis;  ///< δ = basis·y, all speeds
    MatrixXd fullK;  ///< all speeds; nothing for held ones
    double rate;     ///< s [1/s]
    double zero;     ///< ν² that is as good as none
    int numStates = 0;
};

struct PencilMode {
    Complex nu;
    VectorXcd y;
};

MatrixXd select(const Matrix& from, const std::vector<int>& rows, const std::vector<int>& columns) {
    MatrixXd to(rows.size(), columns.size());
    for (size_t j = 0; j < columns.size(); ++j)
        for (size_t i = 0; i < rows.size(); ++i) to(i, j) = from(rows[i], columns[j]);
    return to;
}

/** The square of a rate that modes of interest compare with: of the softest mode of a flexible
 * part, or of a rigid system's stiffest or fastest coordinate. **/
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

/** Units of states: those whose effect on the motion is of order 1; of a state that moves others
only, whose effect on these is; of one that nothing follows, that the motion drives by as much. **/
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
    // Not the very rate of an eigenvalue: a shift by it would be singular.
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
these come out sharpest. @returns false if a mode grows too fast for K + M to be positive. **/
bool solveSymmetric(const ReducedPencil& pencil, std::vector<PencilMode>& pairs) {
    const MatrixXd K = 0.5 * (pencil.K + pencil.K.transpose());
    const MatrixXd M = 0.5 * (pencil.M + pencil.M.transpose());
    if (!isPositiveDefinite(K + M)) return false;
    const SymmetricEigen eigen = calcSymmetricEigen(M, K + M);
    if (!eigen.hasConverged) return false;
    for (Eigen::Index k = K.rows(); k-- > 0;) {
        const double mu = eigen.values[k];
        if (!(mu > 0)) continue;  // no mass, no motion
        const VectorXd y = eigen.vectors.col(k);
        // Rayleigh's quotient in graded coordinates: a pendulum's 10 1/s² is not lost beside 1e12.
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

/** Whether nothing but round-off restores a motion. **/
bool isFree(const ReducedPencil& pencil, const VectorXcd& y) {
    if (pencil.numStates > 0) {
        // Nor may states change: all equations are looked at.
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

/** Directions among which are all that nothing restores. **/
MatrixXd findSoftDirections(const ReducedPencil& pencil) {
    const double largest = pencil.K.rowwise().norm().maxCoeff();
    return largest > 0 ? calcColumnSpace(pencil.K.transpose(), SoftDirection / largest).complement
                       : MatrixXd::Identity(pencil.K.rows(), pencil.K.rows());
}

/** Motions that nothing restores: of the softest directions those of least stiffness over mass. **/
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

/** Eigenvalues μ = 1/(ν − 1), the slowest of which are the largest and come out sharpest, and
vectors whose first rows are y. **/
struct InvertedPencil {
    MatrixXd matrix;
    Eigen::Index shapeRow;  ///< where a vector's y begins
};

/** μ²(M + D + K) + μ(D + 2M) + M = 0. **/
InvertedPencil invertSecondOrder(const ReducedPencil& pencil) {
    const Eigen::Index n = pencil.M.rows();
    const SquareSystem shifted(pencil.M + pencil.D + pencil.K);
    MatrixXd companion = MatrixXd::Zero(2 * n, 2 * n);
    companion.topLeftCorner(n, n) = -shifted.solveEach(pencil.D + 2 * pencil.M);
    companion.topRightCorner(n, n) = -shifted.solveEach(pencil.M);
    companion.bottomLeftCorner(n, n).setIdentity();
    return {std::move(companion), n};
}

/** Of first order in coordinates, states, speeds (y, z, v): as many eigenvalues as there are of
these, none of which is infinite. **/
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

[[noreturn]] void refuseQr(Eigen::Index count) {
    throw std::runtime_error("calcEigenmodes(): the QR iteration for " + std::to_string(count) +
                             " eigenvalues does not converge");
}

void solveGeneral(const ReducedPencil& pencil, std::vector<PencilMode>& pairs) {
    const Eigen::Index n = pencil.M.rows();
    if (n == 0) return;
    const InvertedPencil inverted =
        pencil.numStates > 0 ? invertFirstOrder(pencil) : invertSecondOrder(pencil);
    const Eigen::Index count = inverted.matrix.rows();
    const GeneralEigen eigen = calcGeneralEigen(inverted.matrix);
    if (!eigen.hasConverged) refuseQr(count);

    const std::vector<VectorXcd> free = findFreeMotions(pencil);
    for (const VectorXcd& y : free) pairs.push_back({0, y});
    std::vector<PencilMode> others;
    for (Eigen::Index k = 0; k < count; ++k) {
        const Complex mu = eigen.values[k];
        if (std::abs(mu) < 1e-14) continue;  // no mass, no motion
        others.push_back({1.0 + 1.0 / mu, eigen.vectors.col(k).segment(inverted.shapeRow, n)});
    }
    std::stable_sort(others.begin(), others.end(), [](const PencilMode& a, const PencilMode& b) {
        return std::abs(a.nu) < std::abs(b.nu);
    });
    for (size_t k = 0; k < others.size(); ++k) {
        const PencilMode& pair = others[k];
        const double size = std::abs(pair.nu);
        if (k < 2 * free.size() &&
            (size < NearestZero || (size < NearZero && isFree(pencil, pair.y))))
            continue;
        if (pair.nu.imag() >= 0) pairs.push_back(pair);
    }
}

/** Of the motions that would be without states: a filter may be as fast as it likes. **/
double calcStiffestRate(const ReducedPencil& pencil) {
    const Eigen::Index n = pencil.M.rows() - pencil.numStates;
    const MatrixXd K = pencil.K.topLeftCorner(n, n);
    if (n == 0) return 0;
    const SymmetricEigen eigen =
        calcSymmetricEigen(0.5 * (K + K.transpose()), pencil.M.topLeftCorner(n, n));
    return pencil.rate * std::sqrt(eigen.values.cwiseAbs().maxCoeff());
}

Eigenmode makeMode(const Linearization& linear, const ReducedPencil& pencil,
                   const PencilMode& pair) {
    const int n = linear.M.nrow();
    Eigenmode mode;
    mode.eigenvalue = pencil.rate * pair.nu;
    const double size = std::abs(mode.eigenvalue);
    mode.frequency = size / (2 * Pi);
    mode.dampingRatio = size > 0 ? 0 - mode.eigenvalue.real() / size : 0;  // not −0
    if (pair.nu.imag() == 0 && size > 0) mode.dampingRatio = pair.nu.real() < 0 ? 1 : -1;
    const double modalMass =
        std::real(Complex(pair.y.adjoint() * (pencil.M * pair.y))) / (pencil.rate * pencil.rate);
    VectorXcd shape = pencil.basis * pair.y;
    double largest = 0;
    Complex phase = 1;
    for (int i = 0; i < n; ++i) {
        // A hair's breadth, so that equal ones do not swap by round-off.
        const double displacement = std::abs(shape[i]) * linear.metres[i];
        if (displacement <= 1.0001 * largest) continue;
        largest = displacement;
        phase = std::conj(shape[i]) / std::abs(shape[i]);
    }
    shape *= phase / (modalMass > 0 ? std::sqrt(modalMass) : 1.0);
    mode.shape.resize(n);
    for (int i = 0; i < n; ++i) mode.shape[i] = shape[i];
    return mode;
}

}  // namespace

std::vector<Eigenmode> calcEigenmodes(const Linearization& linearization) {
    const StandardArithmetic standard;
    if (!linearization.unsteady.empty())
        throw std::invalid_argument("there are no natural modes about this motion: " +
                                    linearization.unsteady);
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
    std::vector<Eigenmode> modes;
    for (const PencilMode& pair : pairs) modes.push_back(makeMode(linearization, pencil, pair));
    const double stiffest =
        pencil.numStates > 0 ? calcStiffestRate(pencil) / (2 * Pi) : modes.back().frequency;
    for (Eigenmode& mode : modes) mode.resolution = LeastFrequency * stiffest;
    return modes;
}

namespace {

/** Of ω²: what is as good as free, and the least shift that stands out from round-off. **/
constexpr double ZeroOfSoftest = 1e-12, LeastModeShift = 1e-9;
constexpr int MostRigidMotions = 6;
constexpr int KrylovBlock = 4, DampedBlock = 16, NumDecades = 12, MostKrylovRounds = 12,
              MostDampedRounds = 12;
/** Of displacements, in the norm of K + σM. **/
constexpr double ModeAccuracy = 1e-8, DampedAccuracy = 1e-7;
/** Of a rate, what it may change when it has not moved, and where it may be another one's. **/
constexpr double SameRate = 1e-9, NearRate = 1e-5;
/** Accelerations of what is at rest without a doubt, for its size [1/s²]; and, of the softest
mode's ω², what holds free motions where there is one. **/
constexpr double SlowestChange = 1e-6, HeldBesides = 1e-9;

void refuseImbalance(const std::string& imbalance) {
    if (!imbalance.empty())
        throw NoEquilibrium(
            "there are no natural modes about this State, which is no "
            "equilibrium: " +
            imbalance + "; find a static equilibrium first");
}

/** Rows of tall matrices that are multiplied at a time. **/
constexpr Eigen::Index TallPiece = 4096;

/** AᵀB of tall matrices, in pieces that are summed in order. **/
MatrixXd multiplyTall(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const MatrixXd>& B,
                      int threads) {
    const int count = int((A.rows() + TallPiece - 1) / TallPiece);
    std::vector<MatrixXd> parts(static_cast<size_t>(count));
    parallelFor(count, threads, [&](int k) {
        const Eigen::Index first = k * TallPiece, rows = std::min(TallPiece, A.rows() - first);
        parts[size_t(k)].noalias() =
            A.middleRows(first, rows).transpose() * B.middleRows(first, rows);
    });
    MatrixXd product = MatrixXd::Zero(A.cols(), B.cols());
    for (const MatrixXd& part : parts) product += part;
    return product;
}

/** X −= A·parts. **/
void subtractPart(const Eigen::Ref<const MatrixXd>& A, const MatrixXd& parts, MatrixXd& X,
                  int threads) {
    const int count = int((A.rows() + TallPiece - 1) / TallPiece);
    parallelFor(count, threads, [&](int k) {
        const Eigen::Index first = k * TallPiece, rows = std::min(TallPiece, A.rows() - first);
        X.middleRows(first, rows).noalias() -= A.middleRows(first, rows) * parts;
    });
}

/** The undamped modes of slowest |ω² + σ|, σ small, and what damping makes of them. **/
class SlowModes {
public:
    SlowModes(const MultibodySystem& system, const State& state,
              const std::function<void()>& observer);

    /** Why it does not do; empty if it does. **/
    const std::string& getObstacle() const { return m_obstacle; }
    std::vector<Eigenmode> calc(int count);

private:
    void linearize();
    /** See simflex::describeImbalance(). **/
    std::string describeImbalance();
    void factor(double shift);
    /** Eigenvalues ω² below this one. **/
    int count(double omegaSquared);
    /** (K + σM)⁻¹ f along the joints. **/
    MatrixXd solve(MatrixXd F) {
        m_elimination->solveEach(F);
        return F;
    }
    /** Of each column. **/
    MatrixXd multiplyM(const MatrixXd& X) const {
        MatrixXd product(X.rows(), X.cols());
        parallelFor(int(X.cols()), m_threads,
                    [&](int j) { product.col(j) = m_mass->multiply(X.col(j)); });
        return product;
    }
    MatrixXd multiply(const BlockMatrix<double>& A, const MatrixXd& X) const {
        MatrixXd product(X.rows(), X.cols());
        parallelFor(int(X.cols()), m_threads,
                    [&](int j) { product.col(j) = A.multiply(X.col(j)); });
        return product;
    }
    /** Adds what is new in X, orthonormal in M. **/
    void extend(MatrixXd X);
    auto V() const { return m_space.leftCols(m_count); }
    auto KV() const { return m_stiff.leftCols(m_count); }
    /** Ritz pairs in the space. **/
    void project();
    /** Of each column, in which modes and their corrections are measured. **/
    VectorXd calcNorms(const MatrixXd& X, const MatrixXd& KX, const MatrixXd& MX) const {
        VectorXd norms(X.cols());
        for (Eigen::Index j = 0; j < X.cols(); ++j)
            norms[j] = std::sqrt(std::abs(X.col(j).dot(KX.col(j))) +
                                 m_shift * std::abs(X.col(j).dot(MX.col(j))));
        return norms;
    }
    VectorXd calcNorms(const MatrixXd& X) const {
        return calcNorms(X, multiply(*m_K, X), multiplyM(X));
    }
    /** Roots of round-off: of what is free there are two. **/
    bool isAboutZero(Complex lambda) const { return std::norm(lambda) <= 1e-2 * m_shift; }
    void findUndamped(int wanted);
    void findDamped(int wanted, std::vector<PencilMode>& modes, MatrixXd& basis);
    Eigenmode makeMode(Complex lambda, const VectorXcd& x) const;

    const MultibodySystem& m_system;
    State m_state;
    std::function<void()> m_observer;
    Evaluation m_equations;
    CoordinateScales m_scales;
    BlockGraph m_graph;
    SolutionPoint m_point;
    bool m_isAccelerated = false;
    VectorXd m_uDot;
    std::string m_obstacle;
    std::optional<BlockMass> m_mass;
    std::optional<BlockMatrix<double>> m_K, m_D;
    std::optional<TangentElimination<double>> m_elimination;
    bool m_isSymmetric = true;
    int m_threads = 1;
    double m_softest = 0, m_stiffest = 0, m_shift = 0;  ///< ω²
    VectorXd m_s;
    Vector m_metres;            ///< of Simbody's speeds
    MatrixXd m_space, m_stiff;  ///< the space V and K V, and room for more
    Eigen::Index m_count = 0;
    VectorXd m_values;   ///< ω² of Ritz pairs, ascending
    MatrixXd m_vectors;  ///< in the space
};

SlowModes::SlowModes(const MultibodySystem& system, const State& state,
                     const std::function<void()>& observer)
    : m_system(system),
      m_state(state),
      m_observer(observer),
      m_equations((system.realize(m_state, Stage::Velocity), system), m_state,
                  Topology::Setting::Linearize),
      m_scales(m_equations.getBlocks()),
      m_graph(m_equations, BlockGraph::Links::OfJoints) {
    const Topology& topology = m_equations.getTopology();
    if (topology.hasForeignForces || !topology.simbodyRows.empty())
        m_obstacle = "the system has forces or constraints of Simbody's";
    else if (!topology.frictions.empty())
        m_obstacle = "joints have friction";
    else if (!topology.states.empty())
        m_obstacle = "the system has states of its own";
    if (!m_obstacle.empty()) return;
    m_point.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
    m_point.t = m_state.getTime();
    m_equations.getBlocks().getFromState(m_state, m_point.q.data(), m_point.u.data());
    m_equations.prescribe(m_point.t, 0, nullptr, m_point.q.data(), m_point.u.data());
    IntegratorStatistics statistics;
    ImplicitStep step(m_equations, statistics);
    step.calcAccelerations(m_point.t, m_point.q, m_point.u, m_point.uDot, m_point.lambda);
    for (int b = 0; b < topology.numBlocks(); ++b) {
        const Block& block = m_equations.getBlock(b);
        for (int i = block.firstU; i < block.firstU + block.numU; ++i) {
            if (m_point.u[size_t(i)] != 0) m_obstacle = "'" + block.name + "' is not at rest";
            m_isAccelerated |= std::abs(m_point.uDot[size_t(i)]) * m_scales.metres[size_t(i)] >
                               SlowestChange * m_scales.lengths[size_t(b)];
        }
    }
    m_uDot = Eigen::Map<const VectorXd>(m_point.uDot.data(), topology.numU);
    std::fill(m_point.uDot.begin(), m_point.uDot.end(), 0.0);
}

std::string SlowModes::describeImbalance() {
    if (!m_isAccelerated) return "";
    const VectorXd forces = m_mass->multiply(m_uDot);
    factor(HeldBesides * m_softest);
    return describeDeparture(m_equations, m_scales, solve(forces), forces);
}

void SlowModes::linearize() {
    const Topology& topology = m_equations.getTopology();
    m_equations.updBlocks().chooseNumThreads(omp_get_max_threads());
    m_threads = m_equations.getBlocks().numThreads;
    const auto evaluate = [&](const std::vector<double>& q, VectorXd& r) {
        if (m_observer) m_observer();
        m_equations.realize(m_point.t, q.data(), m_point.u.data());
        r.resize(topology.numU);
        m_equations.calcResidual(q.data(), m_point.u.data(), m_point.uDot.data(),
                                 m_point.lambda.data(), r.data());
    };
    VectorXd r;
    evaluate(m_point.q, r);
    m_mass.emplace(m_equations);
    const LoadTerms::Tangent ofLaws(m_equations.updLoads());
    m_K.emplace(calcStiffness(m_equations, m_scales, m_graph, *m_mass, m_point, evaluate));
    bool isDamped = !topology.elements.empty();
    for (const FlexibleBlock* block : m_equations.getBlocks().flexible)
        isDamped = isDamped || !block->getDamping().isZero();
    if (isDamped)
        m_D.emplace(
            calcDampingBlocks(m_equations, m_scales, m_graph, *m_mass, m_point, m_observer));

    // Turning has other axes with Simbody, but the same radius about all of them.
    m_metres.resize(topology.numU);
    m_metres = 0;
    std::vector<char> turns(size_t(topology.numU), 0);
    for (int b = 0; b < topology.numFlexible; ++b)
        std::fill_n(turns.begin() + m_equations.getBlock(b).firstU, 3, char(1));
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> own = m_scales.metres;
        for (int b = 0; b < topology.numFlexible; ++b)
            for (int i = 0; i < 3; ++i)
                if (i != axis) own[size_t(m_equations.getBlock(b).firstU + i)] = 0;
        if (axis > 0)  // what does not turn has been seen
            for (int i = 0; i < topology.numU; ++i)
                if (!turns[size_t(i)]) own[size_t(i)] = 0;
        const Vector part = m_equations.getBlocks().calcSimbodyUDot(m_point.q.data(), own.data());
        for (int i = 0; i < part.size(); ++i) m_metres[i] = std::hypot(m_metres[i], part[i]);
    }
    const VectorXd stiffness = m_K->getDiagonal(), inertia = m_mass->getDiagonal();
    for (int b = 0; b < topology.numFlexible; ++b) {
        const Block& block = m_equations.getBlock(b);
        for (int i = block.firstU + 6; i < block.firstU + block.numU; ++i)
            if (stiffness[i] > 0 && (m_softest == 0 || stiffness[i] < m_softest))
                m_softest = stiffness[i];
    }
    for (Eigen::Index i = 0; i < stiffness.size(); ++i)
        if (!topology.isPrescribed[size_t(i)])
            m_stiffest = std::max(m_stiffest, std::abs(stiffness[i]) / inertia[i]);
    if (m_softest == 0) m_softest = m_stiffest > 0 ? m_stiffest : 1;
    m_s = VectorXd::Zero(stiffness.size());
    for (Eigen::Index i = 0; i < stiffness.size(); ++i)
        if (!topology.isPrescribed[size_t(i)])
            m_s[i] = 1 / std::sqrt(std::abs(stiffness[i]) + m_softest * inertia[i]);
    m_elimination.emplace(m_graph, *m_mass);
    m_elimination->setNumThreads(m_threads);
}

void SlowModes::factor(double shift) {
    if (m_observer) m_observer();
    BlockMatrix<double> A = *m_K;
    A.addMass(*m_mass, shift);
    m_elimination->factor(A, m_s, TangentElimination<double>::Symmetry::Symmetric);
}

int SlowModes::count(double omegaSquared) {
    factor(-omegaSquared);
    return m_elimination->countNegative();
}

void SlowModes::extend(MatrixXd X) {
    constexpr double Dependent = 1e-6;
    const Eigen::Index n = m_s.size();
    MatrixXd MX = multiplyM(X);
    const auto clear = [&] { subtractPart(V(), multiplyTall(V(), MX, m_threads), X, m_threads); };
    // Among themselves: what is left of a column; those that are kept come first.
    Eigen::Index kept = 0;
    const auto orthogonalize = [&](Eigen::Index j) {
        VectorXd x = X.col(j);
        x -= X.leftCols(kept) * (MX.leftCols(kept).transpose() * x);
        X.col(kept) = x;
        MX.col(kept) = m_mass->multiply(x);
        return std::sqrt(X.col(kept).dot(MX.col(kept)));
    };
    VectorXd before(X.cols());
    for (Eigen::Index j = 0; j < X.cols(); ++j) before[j] = std::sqrt(X.col(j).dot(MX.col(j)));
    clear();
    for (Eigen::Index j = 0; j < X.cols(); ++j) {
        const double size = orthogonalize(j);
        if (!(size > Dependent * before[j])) continue;
        X.col(kept) /= size;
        MX.col(kept++) /= size;
    }
    X.conservativeResize(Eigen::NoChange, kept);
    // What the rows' compliance leaves open, and is no longer small, would cost no energy.
    m_elimination->close(X);
    MX = multiplyM(X);
    clear();
    const Eigen::Index all = kept, first = m_count;
    kept = 0;
    if (m_space.cols() < m_count + all) {
        const Eigen::Index columns = m_count + std::max(all, m_count / 2 + 16);
        m_space.conservativeResize(n, columns);
        m_stiff.conservativeResize(n, columns);
    }
    for (Eigen::Index j = 0; j < all; ++j) {
        const double rest = orthogonalize(j);
        if (!(rest > 0.5)) continue;
        X.col(kept) /= rest;
        MX.col(kept++) /= rest;
    }
    m_space.middleCols(first, kept) = X.leftCols(kept);
    m_stiff.middleCols(first, kept) = multiply(*m_K, X.leftCols(kept));
    m_count += kept;
}

void SlowModes::project() {
    const MatrixXd K = multiplyTall(V(), KV(), m_threads);
    const SymmetricEigen eigen = calcSymmetricEigen(0.5 * (K + K.transpose()));
    m_values = eigen.values;
    m_vectors = eigen.vectors;
}

void SlowModes::findUndamped(int wanted) {
    const Eigen::Index n = m_s.size();
    // A shift by about the slowest: so much smaller than it that it stands out, so much larger than
    // round-off that what is free does not drown it.
    const int numFree = count(ZeroOfSoftest * m_softest);
    int low = -NumDecades, high = NumDecades;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        (count(std::pow(10.0, middle) * m_softest) > numFree ? high : low) = middle;
    }
    m_shift = std::max(std::pow(10.0, low), LeastModeShift) * m_softest;
    factor(m_shift);
    // What differences leave of a free motion may count as a vibration.
    const Eigen::Index most = numFree + wanted + MostRigidMotions;
    m_count = 0;
    m_space.resize(n, 0);
    m_stiff.resize(n, 0);
    MatrixXd X(n, KrylovBlock);
    for (Eigen::Index j = 0; j < X.cols(); ++j)
        for (Eigen::Index i = 0; i < n; ++i)
            X(i, j) = m_s[i] * std::cos(1.3 * double((i + 1) * (j + 1)) + double(j));
    Eigen::Index target = most + most / 2 + 2 * KrylovBlock;
    for (int round = 0; round < MostKrylovRounds; ++round) {
        while (m_count < target) {
            if (m_observer) m_observer();
            X = solve(multiplyM(X));
            const Eigen::Index before = m_count;
            extend(X);
            X = m_space.middleCols(before, m_count - before);
            if (X.cols() == 0) break;  // all there are
        }
        project();
        const Eigen::Index found = std::min(most, m_values.size());
        double error = 0;
        // The fastest come last.
        for (Eigen::Index end = found; end > 0 && X.cols() > 0 && error <= ModeAccuracy;) {
            const Eigen::Index first = std::max<Eigen::Index>(0, end - KrylovBlock);
            const MatrixXd own = m_vectors.middleCols(first, end - first), x = V() * own,
                           Kx = KV() * own, Mx = multiplyM(x);
            const auto values = m_values.segment(first, end - first);
            const VectorXd corrections = calcNorms(solve(Kx - Mx * values.asDiagonal()));
            error = std::max(error, corrections.cwiseQuotient(calcNorms(x, Kx, Mx)).maxCoeff());
            end = first;
        }
        if (error <= ModeAccuracy) {
            if (found == 0) return;
            const double last = m_values[found - 1];
            const double beyond = last + 1e-6 * std::abs(last) + ZeroOfSoftest * m_softest;
            const int expected = count(beyond);
            factor(m_shift);
            if (expected <= std::count_if(m_values.begin(), m_values.end(),
                                          [&](double value) { return value < beyond; }))
                return;
            // As many coincide as blocks are wide: a fresh one sees more.
            X.resize(n, KrylovBlock);
            for (Eigen::Index j = 0; j < X.cols(); ++j)
                for (Eigen::Index i = 0; i < n; ++i)
                    X(i, j) =
                        m_s[i] * std::cos((0.7 + round) * double((i + 2) * (j + 1)) + double(j));
        }
        target += target / 3 + KrylovBlock;
    }
    throw std::runtime_error("calcSlowestEigenmodes(): " + std::to_string(wanted) +
                             " modes do not converge in " + std::to_string(m_count) +
                             " directions");
}

void SlowModes::findDamped(int wanted, std::vector<PencilMode>& modes, MatrixXd& basis) {
    // As many undamped ones more as bring most of what is lacking.
    const Eigen::Index kept = std::min(m_count, Eigen::Index(wanted + wanted / 2 + 8));
    m_space = (V() * m_vectors.leftCols(kept)).eval();
    m_stiff = (KV() * m_vectors.leftCols(kept)).eval();
    m_count = kept;
    const double rate = std::sqrt(std::max(m_shift, ZeroOfSoftest * m_softest));
    MatrixXd DV(m_s.size(), 0);
    std::vector<Complex> good;
    for (int round = 0; round < MostDampedRounds; ++round) {
        const Eigen::Index p = m_count, known = DV.cols();
        DV.conservativeResize(m_s.size(), p);
        DV.rightCols(p - known) = multiply(*m_D, m_space.middleCols(known, p - known));
        const MatrixXd K = multiplyTall(V(), KV(), m_threads), D = multiplyTall(V(), DV, m_threads);
        // (λ − s)⁻¹: the slowest are the largest.
        ReducedPencil pencil;
        pencil.rate = rate;
        pencil.M = MatrixXd::Identity(p, p) * square(rate);
        pencil.D = rate * D;
        pencil.K = K;
        const InvertedPencil inverted = invertSecondOrder(pencil);
        const GeneralEigen eigen = calcGeneralEigen(inverted.matrix);
        if (!eigen.hasConverged) refuseQr(2 * p);
        modes.clear();
        for (Eigen::Index k = 0; k < 2 * p; ++k) {
            const Complex mu = eigen.values[k];
            if (std::abs(mu) < 1e-14) continue;
            const Complex nu = 1.0 + 1.0 / mu;
            if (nu.imag() < 0) continue;
            modes.push_back({rate * nu, eigen.vectors.col(k).segment(inverted.shapeRow, p)});
        }
        std::stable_sort(modes.begin(), modes.end(), [](const PencilMode& a, const PencilMode& b) {
            return std::abs(a.nu) < std::abs(b.nu);
        });
        if (int(modes.size()) > wanted) modes.resize(size_t(wanted));
        double worst = 0;
        // A mode by itself that was found and has not moved since is there still.
        const auto isKnown = [&](Complex own) {
            const auto isNear = [&](double allowed) {
                return [own, allowed](Complex other) {
                    return std::abs(other - own) <= allowed * std::abs(own);
                };
            };
            return std::any_of(good.begin(), good.end(), isNear(SameRate)) &&
                   std::count_if(modes.begin(), modes.end(), [&](const PencilMode& mode) {
                       return isNear(NearRate)(mode.nu);
                   }) == 1;
        };
        // Real and imaginary parts of the others, side by side.
        std::vector<Complex> rates;
        MatrixXd Y(p, 2 * Eigen::Index(modes.size()));
        for (const PencilMode& mode : modes) {
            if (isAboutZero(mode.nu) || isKnown(mode.nu)) continue;
            Y.col(2 * Eigen::Index(rates.size())) = mode.y.real();
            Y.col(2 * Eigen::Index(rates.size()) + 1) = mode.y.imag();
            rates.push_back(mode.nu);
        }
        MatrixXd lacking(m_s.size(), DampedBlock);
        Eigen::Index numLacking = 0;
        const Eigen::Index before = m_count;
        for (size_t first = 0; first < rates.size(); first += DampedBlock) {
            const size_t count = std::min(size_t(DampedBlock), rates.size() - first);
            const MatrixXd y = Y.middleCols(2 * Eigen::Index(first), 2 * Eigen::Index(count)),
                           x = m_space.leftCols(p) * y, Dx = DV * y, Kx = m_stiff.leftCols(p) * y;
            const MatrixXd Mx = multiplyM(x);
            MatrixXd rest(x.rows(), x.cols());
            for (Eigen::Index re = 0; re < x.cols(); re += 2) {
                const Complex l = rates[first + size_t(re / 2)], ll = l * l;
                const Eigen::Index im = re + 1;
                rest.col(re) = ll.real() * Mx.col(re) - ll.imag() * Mx.col(im) +
                               l.real() * Dx.col(re) - l.imag() * Dx.col(im) + Kx.col(re);
                rest.col(im) = ll.real() * Mx.col(im) + ll.imag() * Mx.col(re) +
                               l.real() * Dx.col(im) + l.imag() * Dx.col(re) + Kx.col(im);
            }
            const VectorXd sizes = calcNorms(x, Kx, Mx);
            rest = solve(std::move(rest));
            const VectorXd corrections = calcNorms(rest);
            for (Eigen::Index re = 0; re < x.cols(); re += 2) {
                const double size = std::max(sizes[re], sizes[re + 1]);
                double largest = 0;
                for (const Eigen::Index part : {re, re + 1}) {
                    const double error = corrections[part] / size;
                    largest = std::max(largest, error);
                    if (!(error > DampedAccuracy)) continue;
                    lacking.col(numLacking++) = rest.col(part);
                    if (numLacking < lacking.cols()) continue;
                    extend(lacking);
                    numLacking = 0;
                }
                worst = std::max(worst, largest);
                if (largest <= DampedAccuracy) good.push_back(rates[first + size_t(re / 2)]);
            }
        }
        if (worst <= DampedAccuracy) break;
        extend(lacking.leftCols(numLacking));
        if (m_count == before) break;
    }
    basis = m_space.leftCols(modes.empty() ? 0 : modes[0].y.size());
}

Eigenmode SlowModes::makeMode(Complex lambda, const VectorXcd& x) const {
    Eigenmode mode;
    mode.eigenvalue = lambda;
    const double size = std::abs(lambda);
    mode.frequency = size / (2 * Pi);
    mode.dampingRatio = size > 0 ? 0 - lambda.real() / size : 0;  // not −0
    if (lambda.imag() == 0 && size > 0) mode.dampingRatio = lambda.real() < 0 ? 1 : -1;
    const VectorXd re = x.real(), im = x.imag();
    const double modalMass = re.dot(m_mass->multiply(re)) + im.dot(m_mass->multiply(im));
    const Vector ofRe = m_equations.getBlocks().calcSimbodyUDot(m_point.q.data(), re.data()),
                 ofIm = m_equations.getBlocks().calcSimbodyUDot(m_point.q.data(), im.data());
    double largest = 0;
    Complex phase = 1;
    for (int i = 0; i < ofRe.size(); ++i) {
        const Complex part(ofRe[i], ofIm[i]);
        const double displacement = std::abs(part) * m_metres[i];
        if (displacement <= 1.0001 * largest) continue;
        largest = displacement;
        phase = std::conj(part) / std::abs(part);
    }
    phase /= modalMass > 0 ? std::sqrt(modalMass) : 1.0;
    mode.shape.resize(ofRe.size());
    for (int i = 0; i < ofRe.size(); ++i) mode.shape[i] = phase * Complex(ofRe[i], ofIm[i]);
    return mode;
}

std::vector<Eigenmode> SlowModes::calc(int wanted) {
    linearize();
    refuseImbalance(describeImbalance());
    findUndamped(wanted);
    // Nothing but round-off restores it.
    const VectorXd diagonal = m_K->getDiagonal().cwiseAbs();
    const MatrixXd shapes = V() * m_vectors;
    const auto isFree = [&](Eigen::Index k) {
        return std::abs(m_values[k]) <=
               ZeroOfSoftest * m_softest + RoundOffOfSum * shapes.col(k).cwiseAbs2().dot(diagonal);
    };
    std::vector<char> areFree;
    int numFree = 0, numUnstable = 0;
    for (Eigen::Index k = 0; k < m_values.size(); ++k) {
        areFree.push_back(isFree(k));
        numFree += areFree.back();
        numUnstable += areFree.back() == 0 && m_values[k] < 0;
    }
    std::vector<Eigenmode> modes;
    const Eigen::Index found =
        std::min(m_values.size(), Eigen::Index(wanted + numFree + numUnstable));
    for (Eigen::Index k = 0; k < found; ++k) {
        if (m_D && !areFree[size_t(k)]) continue;
        const VectorXcd x = shapes.col(k).cast<Complex>();
        const double size = std::sqrt(std::abs(m_values[k]));
        if (areFree[size_t(k)])
            modes.push_back(makeMode(0, x));
        else if (m_values[k] > 0)
            modes.push_back(makeMode(Complex(0, size), x));
        else
            for (const double sign : {-1.0, 1.0}) modes.push_back(makeMode(sign * size, x));
    }
    if (m_D) {
        std::vector<PencilMode> damped;
        MatrixXd basis;
        findDamped(wanted + 2 * numFree, damped, basis);
        // What is free has two eigenvalues about zero; it stands among the modes already.
        int skipped = 0;
        for (const PencilMode& mode : damped) {
            if (skipped < 2 * numFree && isAboutZero(mode.nu)) {
                ++skipped;
                continue;
            }
            modes.push_back(makeMode(mode.nu, basis * mode.y));
        }
    }
    std::stable_sort(modes.begin(), modes.end(), [](const Eigenmode& a, const Eigenmode& b) {
        return a.frequency < b.frequency;
    });
    if (int(modes.size()) > numFree + wanted) modes.resize(size_t(numFree + wanted));
    for (Eigenmode& mode : modes)
        mode.resolution = LeastFrequency * std::sqrt(m_stiffest) / (2 * Pi);
    return modes;
}

}  // namespace

void requireEquilibrium(const MultibodySystem& system, const Linearization& linearization) {
    if (!linearization.later) refuseImbalance(describeImbalance(system, linearization));
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
    State moving = about.state;
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
        State state = about.state;
        equations.getBlocks().putIntoState(state.getTime(), moved.data(), u.data(), state);
        system.realize(state, Stage::Velocity);
        states.push_back(state);
    }
    return states;
}

}  // namespace simflex
