#include "simflex/solver/equilibrium/BlockLinearization.h"

#include <omp.h>

#include <algorithm>

#include "simflex/solver/Linearization.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equilibrium/TangentElimination.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

BlockLinearization::BlockLinearization(const MultibodySystem& system, const State& state,
                                       std::function<void()> observer)
    : m_state(state),
      m_observer(std::move(observer)),
      m_equations((system.realize(m_state, Stage::Velocity), system), m_state,
                  Topology::Setting::Linearize),
      m_scales(m_equations.getBlocks()) {
    const Topology& topology = m_equations.getTopology();
    if (!topology.frictions.empty())
        m_obstacle = "joints have friction";
    else if (topology.hasCoupledStates)
        m_obstacle = "the system has states of its own";
    for (int row = 0; row < topology.firstFrictionRow; ++row)
        if (topology.getRowLevel(row) != MotionLevel::Position)
            m_obstacle = topology.describeConstraint(row) + " holds speeds or accelerations";
    if (!m_obstacle.empty()) return;
    m_equations.updBlocks().chooseNumThreads(omp_get_max_threads());
    m_start.resize(topology.numQ, topology.numU, topology.numMultipliers, topology.numZ);
    m_start.t = m_state.getTime();
    m_equations.getBlocks().getFromState(m_state, m_start.q.data(), m_start.u.data());
    for (size_t i = 0; i < m_start.z.size(); ++i) m_start.z[i] = m_state.getZ()[int(i)];
    m_equations.setZ(m_start.z.data());
    m_equations.prescribe(m_start.t, 0, nullptr, m_start.q.data(), m_start.u.data());
    accelerate(m_start);
    m_motion = SteadyMotion(m_equations, m_state, m_start.t, m_start.q, m_start.u, m_start.q);
    if (m_motion.isAtRest())
        for (int b = 0; b < topology.numBlocks(); ++b) {
            const Block& block = m_equations.getBlock(b);
            for (int i = block.firstU; i < block.firstU + block.numU; ++i)
                if (m_start.u[size_t(i)] != 0)
                    m_obstacle = "'" + block.name + "' moves, but does not turn";
        }
    m_graph.emplace(m_equations, m_motion.isLocal() ? BlockGraph::Links::OfJoints
                                                    : BlockGraph::Links::Everywhere);
}

void BlockLinearization::accelerate(SolutionPoint& point) {
    IntegratorStatistics statistics;
    ImplicitStep step(m_equations, statistics);
    step.calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
}

void BlockLinearization::calcNow(Instant& now) {
    now.point = m_start;
    now.motion = m_motion;
    linearize(now);
}

std::string BlockLinearization::calcLater(const Instant& now, Instant& later) {
    const Topology& topology = m_equations.getTopology();
    later.point = now.point;
    now.motion.moveOn(later.point);
    VectorXd errors(topology.numMultipliers);
    m_equations.calcPositionErrors(errors.data());
    for (Eigen::Index k = 0; k < errors.size(); ++k)
        if (!(std::abs(errors[k]) <= Steadiness::SmallGap))
            return topology.describeConstraint(int(k)) +
                   " does not let its bodies continue their present motion";
    accelerate(later.point);
    later.motion = SteadyMotion(m_equations, m_state, later.point.t, later.point.q, later.point.u,
                                later.point.q);
    if (later.motion.isAtRest()) return "a radian later it is at rest";
    if (now.motion.isLocal() && !later.motion.isLocal())
        return "a radian later its bodies no longer keep their twists";
    linearize(later);
    return "";
}

void BlockLinearization::measure(Instant& instant) const {
    const Topology& topology = m_equations.getTopology();
    const VectorXd stiffness = instant.K->getDiagonal(), inertia = instant.mass->getDiagonal();
    instant.softest = instant.stiffest = 0;
    for (int b = 0; b < topology.numFlexible; ++b) {
        const Block& block = m_equations.getBlock(b);
        for (int i = block.firstU + 6; i < block.firstU + block.numU; ++i)
            if (stiffness[i] > 0 && (instant.softest == 0 || stiffness[i] < instant.softest))
                instant.softest = stiffness[i];
    }
    for (Eigen::Index i = 0; i < stiffness.size(); ++i)
        if (!topology.isPrescribed[size_t(i)])
            instant.stiffest = std::max(instant.stiffest, std::abs(stiffness[i]) / inertia[i]);
    if (instant.softest == 0) instant.softest = instant.stiffest > 0 ? instant.stiffest : 1;
    instant.scale = VectorXd::Zero(stiffness.size());
    for (Eigen::Index i = 0; i < stiffness.size(); ++i)
        if (!topology.isPrescribed[size_t(i)])
            instant.scale[i] = 1 / std::sqrt(std::abs(stiffness[i]) + instant.softest * inertia[i]);
}

void BlockLinearization::linearize(Instant& instant) {
    const Topology& topology = m_equations.getTopology();
    const Eigen::Index n = topology.numU, m = topology.numMultipliers;
    SolutionPoint& point = instant.point;
    SteadyMotion& motion = instant.motion;
    std::vector<double> u(size_t(n), 0), uDot(size_t(n), 0);
    if (motion.isAtRest()) {
        instant.moreUDot = Map<const VectorXd>(point.uDot.data(), n);
        std::fill(point.uDot.begin(), point.uDot.end(), 0.0);
    } else {
        motion.addBesides(point.q, point.u, point.uDot);
        instant.moreUDot = motion.getAccelerationsBesides();
    }
    const auto evaluate = [&](const std::vector<double>& q, VectorXd& r) {
        observe();
        motion.calcSpeeds(q, u, uDot);
        m_equations.realize(point.t, q.data(), u.data());
        r.resize(n);
        m_equations.calcResidual(q.data(), u.data(), uDot.data(), point.lambda.data(), r.data());
    };
    VectorXd r;
    evaluate(point.q, r);
    instant.mass.emplace(m_equations);
    KinkedSpeeds kinks;
    const auto refuseKinks = [&] {
        if (!kinks.any()) return;
        m_equations.realize(point.t, point.q.data(), point.u.data());
        throw NoLinearForces(describeKinks(m_equations, m_scales, kinks));
    };
    const auto differentiate = [&] {
        instant.K.emplace(
            calcStiffness(m_equations, m_scales, *m_graph, *instant.mass, point, evaluate, &kinks));
        measure(instant);
    };
    differentiate();
    if (motion.isAtRest()) {
        bool isDamped = !topology.elements.empty() || topology.hasSimbodyForces();
        for (const FlexibleBlock* block : m_equations.getBlocks().flexible)
            isDamped = isDamped || !block->getDamping().isZero();
        if (isDamped)
            instant.D.emplace(calcDampingBlocks(m_equations, m_scales, *m_graph, *instant.mass,
                                                point, m_observer, &kinks));
        refuseKinks();
        return;
    }

    const VectorXd missing = instant.mass->multiply(instant.moreUDot),
                   all = instant.mass->multiply(Map<const VectorXd>(point.uDot.data(), n));
    if (instant.moreUDot.dot(missing) >
        square(Steadiness::Settled) * all.dot(Map<const VectorXd>(point.uDot.data(), n))) {
        // The motion has not yet deformed the bodies: takes the constraint forces that it will
        // cause, and the stiffness that these add.
        const std::vector<double> lambda = point.lambda;
        Map<VectorXd>(point.uDot.data(), n) -= instant.moreUDot;
        motion.dropAccelerationsBesides();
        for (int pass = 0; pass < Steadiness::NumSettlings; ++pass) {
            VectorXd delta, change;
            calcDeparture(instant, delta, change);
            for (Eigen::Index k = 0; k < m; ++k)
                point.lambda[size_t(k)] = lambda[size_t(k)] + change[k];
            differentiate();
        }
    }
    instant.D.emplace(calcDampingBlocks(m_equations, m_scales, *m_graph, *instant.mass, point,
                                        m_observer, &kinks));
    refuseKinks();
    const BlockMatrix<double> dX =
        differentiateByQ(m_equations, m_scales, *m_graph, point.t, point.q, point.u,
                         [&](const std::vector<double>& q, VectorXd& speeds) {
                             motion.calcSpeeds(q, u, uDot);
                             speeds = Map<const VectorXd>(u.data(), n);
                         });
    const std::vector<MatrixXd> A = calcRateBlocks(m_equations, m_scales, point);
    parallelFor(topology.numBlocks(), getNumThreads(), [&](int b) {
        for (size_t k = 0; k < m_graph->neighbours[size_t(b)].size(); ++k) {
            const int row = m_graph->neighbours[size_t(b)][k];
            MatrixXd rates = 2 * dX.columns[size_t(b)][k];
            if (row == b) rates -= A[size_t(b)];
            if (!rates.isZero(0))
                instant.D->columns[size_t(b)][k] += instant.mass->M[size_t(row)].expand() * rates;
        }
    });
}

void BlockLinearization::calcDeparture(const Instant& instant, VectorXd& delta,
                                       VectorXd& multipliers) const {
    const double inertia = square(instant.motion.getRate());
    TangentElimination<double> elimination(*m_graph, *instant.mass);
    elimination.setNumThreads(getNumThreads());
    // Springs and inertia resist; more inertia makes up for springs that the motion softens.
    double held = inertia;
    for (;; held *= 4) {
        BlockMatrix<double> A = *instant.K;
        A.addMass(*instant.mass, held);
        elimination.factor(A, instant.scale, TangentElimination<double>::Symmetry::Symmetric);
        if (elimination.countNegative() == 0 || held > 1e6 * inertia) break;
    }
    delta = instant.mass->multiply(instant.moreUDot);
    multipliers = VectorXd::Zero(m_equations.getTopology().numMultipliers);
    elimination.solve(delta, multipliers);
}

}  // namespace simflex
