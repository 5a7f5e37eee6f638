#include "simflex/solver/Linearization.h"

#include <algorithm>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/NumberText.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/equilibrium/BlockTangent.h"
#include "simflex/solver/equilibrium/ModeReport.h"
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

/** Relative rank tolerance of the constraints that carry missing forces. **/
constexpr double SettlingRank = 1e-10;

/** The equations at one moment of the motion, in the solver's numbering. **/
struct Instant : SteadyMotion::Balance {
    SolutionPoint point;
    SteadyMotion motion;
    MatrixXd D;
    MatrixXd speedsByQ, accelerationsByQ, accelerationsByU;
    StateTangent states;
};

/** Whether the motion has not yet deformed the bodies as it will. **/
bool isUnsettled(const Instant& instant) {
    if (instant.motion.isAtRest()) return false;
    const VectorXd uDot = Map<const VectorXd>(instant.point.uDot.data(), instant.M.rows());
    const VectorXd& more = instant.moreUDot;
    return more.dot(instant.M * more) > square(Steadiness::Settled) * uDot.dot(instant.M * uDot);
}

/** Computes accelerations and matrices at a point's t, q, u and z. **/
void linearize(Evaluation& equations, const CoordinateScales& scales, const State& state,
               const std::function<void()>& observer, Instant& instant) {
    SolutionPoint& point = instant.point;
    const size_t n = point.u.size();
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    step.calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);
    instant.motion = SteadyMotion(equations, state, point.t, point.q, point.u, point.q);

    instant.motion.addBesides(point.q, point.u, point.uDot);
    instant.moreUDot = instant.motion.getAccelerationsBesides();
    std::vector<double> u(n), uDot(n);

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
    KinkedSpeeds kinks;
    const VectorXd terms = calcInertiaChanges(equations, scales, point, instant.M.diagonal());
    const auto calcStiffness = [&] {
        return differentiateByQ(
            equations, scales, point.t, point.q, point.u,
            [&](const std::vector<double>& q, VectorXd& r) {
                if (observer) observer();
                instant.motion.calcSpeeds(q, u, uDot);
                equations.realize(point.t, q.data(), u.data());
                equations.calcResidual(q.data(), u.data(), uDot.data(), point.lambda.data(),
                                       r.data());
            },
            &kinks, terms);
    };
    instant.K = calcStiffness();
    if (isUnsettled(instant)) {
        // The motion has not yet deformed the bodies: takes the constraint forces that it will
        // cause, and the stiffness that these add.
        const VectorXd lambda = Map<const VectorXd>(point.lambda.data(), instant.G.rows()),
                       missing = instant.M * instant.moreUDot;
        Map<VectorXd>(point.uDot.data(), missing.size()) -= instant.moreUDot;
        instant.motion.dropAccelerationsBesides();
        for (int pass = 0; pass < Steadiness::NumSettlings; ++pass) {
            const VectorXd forces = missing - instant.K * instant.motion.calcDeparture(instant);
            if (lambda.size() > 0)
                Map<VectorXd>(point.lambda.data(), lambda.size()) =
                    lambda + solveLeastSquares(instant.G.transpose(), forces, SettlingRank);
            instant.K = calcStiffness();
        }
    }
    instant.D = calcDampingMatrix(equations, scales, point, &kinks, terms);
    instant.states = calcStateTangent(equations, scales, point, &kinks);
    if (kinks.any()) throw NoLinearForces(describeKinks(equations, scales, kinks));
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
                             instant.motion.calcSpeeds(q, u, uDot);
                             f.resize(Eigen::Index(2 * n));
                             f << Map<const VectorXd>(u.data(), Eigen::Index(n)),
                                 Map<const VectorXd>(uDot.data(), Eigen::Index(n)) / rate;
                         });
    const MatrixXd dX = derivatives.topRows(Eigen::Index(n));
    instant.speedsByQ = dX;
    instant.accelerationsByQ = rate * derivatives.bottomRows(Eigen::Index(n));
    instant.accelerationsByU = 2 * dX;
    const std::vector<MatrixXd> A = calcRateBlocks(equations, scales, point);
    for (int b = 0; b < topology.numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        instant.accelerationsByU.block(block.firstU, block.firstU, block.numU, block.numU) -=
            A[size_t(b)];
    }
    instant.D += instant.M * instant.accelerationsByU;
}

/** Writes all matrices into a result, with zeros in D, K, B, C and E for held speeds. **/
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

/** Returns small displacements as the motion carries them to a later instant. **/
MatrixXd calcCarried(Evaluation& equations, const CoordinateScales& scales, const Instant& now,
                     const Instant& later, double duration) {
    const int n = equations.getTopology().numU;
    const std::vector<int> free = listFreeSpeeds(equations);
    MatrixXd units = MatrixXd::Zero(n, Eigen::Index(free.size()));
    VectorXd steps(units.cols());
    for (size_t k = 0; k < free.size(); ++k) {
        units(free[k], Eigen::Index(k)) = 1;
        steps[Eigen::Index(k)] = scales.step[size_t(free[k])];
    }
    const MatrixXd ofFree = now.motion.carry(now.point.q, duration, later.point.q, units, steps);
    MatrixXd carried = MatrixXd::Zero(n, n);
    for (size_t k = 0; k < free.size(); ++k) carried.col(free[k]) = ofFree.col(Eigen::Index(k));
    later.motion.close(carried);
    return carried;
}

/** Frequencies above `lowest` [Hz], the highest first. **/
std::vector<Real> listFrequencies(const Linearization& linear, Real lowest) {
    std::vector<Real> frequencies;
    for (const Eigenmode& mode : calcEigenmodes(linear))
        if (mode.frequency > lowest) frequencies.insert(frequencies.begin(), mode.frequency);
    return frequencies;
}

/** Compares with the matrices a radian later; returns what differs, empty if nothing does. **/
std::string findUnsteadiness(Evaluation& equations, const CoordinateScales& scales,
                             const Instant& now, const MatrixXd& T, const Linearization& result,
                             const std::function<void()>& observer) {
    const double rate = now.motion.getRate();
    if (now.motion.isAtRest()) return "";
    const double lowest = 1e-3 * rate / (2 * Pi);
    const std::vector<Real> frequencies = listFrequencies(result, lowest);
    if (frequencies.empty() || rate < Steadiness::SmallTurn * 2 * Pi * frequencies.back())
        return "";

    std::string departure =
        now.motion.describeDeparture(scales, now.motion.calcDeparture(now), Steadiness::SmallGap);
    if (!departure.empty()) return departure;
    const double duration = 1 / rate;
    Instant later;
    SolutionPoint& point = later.point = now.point;
    now.motion.moveOn(point);
    std::vector<double> errors(point.lambda.size(), 0);
    equations.calcPositionErrors(errors.data());
    for (size_t k = 0; k < errors.size(); ++k)
        if (!(std::abs(errors[k]) <= Steadiness::SmallGap))
            return equations.getTopology().describeConstraint(int(k)) +
                   " does not let its bodies continue their present motion";
    linearize(equations, scales, result.state, observer, later);
    departure = later.motion.describeDeparture(scales, later.motion.calcDeparture(later),
                                               Steadiness::LaterGap);
    if (!departure.empty()) return departure;
    const MatrixXd carried = calcCarried(equations, scales, now, later, duration);

    VectorXd sizes = VectorXd::Zero(equations.getTopology().numU);
    for (const int i : listFreeSpeeds(equations)) sizes[i] = 1 / scales.metres[size_t(i)];
    const MatrixXd gaps = later.G * carried * sizes.asDiagonal() *
                          TangentSpace(now.G * sizes.asDiagonal()).getBasis();
    for (Eigen::Index k = 0; k < gaps.rows(); ++k)
        if (!(gaps.row(k).norm() <=
              Steadiness::SmallGap * (later.G.row(k) * sizes.asDiagonal()).norm()))
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
        if (change <= 2 * Steadiness::SmallChange * square(frequencies[k]) + square(lowest))
            continue;
        return describeChange(frequencies[k], others[k]);
    }
    return "";
}

}  // namespace

Linearization calcLinearization(const MultibodySystem& system, const State& state,
                                const std::function<void()>& observer) {
    const StandardArithmetic standard;
    requireTopology(system, state, "calcLinearization()");
    Linearization result;
    copyState(state, result.state);
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
        T.row(i).cwiseAbs().maxCoeff(&own);  // of the same mobilizer, which is held as a whole
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
    now.motion.moveOn(after);
    later.motion = SteadyMotion(equations, result.state, after.t, after.q, after.u, after.q);
    const MatrixXd carried = calcCarried(equations, scales, now, later, 1 / now.motion.getRate());
    equations.realize(after.t, after.q.data(), after.u.data());
    result.carried =
        toSimbody(calcSimbodyNumbering(equations, after.q.data()) * carried * T.transpose());
    result.later = result.state;
    equations.getBlocks().putIntoState(after.t, after.q.data(), after.u.data(), *result.later);
    system.realize(*result.later, Stage::Velocity);
    return result;
}

std::vector<std::string> listUnevenDamping(const MultibodySystem& system, const State& state) {
    const StandardArithmetic standard;
    State realized = copyState(state);
    system.realize(realized, Stage::Velocity);
    Evaluation equations(system, realized, Topology::Setting::Linearize);
    const Topology& topology = equations.getTopology();
    if (topology.elements.empty()) return {};
    std::vector<double> q(size_t(topology.numQ)), u(size_t(topology.numU)),
        z(size_t(topology.numZ));
    equations.getBlocks().getFromState(realized, q.data(), u.data());
    for (size_t i = 0; i < z.size(); ++i) z[i] = realized.getZ()[int(i)];
    equations.setZ(z.data());
    equations.realize(realized.getTime(), q.data(), u.data());
    std::vector<std::string> uneven;
    for (const KinkedElement& element : listKinkedElements(
             equations, CoordinateScales(equations.getBlocks()), MotionLevel::Velocity)) {
        if (element.isJump) continue;
        const char* unit = element.isForce ? " N s/m" : " N m s/rad";
        uneven.push_back(element.name + " (" +
                         writeGeneral(std::min(element.before, element.after), 4) + unit +
                         " one way, " + writeGeneral(std::max(element.before, element.after), 4) +
                         unit + " the other)");
    }
    return uneven;
}

EquationErrors calcEquationErrors(const MultibodySystem& system, const State& state,
                                  const Vector& uDot, const Vector& multipliers) {
    const StandardArithmetic standard;
    requireTopology(system, state, "calcEquationErrors()");
    State realized = copyState(state);
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
    State scratch = copyState(realized);
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
