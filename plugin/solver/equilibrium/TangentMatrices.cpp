#include "simflex/solver/equilibrium/TangentMatrices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/solver/equilibrium/BlockTangent.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double RankTolerance = 1e-10;
/** Displacement of a body, of its size, that makes an equilibrium none. **/
constexpr double SmallDeparture = 1e-4;
/** The same, where a linear estimate says nothing of how far it goes. **/
constexpr double FarAway = 10;

/** A force that bends by more than this part of its change, or of this part of the largest change,
may have a kink: a stop that closes. **/
constexpr double KinkBend = 0.1, SmallForceChange = 1e-3;
/** Steps are refined until two derivatives agree so far; a kink is found down to 1e-9 of a size.
 * **/
constexpr double KinkAgreement = 0.02, StepRefinement = 1.0 / 16;
constexpr int MaxRefinements = 4;

/** Of what is differenced, the part that may be round-off: what does not depend on a state shall
not seem to. **/
constexpr double Certain = 16 * std::numeric_limits<double>::epsilon();

/** Of differences, without round-off. **/
class Slope {
public:
    explicit Slope(Eigen::Index size)
        : m_sum(VectorXd::Zero(size)), m_largest(VectorXd::Zero(size)) {}
    void add(int place, const VectorXd& f) {
        m_sum += DifferenceWeights[place] * f;
        m_largest = m_largest.cwiseMax(f.cwiseAbs());
    }
    VectorXd get(double h) const {
        VectorXd slope = m_sum / h;
        for (Eigen::Index i = 0; i < slope.size(); ++i)
            if (std::abs(m_sum[i]) <= Certain * m_largest[i]) slope[i] = 0;
        return slope;
    }

private:
    VectorXd m_sum, m_largest;
};

/** Whether two columns are the same but for what SmallForceChange hides. **/
bool areAlike(const VectorXd& a, const VectorXd& b, double allowed) {
    const double largest = SmallForceChange * b.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < a.size(); ++i)
        if (!(std::abs(a[i] - b[i]) <= allowed * (std::abs(b[i]) + largest))) return false;
    return true;
}

}  // namespace

std::string describeDeparture(const Evaluation& equations, const CoordinateScales& scales,
                              const VectorXd& departure, const VectorXd& forces) {
    double worst = SmallDeparture;
    std::string description;
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        const double size = scales.lengths[size_t(b)];
        const double moved = block.calcDisplacement(departure.data() + block.firstU);
        if (!(moved > worst * size)) continue;
        worst = moved / size;
        double force = 0;
        for (int i = block.firstU; i < block.firstU + block.numU; ++i)
            if (scales.metres[size_t(i)] > 0)
                force = std::max(force, std::abs(forces[i]) / scales.metres[size_t(i)]);
        std::ostringstream text;
        text << "forces of up to " << force << " N on '" << block.name << "' lead it ";
        if (moved > FarAway * size)
            text << "away, and nothing near holds it";
        else
            text << moved << " m away";
        description = text.str();
    }
    return description;
}

std::vector<int> listFreeSpeeds(const Evaluation& equations) {
    std::vector<int> speeds;
    for (int i = 0; i < equations.getTopology().numU; ++i)
        if (!equations.getTopology().isPrescribed[size_t(i)]) speeds.push_back(i);
    return speeds;
}

void calcMassAndJacobian(Evaluation& equations, MatrixXd& M, MatrixXd& G) {
    const BlockMass mass(equations);
    M.setZero(equations.getTopology().numU, equations.getTopology().numU);
    G.setZero(mass.numMultipliers, M.rows());
    for (size_t b = 0; b < mass.M.size(); ++b) {
        const Eigen::Index first = mass.firstU[b], n = mass.M[b].size();
        M.block(first, first, n, n) = mass.M[b].expand();
        for (size_t k = 0; k < mass.rows[b].size(); ++k)
            G.row(mass.rows[b][k]).segment(first, n) = mass.Gt[b].col(Eigen::Index(k)).transpose();
    }
}

void differentiate(
    const std::function<void(const std::vector<double>& delta, VectorXd& f)>& evaluate,
    const std::vector<double>& steps, const VectorXd& middle, const VectorXd& weights,
    const std::vector<std::vector<DifferenceColumn>>& groups) {
    std::vector<double> delta(steps.size(), 0);
    const auto gather = [](const DifferenceColumn& column, const VectorXd& f) {
        Eigen::Index size = 0;
        for (const auto& range : column.rows) size += range.second;
        VectorXd own(size);
        size = 0;
        for (const auto& [first, count] : column.rows) {
            own.segment(size, count) = f.segment(first, count);
            size += count;
        }
        return own;
    };
    struct Active {
        const DifferenceColumn* column;
        double h;
        VectorXd middle, weights, slope, rise, bend, least, most;
        bool isStraight() const {
            const VectorXd change = weights.cwiseProduct(rise);
            return areAlike(change + weights.cwiseProduct(bend), change, KinkBend);
        }
    };
    std::vector<Active> active;
    VectorXd f(middle.size());
    const auto difference = [&] {
        for (Active& one : active) {
            one.slope = VectorXd::Zero(one.middle.size());
            one.rise = one.slope;
            one.bend = -2 * one.middle;
            one.least = one.most = one.middle;
        }
        for (int k = 0; k < 4; ++k) {
            for (const Active& one : active)
                delta[size_t(one.column->speed)] = DifferencePlaces[k] * one.h;
            evaluate(delta, f);
            for (Active& one : active) {
                const VectorXd own = gather(*one.column, f);
                one.slope += DifferenceWeights[k] / one.h * own;
                one.least = one.least.cwiseMin(own);
                one.most = one.most.cwiseMax(own);
                delta[size_t(one.column->speed)] = 0;
                if (std::abs(DifferencePlaces[k]) < 2) continue;  // the outer ones see most
                one.rise += DifferencePlaces[k] / 2 * own;
                one.bend += own;
            }
        }
        for (Active& one : active)
            for (Eigen::Index i = 0; i < one.slope.size(); ++i)
                if (one.least[i] == one.most[i]) one.slope[i] = 0;  // but for the weights
    };
    for (const std::vector<DifferenceColumn>& group : groups) {
        active.clear();
        for (const DifferenceColumn& column : group)
            active.push_back({&column,
                              steps[size_t(column.speed)],
                              gather(column, middle),
                              gather(column, weights),
                              {},
                              {},
                              {},
                              {},
                              {}});
        difference();
        const auto dropStraight = [&] {
            for (const Active& one : active)
                if (one.isStraight()) one.column->take(one.slope);
            active.erase(std::remove_if(active.begin(), active.end(),
                                        [](const Active& one) { return one.isStraight(); }),
                         active.end());
        };
        dropStraight();
        for (int k = 0; !active.empty() && k < MaxRefinements; ++k) {
            std::vector<VectorXd> before;
            for (Active& one : active) {
                before.push_back(one.slope);
                one.h *= StepRefinement;
            }
            difference();
            for (size_t i = 0; i < active.size(); ++i) {
                // Of two that agree the longer step's is the sharper one; the finer one's counts
                // where it is straight.
                Active& one = active[i];
                const VectorXd& w = one.weights;
                if (!one.isStraight() ||
                    areAlike(w.cwiseProduct(before[i]), w.cwiseProduct(one.slope), KinkAgreement))
                    one.slope = before[i];
            }
            dropStraight();
        }
        for (const Active& one : active) one.column->take(one.slope);
    }
}

namespace {

/** Of a displaced q. **/
std::function<void(const std::vector<double>& delta, VectorXd& f)> displaceEach(
    Evaluation& equations, double t, const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, VectorXd& f)>& evaluate) {
    return [&equations, t, &q, &u, &evaluate, moved = q](const std::vector<double>& delta,
                                                         VectorXd& f) mutable {
        if (equations.getTopology().needsSimbody)
            equations.realize(t, q.data(), u.data());  // for its N(q)
        moved = q;
        equations.getBlocks().moveQ(delta.data(), moved.data());
        evaluate(moved, f);
    };
}

/** Of residuals. **/
VectorXd weighRows(const CoordinateScales& scales, Eigen::Index count) {
    VectorXd weights = VectorXd::Ones(count);
    const Eigen::Index n = Eigen::Index(scales.metres.size());
    if (n > 0 && count % n == 0)  // once, or with their rates
        for (Eigen::Index i = 0; i < count; ++i)
            weights[i] = 1 / std::max(scales.metres[size_t(i % n)], 1e-12);
    return weights;
}

}  // namespace

MatrixXd differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, double t, const std::vector<double>& q,
    const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, VectorXd& f)>& evaluate) {
    VectorXd middle(equations.getTopology().numU);
    evaluate(q, middle);
    MatrixXd derivative = MatrixXd::Zero(middle.size(), equations.getTopology().numU);
    std::vector<std::vector<DifferenceColumn>> groups;
    for (const int column : listFreeSpeeds(equations))
        groups.push_back(
            {{column, {{0, int(middle.size())}}, [&derivative, column](const VectorXd& slope) {
                  derivative.col(column) = slope;
              }}});
    differentiate(displaceEach(equations, t, q, u, evaluate), scales.step, middle,
                  weighRows(scales, middle.size()), groups);
    equations.realize(t, q.data(), u.data());
    return derivative;
}

BlockMatrix<double> differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph, double t,
    const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, VectorXd& r)>& evaluate,
    int firstBlock) {
    VectorXd middle(equations.getTopology().numU);
    evaluate(q, middle);
    BlockMatrix<double> derivative(graph);
    std::vector<std::vector<DifferenceColumn>> groups;
    for (const std::vector<int>& blocks : graph.groups) {
        int largest = 0;
        for (const int b : blocks)
            if (b >= firstBlock) largest = std::max(largest, graph.sizes[size_t(b)]);
        for (int i = 0; i < largest; ++i) {
            std::vector<DifferenceColumn> group;
            for (const int b : blocks) {
                const int speed = graph.firstU[size_t(b)] + i;
                if (b < firstBlock || i >= graph.sizes[size_t(b)] ||
                    equations.getTopology().isPrescribed[size_t(speed)])
                    continue;
                DifferenceColumn column{speed, {}, [&derivative, b, i](const VectorXd& slope) {
                                            Eigen::Index first = 0;
                                            for (MatrixXd& part : derivative.columns[size_t(b)]) {
                                                part.col(i) = slope.segment(first, part.rows());
                                                first += part.rows();
                                            }
                                        }};
                for (const int row : graph.neighbours[size_t(b)])
                    column.rows.emplace_back(graph.firstU[size_t(row)], graph.sizes[size_t(row)]);
                group.push_back(std::move(column));
            }
            groups.push_back(std::move(group));
        }
    }
    differentiate(displaceEach(equations, t, q, u, evaluate), scales.step, middle,
                  weighRows(scales, middle.size()), groups);
    equations.realize(t, q.data(), u.data());
    return derivative;
}

MatrixXd calcDampingMatrix(Evaluation& equations, const CoordinateScales& scales,
                           const SolutionPoint& point) {
    const int n = equations.getTopology().numU;
    double fastest = 0;  // how fast the system turns
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        if (scales.lengths[size_t(b)] > 0)
            fastest = std::max(fastest, block.calcDisplacement(point.u.data() + block.firstU) /
                                            scales.lengths[size_t(b)]);
    }
    MatrixXd D = MatrixXd::Zero(n, n);
    std::vector<double> u = point.u;
    VectorXd r(n);
    for (int column : listFreeSpeeds(equations)) {
        const size_t i = size_t(column);
        const double h = scales.step[i] * std::max(scales.rate[i], fastest);
        for (int k = 0; k < 4; ++k) {
            u[i] = point.u[i] + DifferencePlaces[k] * h;
            equations.realize(point.t, point.q.data(), u.data());
            equations.calcResidual(point.q.data(), u.data(), point.uDot.data(), point.lambda.data(),
                                   r.data());
            D.col(column) += DifferenceWeights[k] / h * r;
        }
        u[i] = point.u[i];
    }
    equations.realize(point.t, point.q.data(), point.u.data());
    return D;
}

StateTangent calcStateTangent(Evaluation& equations, const CoordinateScales& scales,
                              const SolutionPoint& point) {
    const Topology& topology = equations.getTopology();
    StateTangent tangent;
    tangent.states = topology.listOwnStates();
    const Eigen::Index n = topology.numU, s = Eigen::Index(tangent.states.size());
    tangent.B = MatrixXd::Zero(n, s);
    tangent.C = tangent.E = MatrixXd::Zero(s, n);
    tangent.F = MatrixXd::Zero(s, s);
    if (s == 0) return tangent;
    std::vector<double> zDot(point.z.size());
    const auto calcRates = [&](const std::vector<double>& q, const std::vector<double>& u) {
        equations.realize(point.t, q.data(), u.data());
        equations.updLoads().calcStateRates(zDot.data());
        VectorXd rates(s);
        for (Eigen::Index i = 0; i < s; ++i) rates[i] = zDot[size_t(tangent.states[size_t(i)])];
        return rates;
    };
    tangent.rates = calcRates(point.q, point.u);
    tangent.C = differentiateByQ(
        equations, scales, point.t, point.q, point.u,
        [&](const std::vector<double>& q, VectorXd& f) { f = calcRates(q, point.u); });
    std::vector<double> u = point.u, z = point.z;
    for (const int column : listFreeSpeeds(equations)) {
        const size_t i = size_t(column);
        const double h = scales.step[i] * scales.rate[i];
        Slope slope(s);
        for (int k = 0; k < 4; ++k) {
            u[i] = point.u[i] + DifferencePlaces[k] * h;
            slope.add(k, calcRates(point.q, u));
        }
        tangent.E.col(column) = slope.get(h);
        u[i] = point.u[i];
    }
    VectorXd r(n);
    for (Eigen::Index j = 0; j < s; ++j) {
        const size_t i = size_t(tangent.states[size_t(j)]);
        const double scale = topology.states[i - size_t(topology.firstZ)].equation->getScale();
        const double h = 1e-4 * std::max(scale, std::abs(z[i]));
        Slope rates(s), forces(n);
        for (int k = 0; k < 4; ++k) {
            z[i] = point.z[i] + DifferencePlaces[k] * h;
            equations.setZ(z.data());
            rates.add(k, calcRates(point.q, point.u));
            equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(),
                                   point.lambda.data(), r.data());
            forces.add(k, r);
        }
        tangent.F.col(j) = rates.get(h);
        tangent.B.col(j) = forces.get(h);
        z[i] = point.z[i];
    }
    equations.setZ(point.z.data());
    equations.realize(point.t, point.q.data(), point.u.data());
    return tangent;
}

std::vector<MatrixXd> calcRateBlocks(Evaluation& equations, const CoordinateScales& scales,
                                     const SolutionPoint& point) {
    const Topology& topology = equations.getTopology();
    const int numQ = topology.numQ;
    std::vector<MatrixXd> A;
    for (int b = 0; b < topology.numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        A.push_back(MatrixXd::Zero(block.numU, block.numU));
        if (b >= topology.numFlexible) continue;
        // ω is that in the body.
        const double* omega = &point.u[size_t(block.firstU)];
        A.back().topLeftCorner<3, 3>() << 0, -omega[2], omega[1], omega[2], 0, -omega[0], -omega[1],
            omega[0], 0;
    }
    // Of rigid trees, all of them at a time: N is each one's own.
    struct Tree {
        size_t number;
        const Block* block;
        double duration;  ///< of a flow at its own speed for differences
        MatrixXd N, bracket;
    };
    std::vector<Tree> trees;
    std::vector<double> own(point.u.size(), 0), unit(point.u.size(), 0);
    int largest = 0;
    for (int b = topology.numFlexible; b < topology.numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        const double speed = block.calcDisplacement(point.u.data() + block.firstU);
        if (!(speed > 0)) continue;
        std::copy_n(point.u.begin() + block.firstU, block.numU, own.begin() + block.firstU);
        // A ten-thousandth of the time it takes to move by itself.
        trees.push_back({size_t(b), &block,
                         CoordinateScales::StepFraction * scales.lengths[size_t(b)] / speed,
                         MatrixXd(block.numQ, block.numU), MatrixXd(block.numQ, block.numU)});
        largest = std::max(largest, block.numU);
    }
    const auto calcQDot = [&](const std::vector<double>& q, const std::vector<double>& u) {
        equations.realize(point.t, q.data(), point.u.data());
        VectorXd qDot(numQ);
        equations.getBlocks().calcQDot(q.data(), u.data(), qDot.data());
        return qDot;
    };
    /** Derivative of N(q)u along N(q)v. @param h  by coordinate; 0: none **/
    const auto differentiate = [&](const std::vector<double>& u, const std::vector<double>& v,
                                   const VectorXd& h) {
        const VectorXd along = calcQDot(point.q, v);
        VectorXd derivative = VectorXd::Zero(numQ);
        for (int k = 0; k < 4; ++k) {
            std::vector<double> q = point.q;
            for (int i = 0; i < numQ; ++i) q[size_t(i)] += DifferencePlaces[k] * h[i] * along[i];
            derivative += DifferenceWeights[k] * calcQDot(q, u);
        }
        for (int i = 0; i < numQ; ++i) derivative[i] = h[i] > 0 ? derivative[i] / h[i] : 0;
        return derivative;
    };
    for (int i = 0; i < largest; ++i) {
        VectorXd durations = VectorXd::Zero(numQ), steps = durations;
        for (const Tree& tree : trees) {
            if (i >= tree.block->numU) continue;
            const size_t column = size_t(tree.block->firstU + i);
            unit[column] = 1;
            durations.segment(tree.block->firstQ, tree.block->numQ).setConstant(tree.duration);
            steps.segment(tree.block->firstQ, tree.block->numQ).setConstant(scales.step[column]);
        }
        const VectorXd N = calcQDot(point.q, unit), bracket = differentiate(unit, own, durations) -
                                                              differentiate(own, unit, steps);
        for (Tree& tree : trees) {
            if (i >= tree.block->numU) continue;
            tree.N.col(i) = N.segment(tree.block->firstQ, tree.block->numQ);
            tree.bracket.col(i) = bracket.segment(tree.block->firstQ, tree.block->numQ);
            unit[size_t(tree.block->firstU + i)] = 0;
        }
    }
    for (const Tree& tree : trees) A[tree.number] = solveLeastSquares(tree.N, tree.bracket);
    equations.realize(point.t, point.q.data(), point.u.data());
    return A;
}

TangentSpace::TangentSpace(const MatrixXd& G) {
    const Eigen::Index n = G.cols(), m = G.rows();
    m_rowScale = VectorXd::Ones(m);
    if (m == 0) {
        m_Z = MatrixXd::Identity(n, n);
        m_inverse.setZero(0, n);
        return;
    }
    MatrixXd Gt = G.transpose();
    for (Eigen::Index k = 0; k < m; ++k) {
        const double norm = Gt.col(k).norm();
        if (norm > 0) m_rowScale[k] = 1 / norm;
        Gt.col(k) *= m_rowScale[k];
    }
    ColumnSpace space = calcColumnSpace(Gt, RankTolerance);
    m_rank = space.rank;
    m_Z = std::move(space.complement);
    m_inverse = std::move(space.pseudoInverse);
}

VectorXd TangentSpace::solveForMotion(const VectorXd& g) const {
    return m_inverse.transpose() * m_rowScale.cwiseProduct(g);
}

VectorXd TangentSpace::solveForMultipliers(const VectorXd& f) const {
    return m_rowScale.cwiseProduct(m_inverse * f);
}

}  // namespace simflex
