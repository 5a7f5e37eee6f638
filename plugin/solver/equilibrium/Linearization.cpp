#include "simflex/solver/Linearization.h"

#include <algorithm>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/equilibrium/SimbodyMatrix.h"
#include "simflex/solver/equilibrium/SimbodyNumbering.h"
#include "simflex/solver/equilibrium/SteadyMotion.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** A motion that turns by less than this in a radian of the slowest mode is as good as at rest. **/
constexpr double SmallTurn = 5e-3;
/** How much frequencies may change, of themselves, with the mean of matrices a radian apart. **/
constexpr double SmallChange = 1e-3;
/** How far constraints may come apart meanwhile, of a body's size, and per displacement. **/
constexpr double SmallGap = 1e-3;
/** Accelerations besides those of the motion, of all, that count as none; how often forces and
stiffness are settled by each other, and the rank of constraints. **/
constexpr double Settled = 1e-5, SettlingRank = 1e-10;
constexpr int NumSettlings = 2;
/** How far forces that do not turn along may lead, of a body's size: an unbalance does. **/
constexpr double LaterGap = 5e-3;

/** The equations at one moment of the motion, in the solver's numbering. **/
struct Instant : SteadyMotion::Balance {
    SolutionPoint point;
    SteadyMotion motion;
    MatrixXd D;
    MatrixXd speedsByQ, accelerationsByQ, accelerationsByU;
    StateTangent states;
};

/** Whether bodies do not yet bend as the motion will bend them. **/
bool isUnsettled(const Instant& instant) {
    if (instant.motion.isAtRest()) return false;
    const VectorXd uDot = Map<const VectorXd>(instant.point.uDot.data(), instant.M.rows());
    const VectorXd& more = instant.moreUDot;
    return more.dot(instant.M * more) > square(Settled) * uDot.dot(instant.M * uDot);
}

/** Accelerations and matrices at a point's t, q, u and z. **/
void linearize(Evaluation& equations, const CoordinateScales& scales, const State& state,
               const std::function<void()>& observer, Instant& instant) {
    SolutionPoint& point = instant.point;
    const size_t n = point.u.size();
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    step.calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
    instant.motion = SteadyMotion(equations, state, point.t, point.q, point.u, point.q);

    // What the State has besides the steady motion stays as it is in Simbody's axes.
    std::vector<double> u(n), uDot(n);
    instant.motion.calcSpeeds(point.q, u, uDot);
    std::vector<double> moreU(n), moreUDot(n);
    for (size_t i = 0; i < n; ++i) {
        moreU[i] = point.u[i] - u[i];
        moreUDot[i] = point.uDot[i] - uDot[i];
    }
    instant.moreUDot = Map<const VectorXd>(moreUDot.data(), Eigen::Index(n));
    const auto calcSpeeds = [&](const std::vector<double>& q) {
        instant.motion.calcSpeeds(q, u, uDot);
        for (size_t i = 0; i < n; ++i) {
            u[i] += moreU[i];
            uDot[i] += moreUDot[i];
        }
        for (int b = 0; b < equations.getTopology().numFlexible; ++b) {
            const size_t q0 = size_t(equations.getBlock(b).firstQ),
                         u0 = size_t(equations.getBlock(b).firstU);
            const Rotation turn = ~rotationOf(&q[q0]) * rotationOf(&point.q[q0]);
            for (const auto& [total, more] : {std::pair(&u, &moreU), std::pair(&uDot, &moreUDot)}) {
                const Vec3 fixed = Vec3::getAs(more->data() + u0);
                Vec3::updAs(total->data() + u0) += turn * fixed - fixed;
            }
        }
    };

    const Topology& topology = equations.getTopology();
    for (int k = 0; k < int(topology.frictions.size()); ++k)
        if (equations.getFrictions().isSliding(k))
            throw std::invalid_argument(
                "calcLinearization(): " +
                topology.describeConstraint(topology.frictions[size_t(k)].firstRow) +
                " slides, or begins to: only what sticks can be linearised, where it is held; let "
                "it come to rest, or leave the friction out");
    equations.realize(point.t, point.q.data(), point.u.data());
    equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(), point.lambda.data(),
                           VectorXd(equations.getTopology().numU).data());
    calcMassAndJacobian(equations, instant.M, instant.G);
    const LoadTerms::Tangent tangent(equations.updLoads());
    const auto calcStiffness = [&] {
        return differentiateByQ(equations, scales, point.t, point.q, point.u,
                                [&](const std::vector<double>& q, VectorXd& r) {
                                    if (observer) observer();
                                    calcSpeeds(q);
                                    equations.realize(point.t, q.data(), u.data());
                                    equations.calcResidual(q.data(), u.data(), uDot.data(),
                                                           point.lambda.data(), r.data());
                                });
    };
    instant.K = calcStiffness();
    if (isUnsettled(instant)) {
        // Forces that the motion has yet to spread through the bodies: those that it will have.
        const VectorXd lambda = Map<const VectorXd>(point.lambda.data(), instant.G.rows()),
                       missing = instant.M * instant.moreUDot;
        for (size_t i = 0; i < n; ++i) {
            point.uDot[i] -= moreUDot[i];
            moreUDot[i] = 0;
        }
        for (int pass = 0; pass < NumSettlings; ++pass) {
            const VectorXd forces = missing - instant.K * instant.motion.calcDeparture(instant);
            if (lambda.size() > 0)
                Map<VectorXd>(point.lambda.data(), lambda.size()) =
                    lambda + solveLeastSquares(instant.G.transpose(), forces, SettlingRank);
            instant.K = calcStiffness();
        }
    }
    instant.D = calcDampingMatrix(equations, scales, point);
    instant.states = calcStateTangent(equations, scales, point);
    if (instant.motion.isAtRest()) return;
    if (!instant.states.states.empty())
        throw std::invalid_argument(
            "calcLinearization(): the system moves, and has states of its own, such as '" +
            equations.getTopology()
                .states[size_t(instant.states.states[0] - equations.getTopology().firstZ)]
                .equation->getName() +
            "': only what is at rest can be linearised with them");
    const double rate = instant.motion.getRate();
    const MatrixXd derivatives =
        differentiateByQ(equations, scales, point.t, point.q, point.u,
                         [&](const std::vector<double>& q, VectorXd& f) {
                             if (observer) observer();
                             calcSpeeds(q);
                             f.resize(Eigen::Index(2 * n));
                             f << Map<const VectorXd>(u.data(), Eigen::Index(n)),
                                 Map<const VectorXd>(uDot.data(), Eigen::Index(n)) / rate;
                         });
    const MatrixXd dX = derivatives.topRows(Eigen::Index(n));
    instant.speedsByQ = dX;
    instant.accelerationsByQ = rate * derivatives.bottomRows(Eigen::Index(n));
    instant.accelerationsByU = 2 * dX - calcRateMatrix(equations, scales, point);
    instant.D += instant.M * instant.accelerationsByU;
}

/** Writes M, D, K and G into a result, with zeroes for what is held. **/
void putMatrices(const Instant& instant, const MatrixXd& T, Linearization& result) {
    MatrixXd D = T * instant.D * T.transpose(), K = T * instant.K * T.transpose(),
             B = T * instant.states.B, C = instant.states.C * T.transpose(),
             E = instant.states.E * T.transpose();
    for (Eigen::Index i = 0; i < D.rows(); ++i) {
        if (!result.isHeld[unsigned(i)]) continue;
        B.row(i).setZero();
        C.col(i).setZero();
        E.col(i).setZero();
        for (MatrixXd* matrix : {&D, &K}) {
            matrix->row(i).setZero();
            matrix->col(i).setZero();
        }
    }
    result.M = toSimbody(T * instant.M * T.transpose());
    result.D = toSimbody(D);
    result.K = toSimbody(K);
    result.G = toSimbody(instant.G * T.transpose());
    result.B = toSimbody(B);
    result.C = toSimbody(C);
    result.E = toSimbody(E);
    result.F = toSimbody(instant.states.F);
    if (instant.motion.isAtRest()) return;
    result.speedsByQ = toSimbody(T * instant.speedsByQ * T.transpose());
    result.accelerationsByQ = toSimbody(T * instant.accelerationsByQ * T.transpose());
    result.accelerationsByU = toSimbody(T * instant.accelerationsByU * T.transpose());
}

/** Small displacements of the motion, as the motion carries them to where it is later. **/
MatrixXd calcCarried(Evaluation& equations, const CoordinateScales& scales, const Instant& now,
                     const Instant& later, double duration) {
    const int n = equations.getTopology().numU;
    const std::vector<double>&q = now.point.q, &laterQ = later.point.q;
    const double t = now.point.t;
    const auto carry = [&](int column, double h) {
        std::vector<double> delta(size_t(n), 0), moved = q;
        delta[size_t(column)] = h;
        if (equations.getTopology().needsSimbody)
            equations.realize(t, q.data(), now.point.u.data());
        equations.getBlocks().moveQ(delta.data(), moved.data());
        moved = now.motion.flow(moved, duration);
        for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
            const Block& block = equations.getBlock(b);
            block.alignQ(&laterQ[size_t(block.firstQ)], &moved[size_t(block.firstQ)]);
        }
        return VectorXd(Map<const VectorXd>(moved.data(), equations.getTopology().numQ));
    };
    MatrixXd changes = MatrixXd::Zero(equations.getTopology().numQ, n),
             N(equations.getTopology().numQ, n);
    for (const int column : listFreeSpeeds(equations)) {
        const double h = scales.step[size_t(column)];
        changes.col(column) = (carry(column, h) - carry(column, -h)) / (2 * h);
    }
    std::vector<double> unit(size_t(n), 0);
    equations.realize(t, laterQ.data(), unit.data());
    for (int i = 0; i < n; ++i) {
        unit[size_t(i)] = 1;
        equations.getBlocks().calcQDot(laterQ.data(), unit.data(), N.col(i).data());
        unit[size_t(i)] = 0;
    }
    MatrixXd carried = solveLeastSquares(N, changes);
    later.motion.close(carried);
    return carried;
}

/** Whether motions that constraints allow are other ones where they are carried to. **/
bool turnsMotions(const Linearization& linear, const MatrixXd& carried, const MatrixXd& G) {
    constexpr double Turned = 0.1;
    VectorXd metres = VectorXd::Zero(carried.rows()), sizes = metres;
    for (int i = 0; i < int(sizes.size()); ++i) {
        if (linear.isHeld[unsigned(i)] || !(linear.metres[i] > 0)) continue;
        metres[i] = linear.metres[i];
        sizes[i] = 1 / metres[i];
    }
    const MatrixXd motions = TangentSpace(G * sizes.asDiagonal()).getBasis();
    if (motions.cols() == 0) return false;
    const MatrixXd change =
        metres.asDiagonal() * (carried * (sizes.asDiagonal() * motions)) - motions;
    return change.colwise().norm().maxCoeff() > Turned;
}

/** Frequencies of what moves back and forth, the highest first. **/
std::vector<Real> listFrequencies(const Linearization& linear, Real lowest) {
    std::vector<Real> frequencies;
    for (const Eigenmode& mode : calcEigenmodes(linear))
        if (mode.frequency > lowest) frequencies.insert(frequencies.begin(), mode.frequency);
    return frequencies;
}

/** Whether time itself turns the system. **/
bool isDriven(Evaluation& equations, const SolutionPoint& point) {
    for (int i = 0; i < equations.getTopology().numU; ++i)
        if (equations.getTopology().isPrescribed[size_t(i)] && point.u[size_t(i)] != 0) return true;
    const std::vector<double> none(point.u.size(), 0);
    std::vector<double> errors(point.lambda.size(), 0);
    equations.realize(point.t, point.q.data(), none.data());
    equations.calcVelocityErrors(errors.data());
    return std::any_of(errors.begin(), errors.end(), [](double error) { return error != 0; });
}

/** Where the motion is a radian later. **/
void moveOn(Evaluation& equations, const SteadyMotion& motion, SolutionPoint& point) {
    const double duration = 1 / motion.getRate();
    if (isDriven(equations, point)) point.t += duration;
    point.q = motion.flow(point.q, duration);
    motion.calcSpeeds(point.q, point.u, point.uDot);
    equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    equations.realize(point.t, point.q.data(), point.u.data());
}

/** Compares with the matrices a radian later. **/
std::string findUnsteadiness(Evaluation& equations, const CoordinateScales& scales,
                             const Instant& now, const MatrixXd& T, const Linearization& result,
                             const std::function<void()>& observer) {
    const double rate = now.motion.getRate();
    if (now.motion.isAtRest()) return "";
    const double lowest = 1e-3 * rate / (2 * Pi);
    const std::vector<Real> frequencies = listFrequencies(result, lowest);
    if (frequencies.empty() || rate < SmallTurn * 2 * Pi * frequencies.back()) return "";

    std::string departure = now.motion.findDeparture(scales, now, SmallGap);
    if (!departure.empty()) return departure;
    const double duration = 1 / rate;
    Instant later;
    SolutionPoint& point = later.point = now.point;
    moveOn(equations, now.motion, point);
    std::vector<double> errors(point.lambda.size(), 0);
    equations.calcPositionErrors(errors.data());
    for (size_t k = 0; k < errors.size(); ++k)
        if (!(std::abs(errors[k]) <= SmallGap))
            return equations.getTopology().describeConstraint(int(k)) +
                   " does not let its bodies continue their present motion";
    linearize(equations, scales, result.state, observer, later);
    departure = later.motion.findDeparture(scales, later, LaterGap);
    if (!departure.empty()) return departure;
    const MatrixXd carried = calcCarried(equations, scales, now, later, duration);

    VectorXd sizes = VectorXd::Zero(equations.getTopology().numU);
    for (const int i : listFreeSpeeds(equations)) sizes[i] = 1 / scales.metres[size_t(i)];
    const MatrixXd gaps = later.G * carried * sizes.asDiagonal() *
                          TangentSpace(now.G * sizes.asDiagonal()).getBasis();
    for (Eigen::Index k = 0; k < gaps.rows(); ++k)
        if (!(gaps.row(k).norm() <= SmallGap * (later.G.row(k) * sizes.asDiagonal()).norm()))
            return equations.getTopology().describeConstraint(int(k)) +
                   " does not let displaced bodies continue their present motion";

    Instant mean = now;
    mean.M = 0.5 * (now.M + calcCongruent(carried, later.M));
    mean.D = 0.5 * (now.D + calcCongruent(carried, later.D));
    mean.K = 0.5 * (now.K + calcCongruent(carried, later.K));
    Linearization between = result;
    putMatrices(mean, T, between);
    const std::vector<Real> others = listFrequencies(between, lowest);
    for (size_t k = 0; k < std::min(frequencies.size(), others.size()); ++k) {
        const double change = std::abs(square(others[k]) - square(frequencies[k]));
        if (change <= 2 * SmallChange * square(frequencies[k]) + square(lowest)) continue;
        std::ostringstream text;
        text << "the equations of small motions change as the motion goes on: a natural frequency "
                "of "
             << frequencies[k] << " Hz is " << others[k]
             << " Hz with the mean of their coefficients over a radian";
        return text.str();
    }
    return "";
}

}  // namespace

Linearization calcLinearization(const MultibodySystem& system, const State& state,
                                const std::function<void()>& observer) {
    const StandardArithmetic standard;
    requireTopology(system, state, "calcLinearization()");
    Linearization result;
    result.state = state;
    system.realize(result.state, Stage::Velocity);
    Evaluation equations(system, result.state, Topology::Setting::Linearize);
    for (int row = 0; row < equations.getTopology().firstFrictionRow; ++row)
        if (equations.getTopology().getRowLevel(row) != MotionLevel::Position)
            throw std::invalid_argument(
                "calcLinearization(): " + equations.getTopology().describeConstraint(row) +
                " holds speeds or accelerations; only constraints of "
                "positions can be linearised: disable it");

    Instant now;
    SolutionPoint& point = now.point;
    const int n = equations.getTopology().numU;
    point.resize(equations.getTopology().numQ, n, equations.getTopology().numMultipliers,
                 equations.getTopology().numZ);
    point.t = result.state.getTime();
    equations.getBlocks().getFromState(result.state, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = result.state.getZ()[int(i)];
    equations.setZ(point.z.data());
    equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    const CoordinateScales scales(equations.getBlocks());
    linearize(equations, scales, result.state, observer, now);

    result.isHeld.resize(unsigned(n), 0);
    result.isModal.resize(unsigned(n), 0);
    std::vector<char> isModal(size_t(n), 0);
    for (int b = 0; b < equations.getTopology().numFlexible; ++b) {
        const Block& block = equations.getBlock(b);
        std::fill_n(isModal.begin() + block.firstU + 6, block.numU - 6, char(1));
    }
    result.metres.resize(n);
    result.uDot.resize(n);
    const MatrixXd T = calcSimbodyNumbering(equations, point.q.data());
    const VectorXd uDot = T * Map<const VectorXd>(point.uDot.data(), n);
    for (int i = 0; i < n; ++i) {
        Eigen::Index own;
        T.row(i).cwiseAbs().maxCoeff(&own);  // one of its own mobilizer, held as a whole
        result.metres[i] = scales.metres[size_t(own)];
        result.uDot[i] = uDot[i];
        result.isModal[unsigned(i)] = isModal[size_t(own)];
        result.isHeld[unsigned(i)] = equations.getTopology().isPrescribed[size_t(own)];
    }
    result.multipliers.resize(equations.getTopology().numMultipliers);
    for (int k = 0; k < equations.getTopology().numMultipliers; ++k)
        result.multipliers[k] = point.lambda[size_t(k)];
    putMatrices(now, T, result);
    result.unsteady = findUnsteadiness(equations, scales, now, T, result, observer);
    if (now.motion.isAtRest()) return result;
    Instant later;
    SolutionPoint& after = later.point = now.point;
    moveOn(equations, now.motion, after);
    later.motion = SteadyMotion(equations, result.state, after.t, after.q, after.u, after.q);
    const MatrixXd carried = calcCarried(equations, scales, now, later, 1 / now.motion.getRate());
    equations.realize(after.t, after.q.data(), after.u.data());
    const MatrixXd inGround =
        calcSimbodyNumbering(equations, after.q.data()) * carried * T.transpose();
    result.carried = toSimbody(inGround);
    result.isSeenTurning = turnsMotions(result, inGround, now.G * T.transpose());
    result.later = result.state;
    equations.getBlocks().putIntoState(after.t, after.q.data(), after.u.data(), *result.later);
    system.realize(*result.later, Stage::Velocity);
    return result;
}

EquationErrors calcEquationErrors(const MultibodySystem& system, const State& state,
                                  const Vector& uDot, const Vector& multipliers) {
    const StandardArithmetic standard;
    requireTopology(system, state, "calcEquationErrors()");
    State realized = state;
    system.realize(realized, Stage::Velocity);
    Evaluation equations(system, realized, Topology::Setting::Linearize);
    const Topology& topology = equations.getTopology();
    const int n = topology.numU, m = topology.numMultipliers;
    if (uDot.size() != n || multipliers.size() != m)
        throw std::invalid_argument("calcEquationErrors(): the system has " + std::to_string(n) +
                                    " speeds and " + std::to_string(m) + " multipliers, not " +
                                    std::to_string(uDot.size()) + " and " +
                                    std::to_string(multipliers.size()));
    SolutionPoint point;
    point.resize(topology.numQ, n, m, topology.numZ);
    point.t = realized.getTime();
    equations.getBlocks().getFromState(realized, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = realized.getZ()[int(i)];
    equations.setZ(point.z.data());
    State scratch = realized;
    const VectorXd own = takeFromSimbody(equations, scratch, uDot);
    VectorXd residual(n);
    for (int k = 0; k < m; ++k) point.lambda[size_t(k)] = multipliers[k];
    equations.realize(point.t, point.q.data(), point.u.data());
    equations.calcResidual(point.q.data(), point.u.data(), own.data(), point.lambda.data(),
                           residual.data());
    EquationErrors errors{equations.getBlocks().calcSimbodyUDot(point.q.data(), residual.data()),
                          Vector(m), Vector(m), Vector()};
    std::vector<double> rows(size_t(m), 0);
    equations.calcPositionErrors(rows.data());
    for (int k = 0; k < m; ++k) errors.positions[k] = rows[size_t(k)];
    equations.calcVelocityErrors(rows.data());
    for (int k = 0; k < m; ++k) errors.velocities[k] = rows[size_t(k)];
    const std::vector<int> states = topology.listOwnStates();
    std::vector<double> zDot(point.z.size());
    if (!states.empty()) equations.updLoads().calcStateRates(zDot.data());
    errors.rates.resize(int(states.size()));
    for (size_t i = 0; i < states.size(); ++i) errors.rates[int(i)] = zDot[size_t(states[i])];
    return errors;
}

}  // namespace simflex
