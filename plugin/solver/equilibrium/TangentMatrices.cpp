#include "simflex/solver/equilibrium/TangentMatrices.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/solver/equilibrium/BlockTangent.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double RankTolerance = 1e-10;
/** Displacement, relative to a body's size, beyond which a State is no equilibrium. **/
constexpr double SmallDeparture = 1e-4;
/** The same, beyond which a linear estimate of the displacement is meaningless. **/
constexpr double FarAway = 10;

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

namespace {

/** Evaluates at displaced positions. **/
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

/** Evaluates at changed speeds. **/
std::function<void(const std::vector<double>& delta, VectorXd& f)> quicken(
    const std::vector<double>& u,
    const std::function<void(const std::vector<double>& u, VectorXd& f)>& evaluate) {
    return [&u, &evaluate, moved = u](const std::vector<double>& delta, VectorXd& f) mutable {
        for (size_t i = 0; i < u.size(); ++i) moved[i] = u[i] + delta[i];
        evaluate(moved, f);
    };
}

void noteKinks(int speed, const std::vector<Kink>& kinks, KinkedSpeeds& noted) {
    if (!kinks.empty()) noted.byPosition.push_back(speed);
}

void noteJumps(int speed, const std::vector<Kink>& kinks, KinkedSpeeds& noted) {
    if (std::any_of(kinks.begin(), kinks.end(), [](const Kink& kink) { return kink.isJump; }))
        noted.byJump.push_back(speed);
}
using Note = void (*)(int speed, const std::vector<Kink>& kinks, KinkedSpeeds& noted);

/** Columns with all rows, one by one. **/
std::vector<std::vector<DifferenceColumn>> listColumns(const Evaluation& equations,
                                                       MatrixXd& derivative, Note note,
                                                       KinkedSpeeds* noted) {
    std::vector<std::vector<DifferenceColumn>> groups;
    for (const int column : listFreeSpeeds(equations))
        groups.push_back({{column,
                           {{0, int(derivative.rows())}},
                           [&derivative, column, note, noted](const VectorXd& slopes,
                                                              const std::vector<Kink>& kinks) {
                               derivative.col(column) = slopes;
                               if (noted) note(column, kinks, *noted);
                           }}});
    return groups;
}

/** Columns with the rows of neighbours, for blocks without a common neighbour at a time. **/
std::vector<std::vector<DifferenceColumn>> listColumns(const Evaluation& equations,
                                                       const BlockGraph& graph, int firstBlock,
                                                       BlockMatrix<double>& derivative, Note note,
                                                       KinkedSpeeds* noted) {
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
                DifferenceColumn column{
                    speed,
                    {},
                    [&derivative, b, i, speed, note, noted](const VectorXd& slopes,
                                                            const std::vector<Kink>& kinks) {
                        Eigen::Index first = 0;
                        for (MatrixXd& part : derivative.columns[size_t(b)]) {
                            part.col(i) = slopes.segment(first, part.rows());
                            first += part.rows();
                        }
                        if (noted) note(speed, kinks, *noted);
                    }};
                for (const int row : graph.neighbours[size_t(b)])
                    column.rows.emplace_back(graph.firstU[size_t(row)], graph.sizes[size_t(row)]);
                group.push_back(std::move(column));
            }
            if (!group.empty()) groups.push_back(std::move(group));
        }
    }
    return groups;
}

}  // namespace

VectorXd calcInertiaChanges(const Evaluation& equations, const CoordinateScales& scales,
                            const SolutionPoint& point, const VectorXd& mass) {
    VectorXd turning = VectorXd::Zero(mass.size());
    double most = 0;
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        const double size = scales.lengths[size_t(b)];
        if (!(size > 0)) continue;
        const double speed = block.calcDisplacement(point.u.data() + block.firstU) / size,
                     change = block.calcDisplacement(point.uDot.data() + block.firstU) / size,
                     rate = std::sqrt(speed * speed + change);
        for (int i = block.firstU; i < block.firstU + block.numU; ++i) {
            turning[i] = rate * std::sqrt(std::abs(mass[i]));
            most = std::max(most, turning[i] * scales.step[size_t(i)]);
        }
    }
    return most * turning;
}

MatrixXd differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, double t, const std::vector<double>& q,
    const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, VectorXd& f)>& evaluate,
    KinkedSpeeds* kinks, const VectorXd& terms) {
    VectorXd middle(equations.getTopology().numU);
    evaluate(q, middle);
    MatrixXd derivative = MatrixXd::Zero(middle.size(), equations.getTopology().numU);
    differentiate(displaceEach(equations, t, q, u, evaluate), scales.step, middle,
                  listColumns(equations, derivative, noteKinks, kinks), terms,
                  scales.originDistance);
    equations.realize(t, q.data(), u.data());
    return derivative;
}

BlockMatrix<double> differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph, double t,
    const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, VectorXd& r)>& evaluate, int firstBlock,
    KinkedSpeeds* kinks, const VectorXd& terms) {
    VectorXd middle(equations.getTopology().numU);
    evaluate(q, middle);
    BlockMatrix<double> derivative(graph);
    differentiate(displaceEach(equations, t, q, u, evaluate), scales.step, middle,
                  listColumns(equations, graph, firstBlock, derivative, noteKinks, kinks), terms,
                  scales.originDistance);
    equations.realize(t, q.data(), u.data());
    return derivative;
}

BlockMatrix<double> differentiateByU(Evaluation& equations, const CoordinateScales& scales,
                                     const BlockGraph& graph, const SolutionPoint& point,
                                     const std::function<void()>& observer, KinkedSpeeds* kinks,
                                     const VectorXd& terms) {
    const auto evaluate = [&](const std::vector<double>& u, VectorXd& r) {
        if (observer) observer();
        equations.realize(point.t, point.q.data(), u.data());
        equations.calcResidual(point.q.data(), u.data(), point.uDot.data(), point.lambda.data(),
                               r.data());
    };
    VectorXd middle(equations.getTopology().numU);
    evaluate(point.u, middle);
    std::vector<double> steps = scales.step;
    for (size_t i = 0; i < steps.size(); ++i) steps[i] *= scales.rate[i];
    BlockMatrix<double> D(graph);
    differentiate(quicken(point.u, evaluate), steps, middle,
                  listColumns(equations, graph, 0, D, noteJumps, kinks), terms,
                  scales.originDistance);
    equations.realize(point.t, point.q.data(), point.u.data());
    return D;
}

MatrixXd calcDampingMatrix(Evaluation& equations, const CoordinateScales& scales,
                           const SolutionPoint& point, KinkedSpeeds* kinks, const VectorXd& terms) {
    const int n = equations.getTopology().numU;
    double fastest = 0;  // rate of the fastest block [1/s]
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        if (scales.lengths[size_t(b)] > 0)
            fastest = std::max(fastest, block.calcDisplacement(point.u.data() + block.firstU) /
                                            scales.lengths[size_t(b)]);
    }
    const auto evaluate = [&](const std::vector<double>& u, VectorXd& r) {
        equations.realize(point.t, point.q.data(), u.data());
        equations.calcResidual(point.q.data(), u.data(), point.uDot.data(), point.lambda.data(),
                               r.data());
    };
    VectorXd middle(n);
    evaluate(point.u, middle);
    std::vector<double> steps = scales.step;
    for (size_t i = 0; i < steps.size(); ++i) steps[i] *= std::max(scales.rate[i], fastest);
    MatrixXd D = MatrixXd::Zero(n, n);
    differentiate(quicken(point.u, evaluate), steps, middle,
                  listColumns(equations, D, noteJumps, kinks), terms, scales.originDistance);
    equations.realize(point.t, point.q.data(), point.u.data());
    return D;
}

StateTangent calcStateTangent(Evaluation& equations, const CoordinateScales& scales,
                              const SolutionPoint& point, KinkedSpeeds* kinks) {
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
    const auto ofPlaces = [&](const std::vector<double>& q, VectorXd& f) {
        f = calcRates(q, point.u);
    };
    differentiate(displaceEach(equations, point.t, point.q, point.u, ofPlaces), scales.step,
                  tangent.rates, listColumns(equations, tangent.C, noteJumps, kinks), {},
                  scales.originDistance);
    const auto ofSpeeds = [&](const std::vector<double>& u, VectorXd& f) {
        f = calcRates(point.q, u);
    };
    std::vector<double> steps = scales.step;
    for (size_t i = 0; i < steps.size(); ++i) steps[i] *= scales.rate[i];
    differentiate(quicken(point.u, ofSpeeds), steps, tangent.rates,
                  listColumns(equations, tangent.E, noteJumps, kinks), {}, scales.originDistance);

    std::vector<double> z = point.z, zSteps;
    std::vector<std::vector<DifferenceColumn>> columns;
    for (Eigen::Index j = 0; j < s; ++j) {
        const size_t i = size_t(tangent.states[size_t(j)]);
        const double scale = topology.states[i - size_t(topology.firstZ)].equation->getScale();
        zSteps.push_back(CoordinateScales::StepFraction * std::max(scale, std::abs(z[i])));
        columns.push_back(
            {{int(j),
              {{0, int(s + n)}},
              [&tangent, j, s, n, kinks](const VectorXd& slopes, const std::vector<Kink>& found) {
                  tangent.F.col(j) = slopes.head(s);
                  tangent.B.col(j) = slopes.tail(n);
                  if (kinks) noteJumps(-1, found, *kinks);
              }}});
    }
    const auto ofStates = [&](const std::vector<double>& delta, VectorXd& f) {
        for (Eigen::Index j = 0; j < s; ++j) {
            const size_t i = size_t(tangent.states[size_t(j)]);
            z[i] = point.z[i] + delta[size_t(j)];
        }
        equations.setZ(z.data());
        f.resize(s + n);
        f.head(s) = calcRates(point.q, point.u);
        equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(),
                               point.lambda.data(), f.data() + s);
    };
    VectorXd middle;
    ofStates(std::vector<double>(size_t(s), 0), middle);
    differentiate(ofStates, zSteps, middle, columns);
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
        // ω is expressed in the body.
        const double* omega = &point.u[size_t(block.firstU)];
        A.back().topLeftCorner<3, 3>() << 0, -omega[2], omega[1], omega[2], 0, -omega[0], -omega[1],
            omega[0], 0;
    }
    // Differences all rigid trees at once: N of each depends on its own q.
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
        // Time in which it moves by StepFraction of its size.
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
    // Derivative of N(q)u along N(q)v. h: step by coordinate; 0: none.
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
