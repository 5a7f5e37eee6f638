#include "simflex/solver/FrequencyResponse.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <sstream>

#include "simflex/base/FlushDenormals.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/elimination/FrontSolver.h"
#include "simflex/solver/equilibrium/BlockTangent.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"
#include "simflex/solver/equilibrium/TangentElimination.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

/** Residual relative to the right-hand side, and the largest number of corrections. **/
constexpr double HarmonicResidual = 1e-9;
constexpr int HarmonicCorrections = 12;
/** Largest relative sensitivity of a response to frequency. **/
constexpr double SharpestResonance = 1e7;
/** Growth of free motions, relative to the softest vibration's ω², that counts as round-off. **/
constexpr double LeastFall = 1e-9;
constexpr double LeastSize = 1e-300;
/** Scaled motion, relative to the scaled forces, below which it is round-off: constraints alone
carry the load. **/
constexpr double LeastMotion = 1e-6;
/** Of scaled entries: noise of differences in asymmetry and coupling; largest coupling of modes
that are eliminated one by one, which corrections make up for. **/
constexpr double SmallSkew = 1e-9, SmallModeCoupling = 1e-3;
/** Compliance of constraints and least pivot of a mode, in scaled equations. **/
constexpr double MultiplierCompliance = 1e-12, LeastTailPivot = 1e-12;
/** Least inertia for a pivot, relative to the softest vibration's ω²; corrections remove the
excess. **/
constexpr double LeastPivotInertia = 1e-10;
/** Rate that restrains free motions, relative to the softest vibration's. **/
constexpr double HarmonicInertiaHold = 1e-3;
/** Accelerations that count as rest, relative to size [1/s²]. **/
constexpr double SlowestDeparture = 1e-6;

}  // namespace

/** A matrix of a flexible body at rest: an arrow with its rigid motions as head and its modes as
tail, uncoupled except by preloads. Other bodies have a head only. **/
struct ArrowMatrix {
    MatrixXd head, right, below;  ///< h×h, h×f, f×h
    VectorXd tail;                ///< f: of the diagonal
    MatrixXd rest;                ///< f×f: off the diagonal; 0×0 if zero

    ArrowMatrix(const MatrixXd& A, Eigen::Index numHead)
        : head(A.topLeftCorner(numHead, numHead)),
          right(A.topRightCorner(numHead, A.cols() - numHead)),
          below(A.bottomLeftCorner(A.rows() - numHead, numHead)),
          tail(A.diagonal().tail(A.rows() - numHead)) {
        const Eigen::Index count = tail.size();
        MatrixXd besides = A.bottomRightCorner(count, count);
        besides.diagonal().setZero();
        if (count > 0 && besides.cwiseAbs().maxCoeff() > 0) rest = std::move(besides);
    }
    Eigen::Index numHead() const { return head.rows(); }

    /** y += factor·A x. **/
    void addProduct(const VectorXcd& x, Complex factor, VectorXcd& y) const {
        const Eigen::Index h = numHead(), f = tail.size();
        y.head(h) += factor * (head * x.head(h) + right * x.tail(f));
        y.tail(f) += factor * (below * x.head(h) + tail.cwiseProduct(x.tail(f)));
        if (rest.size() > 0) y.tail(f) += factor * (rest * x.tail(f));
    }
};

/** Two bodies coupled by a force element or a joint's own forces: ∂r of `row` by δ of `column`. **/
struct CoupledPair {
    int row, column;
    MatrixXd K, D;
};

struct FrequencyResponse::Contents {
    Contents(const MultibodySystem& system, const State& state,
             const std::function<void()>& observer);

    OperatingPoint point;
    Evaluation equations;
    CoordinateScales scales;
    std::vector<double> q;
    std::vector<int> firstU, sizes;  ///< of blocks
    std::unique_ptr<BlockMass> mass;
    std::vector<ArrowMatrix> M, K, D;  ///< of blocks
    std::vector<CoupledPair> pairs;
    VectorXd diagonalK, diagonalM;
    std::vector<char> isHeld;
    double softest = 0;  ///< approximate ω² of the softest vibration
    bool isSymmetric = false;
    int numUnstable = 0;

    int numSpeeds() const { return equations.getTopology().numU; }
    int numMultipliers() const { return equations.getTopology().numMultipliers; }
    VectorXd calcScale(double omegaSquared) const;
    VectorXcd multiply(const VectorXcd& x, const VectorXcd& lambda, double omega,
                       double hold) const;
    VectorXcd multiplyG(const VectorXcd& x) const {
        return mass->multiplyG(x.real()) + Complex(0, 1) * mass->multiplyG(x.imag());
    }
    VectorXcd multiplyGt(const VectorXcd& y) const {
        return mass->multiplyGt(y.real()) + Complex(0, 1) * mass->multiplyGt(y.imag());
    }
    /** In the solver's numbering, zero where speeds are held. **/
    std::vector<VectorXd> takeColumns(const Matrix& columns) const;
    std::vector<VectorXd> takeRows(const Matrix& rows) const { return takeColumns(~rows); }

    class Solver;

private:
    void takeMatrices(const BlockGraph& graph, const BlockMatrix<double>& stiffness,
                      const BlockMatrix<double>& damping);
};

FrequencyResponse::Contents::Contents(const MultibodySystem& system, const State& state,
                                      const std::function<void()>& observer)
    : point{state, Vector(), Vector()},
      equations((system.realize(point.state, Stage::Velocity), system), point.state,
                Topology::Setting::Linearize),
      scales(equations.getBlocks()) {
    const Topology& topology = equations.getTopology();
    if (point.state.getU().normInf() > 0)
        throw std::invalid_argument(
            "FrequencyResponse: the State has speeds; what moves is linearised by "
            "calcLinearization()");
    if (!topology.listOwnStates().empty())
        throw std::invalid_argument(
            "FrequencyResponse: the system has states of its own; calcLinearization() knows them");
    for (int row = 0; row < topology.firstFrictionRow; ++row)
        if (topology.getRowLevel(row) != MotionLevel::Position)
            throw std::invalid_argument("FrequencyResponse: " + topology.describeConstraint(row) +
                                        " holds speeds or accelerations; only constraints of "
                                        "positions can be linearised: disable it");
    equations.updBlocks().chooseNumThreads(omp_get_max_threads());
    SolutionPoint now;
    now.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
    now.t = point.state.getTime();
    equations.getBlocks().getFromState(point.state, now.q.data(), now.u.data());
    for (size_t i = 0; i < now.z.size(); ++i) now.z[i] = point.state.getZ()[int(i)];
    equations.setZ(now.z.data());
    equations.prescribe(now.t, 0, nullptr, now.q.data(), now.u.data());
    q = now.q;
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    step.calcAccelerations(now.t, now.q, now.u, now.uDot, now.lambda);
    point.uDot = equations.getBlocks().calcSimbodyUDot(q.data(), now.uDot.data());
    point.multipliers.resize(topology.numMultipliers);
    for (int k = 0; k < topology.numMultipliers; ++k) point.multipliers[k] = now.lambda[size_t(k)];

    for (int k = 0; k < int(topology.frictions.size()); ++k)
        if (equations.getFrictions().isSliding(k))
            throw std::invalid_argument(
                "FrequencyResponse: " +
                topology.describeConstraint(topology.frictions[size_t(k)].firstRow) +
                " slides, or begins to: only what sticks can be linearised, where it is held; let "
                "it come to rest, or leave the friction out");
    equations.realize(now.t, now.q.data(), now.u.data());
    VectorXd residual(topology.numU);
    equations.calcResidual(now.q.data(), now.u.data(), now.uDot.data(), now.lambda.data(),
                           residual.data());
    mass = std::make_unique<BlockMass>(equations);
    KinkedSpeeds kinks;
    const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
    firstU = graph.firstU;
    sizes = graph.sizes;
    isHeld.assign(size_t(topology.numU), 1);
    for (const int i : listFreeSpeeds(equations)) isHeld[size_t(i)] = 0;
    double fastest = 0;
    for (int b = 0; b < topology.numBlocks(); ++b)
        for (int i = firstU[size_t(b)]; i < firstU[size_t(b)] + sizes[size_t(b)]; ++i)
            fastest = std::max(fastest, std::abs(now.uDot[size_t(i)]) * scales.metres[size_t(i)] /
                                            scales.lengths[size_t(b)]);
    if (fastest <= SlowestDeparture) std::fill(now.uDot.begin(), now.uDot.end(), 0.0);
    const BlockMatrix<double> stiffness = calcStiffness(
        equations, scales, graph, *mass, now,
        [&](const std::vector<double>& moved, VectorXd& r) {
            if (observer) observer();
            equations.realize(now.t, moved.data(), now.u.data());
            equations.calcResidual(moved.data(), now.u.data(), now.uDot.data(), now.lambda.data(),
                                   r.data());
        },
        &kinks);
    takeMatrices(graph, stiffness,
                 calcDampingBlocks(equations, scales, graph, *mass, now, observer, &kinks));
    equations.realize(now.t, now.q.data(), now.u.data());
    if (kinks.any()) throw NoLinearForces(describeKinks(equations, scales, kinks));
    if (stiffness.findSkew(calcScale(softest)) > LargestSkewOfPotential) {
        // Without a potential, negative eigenvalues of the stiffness do not decide stability.
        try {
            numUnstable = int(calcGrowingModes(system, point.state, observer).size());
        } catch (const NoEquilibrium&) {
            // describeImbalance() reports it.
        }
        return;
    }
    TangentElimination<double> elimination(graph, *mass);
    elimination.setNumThreads(equations.getBlocks().numThreads);
    BlockMatrix<double> shifted = stiffness;
    shifted.addMass(*mass, LeastFall * softest);
    elimination.factor(shifted, calcScale(softest),
                       TangentElimination<double>::Symmetry::Symmetric);
    numUnstable = std::max(0, elimination.countNegative());
}

void FrequencyResponse::Contents::takeMatrices(const BlockGraph& graph,
                                               const BlockMatrix<double>& stiffness,
                                               const BlockMatrix<double>& damping) {
    const Topology& topology = equations.getTopology();
    diagonalK = stiffness.getDiagonal();
    diagonalM = mass->getDiagonal();
    for (int b = 0; b < topology.numFlexible; ++b)
        for (int i = 6; i < sizes[size_t(b)]; ++i) {
            const Eigen::Index row = firstU[size_t(b)] + i;
            const double square = std::abs(diagonalK[row]) / diagonalM[row];
            if (square > 0 && (softest == 0 || square < softest)) softest = square;
        }
    if (softest == 0 && topology.numU > 0)
        softest = diagonalK.cwiseAbs().cwiseQuotient(diagonalM).maxCoeff();
    if (softest == 0) softest = 1;
    const VectorXd scale = calcScale(softest);
    const double rate = std::sqrt(softest);
    isSymmetric =
        stiffness.findSkew(scale) <= SmallSkew && rate * damping.findSkew(scale) <= SmallSkew;

    // Modes coupled among themselves or to neighbours belong to the head.
    const auto isNothing = [&](size_t column, size_t k) {
        const auto isZero = [&](const BlockMatrix<double>& A) {
            const MatrixXd& values = A.columns[column][k];
            return values.size() == 0 || values.cwiseAbs().maxCoeff() == 0;
        };
        return isZero(stiffness) && isZero(damping);
    };
    const auto scaled = [&](const BlockMatrix<double>& A, size_t column, size_t k) {
        const size_t row = size_t(graph.neighbours[column][k]);
        return MatrixXd(scale.segment(firstU[row], sizes[row]).asDiagonal() * A.expand(column, k) *
                        scale.segment(firstU[column], sizes[column]).asDiagonal());
    };
    std::vector<Eigen::Index> numHead(sizes.size());
    for (size_t b = 0; b < sizes.size(); ++b)
        numHead[b] = int(b) < topology.numFlexible ? std::min(6, sizes[b]) : sizes[b];
    std::vector<std::pair<size_t, size_t>> coupled;  // column, place among its neighbours
    for (size_t b = 0; b < sizes.size(); ++b)
        for (size_t k = 0; k < graph.neighbours[b].size(); ++k) {
            const size_t row = size_t(graph.neighbours[b][k]);
            if (isNothing(b, k)) continue;
            MatrixXd size = scaled(stiffness, b, k).cwiseAbs();
            size += rate * scaled(damping, b, k).cwiseAbs();
            if (row == b) {
                const Eigen::Index count = sizes[b] - numHead[b];
                MatrixXd besides = size.bottomRightCorner(count, count);
                besides.diagonal().setZero();
                if (count > 0 && besides.maxCoeff() > SmallModeCoupling) numHead[b] = sizes[b];
                continue;
            }
            if (!(size.maxCoeff() > SmallSkew)) continue;
            coupled.emplace_back(b, k);
            if (size.bottomRows(sizes[row] - numHead[row]).sum() > SmallSkew)
                numHead[row] = sizes[row];
            if (size.rightCols(sizes[b] - numHead[b]).sum() > SmallSkew) numHead[b] = sizes[b];
        }
    for (const auto& [b, k] : coupled)
        pairs.push_back(
            {graph.neighbours[b][k], int(b), stiffness.expand(b, k), damping.expand(b, k)});
    for (size_t b = 0; b < sizes.size(); ++b) {
        const std::vector<int>& list = graph.neighbours[b];
        const size_t own =
            size_t(std::lower_bound(list.begin(), list.end(), int(b)) - list.begin());
        M.emplace_back(mass->M[b].expand(), numHead[b]);
        K.emplace_back(stiffness.expand(b, own), numHead[b]);
        D.emplace_back(damping.expand(b, own), numHead[b]);
    }
}

VectorXd FrequencyResponse::Contents::calcScale(double omegaSquared) const {
    VectorXd scale(diagonalK.size());
    for (Eigen::Index i = 0; i < scale.size(); ++i)
        scale[i] = isHeld[size_t(i)]
                       ? 0
                       : 1 / std::sqrt(std::abs(diagonalK[i]) + omegaSquared * diagonalM[i]);
    return scale;
}

VectorXcd FrequencyResponse::Contents::multiply(const VectorXcd& x, const VectorXcd& lambda,
                                                double omega, double hold) const {
    VectorXcd y = multiplyGt(lambda);
    for (size_t b = 0; b < sizes.size(); ++b) {
        const VectorXcd own = x.segment(firstU[b], sizes[b]);
        VectorXcd product = VectorXcd::Zero(sizes[b]);
        K[b].addProduct(own, 1, product);
        D[b].addProduct(own, Complex(0, omega), product);
        M[b].addProduct(own, hold - omega * omega, product);
        y.segment(firstU[b], sizes[b]) += product;
    }
    for (const CoupledPair& pair : pairs) {
        const size_t row = size_t(pair.row), column = size_t(pair.column);
        const VectorXcd own = x.segment(firstU[column], sizes[column]);
        y.segment(firstU[row], sizes[row]) += pair.K * own + Complex(0, omega) * (pair.D * own);
    }
    for (Eigen::Index i = 0; i < y.size(); ++i)
        if (isHeld[size_t(i)]) y[i] = 0;
    return y;
}

std::vector<VectorXd> FrequencyResponse::Contents::takeColumns(const Matrix& columns) const {
    State scratch = copyState(point.state);
    std::vector<VectorXd> all;
    for (int k = 0; k < columns.ncol(); ++k) {
        all.push_back(takeFromSimbody(equations, scratch, columns(k)));
        for (Eigen::Index i = 0; i < all.back().size(); ++i)
            if (isHeld[size_t(i)]) all.back()[i] = 0;
    }
    return all;
}

/** Solves the equations at one frequency after another: tails of arrows are eliminated body by
body, heads and multipliers multifrontally. **/
class FrequencyResponse::Contents::Solver {
public:
    explicit Solver(const Contents& contents) : m_contents(contents), m_fronts(makePattern()) {
        m_values.resize(m_numCliques);
        m_tails.resize(contents.sizes.size());
    }

    /** @param hold  factor of M that restrains free motions at ω = 0 [1/s²] **/
    void setFrequency(double omega, double hold = 0) {
        const Contents& c = m_contents;
        m_omega = omega;
        m_hold = hold;
        m_inertia = hold > 0 ? hold : -std::max(omega * omega, LeastPivotInertia * c.softest);
        m_scale = c.calcScale(std::abs(m_inertia));
        m_rowScale = VectorXd::Zero(c.numMultipliers());
        for (size_t b = 0; b < c.sizes.size(); ++b)
            for (size_t k = 0; k < c.mass->rows[b].size(); ++k)
                m_rowScale[c.mass->rows[b][k]] +=
                    m_scale.segment(c.firstU[b], c.sizes[b])
                        .cwiseProduct(c.mass->Gt[b].col(Eigen::Index(k)))
                        .squaredNorm();
        for (Eigen::Index k = 0; k < m_rowScale.size(); ++k)
            m_rowScale[k] = m_rowScale[k] > 0 ? 1 / std::sqrt(m_rowScale[k]) : 0;
        size_t clique = 0;
        for (size_t b = 0; b < c.sizes.size(); ++b) setBody(b, m_values[clique++]);
        for (const CoupledPair& pair : c.pairs) setPair(pair, m_values[clique++]);
        for (; clique < m_numCliques; ++clique)
            m_values[clique].setConstant(1, 1, -MultiplierCompliance);
        std::vector<const Complex*> pointers;
        for (const Eigen::MatrixXcd& values : m_values) pointers.push_back(values.data());
        m_fronts.setSymmetric(c.isSymmetric);
        if (c.numSpeeds() > 0) m_fronts.factor(pointers, 1);
    }

    /** Solves in place. @throws std::runtime_error near an undamped resonance **/
    void solve(VectorXcd& f, VectorXcd& g) {
        const VectorXcd rightF = f, rightG = g;
        const auto measure = [&](const VectorXcd& forces) {
            return m_scale.cwiseProduct(forces.cwiseAbs()).norm();
        };
        VectorXcd x = VectorXcd::Zero(f.size()), lambda = VectorXcd::Zero(g.size());
        const auto calcOpening = [&](const VectorXcd& opening) {
            return m_rowScale.cwiseProduct(opening.cwiseAbs()).norm();
        };
        const auto calcSize = [&] {
            double sum = 0;
            for (Eigen::Index i = 0; i < x.size(); ++i)
                if (m_scale[i] > 0) sum += std::norm(x[i] / m_scale[i]);
            return std::sqrt(sum);
        };
        double size = 0, left = Infinity;
        for (int pass = 0; pass <= HarmonicCorrections; ++pass) {
            solveOnce(f, g);
            x += f;
            lambda += g;
            f = rightF - m_contents.multiply(x, lambda, m_omega, m_hold);
            g = rightG - m_contents.multiplyG(x);
            // Includes the forces that a drive needs.
            if (pass == 0) size = std::max(measure(rightF), measure(m_contents.multiplyGt(lambda)));
            left = std::max(size > 0 ? measure(f) / size : 0,
                            calcOpening(g) / std::max({calcSize(), LeastMotion * size, LeastSize}));
            if (left <= HarmonicResidual) break;
        }
        const double sharpness =
            m_omega > 0 && size > 0 ? calcSharpness(x, LeastMotion * size, f, g) : 0;
        if (!(left <= HarmonicResidual) || !(sharpness <= SharpestResonance)) {
            std::ostringstream text;
            text << "at " << m_omega / (2 * Pi) << " Hz the equations of a harmonic motion cannot "
                 << "be solved";
            if (!(left <= HarmonicResidual)) text << " (residual " << left << ")";
            text << ": without damping there is none in resonance; choose another frequency, or "
                    "add damping";
            throw std::runtime_error(text.str());
        }
        f = x;
        g = lambda;
    }

    /** ω |∂x/∂ω| / |x|: at a resonance, the inverse of its width. @param f, g  scratch **/
    double calcSharpness(const VectorXcd& x, double leastSize, VectorXcd& f, VectorXcd& g) {
        constexpr double Change = 1e-3;
        const VectorXcd none = VectorXcd::Zero(g.size());
        f = (m_contents.multiply(x, none, m_omega, m_hold) -
             m_contents.multiply(x, none, (1 + Change) * m_omega, m_hold)) /
            Change;
        g = none;
        solveOnce(f, g);
        double changed = 0, own = 0;
        for (Eigen::Index i = 0; i < x.size(); ++i) {
            if (m_scale[i] == 0) continue;
            changed += std::norm(f[i] / m_scale[i]);
            own += std::norm(x[i] / m_scale[i]);
        }
        own = std::max(own, leastSize * leastSize);
        return own > 0 ? std::sqrt(changed / own) : 0;
    }

private:
    /** Factors that eliminate a body's tail. **/
    struct Tail {
        VectorXcd inverse;                     ///< f
        Eigen::MatrixXcd rightRows, leftRows;  ///< (h + m)×f: A₁ᵤ, Aᵤ₁ᵀ
    };

    CliquePattern makePattern() {
        const Contents& c = m_contents;
        CliquePattern pattern;
        // Unknowns: heads, then multipliers.
        int count = 0;
        for (size_t b = 0; b < c.sizes.size(); ++b) {
            m_firstHead.push_back(count);
            count += int(c.K[b].numHead());
        }
        m_numHeads = count;
        pattern.numUnknowns = count + c.numMultipliers();
        pattern.firstMultiplier = count;
        const auto appendHead = [&](std::vector<int>& clique, int b) {
            for (int i = 0; i < int(c.K[size_t(b)].numHead()); ++i)
                clique.push_back(m_firstHead[size_t(b)] + i);
        };
        for (int b = 0; b < int(c.sizes.size()); ++b) {
            pattern.cliques.emplace_back();
            appendHead(pattern.cliques.back(), b);
            for (const int row : c.mass->rows[size_t(b)])
                pattern.cliques.back().push_back(count + row);
        }
        for (const CoupledPair& pair : c.pairs) {
            pattern.cliques.emplace_back();
            appendHead(pattern.cliques.back(), pair.row);
            appendHead(pattern.cliques.back(), pair.column);
        }
        for (int row = 0; row < c.numMultipliers(); ++row) pattern.cliques.push_back({count + row});
        m_numCliques = pattern.cliques.size();
        return pattern;
    }

    Eigen::MatrixXcd combine(const MatrixXd& K, const MatrixXd& D, const MatrixXd& M) const {
        return (K + m_inertia * M).cast<Complex>() + Complex(0, m_omega) * D.cast<Complex>();
    }

    void setBody(size_t b, Eigen::MatrixXcd& values) {
        const Contents& c = m_contents;
        const ArrowMatrix &K = c.K[b], &D = c.D[b], &M = c.M[b];
        const Eigen::Index h = K.numHead(), f = K.tail.size(),
                           m = Eigen::Index(c.mass->rows[b].size());
        const auto headScale = m_scale.segment(c.firstU[b], h);
        const auto tailScale = m_scale.segment(c.firstU[b] + h, f);
        values.setZero(h + m, h + m);
        values.topLeftCorner(h, h) =
            headScale.asDiagonal() * combine(K.head, D.head, M.head) * headScale.asDiagonal();
        for (Eigen::Index i = 0; i < h; ++i)
            if (headScale[i] == 0) values(i, i) = 1;
        MatrixXd Gt = c.mass->Gt[b];
        for (Eigen::Index k = 0; k < m; ++k) Gt.col(k) *= m_rowScale[c.mass->rows[b][size_t(k)]];
        values.topRightCorner(h, m) = (headScale.asDiagonal() * Gt.topRows(h)).cast<Complex>();
        values.bottomLeftCorner(m, h) = values.topRightCorner(h, m).transpose();
        if (f == 0) return;
        Tail& tail = m_tails[b];
        tail.rightRows.resize(h + m, f);
        tail.leftRows.resize(h + m, f);
        tail.rightRows.topRows(h) =
            headScale.asDiagonal() * combine(K.right, D.right, M.right) * tailScale.asDiagonal();
        tail.leftRows.topRows(h) = headScale.asDiagonal() *
                                   combine(K.below, D.below, M.below).transpose() *
                                   tailScale.asDiagonal();
        tail.rightRows.bottomRows(m) =
            (Gt.bottomRows(f).transpose() * tailScale.asDiagonal()).cast<Complex>();
        tail.leftRows.bottomRows(m) = tail.rightRows.bottomRows(m);
        tail.inverse.resize(f);
        for (Eigen::Index i = 0; i < f; ++i) {
            const Complex pivot = tailScale[i] * tailScale[i] *
                                  Complex(K.tail[i] + m_inertia * M.tail[i], m_omega * D.tail[i]);
            // The joints of a part in undamped resonance determine its motion.
            tail.inverse[i] = tailScale[i] == 0                  ? 0
                              : std::abs(pivot) > LeastTailPivot ? 1.0 / pivot
                                                                 : 1.0 / LeastTailPivot;
        }
        values.noalias() -= tail.rightRows * tail.inverse.asDiagonal() * tail.leftRows.transpose();
    }

    void setPair(const CoupledPair& pair, Eigen::MatrixXcd& values) const {
        const Contents& c = m_contents;
        const Eigen::Index rows = c.K[size_t(pair.row)].numHead(),
                           columns = c.K[size_t(pair.column)].numHead();
        values.setZero(rows + columns, rows + columns);
        values.topRightCorner(rows, columns) =
            m_scale.segment(c.firstU[size_t(pair.row)], rows).asDiagonal() *
            (pair.K.topLeftCorner(rows, columns).cast<Complex>() +
             Complex(0, m_omega) * pair.D.topLeftCorner(rows, columns).cast<Complex>()) *
            m_scale.segment(c.firstU[size_t(pair.column)], columns).asDiagonal();
    }

    void solveOnce(VectorXcd& f, VectorXcd& g) {
        const Contents& c = m_contents;
        VectorXcd x = VectorXcd::Zero(m_numHeads + g.size());
        x.tail(g.size()) = m_rowScale.cwiseProduct(g);
        f = m_scale.cwiseProduct(f);
        for (size_t b = 0; b < c.sizes.size(); ++b) {
            const Eigen::Index h = c.K[b].numHead(), count = c.K[b].tail.size();
            x.segment(m_firstHead[b], h) += f.segment(c.firstU[b], h);
            if (count == 0) continue;
            const VectorXcd moved = m_tails[b].rightRows * m_tails[b].inverse.cwiseProduct(
                                                               f.segment(c.firstU[b] + h, count));
            x.segment(m_firstHead[b], h) -= moved.head(h);
            for (size_t k = 0; k < c.mass->rows[b].size(); ++k)
                x[m_numHeads + c.mass->rows[b][k]] -= moved[h + Eigen::Index(k)];
        }
        if (x.size() > 0) m_fronts.solve(x.data(), 1);
        VectorXcd own;
        for (size_t b = 0; b < c.sizes.size(); ++b) {
            const Eigen::Index h = c.K[b].numHead(), count = c.K[b].tail.size();
            if (count > 0) {
                own.resize(h + Eigen::Index(c.mass->rows[b].size()));
                own.head(h) = x.segment(m_firstHead[b], h);
                for (size_t k = 0; k < c.mass->rows[b].size(); ++k)
                    own[h + Eigen::Index(k)] = x[m_numHeads + c.mass->rows[b][k]];
                const VectorXcd rest =
                    f.segment(c.firstU[b] + h, count) - m_tails[b].leftRows.transpose() * own;
                f.segment(c.firstU[b] + h, count) = m_tails[b].inverse.cwiseProduct(rest);
            }
            f.segment(c.firstU[b], h) = x.segment(m_firstHead[b], h);
        }
        f = m_scale.cwiseProduct(f);
        g = m_rowScale.cwiseProduct(x.tail(g.size()));
    }

    const Contents& m_contents;
    double m_omega = 0, m_hold = 0, m_inertia = 0;
    int m_numHeads = 0;
    size_t m_numCliques = 0;
    std::vector<int> m_firstHead;  ///< of blocks, among unknowns
    VectorXd m_scale, m_rowScale;
    std::vector<Eigen::MatrixXcd> m_values;  ///< of bodies, pairs, multipliers
    std::vector<Tail> m_tails;
    FrontSolver<Complex> m_fronts;
};

FrequencyResponse::FrequencyResponse(const MultibodySystem& system, const State& state,
                                     const std::function<void()>& observer) {
    const StandardArithmetic standard;
    requireTopology(system, state, "FrequencyResponse");
    m_contents = std::make_unique<Contents>(system, state, observer);
}

FrequencyResponse::~FrequencyResponse() = default;
FrequencyResponse::FrequencyResponse(FrequencyResponse&&) noexcept = default;

const OperatingPoint& FrequencyResponse::getPoint() const {
    return m_contents->point;
}

int FrequencyResponse::countUnstable() const {
    return m_contents->numUnstable;
}

std::string FrequencyResponse::describeImbalance() const {
    const StandardArithmetic standard;
    const Contents& c = *m_contents;
    const double hold = square(HarmonicInertiaHold) * c.softest;
    Contents::Solver solver(c);
    solver.setFrequency(0, hold);
    State scratch = copyState(c.point.state);
    const VectorXd forces = c.mass->multiply(takeFromSimbody(c.equations, scratch, c.point.uDot));
    VectorXcd motion = forces.cast<Complex>(), none = VectorXcd::Zero(c.numMultipliers());
    for (Eigen::Index i = 0; i < motion.size(); ++i)
        if (c.isHeld[size_t(i)]) motion[i] = 0;
    solver.solve(motion, none);
    const VectorXd departure = motion.real();
    return describeDeparture(c.equations, c.scales, departure, forces);
}

FrequencyResponse::Amplitudes FrequencyResponse::calcMotions(Real omega,
                                                             const LinearInputs& inputs) const {
    const StandardArithmetic standard;
    const Contents& c = *m_contents;
    Contents::Solver solver(c);
    solver.setFrequency(omega);
    Amplitudes motions(c.numSpeeds(), inputs.forces.ncol());
    const std::vector<VectorXd> forces = c.takeColumns(inputs.forces);
    for (int k = 0; k < inputs.forces.ncol(); ++k) {
        VectorXcd f = forces[size_t(k)].cast<Complex>(), g(c.numMultipliers());
        for (int i = 0; i < c.numMultipliers(); ++i) g[i] = inputs.drives(i, k);
        solver.solve(f, g);
        const VectorXd re = f.real(), im = f.imag();
        const Vector simbodyRe = c.equations.getBlocks().calcSimbodyUDot(c.q.data(), re.data()),
                     simbodyIm = c.equations.getBlocks().calcSimbodyUDot(c.q.data(), im.data());
        for (int i = 0; i < c.numSpeeds(); ++i) motions(i, k) = Complex(simbodyRe[i], simbodyIm[i]);
    }
    return motions;
}

std::vector<FrequencyResponse::Amplitudes> FrequencyResponse::calcTransfers(
    const std::vector<Real>& omegas, const LinearInputs& inputs, const LinearOutputs& outputs,
    int threads, const std::function<void(size_t done)>& observer) const {
    const StandardArithmetic standard;
    const Contents& c = *m_contents;
    const int p = inputs.forces.ncol(), o = outputs.byQ.nrow(), m = c.numMultipliers();
    const std::vector<VectorXd> forces = c.takeColumns(inputs.forces);
    std::vector<VectorXcd> drives;
    for (int k = 0; k < p; ++k) {
        drives.emplace_back(m);
        for (int i = 0; i < m; ++i) drives.back()[i] = inputs.drives(i, k);
    }
    const std::vector<VectorXd> byQ = c.takeRows(outputs.byQ), byU = c.takeRows(outputs.byU),
                                byUDot = c.takeRows(outputs.byUDot);
    std::vector<VectorXd> byMultipliers(static_cast<size_t>(o), VectorXd::Zero(m));
    for (int i = 0; i < o; ++i)
        for (int k = 0; k < m; ++k) byMultipliers[size_t(i)][k] = outputs.byMultipliers(i, k);

    std::vector<Amplitudes> transfers(omegas.size());
    const int most = threads > 0 ? threads : omp_get_max_threads();
    const int team = std::max(1, std::min(most, int(omegas.size())));
    std::vector<std::unique_ptr<Contents::Solver>> solvers;
    for (int i = 0; i < team; ++i) solvers.push_back(std::make_unique<Contents::Solver>(c));
    for (size_t first = 0; first < omegas.size(); first += size_t(team)) {
        const int count = int(std::min(size_t(team), omegas.size() - first));
        parallelFor(count, team, Schedule::WhoeverIsFree, [&](int i) {
            const size_t at = first + size_t(i);
            const double omega = omegas[at];
            Contents::Solver& solver = *solvers[size_t(i)];
            solver.setFrequency(omega);
            transfers[at].resize(o, p);
            for (int k = 0; k < p; ++k) {
                VectorXcd x = forces[size_t(k)].cast<Complex>(), lambda = drives[size_t(k)];
                solver.solve(x, lambda);
                for (int row = 0; row < o; ++row) {
                    const size_t r = size_t(row);
                    const auto along = [&](const VectorXd& weights, const VectorXcd& y) {
                        return Complex(weights.dot(y.real()), weights.dot(y.imag()));
                    };
                    transfers[at](row, k) = along(byQ[r], x) +
                                            Complex(0, omega) * along(byU[r], x) -
                                            square(omega) * along(byUDot[r], x) +
                                            along(byMultipliers[r], lambda) + inputs.direct(row, k);
                }
            }
        });
        if (observer) observer(first + size_t(count));
    }
    return transfers;
}

}  // namespace simflex
