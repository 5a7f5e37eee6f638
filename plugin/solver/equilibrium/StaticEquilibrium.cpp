#include "simflex/solver/StaticEquilibrium.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/body/Assembly.h"
#include "simflex/solver/equations/StateImage.h"
#include "simflex/solver/equilibrium/SteadyMotion.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double StepLimit = 0.3;  // of a body's size
constexpr double ZeroStiffness = 1e-12;
/** Of a force's parts: what the residual along a free motion may be by round-off. **/
constexpr double ZeroForce = 1e-9;
constexpr double SmallestLoadStep = 1.0 / 64;

/** @throws std::runtime_error naming a constraint that moves apart. **/
void refuseUnsteady(const Evaluation& equations, const std::vector<double>& u,
                    const std::vector<double>& errors) {
    double fastest = 0;
    for (const double speed : u) fastest = std::max(fastest, std::abs(speed));
    for (size_t k = 0; k < errors.size(); ++k) {
        if (std::abs(errors[k]) <= 1e-7 * (1 + fastest)) continue;
        std::ostringstream text;
        text << "the speeds of the State are not those of a steady motion: "
             << equations.getTopology().describeConstraint(int(k)) << " moves apart at "
             << errors[k] << " m/s or rad/s";
        throw std::runtime_error(text.str());
    }
}

}  // namespace

/** Newton's iteration of one system. **/
class StaticEquilibrium::Search {
public:
    Search(const StaticEquilibrium& settings, Evaluation& equations, const SolutionPoint& start,
           SteadyMotion motion)
        : m_settings(settings),
          m_equations(equations),
          m_scales(equations.getBlocks()),
          m_free(listFreeSpeeds(equations)),
          m_point(start),
          m_motion(std::move(motion)) {}

    /** Raises the loads to their full size. @throws as solve(). **/
    void run();

    const SolutionPoint& getPoint() const { return m_point; }
    std::vector<std::string> describeFreeMotions();
    int numIterations = 0, numLoadSteps = 0;

private:
    /** What a correction is made of: unknowns x = δ/s of free speeds. **/
    struct Tangent {
        VectorXd s;
        MatrixXd K;  ///< scaled
        MatrixXd G;  ///< scaled columns
        VectorXd r, g;
        StateTangent states;  ///< unscaled
    };

    bool converge(double fraction);
    Tangent calcTangent();
    void evaluate(const std::vector<double>& q, VectorXd& r);
    /** Steps downhill where the stiffness is not positive. **/
    VectorXd solveReduced(const MatrixXd& K, const VectorXd& f) const;
    double limitStep(const VectorXd& delta) const;
    /** Onto states that do not change, together with the motions Z y. @returns false if they are
    not determined. **/
    bool solveWithStates(const Tangent& tangent, const MatrixXd& Z, const VectorXd& onto,
                         const VectorXd& force, VectorXd& y, VectorXd& dz) const;
    VectorXd expand(const Tangent& tangent, const VectorXd& x) const;
    /** "'rod'" of the body that moves most in a motion δ. **/
    std::string nameMostMoved(const VectorXd& delta) const;
    /** Null space of the stiffness, as motions δ. **/
    std::vector<VectorXd> findFreeMotions(const Tangent& tangent) const;
    [[noreturn]] void fail(double fraction);

    const StaticEquilibrium& m_settings;
    Evaluation& m_equations;
    CoordinateScales m_scales;
    std::vector<int> m_free;
    SolutionPoint m_point;
    SteadyMotion m_motion;
    double m_fraction = 1;    ///< of the loads
    double m_forceScale = 0;  ///< largest part of any force so far, scaled as r
    double m_change = 0, m_error = 0;
    int m_worstBlock = 0, m_worstRow = -1;
    std::string m_reason;
};

void StaticEquilibrium::Search::run() {
    const SolutionPoint start = m_point;
    if (converge(1)) return;
    // From nothing in parts.
    const SolutionPoint stuck = m_point;
    m_point = start;
    double reached = 0, part = 0.5;
    while (reached < 1 && part >= SmallestLoadStep) {
        const SolutionPoint before = m_point;
        const double fraction = std::min(1.0, reached + part);
        if (converge(fraction)) {
            reached = fraction;
            part *= 1.5;
        } else {
            m_point = before;
            part *= 0.5;
        }
    }
    if (reached == 1) return;
    if (reached == 0) m_point = stuck;
    fail(reached);
}

void StaticEquilibrium::Search::evaluate(const std::vector<double>& q, VectorXd& r) {
    if (m_settings.m_observer) m_settings.m_observer();
    m_motion.calcSpeeds(q, m_point.u, m_point.uDot);
    std::vector<double>& moved = m_point.qDot;  // prescribed coordinates are where they are already
    moved = q;
    m_equations.prescribe(m_point.t, 0, nullptr, moved.data(), m_point.u.data());
    m_equations.realize(m_point.t, q.data(), m_point.u.data());
    r.resize(m_equations.getTopology().numU);
    m_equations.calcResidual(q.data(), m_point.u.data(), m_point.uDot.data(), m_point.lambda.data(),
                             r.data());
}

StaticEquilibrium::Search::Tangent StaticEquilibrium::Search::calcTangent() {
    const int n = int(m_free.size()), m = m_equations.getTopology().numMultipliers;
    MatrixXd K;
    Tangent tangent;
    {
        m_equations.realize(m_point.t, m_point.q.data(), m_point.u.data());
        const LoadTerms::Tangent ofLaws(m_equations.updLoads());
        tangent.states = calcStateTangent(m_equations, m_scales, m_point);
        K = differentiateByQ(m_equations, m_scales, m_point.t, m_point.q, m_point.u,
                             [&](const std::vector<double>& q, VectorXd& r) { evaluate(q, r); });
    }
    VectorXd r, withoutJoints, withoutLoads;
    std::vector<double> lambda(size_t(m), 0);
    std::swap(lambda, m_point.lambda);
    evaluate(m_point.q, withoutJoints);
    m_equations.updSimbody().setLoadFraction(0);
    evaluate(m_point.q, withoutLoads);
    m_equations.updSimbody().setLoadFraction(m_fraction);
    std::swap(lambda, m_point.lambda);
    evaluate(m_point.q, r);
    MatrixXd M, G;
    calcMassAndJacobian(m_equations, M, G);

    tangent.g.resize(m);
    m_equations.calcPositionErrors(tangent.g.data());
    tangent.s.resize(n);
    tangent.r.resize(n);
    tangent.K.resize(n, n);
    tangent.G.resize(m, n);
    // Rigid coordinates, which little may hold, are measured by what the softest mode resists.
    double softest = 0;
    for (int b = 0; b < m_equations.getTopology().numFlexible; ++b) {
        const Block& block = m_equations.getBlock(b);
        for (int i = block.firstU + 6; i < block.firstU + block.numU; ++i)
            if (K(i, i) > 0 && (softest == 0 || K(i, i) < softest)) softest = K(i, i);
    }
    for (int i : m_free)
        if (softest == 0 || m_equations.getTopology().numFlexible == 0)
            softest = std::max(softest, std::abs(K(i, i)) / M(i, i));
    if (softest == 0) softest = 1;
    const Map<const VectorXd> lambdas(m_point.lambda.data(), m);
    for (int i = 0; i < n; ++i) {
        const int own = m_free[size_t(i)];
        tangent.s[i] = 1 / std::sqrt(std::abs(K(own, own)) + softest * M(own, own));
        tangent.r[i] = tangent.s[i] * r[own];
        const double parts = std::abs(withoutLoads[own]) +
                             std::abs(withoutJoints[own] - withoutLoads[own]) +
                             G.col(own).cwiseAbs().dot(lambdas.cwiseAbs()) +
                             M(own, own) * square(m_motion.getRate()) *
                                 std::min(1.0, 1 / m_scales.metres[size_t(own)]);
        m_forceScale = std::max(m_forceScale, tangent.s[i] * parts);
        tangent.G.col(i) = tangent.s[i] * G.col(own);
    }
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            tangent.K(i, j) = tangent.s[i] * tangent.s[j] * K(m_free[size_t(i)], m_free[size_t(j)]);
    return tangent;
}

VectorXd StaticEquilibrium::Search::solveReduced(const MatrixXd& K, const VectorXd& f) const {
    const MatrixXd symmetric = 0.5 * (K + K.transpose());
    if (calcSmallestPivot(symmetric) > 100 * ZeroStiffness) return SquareSystem(K).solve(f);
    const SymmetricEigen eigen = calcSymmetricEigen(symmetric);
    const double allowed = ZeroForce * m_forceScale;
    VectorXd y = VectorXd::Zero(f.size());
    for (Eigen::Index k = 0; k < f.size(); ++k) {
        const double stiffness = eigen.values[k];
        const auto direction = eigen.vectors.col(k);
        const double force = direction.dot(f);
        const bool isZero = std::abs(stiffness) < ZeroStiffness;
        if (isZero && std::abs(force) <= allowed) continue;
        y += force / std::max(std::abs(stiffness), ZeroStiffness) * direction;
    }
    return y;
}

bool StaticEquilibrium::Search::solveWithStates(const Tangent& tangent, const MatrixXd& Z,
                                                const VectorXd& onto, const VectorXd& force,
                                                VectorXd& y, VectorXd& dz) const {
    const StateTangent& states = tangent.states;
    const Eigen::Index n = Z.cols(), s = states.F.rows();
    MatrixXd B(Eigen::Index(m_free.size()), s), C(s, Eigen::Index(m_free.size()));
    for (size_t i = 0; i < m_free.size(); ++i) {
        const double scale = tangent.s[Eigen::Index(i)];
        B.row(Eigen::Index(i)) = scale * states.B.row(m_free[i]);
        C.col(Eigen::Index(i)) = scale * states.C.col(m_free[i]);
    }
    MatrixXd A(n + s, n + s);
    A.topLeftCorner(n, n) = calcCongruent(Z, tangent.K);
    A.topRightCorner(n, s) = Z.transpose() * B;
    A.bottomLeftCorner(s, n) = C * Z;
    A.bottomRightCorner(s, s) = states.F;
    VectorXd b(n + s);
    b << Z.transpose() * force, -(states.rates + C * onto);
    VectorXd columns = VectorXd::Ones(n + s);
    for (Eigen::Index i = 0; i < n + s; ++i) {
        const double size = A.row(i).cwiseAbs().maxCoeff();
        if (!(size > 0)) return false;
        A.row(i) /= size;
        b[i] /= size;
    }
    for (Eigen::Index i = 0; i < n + s; ++i) {
        columns[i] = A.col(i).cwiseAbs().maxCoeff();
        if (!(columns[i] > 0)) return false;
        A.col(i) /= columns[i];
    }
    const SquareSystem system(A);
    if (!(system.getSmallestPivot() > ZeroStiffness)) return false;
    const VectorXd x = system.solve(b).cwiseQuotient(columns);
    y = x.head(n);
    dz = x.tail(s);
    return true;
}

VectorXd StaticEquilibrium::Search::expand(const Tangent& tangent, const VectorXd& x) const {
    VectorXd delta = VectorXd::Zero(m_equations.getTopology().numU);
    for (size_t i = 0; i < m_free.size(); ++i)
        delta[m_free[i]] = tangent.s[Eigen::Index(i)] * x[Eigen::Index(i)];
    return delta;
}

double StaticEquilibrium::Search::limitStep(const VectorXd& delta) const {
    double factor = 1;
    for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
        const Block& block = m_equations.getBlock(b);
        const double displacement = block.calcDisplacement(delta.data() + block.firstU);
        const double allowed =
            std::min(StepLimit * m_scales.lengths[size_t(b)], double(m_settings.m_maximumStep));
        if (displacement > allowed) factor = std::min(factor, allowed / displacement);
    }
    return factor;
}

bool StaticEquilibrium::Search::converge(double fraction) {
    m_fraction = fraction;
    m_equations.updSimbody().setLoadFraction(fraction);
    m_motion.setFactor(std::sqrt(fraction));
    for (int iteration = 0; iteration < m_settings.m_maximumIterations; ++iteration) {
        const Tangent tangent = calcTangent();
        ++numIterations;
        m_error = 0;
        for (Eigen::Index k = 0; k < tangent.g.size(); ++k)
            if (!(std::abs(tangent.g[k]) <= m_error)) {
                m_error = std::abs(tangent.g[k]);
                m_worstRow = int(k);
            }
        if (!tangent.r.allFinite() || !tangent.g.allFinite() || !tangent.K.allFinite()) {
            m_reason = "forces or positions are not finite numbers";
            return false;
        }
        // x = Y a + Z y: onto the joints, then along them.
        const TangentSpace space(tangent.G);
        const MatrixXd& Z = space.getBasis();
        const VectorXd onto = space.solveForMotion(-tangent.g);
        const VectorXd force = -(tangent.r + tangent.K * onto);
        VectorXd x = onto, y, dz = VectorXd::Zero(tangent.states.F.rows());
        if (dz.size() > 0) {
            if (!solveWithStates(tangent, Z, onto, force, y, dz)) {
                m_reason = "no values of the states keep them from changing";
                return false;
            }
            x += Z * y;
        } else if (Z.cols() > 0)
            x += Z * solveReduced(calcCongruent(Z, tangent.K), Z.transpose() * force);
        VectorXd delta = expand(tangent, x);
        m_change = m_equations.getBlocks().calcDisplacement(delta.data(), &m_worstBlock);
        const double factor = limitStep(delta);
        delta *= factor;
        const VectorXd deltaLambda =
            space.solveForMultipliers(-(tangent.r + factor * (tangent.K * x)));

        m_equations.realize(m_point.t, m_point.q.data(), m_point.u.data());
        m_equations.getBlocks().moveQ(delta.data(), m_point.q.data());
        m_equations.getBlocks().normalizeQ(m_point.q.data());
        for (size_t k = 0; k < m_point.lambda.size(); ++k)
            m_point.lambda[k] += deltaLambda[Eigen::Index(k)];
        double largestState = 0;
        for (Eigen::Index i = 0; i < dz.size(); ++i) {
            const int state = tangent.states.states[size_t(i)];
            m_point.z[size_t(state)] += factor * dz[i];
            const Topology& topology = m_equations.getTopology();
            const auto& equation = *topology.states[size_t(state - topology.firstZ)].equation;
            largestState = std::max(largestState, std::abs(dz[i]) / equation.getScale());
        }
        if (dz.size() > 0) m_equations.setZ(m_point.z.data());
        if (factor == 1 && largestState <= m_settings.m_tolerance &&
            m_change <= m_settings.m_tolerance && m_error <= m_settings.m_constraintTolerance) {
            ++numLoadSteps;
            VectorXd r;
            evaluate(m_point.q, r);
            return true;
        }
    }
    m_reason = "it does not converge within " + std::to_string(m_settings.m_maximumIterations) +
               " iterations";
    return false;
}

std::vector<VectorXd> StaticEquilibrium::Search::findFreeMotions(const Tangent& tangent) const {
    const TangentSpace space(tangent.G);
    const MatrixXd& Z = space.getBasis();
    std::vector<VectorXd> motions;
    if (Z.cols() == 0) return motions;
    const MatrixXd K = calcCongruent(Z, tangent.K);
    const SymmetricEigen eigen = calcSymmetricEigen(0.5 * (K + K.transpose()));
    for (Eigen::Index k = 0; k < K.rows(); ++k)
        if (std::abs(eigen.values[k]) < ZeroStiffness)
            motions.push_back(expand(tangent, Z * eigen.vectors.col(k)));
    return motions;
}

std::string StaticEquilibrium::Search::nameMostMoved(const VectorXd& delta) const {
    int worst = 0;
    m_equations.getBlocks().calcDisplacement(delta.data(), &worst);
    return "'" + m_equations.getBlock(worst).name + "'";
}

std::vector<std::string> StaticEquilibrium::Search::describeFreeMotions() {
    std::vector<std::string> names;
    for (const VectorXd& motion : findFreeMotions(calcTangent()))
        names.push_back(nameMostMoved(motion) + " is free to move");
    return names;
}

void StaticEquilibrium::Search::fail(double fraction) {
    m_fraction = 1;
    m_equations.updSimbody().setLoadFraction(1);
    m_motion.setFactor(1);
    std::ostringstream text;
    text << "no static equilibrium: ";
    const Tangent tangent = calcTangent();
    if (tangent.K.allFinite() && tangent.r.allFinite())
        for (const VectorXd& motion : findFreeMotions(tangent)) {
            double force = 0;
            for (size_t i = 0; i < m_free.size(); ++i)
                force +=
                    motion[m_free[i]] / tangent.s[Eigen::Index(i)] * tangent.r[Eigen::Index(i)];
            if (std::abs(force) <= 1e-6 * m_forceScale) continue;
            text << nameMostMoved(motion)
                 << " is free to move and loads act along that motion; hold it by a joint or lock, "
                    "or give it a spring";
            throw std::runtime_error(text.str());
        }
    text << m_reason << "; the largest correction is " << m_change << " m at '"
         << m_equations.getBlock(m_worstBlock).name << "' (allowed " << m_settings.m_tolerance
         << " m)";
    if (m_worstRow >= 0)
        text << ", the largest joint error " << m_error << " at "
             << m_equations.getTopology().describeConstraint(m_worstRow) << " (allowed "
             << m_settings.m_constraintTolerance << ")";
    if (fraction > 0) text << "; " << 100 * fraction << " % of the loads could be applied";
    text << "; start closer to the equilibrium: a damped motion leads there";
    throw std::runtime_error(text.str());
}

State StaticEquilibrium::assemble(const State& state) const {
    State start = makeFreshState(m_system, state);
    m_system.realize(start, Stage::Velocity);
    State held = start;
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (MobilizedBodyIndex index : m_held) matter.getMobilizedBody(index).lock(held);
    simflex::assemble(m_system, held, m_constraintTolerance);
    start.updQ() = held.getQ();
    m_system.realize(start, Stage::Velocity);
    return start;
}

void StaticEquilibrium::solve(const State& state) {
    run(state, Speeds::Zero);
}

void StaticEquilibrium::solveSteadyMotion(const State& state) {
    run(state, Speeds::OfState);
}

void StaticEquilibrium::run(const State& state, Speeds speeds) {
    const StandardArithmetic standard;
    requireTopology(m_system, state, "StaticEquilibrium::solve()");
    m_numIterations = m_numLoadSteps = 0;
    m_freeMotions.clear();
    State start = state;
    m_system.realize(start, Stage::Velocity);
    if (speeds == Speeds::Zero) start.updU() = 0;
    // Assembled bodies stand elsewhere, but their twists are the State's.
    const State assembled = assemble(start);
    m_system.realize(start, Stage::Velocity);
    Evaluation equations(m_system, assembled);
    SolutionPoint point;
    point.resize(equations.getTopology().numQ, equations.getTopology().numU,
                 equations.getTopology().numMultipliers, equations.getTopology().numZ);
    point.t = assembled.getTime();
    equations.getBlocks().getFromState(assembled, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = assembled.getZ()[int(i)];
    equations.setZ(point.z.data());
    SteadyMotion motion;
    if (speeds == Speeds::OfState && !equations.getTopology().listOwnStates().empty())
        throw std::invalid_argument(
            "no steady motion is looked for in a system with states of its own; let a motion "
            "settle");
    if (speeds == Speeds::OfState) {
        std::vector<double> given = point.q;
        equations.getBlocks().getFromState(start, given.data(), point.u.data());
        equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
        motion = SteadyMotion(equations, start, point.t, given, point.u, point.q);
        refuseUnsteady(equations, point.u, motion.getErrors());
    }
    equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());

    Search search(*this, equations, point, motion);
    search.run();
    m_numIterations = search.numIterations;
    m_numLoadSteps = search.numLoadSteps;
    m_freeMotions = search.describeFreeMotions();

    // Multipliers of least norm, as the integrators give them.
    point = search.getPoint();
    const int n = equations.getTopology().numU, m = equations.getTopology().numMultipliers;
    if (speeds == Speeds::OfState) {
        std::vector<double> errors(size_t(m), 0);
        equations.calcVelocityErrors(errors.data());
        refuseUnsteady(equations, point.u, errors);
    }
    m_multipliers.resize(m);
    if (m > 0) {
        MatrixXd M, G;
        calcMassAndJacobian(equations, M, G);
        VectorXd r(n);
        std::fill(point.lambda.begin(), point.lambda.end(), 0.0);
        equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(),
                               point.lambda.data(), r.data());
        const VectorXd lambda = solveLeastSquares(G.transpose(), -r, 1e-10);
        for (int k = 0; k < m; ++k) m_multipliers[k] = lambda[k];
    }
    m_firstRows.clear();
    if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system))
        for (JointIndex j(0); j < flexible->getNumJoints(); ++j)
            m_firstRows.push_back(equations.getTopology().findFirstRow(j));
    m_state = makeFreshState(m_system, state);
    equations.getBlocks().putIntoState(point.t, point.q.data(), point.u.data(), m_state);
    for (size_t i = 0; i < point.z.size(); ++i) m_state.updZ()[int(i)] = point.z[i];
    m_system.realize(m_state, Stage::Velocity);
}

Vector StaticEquilibrium::getMultipliers(const Joint& joint) const {
    const int first = m_firstRows.at(size_t(joint.getIndex())), count = joint.getNumEquations();
    Vector multipliers(count, 0.0);
    for (int k = 0; k < count && first >= 0; ++k) multipliers[k] = m_multipliers[first + k];
    return multipliers;
}

void setSteadyRotation(const MultibodySystem& system, State& state, const Vec3& omega_G,
                       const Vec3& point_G) {
    const StandardArithmetic standard;
    const SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    system.realize(state, Stage::Position);
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (!MobilizedBody::Free::isInstanceOf(mobod) ||
            mobod.getParentMobilizedBody().getMobilizedBodyIndex() != GroundIndex)
            continue;
        system.realize(state, Stage::Position);
        const Vec3 p = mobod.getBodyOriginLocation(state);
        mobod.setUToFitVelocity(state, SpatialVec(omega_G, omega_G % (p - point_G)));
    }
}

}  // namespace simflex
