#include "simflex/solver/equilibrium/SlowModes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equilibrium/BlockLinearization.h"
#include "simflex/solver/equilibrium/ModeReport.h"
#include "simflex/solver/equilibrium/SecondOrderPencil.h"
#include "simflex/solver/equilibrium/TangentElimination.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using TangentSymmetry = TangentElimination<double>::Symmetry;

namespace {

/** ω² of free motions, and least shift above round-off; relative to the softest mode's ω². **/
constexpr double ZeroOfSoftest = 1e-12, LeastModeShift = 1e-9;
constexpr int MostRigidMotions = 6;
constexpr int KrylovBlock = 4, DampedBlock = 16, NumDecades = 12, MostKrylovRounds = 12,
              MostDampedRounds = 12, MostCounts = 6;
/** Errors of displacements, in the norm of K + σM. **/
constexpr double ModeAccuracy = 1e-8, DampedAccuracy = 1e-7;
/** Relative change of a converged rate, and distance at which it may be another one's. **/
constexpr double SameRate = 1e-9, NearRate = 1e-5;
/** Accelerations that count as rest, relative to size [1/s²]; restraint of free motions, relative
to the softest mode's ω². **/
constexpr double SlowestChange = 1e-6, HeldBesides = 1e-9;
/** Shift of a steady motion's pencil, relative to its rate. **/
constexpr double ShiftOfRate = 0.1;
/** Relative to scaled matrices: least damping and follower forces; asymmetry of K above the noise
of differences. **/
constexpr double LeastDamping = 1e-11, LeastSkew = 1e-8;

/** Number of rows of tall matrices multiplied at a time. **/
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

/** ½(A ± Aᵀ). **/
BlockMatrix<double> takePart(const BlockMatrix<double>& A, double sign) {
    BlockMatrix<double> part(*A.graph);
    part.add(A, 0.5);
    part.add(A.transpose(), 0.5 * sign);
    return part;
}

}  // namespace

class SlowModes::Search {
public:
    Search(const MultibodySystem& system, const State& state, const std::function<void()>& observer)
        : m_linear(system, state, observer) {}

    const std::string& getObstacle() const { return m_linear.getObstacle(); }
    std::vector<Eigenmode> calc(int wanted);

private:
    using Blocks = BlockMatrix<double>;

    void refuseImbalance();
    void findMetres();
    /** Factors K + σM, of which the symmetric part is used. **/
    void factor(double shift);
    /** Factors K + sD + s²M. **/
    void factor(const Blocks& K, const Blocks& D, double rate);
    /** Number of eigenvalues ω² below this one. **/
    int count(double omegaSquared);
    /** Number of negative eigenvalues of H(ω). **/
    int count(const Blocks& K, const Blocks& D, double omega);
    /** The same for its projection onto the space. **/
    int countInSpace(const Blocks& K, const Blocks& D, double omega) const;
    /** Solves with the current factors on the null space of G. **/
    MatrixXd solve(MatrixXd F) {
        m_elimination->solveEach(F);
        return F;
    }
    MatrixXd multiplyM(const MatrixXd& X) const { return multiply(*m_now.mass, X); }
    /** Of each column. **/
    template <class Operator>
    MatrixXd multiply(const Operator& A, const MatrixXd& X) const {
        MatrixXd product(X.rows(), X.cols());
        parallelFor(int(X.cols()), m_threads,
                    [&](int j) { product.col(j) = A.multiply(X.col(j)); });
        return product;
    }
    /** Pseudo-random directions. **/
    MatrixXd makeFresh(double phase, int step) const {
        MatrixXd X(m_now.scale.size(), KrylovBlock);
        for (Eigen::Index j = 0; j < X.cols(); ++j)
            for (Eigen::Index i = 0; i < X.rows(); ++i)
                X(i, j) =
                    m_now.scale[i] * std::cos(phase * double((i + step) * (j + 1)) + double(j));
        return X;
    }
    /** Adds the new directions in X, M-orthonormalised. **/
    void extend(MatrixXd X);
    auto V() const { return m_space.leftCols(m_count); }
    auto KV() const { return m_stiff.leftCols(m_count); }
    /** Ritz pairs in the space, of the symmetric part of K. **/
    void project();
    /** Squared norms of columns, for modes and their corrections: xᵀKx plus weighted xᵀMx.
    @param weight  of the latter **/
    VectorXd calcNorms(const MatrixXd& X, const MatrixXd& KX, const MatrixXd& MX,
                       double weight) const {
        VectorXd norms(X.cols());
        for (Eigen::Index j = 0; j < X.cols(); ++j)
            norms[j] = std::sqrt(std::abs(X.col(j).dot(KX.col(j))) +
                                 weight * std::abs(X.col(j).dot(MX.col(j))));
        return norms;
    }
    VectorXd calcNorms(const MatrixXd& X) const {
        return calcNorms(X, multiply(*m_now.K, X), multiplyM(X), m_shift);
    }
    /** True for eigenvalues that are roots of round-off; a free motion has two. **/
    bool isAboutZero(Complex lambda) const {
        return m_now.motion.isAtRest() ? std::norm(lambda) <= 1e-2 * m_shift
                                       : std::abs(lambda) <= NearZero * m_now.motion.getRate();
    }
    /** Chooses the shift near the slowest ω²; returns how many are less than `zero`. **/
    int chooseShift(double zero, double least);
    /** Extends the Krylov space to this size. @param X  directions to continue with **/
    void span(Eigen::Index target, MatrixXd& X);
    void findUndamped(int wanted);
    /** Keeps the slowest Ritz vectors. **/
    void keepSlowest(int wanted);
    /** Finds modes of λ²M + λD + K in the space, extending it until they converge. @pre factor() at
    a nearby rate
    @param rate  about that of the slowest **/
    void refine(const Blocks& K, const Blocks& D, double rate, int wanted,
                std::vector<PencilMode>& modes);
    std::vector<Eigenmode> calcAtRest(int wanted);
    /** For systems that move, or have co-rotating forces. **/
    std::vector<Eigenmode> calcGeneral(int wanted);
    /** Compares with the equations a radian later, and determines which modes co-rotate.
    @param shapes  real and imaginary parts of the last modes
    @throws std::invalid_argument if the motion is not steady **/
    void requireSteadiness(const MatrixXd& shapes, std::vector<Eigenmode>& modes);
    std::string findUnsteadiness(const MatrixXd& shapes, MatrixXd carried, double lowest);
    /** In Simbody's numbering. **/
    VectorXcd toSimbody(const std::vector<double>& q, const VectorXcd& x) const;
    Eigenmode makeMode(Complex lambda, const VectorXcd& x) const;
    /** Sorts by frequency, keeps at most this many, and sets their resolution. **/
    void finish(std::vector<Eigenmode>& modes, int most) const;

    BlockLinearization m_linear;
    BlockLinearization::Instant m_now;
    std::optional<TangentElimination<double>> m_elimination;
    int m_threads = 1;
    double m_shift = 0;         ///< σ [1/s²]
    Vector m_metres;            ///< of Simbody's speeds
    MatrixXd m_space, m_stiff;  ///< the space V and K V, and room for more
    Eigen::Index m_count = 0;
    VectorXd m_values;   ///< ω² of Ritz pairs, ascending
    MatrixXd m_vectors;  ///< in the space
};

SlowModes::SlowModes(const MultibodySystem& system, const State& state,
                     const std::function<void()>& observer)
    : m_search(std::make_unique<Search>(system, state, observer)) {}
SlowModes::~SlowModes() = default;

const std::string& SlowModes::getObstacle() const {
    return m_search->getObstacle();
}
std::vector<Eigenmode> SlowModes::calc(int count) {
    return m_search->calc(count);
}

std::vector<Eigenmode> SlowModes::Search::calc(int wanted) {
    m_linear.calcNow(m_now);
    m_threads = m_linear.getNumThreads();
    m_elimination.emplace(m_linear.getGraph(), *m_now.mass);
    m_elimination->setNumThreads(m_threads);
    findMetres();
    if (m_now.motion.isAtRest()) {
        refuseImbalance();
        if (m_now.K->findSkew(m_now.scale) <= LeastSkew) return calcAtRest(wanted);
        m_now.K = m_now.K->expandModes();
        if (m_now.D) m_now.D = m_now.D->expandModes();
    }
    if (!m_now.D) m_now.D.emplace(m_linear.getGraph());
    return calcGeneral(wanted);
}

void SlowModes::Search::refuseImbalance() {
    const Evaluation& equations = m_linear.getEquations();
    const CoordinateScales& scales = m_linear.getScales();
    bool isAccelerated = false;
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        for (int i = block.firstU; i < block.firstU + block.numU; ++i)
            isAccelerated |= std::abs(m_now.moreUDot[i]) * scales.metres[size_t(i)] >
                             SlowestChange * scales.lengths[size_t(b)];
    }
    if (!isAccelerated) return;
    const VectorXd forces = m_now.mass->multiply(m_now.moreUDot);
    factor(HeldBesides * m_now.softest);
    const std::string imbalance = describeDeparture(equations, scales, solve(forces), forces);
    if (!imbalance.empty()) simflex::refuseImbalance(imbalance);
}

void SlowModes::Search::findMetres() {
    // Simbody rotates bodies about other axes; the radius is the same about all of them.
    const Evaluation& equations = m_linear.getEquations();
    const Topology& topology = equations.getTopology();
    const std::vector<double>& metres = m_linear.getScales().metres;
    m_metres.resize(topology.numU);
    m_metres = 0;
    std::vector<char> turns(size_t(topology.numU), 0);
    for (int b = 0; b < topology.numFlexible; ++b)
        std::fill_n(turns.begin() + equations.getBlock(b).firstU, 3, char(1));
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> own = metres;
        for (int b = 0; b < topology.numFlexible; ++b)
            for (int i = 0; i < 3; ++i)
                if (i != axis) own[size_t(equations.getBlock(b).firstU + i)] = 0;
        if (axis > 0)  // other coordinates were done with the first axis
            for (int i = 0; i < topology.numU; ++i)
                if (!turns[size_t(i)]) own[size_t(i)] = 0;
        const Vector part = equations.getBlocks().calcSimbodyUDot(m_now.point.q.data(), own.data());
        for (int i = 0; i < part.size(); ++i) m_metres[i] = std::hypot(m_metres[i], part[i]);
    }
}

void SlowModes::Search::factor(double shift) {
    m_linear.observe();
    Blocks A = *m_now.K;
    A.addMass(*m_now.mass, shift);
    m_elimination->factor(A, m_now.scale, TangentSymmetry::Symmetric);
}

void SlowModes::Search::factor(const Blocks& K, const Blocks& D, double rate) {
    m_linear.observe();
    Blocks A = K;
    A.add(D, rate);
    A.addMass(*m_now.mass, square(rate));
    m_elimination->factor(A, m_now.scale, TangentSymmetry::General);
}

int SlowModes::Search::count(double omegaSquared) {
    factor(-omegaSquared);
    return m_elimination->countNegative();
}

int SlowModes::Search::count(const Blocks& K, const Blocks& D, double omega) {
    // The real matrix [A, −B; B, A] has each eigenvalue of H = A + iB twice.
    BlockGraph graph = m_linear.getGraph();
    for (int& first : graph.firstU) first *= 2;
    for (int& size : graph.sizes) size *= 2;
    BlockMass mass = *m_now.mass;
    mass.numMultipliers *= 2;
    for (size_t b = 0; b < mass.Gt.size(); ++b) {
        const MatrixXd own = mass.Gt[b];
        const std::vector<int> rows = mass.rows[b];
        mass.Gt[b].setZero(2 * own.rows(), 2 * own.cols());
        mass.rows[b].clear();
        for (Eigen::Index k = 0; k < own.cols(); ++k)
            for (const int part : {0, 1}) {
                mass.Gt[b].col(2 * k + part).segment(part * own.rows(), own.rows()) = own.col(k);
                mass.rows[b].push_back(2 * rows[size_t(k)] + part);
            }
    }
    Blocks A = K;
    A.addMass(*m_now.mass, -square(omega));
    Blocks H(graph);
    VectorXd scale(2 * m_now.scale.size());
    for (size_t b = 0; b < H.columns.size(); ++b) {
        const Eigen::Index n = graph.sizes[b] / 2;
        const auto own = m_now.scale.segment(graph.firstU[b] / 2, n);
        scale.segment(graph.firstU[b], 2 * n) << own, own;
        for (size_t k = 0; k < H.columns[b].size(); ++k)
            H.columns[b][k] << A.columns[b][k], -omega * D.columns[b][k], omega * D.columns[b][k],
                A.columns[b][k];
    }
    m_linear.observe();
    TangentElimination<double> elimination(graph, mass);
    elimination.setNumThreads(m_threads);
    elimination.factor(H, scale, TangentSymmetry::Symmetric);
    return elimination.countNegative() / 2;
}

int SlowModes::Search::countInSpace(const Blocks& K, const Blocks& D, double omega) const {
    const Eigen::Index p = m_count;
    const MatrixXd A = multiplyTall(V(), multiply(K, V()), m_threads) -
                       square(omega) * MatrixXd::Identity(p, p),
                   B = omega * multiplyTall(V(), multiply(D, V()), m_threads);
    MatrixXd H(2 * p, 2 * p);
    H << A, -B, B, A;
    const VectorXd values = calcSymmetricEigen(0.5 * (H + H.transpose())).values;
    return int(std::count_if(values.begin(), values.end(), [](double v) { return v < 0; })) / 2;
}

void SlowModes::Search::extend(MatrixXd X) {
    constexpr double Dependent = 1e-6;
    const Eigen::Index n = m_now.scale.size();
    MatrixXd MX = multiplyM(X);
    const auto clear = [&] { subtractPart(V(), multiplyTall(V(), MX, m_threads), X, m_threads); };
    // Moves a column behind those kept, orthogonal to them; returns its remaining norm.
    Eigen::Index kept = 0;
    const auto orthogonalize = [&](Eigen::Index j) {
        VectorXd x = X.col(j);
        x -= X.leftCols(kept) * (MX.leftCols(kept).transpose() * x);
        X.col(kept) = x;
        MX.col(kept) = m_now.mass->multiply(x);
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
    // The rows' compliance leaves gaps, enlarged by normalisation, that would cost no energy.
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
    m_stiff.middleCols(first, kept) = multiply(*m_now.K, X.leftCols(kept));
    m_count += kept;
}

void SlowModes::Search::project() {
    const MatrixXd K = multiplyTall(V(), KV(), m_threads);
    const SymmetricEigen eigen = calcSymmetricEigen(0.5 * (K + K.transpose()));
    m_values = eigen.values;
    m_vectors = eigen.vectors;
}

int SlowModes::Search::chooseShift(double zero, double least) {
    // The shift is small enough for the slowest mode to stand out, and large enough for round-off
    // of free motions not to drown it.
    const int numFree = count(zero);
    int low = -NumDecades, high = NumDecades;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        (count(std::pow(10.0, middle) * m_now.softest) > numFree ? high : low) = middle;
    }
    m_shift = std::max(std::pow(10.0, low) * m_now.softest, least);
    factor(m_shift);
    m_count = 0;
    m_space.resize(m_now.scale.size(), 0);
    m_stiff.resize(m_now.scale.size(), 0);
    return numFree;
}

void SlowModes::Search::span(Eigen::Index target, MatrixXd& X) {
    while (m_count < target) {
        m_linear.observe();
        X = solve(multiplyM(X));
        const Eigen::Index before = m_count;
        extend(X);
        X = m_space.middleCols(before, m_count - before);
        if (X.cols() == 0) return;  // the space is complete
    }
}

void SlowModes::Search::findUndamped(int wanted) {
    const int numFree = chooseShift(ZeroOfSoftest * m_now.softest, LeastModeShift * m_now.softest);
    // Noise of differences may make a free motion count as a vibration.
    const Eigen::Index most = numFree + wanted + MostRigidMotions;
    MatrixXd X = makeFresh(1.3, 1);
    Eigen::Index target = most + most / 2 + 2 * KrylovBlock;
    for (int round = 0; round < MostKrylovRounds; ++round) {
        span(target, X);
        project();
        const Eigen::Index found = std::min(most, m_values.size());
        double error = 0;
        // The fastest converge last, and so are checked first.
        for (Eigen::Index end = found; end > 0 && X.cols() > 0 && error <= ModeAccuracy;) {
            const Eigen::Index first = std::max<Eigen::Index>(0, end - KrylovBlock);
            const MatrixXd own = m_vectors.middleCols(first, end - first), x = V() * own,
                           Kx = KV() * own, Mx = multiplyM(x);
            const auto values = m_values.segment(first, end - first);
            const VectorXd corrections = calcNorms(solve(Kx - Mx * values.asDiagonal()));
            error = std::max(error,
                             corrections.cwiseQuotient(calcNorms(x, Kx, Mx, m_shift)).maxCoeff());
            end = first;
        }
        if (error <= ModeAccuracy) {
            if (found == 0) return;
            const double last = m_values[found - 1];
            const double beyond = last + 1e-6 * std::abs(last) + ZeroOfSoftest * m_now.softest;
            const int expected = count(beyond);
            factor(m_shift);
            if (expected <= std::count_if(m_values.begin(), m_values.end(),
                                          [&](double value) { return value < beyond; }))
                return;
            // More modes may coincide than a block is wide; a fresh block finds the others.
            X = makeFresh(0.7 + round, 2);
        }
        target += target / 3 + KrylovBlock;
    }
    throw std::runtime_error("calcSlowestEigenmodes(): " + std::to_string(wanted) +
                             " modes do not converge in " + std::to_string(m_count) +
                             " directions");
}

void SlowModes::Search::keepSlowest(int wanted) {
    // The additional vectors contain most of the corrections that follow.
    const Eigen::Index kept = std::min(m_count, Eigen::Index(wanted + wanted / 2 + 8));
    m_space = (V() * m_vectors.leftCols(kept)).eval();
    m_stiff = (KV() * m_vectors.leftCols(kept)).eval();
    m_count = kept;
}

void SlowModes::Search::refine(const Blocks& K, const Blocks& D, double rate, int wanted,
                               std::vector<PencilMode>& modes) {
    const Eigen::Index n = m_now.scale.size();
    const bool isAtRest = m_now.motion.isAtRest();
    MatrixXd ofK(n, 0), ofD(n, 0);
    std::vector<Complex> good;
    for (int round = 0; round < MostDampedRounds; ++round) {
        const Eigen::Index p = m_count, known = ofD.cols();
        ofK.conservativeResize(n, p);
        ofD.conservativeResize(n, p);
        ofK.rightCols(p - known) = multiply(K, m_space.middleCols(known, p - known));
        ofD.rightCols(p - known) = multiply(D, m_space.middleCols(known, p - known));
        // The slowest modes have the largest (λ − s)⁻¹.
        modes = solveInverted(invertSecondOrder(MatrixXd::Identity(p, p) * square(rate),
                                                rate * multiplyTall(V(), ofD, m_threads),
                                                multiplyTall(V(), ofK, m_threads)),
                              p);
        modes.erase(std::remove_if(modes.begin(), modes.end(),
                                   [](const PencilMode& mode) { return mode.nu.imag() < 0; }),
                    modes.end());
        for (PencilMode& mode : modes) mode.nu *= rate;
        if (int(modes.size()) > wanted) modes.resize(size_t(wanted));
        double worst = 0;
        // An isolated mode that has converged and not moved since needs no further check.
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
        // Real and imaginary parts of the modes to check, side by side.
        std::vector<Complex> rates;
        MatrixXd Y(p, 2 * Eigen::Index(modes.size()));
        for (const PencilMode& mode : modes) {
            if (isAboutZero(mode.nu) || isKnown(mode.nu)) continue;
            Y.col(2 * Eigen::Index(rates.size())) = mode.y.real();
            Y.col(2 * Eigen::Index(rates.size()) + 1) = mode.y.imag();
            rates.push_back(mode.nu);
        }
        MatrixXd lacking(n, DampedBlock);
        Eigen::Index numLacking = 0;
        const Eigen::Index before = m_count;
        for (size_t first = 0; first < rates.size(); first += DampedBlock) {
            const size_t count = std::min(size_t(DampedBlock), rates.size() - first);
            const MatrixXd y = Y.middleCols(2 * Eigen::Index(first), 2 * Eigen::Index(count)),
                           x = m_space.leftCols(p) * y, Dx = ofD * y, Kx = ofK * y;
            const MatrixXd Mx = multiplyM(x);
            MatrixXd rest(x.rows(), x.cols());
            VectorXd sizes(x.cols());
            for (Eigen::Index re = 0; re < x.cols(); re += 2) {
                const Complex l = rates[first + size_t(re / 2)], ll = l * l;
                const Eigen::Index im = re + 1;
                rest.col(re) = ll.real() * Mx.col(re) - ll.imag() * Mx.col(im) +
                               l.real() * Dx.col(re) - l.imag() * Dx.col(im) + Kx.col(re);
                rest.col(im) = ll.real() * Mx.col(im) + ll.imag() * Mx.col(re) +
                               l.real() * Dx.col(im) + l.imag() * Dx.col(re) + Kx.col(im);
                sizes.segment(re, 2) =
                    calcNorms(x.middleCols(re, 2), Kx.middleCols(re, 2), Mx.middleCols(re, 2),
                              isAtRest ? m_shift : m_shift + std::norm(l));
            }
            rest = solve(std::move(rest));
            const MatrixXd Kr = multiply(K, rest), Mr = multiplyM(rest);
            for (Eigen::Index re = 0; re < x.cols(); re += 2) {
                const Complex l = rates[first + size_t(re / 2)];
                const double size = std::max(sizes[re], sizes[re + 1]);
                const VectorXd corrections =
                    calcNorms(rest.middleCols(re, 2), Kr.middleCols(re, 2), Mr.middleCols(re, 2),
                              isAtRest ? m_shift : m_shift + std::norm(l));
                double largest = 0;
                for (const Eigen::Index part : {re, re + 1}) {
                    const double error = corrections[part - re] / size;
                    largest = std::isfinite(error) ? std::max(largest, error) : Infinity;
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
        if (worst <= DampedAccuracy) return;
        extend(lacking.leftCols(numLacking));
        if (m_count == before) return;  // the space is complete
    }
    throw std::runtime_error("calcSlowestEigenmodes(): " + std::to_string(wanted) +
                             " damped or gyroscopic modes do not converge in " +
                             std::to_string(m_count) + " directions");
}

VectorXcd SlowModes::Search::toSimbody(const std::vector<double>& q, const VectorXcd& x) const {
    const simflex::Blocks& blocks = m_linear.getEquations().getBlocks();
    const VectorXd re = x.real(), im = x.imag();
    const Vector ofRe = blocks.calcSimbodyUDot(q.data(), re.data()),
                 ofIm = blocks.calcSimbodyUDot(q.data(), im.data());
    VectorXcd result(x.size());
    for (int i = 0; i < ofRe.size(); ++i) result[i] = Complex(ofRe[i], ofIm[i]);
    return result;
}

Eigenmode SlowModes::Search::makeMode(Complex lambda, const VectorXcd& x) const {
    VectorXcd momentum(x.size());
    momentum.real() = m_now.mass->multiply(x.real());
    momentum.imag() = m_now.mass->multiply(x.imag());
    return makeEigenmode(lambda, toSimbody(m_now.point.q, x), toSimbody(m_now.point.q, momentum),
                         m_metres);
}

void SlowModes::Search::finish(std::vector<Eigenmode>& modes, int most) const {
    std::stable_sort(modes.begin(), modes.end(), [](const Eigenmode& a, const Eigenmode& b) {
        return a.frequency < b.frequency;
    });
    if (int(modes.size()) > most) modes.resize(size_t(most));
    for (Eigenmode& mode : modes)
        mode.resolution = std::max(LeastFrequency * std::sqrt(m_now.stiffest),
                                   NearZero * m_now.motion.getRate()) /
                          (2 * Pi);
}

std::vector<Eigenmode> SlowModes::Search::calcAtRest(int wanted) {
    findUndamped(wanted);
    // A motion is free if only round-off restores it.
    const VectorXd diagonal = m_now.K->getDiagonal().cwiseAbs();
    const MatrixXd shapes = V() * m_vectors;
    const auto isFree = [&](Eigen::Index k) {
        return std::abs(m_values[k]) <= ZeroOfSoftest * m_now.softest +
                                            RoundOffOfSum * shapes.col(k).cwiseAbs2().dot(diagonal);
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
        if (m_now.D && !areFree[size_t(k)]) continue;
        const VectorXcd x = shapes.col(k).cast<Complex>();
        const double size = std::sqrt(std::abs(m_values[k]));
        if (areFree[size_t(k)])
            modes.push_back(makeMode(0, x));
        else if (m_values[k] > 0)
            modes.push_back(makeMode(Complex(0, size), x));
        else
            for (const double sign : {-1.0, 1.0}) modes.push_back(makeMode(sign * size, x));
    }
    if (m_now.D) {
        std::vector<PencilMode> damped;
        keepSlowest(wanted + 2 * numFree);
        refine(*m_now.K, *m_now.D, std::sqrt(std::max(m_shift, ZeroOfSoftest * m_now.softest)),
               wanted + 2 * numFree, damped);
        // A free motion, already among the modes, has two eigenvalues near zero.
        int skipped = 0;
        for (const PencilMode& mode : damped) {
            if (skipped < 2 * numFree && isAboutZero(mode.nu)) {
                ++skipped;
                continue;
            }
            modes.push_back(makeMode(mode.nu, m_space.leftCols(mode.y.size()) * mode.y));
        }
    }
    finish(modes, numFree + wanted);
    return modes;
}

std::vector<Eigenmode> SlowModes::Search::calcGeneral(int wanted) {
    const Blocks K = takePart(*m_now.K, 1), D = takePart(*m_now.D, -1);
    // ω² below which a motion is free: includes the noise of differences from the speeds.
    double fastest = 0;
    for (const double speed : m_now.point.u) fastest = std::max(fastest, std::abs(speed));
    const double zero = ZeroOfSoftest * m_now.softest + square(SlowestMotion * fastest),
                 least = ShiftOfRate * m_now.motion.getRate();
    const int numFree = chooseShift(zero, std::max(LeastModeShift * m_now.softest, square(least)));
    const double rate = std::sqrt(m_shift);
    const int most = wanted + 2 * MostRigidMotions;
    MatrixXd X = makeFresh(1.3, 1);
    span(most + most / 2 + numFree + 2 * KrylovBlock, X);
    project();
    const VectorXd diagonal = m_now.K->getDiagonal().cwiseAbs();
    MatrixXd free(m_now.scale.size(), 0);
    for (Eigen::Index k = 0; k < m_values.size(); ++k) {
        const VectorXd x = V() * m_vectors.col(k);
        if (std::abs(m_values[k]) > zero + RoundOffOfSum * x.cwiseAbs2().dot(diagonal)) continue;
        free.conservativeResize(Eigen::NoChange, free.cols() + 1);
        free.rightCols<1>() = x;
    }
    keepSlowest(most + numFree);
    factor(K, D, rate);
    std::vector<PencilMode> found;
    int missing = 0;
    for (int attempt = 0; attempt < MostCounts; ++attempt) {
        refine(K, D, rate, wanted + 2 * int(free.cols()), found);
        double beyond = 0;
        for (const PencilMode& mode : found) beyond = std::max(beyond, std::abs(mode.nu));
        beyond *= 1 + 1e-6;
        missing = count(K, D, beyond) - countInSpace(K, D, beyond);
        if (missing <= 0) break;
        X = makeFresh(0.7 + attempt, 2);
        for (int pass = 0; pass < 2; ++pass) X = solve(multiplyM(X));
        extend(X);
    }
    if (missing > 0)
        throw std::runtime_error("calcSlowestEigenmodes(): " + std::to_string(missing) +
                                 " modes are missed in " + std::to_string(m_count) + " directions");
    Blocks others = *m_now.D;
    others.add(D, -1);
    if (rate * others.findLargest(m_now.scale) > LeastDamping ||
        m_now.K->findSkew(m_now.scale) > LeastDamping) {
        factor(*m_now.K, *m_now.D, rate);
        const int sought = wanted + 2 * int(free.cols());
        refine(*m_now.K, *m_now.D, rate, sought, found);
        // Damping may make faster modes the slowest: fresh directions find these.
        for (int attempt = 0; attempt < MostCounts; ++attempt) {
            X = makeFresh(1.7 + attempt, 3);
            for (int pass = 0; pass < 2; ++pass) X = solve(multiplyM(X));
            extend(X);
            const std::vector<PencilMode> before = found;
            refine(*m_now.K, *m_now.D, rate, sought, found);
            const auto isSame = [](const PencilMode& one, const PencilMode& other) {
                return std::abs(std::abs(one.nu) - std::abs(other.nu)) <=
                       NearRate * std::abs(other.nu) + 1e-300;
            };
            if (std::equal(found.begin(), found.end(), before.begin(), before.end(), isSame)) break;
        }
    }
    std::vector<Eigenmode> modes;
    for (Eigen::Index k = 0; k < free.cols(); ++k)
        modes.push_back(makeMode(0, free.col(k).cast<Complex>()));
    MatrixXd shapes(m_now.scale.size(), 2 * Eigen::Index(found.size()));
    Eigen::Index numShapes = 0;
    const MatrixXd freeMass = multiplyM(free);
    const auto isFree = [&](const VectorXcd& x) {
        const VectorXcd rest = x - free.cast<Complex>() * (freeMass.transpose() * x);
        const auto measure = [&](const VectorXcd& y) {
            return y.real().dot(m_now.mass->multiply(y.real())) +
                   y.imag().dot(m_now.mass->multiply(y.imag()));
        };
        return measure(rest) < 1e-2 * measure(x);
    };
    int skipped = 0;
    for (const PencilMode& mode : found) {
        if (skipped < 2 * free.cols() && isAboutZero(mode.nu) &&
            isFree(m_space.leftCols(mode.y.size()) * mode.y)) {
            ++skipped;
            continue;
        }
        if (int(modes.size()) == wanted + int(free.cols())) break;
        const VectorXcd x = m_space.leftCols(mode.y.size()) * mode.y;
        modes.push_back(makeMode(mode.nu, x));
        shapes.col(numShapes++) = x.real();
        shapes.col(numShapes++) = x.imag();
    }
    if (!m_now.motion.isAtRest()) requireSteadiness(shapes.leftCols(numShapes), modes);
    finish(modes, wanted + int(free.cols()));
    return modes;
}

void SlowModes::Search::requireSteadiness(const MatrixXd& shapes, std::vector<Eigenmode>& modes) {
    const double rate = m_now.motion.getRate(), lowest = 1e-3 * rate / (2 * Pi);
    const simflex::Blocks& blocks = m_linear.getEquations().getBlocks();
    VectorXd steps(shapes.cols());
    for (Eigen::Index j = 0; j < shapes.cols(); ++j) {
        double turned = 0;
        for (size_t b = 0; b < blocks.all.size(); ++b) {
            const double length = m_linear.getScales().lengths[b];
            if (length > 0)
                turned = std::max(turned, blocks.all[b]->calcDisplacement(shapes.col(j).data() +
                                                                          blocks.all[b]->firstU) /
                                              length);
        }
        steps[j] = turned > 0 ? CoordinateScales::StepFraction / turned : 1;
    }
    SolutionPoint after = m_now.point;
    m_now.motion.moveOn(after);
    const MatrixXd carried = m_now.motion.carry(m_now.point.q, 1 / rate, after.q, shapes, steps);

    const size_t numFree = modes.size() - size_t(shapes.cols() / 2);
    double slowest = Infinity;
    for (size_t k = numFree; k < modes.size(); ++k) {
        const Eigen::Index re = 2 * Eigen::Index(k - numFree);
        VectorXcd x(shapes.rows()), later(shapes.rows());
        x.real() = shapes.col(re);
        x.imag() = shapes.col(re + 1);
        later.real() = carried.col(re);
        later.imag() = carried.col(re + 1);
        modes[k].isSeenTurning =
            isTurned(toSimbody(m_now.point.q, x), toSimbody(after.q, later), m_metres);
        if (modes[k].frequency > lowest) slowest = std::min(slowest, double(modes[k].frequency));
    }
    // The rotation is negligible.
    if (!(slowest < Infinity) || rate < Steadiness::SmallTurn * 2 * Pi * slowest) return;
    const std::string unsteady = findUnsteadiness(shapes, carried, lowest);
    if (!unsteady.empty()) refuseUnsteadiness(unsteady);
}

std::string SlowModes::Search::findUnsteadiness(const MatrixXd& shapes, MatrixXd carried,
                                                double lowest) {
    const Topology& topology = m_linear.getEquations().getTopology();
    const CoordinateScales& scales = m_linear.getScales();
    const auto findDeparture = [&](const BlockLinearization::Instant& instant, double allowed) {
        VectorXd delta, multipliers;
        m_linear.calcDeparture(instant, delta, multipliers);
        return instant.motion.describeDeparture(scales, delta, allowed);
    };
    std::string departure = findDeparture(m_now, Steadiness::SmallGap);
    if (!departure.empty()) return departure;
    BlockLinearization::Instant later;
    const std::string obstacle = m_linear.calcLater(m_now, later);
    if (!obstacle.empty()) return obstacle;
    departure = findDeparture(later, Steadiness::LaterGap);
    if (!departure.empty()) return departure;

    later.motion.close(carried);
    VectorXd sizes = VectorXd::Zero(shapes.rows()), rows = VectorXd::Zero(topology.numMultipliers);
    for (const int i : listFreeSpeeds(m_linear.getEquations()))
        sizes[i] = 1 / scales.metres[size_t(i)];
    for (size_t b = 0; b < later.mass->Gt.size(); ++b)
        for (size_t k = 0; k < later.mass->rows[b].size(); ++k)
            rows[later.mass->rows[b][k]] +=
                later.mass->Gt[b]
                    .col(Eigen::Index(k))
                    .cwiseProduct(sizes.segment(later.mass->firstU[b], later.mass->Gt[b].rows()))
                    .squaredNorm();
    for (Eigen::Index j = 0; j < carried.cols(); ++j) {
        double moved = 0;
        for (Eigen::Index i = 0; i < sizes.size(); ++i)
            if (sizes[i] > 0) moved += square(carried(i, j) / sizes[i]);
        const VectorXd gaps = later.mass->multiplyG(carried.col(j));
        for (Eigen::Index k = 0; k < gaps.size(); ++k)
            if (!(std::abs(gaps[k]) <= Steadiness::SmallGap * std::sqrt(rows[k] * moved)))
                return topology.describeConstraint(int(k)) +
                       " does not let displaced bodies continue their present motion";
    }

    // Compares frequencies in the space of the modes: now, and with the matrices' mean over a
    // radian.
    const SymmetricEigen gram =
        calcSymmetricEigen(multiplyTall(shapes, multiplyM(shapes), m_threads));
    Eigen::Index first = 0;
    while (first < gram.values.size() &&
           gram.values[first] <= 1e-10 * gram.values[gram.values.size() - 1])
        ++first;
    const Eigen::Index p = gram.values.size() - first;
    const MatrixXd T =
        gram.vectors.rightCols(p) * gram.values.tail(p).cwiseSqrt().cwiseInverse().asDiagonal();
    const MatrixXd X = shapes * T, Y = carried * T;
    const auto project = [&](const auto& A, const MatrixXd& of) -> MatrixXd {
        return multiplyTall(of, multiply(A, of), m_threads);
    };
    const MatrixXd M = project(*m_now.mass, X), D = project(*m_now.D, X), K = project(*m_now.K, X);
    const double rate = m_now.motion.getRate();
    const auto list = [&](double share) {
        std::vector<double> frequencies;
        const auto mix = [share](const MatrixXd& now, const MatrixXd& then) -> MatrixXd {
            return (1 - share) * now + share * then;
        };
        for (const PencilMode& mode :
             solveInverted(invertSecondOrder(square(rate) * mix(M, project(*later.mass, Y)),
                                             rate * mix(D, project(*later.D, Y)),
                                             mix(K, project(*later.K, Y))),
                           p))
            if (mode.nu.imag() >= 0 && rate * std::abs(mode.nu) / (2 * Pi) > lowest)
                frequencies.push_back(rate * std::abs(mode.nu) / (2 * Pi));
        return frequencies;
    };
    const std::vector<double> frequencies = list(0), others = list(0.5);
    // Compares the fastest first: a slow mode may be in one list only.
    for (size_t k = 1; k <= std::min(frequencies.size(), others.size()); ++k) {
        const double own = frequencies[frequencies.size() - k], other = others[others.size() - k];
        const double change = std::abs(square(other) - square(own));
        if (change > 2 * Steadiness::SmallChange * square(own) + square(lowest))
            return describeChange(own, other);
    }
    return "";
}

}  // namespace simflex
