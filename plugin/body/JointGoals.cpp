#include "simflex/body/JointGoals.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/StateCopy.h"

namespace simflex {

using namespace SimTK;

namespace {

constexpr Real ModalWeight = 1e3;      // factor of modal speeds if bodies must deform
constexpr Real LargestStep = 0.1;      // largest step of an angle [rad]
constexpr Real GoalTolerance = 1e-11;  // error of joints and coordinates [m, rad]
constexpr Real Conditioning = 1e-9;    // pivot threshold for dependent rows
constexpr Real RateTolerance = 1e-9;   // [m/s, rad/s]
constexpr Real Open = 1e-6;            // smallest joint error worth naming [m, rad]
constexpr int MostCorrections = 40;    // iterations beyond those needed for the way

enum class Bending { Held, Free };

Eigen::Map<const Eigen::VectorXd> viewVector(const Vector& vector) {
    return {&vector[0], vector.size()};
}

/** A State on its way to the goals. **/
class JointGuide {
public:
    JointGuide(const FlexibleBodySubsystem& bodies, const State& start,
               const std::vector<JointGoal>& goals, Bending bending, AngleWay angleWay)
        : m_bodies(bodies),
          m_system(bodies.getMultibodySystem()),
          m_matter(m_system.getMatterSubsystem()),
          m_goals(goals),
          m_bending(bending),
          m_state(copyState(start)),
          m_given(start.getU()) {
        bodies.closeJoints(m_state);
        copyState(m_state, m_closed);
        m_weights.resize(m_state.getNU());
        m_weights = 1;
        for (int b = 0; b < bodies.getNumBodies(); ++b) {
            const FlexibleBody body = bodies.getBody(FlexibleBodyIndex(b));
            size_t numModes = 0;
            for (int k = 0; k < body.getNumModalMobilizers(); ++k) {
                const MobilizedBody& mobod = body.getModalMobilizer(k);
                scale(mobod, bending == Bending::Held ? Infinity : ModalWeight);
                for (int i = 0; i < mobod.getNumU(m_state); ++i)
                    m_modes.push_back({int(mobod.getFirstUIndex(m_state)) + i,
                                       int(mobod.getFirstQIndex(m_state)) + i,
                                       body.getPart().omegaSquared[numModes++], 0});
            }
        }
        // Locked mobilizers and those with a Motion do not move.
        for (MobilizedBodyIndex i(1); i < m_matter.getNumBodies(); ++i) {
            const MobilizedBody& mobod = m_matter.getMobilizedBody(i);
            if (mobod.isLocked(m_state) ||
                (mobod.hasMotion() && !mobod.getMotion().isDisabled(m_state)))
                scale(mobod, Infinity);
        }
        for (Mode& mode : m_modes) mode.start = start.getQ()[mode.q];
        m_countsTurns = findTurnCounts();
        followTurns();
        for (size_t i = 0; i < goals.size(); ++i) {
            m_reached.push_back(calcCoordinate(i));
            const Real way = goals[i].value - m_reached[i];
            const bool isShorter =
                getKind(i).isPeriodic() && (angleWay == AngleWay::Shorter || !m_countsTurns);
            m_wanted.push_back(isShorter ? m_reached[i] + std::remainder(way, 2 * Pi)
                                         : goals[i].value);
        }
    }

    const State& getState() const { return m_state; }

    /** @returns false if the joints do not allow it. **/
    bool leadCoordinates() {
        Real tolerance = GoalTolerance, way = 0;
        for (const JointGoal& goal : m_goals)
            tolerance = std::max(tolerance, GoalTolerance * (1 + std::abs(goal.value)));
        const Vector whole = calcWay();
        for (size_t i = 0; i < m_goals.size(); ++i)
            way = std::max(way, std::abs(whole[int(i)]) / calcLongestStep(i, whole[int(i)]));
        const int mostSteps = MostCorrections + int(std::ceil(2 * way));
        // With held shapes, closing the joints must not have deformed the bodies.
        if (m_bending == Bending::Held && hasBent()) return false;
        if (m_bending == Bending::Free) weighStrain();
        m_isSettled = m_bending == Bending::Held || m_modes.empty();
        for (int step = 0; step < mostSteps; ++step) {
            Vector rest = calcWay();
            if (calcLargest(rest, rest.size()) < tolerance && calcLargestError() < GoalTolerance &&
                m_isSettled)
                return true;
            Real part = 1;
            for (size_t i = 0; i < m_goals.size(); ++i)
                if (std::abs(rest[int(i)]) > tolerance)
                    part =
                        std::min(part, calcLongestStep(i, whole[int(i)]) / std::abs(rest[int(i)]));
            rest *= part;
            move(rest);
            if (!std::isfinite(calcLargestError())) break;
        }
        return false;
    }

    /** @returns false if no such speeds exist. **/
    bool changeRates() {
        Real largestRate = 0;
        for (const JointGoal& goal : m_goals)
            largestRate = std::max(largestRate, std::abs(goal.value));
        const int m = m_state.getNUErr();
        const Vector nothing(m_state.getNU(), Real(0));
        // One impulse satisfies joints and goals.
        m_state.updU() = m_given;
        m_system.realize(m_state, Stage::Position);
        m_system.prescribeU(m_state);
        realize();
        for (int i = 0; i < 2; ++i) {
            m_state.updU() += solve(m, -m_state.getUErr(), calcRateErrors(), nothing);
            realize();
        }
        const Vector errors = calcRateErrors();
        for (size_t i = 0; i < m_goals.size(); ++i) {
            m_wanted[i] = m_goals[i].value;
            m_reached[i] = m_goals[i].value - errors[int(i)];
        }
        return std::max(calcLargest(m_state.getUErr(), m), calcLargest(errors, errors.size())) <
               RateTolerance * (1 + largestRate);
    }

    /** Describes a body deformed beyond its linear range, else returns "". **/
    std::string describeDeformation() const {
        return describeForcedDeformation(m_bodies, m_closed, m_state);
    }

    /** Returns the joint with the largest error or, if all are closed, that of the goal with the
    largest error. **/
    std::string findWorstJoint() const {
        size_t furthest = 0;
        for (size_t i = 1; i < m_goals.size(); ++i)
            if (calcRest(i) > calcRest(furthest)) furthest = i;
        std::string worst =
            m_goals.empty() ? "a constraint" : "'" + m_goals[furthest].joint.getName() + "'";
        Real largest = Open;
        for (int i = 0; i < m_bodies.getNumJoints(); ++i) {
            const Joint other = m_bodies.getJoint(JointIndex(i));
            const Vector errors = other.calcPositionErrors(m_state);
            const Real error = calcLargest(errors, errors.size());
            if (error <= largest) continue;
            largest = error;
            worst = "'" + other.getName() + "'";
        }
        return worst;
    }

private:
    struct Mode {
        int u, q;
        Real stiffness;  ///< Ω² [1/s²]
        Real start;      ///< ξ before the joints were closed
    };

    /** Returns whether closing the joints has deformed bodies. **/
    bool hasBent() const {
        constexpr Real Bent = 1e-9;  // change of a modal coordinate [m √kg]
        return std::any_of(m_modes.begin(), m_modes.end(), [&](const Mode& mode) {
            return std::abs(m_closed.getQ()[mode.q] - mode.start) > Bent;
        });
    }
    /** Weights modes by stiffness, so that the least change has the least strain energy. **/
    void weighStrain() {
        Real softest = Infinity;
        for (const Mode& mode : m_modes) softest = std::min(softest, mode.stiffness);
        for (const Mode& mode : m_modes)
            if (softest > 0) m_weights[mode.u] *= std::sqrt(mode.stiffness / softest);
    }

    /** Largest magnitude of the first `count` values. **/
    static Real calcLargest(const Vector& values, int count) {
        Real largest = 0;
        for (int i = 0; i < count; ++i) largest = std::max(largest, std::abs(values[i]));
        return largest;
    }

    Real calcRest(size_t goal) const { return std::abs(m_wanted[goal] - m_reached[goal]); }

    const JointCoordinate& getKind(size_t goal) const {
        return m_goals[goal].joint.getEquations().getCoordinate(m_goals[goal].coordinate);
    }
    Real calcLongestStep(size_t goal, Real way) const {
        return getKind(goal).isAngle() ? LargestStep : std::max(std::abs(way) / 10, GoalTolerance);
    }
    Real calcLargestError() const { return calcLargest(m_state.getQErr(), getNumPositionRows()); }

    Real calcCoordinate(size_t i) const {
        return m_goals[i].joint.calcCoordinates(m_state)[m_goals[i].coordinate];
    }

    Vector calcWay() const {
        Vector way(int(m_goals.size()));
        for (size_t i = 0; i < m_goals.size(); ++i) way[int(i)] = m_wanted[i] - m_reached[i];
        return way;
    }

    bool findTurnCounts() const {
        const auto& states = m_bodies.getGuts().states();
        return std::any_of(states.begin(), states.end(),
                           [](const auto& state) { return state->countsTurns(); });
    }
    /** Updates turn counts and the goals' current values. **/
    void followTurns() {
        if (m_countsTurns) m_bodies.getGuts().startStates(m_state);
        for (size_t i = 0; i < m_reached.size(); ++i) {
            const Real now = calcCoordinate(i);
            m_reached[i] = getKind(i).isPeriodic()
                               ? m_reached[i] - std::remainder(m_reached[i] - now, 2 * Pi)
                               : now;
        }
    }
    Vector calcRateErrors() const {
        Vector errors(int(m_goals.size()));
        for (size_t i = 0; i < m_goals.size(); ++i)
            errors[int(i)] = m_goals[i].value -
                             m_goals[i].joint.calcCoordinateDots(m_state)[m_goals[i].coordinate];
        return errors;
    }

    /** Moves the coordinates by `change` to first order, while closing the joints. **/
    void move(const Vector& change) {
        constexpr Real Settled = 1e-7;              // relative to the largest deformation
        Vector deformed(m_state.getNU(), Real(0));  // since the start
        if (m_bending == Bending::Free)
            for (const Mode& mode : m_modes) deformed[mode.u] = m_state.getQ()[mode.q] - mode.start;
        const Vector delta = solve(getNumPositionRows(), -m_state.getQErr(), change, deformed);
        Real changed = 0, largest = 0;
        for (const Mode& mode : m_modes) {
            changed = std::max(changed, std::abs(delta[mode.u]));
            largest = std::max(largest, std::abs(deformed[mode.u]));
        }
        m_isSettled = m_bending == Bending::Held || changed <= Settled * largest + GoalTolerance;
        Vector dq(m_state.getNQ());
        m_matter.multiplyByN(m_state, false, delta, dq);
        m_state.updQ() += dq;
        m_matter.normalizeQuaternions(m_state);
        realize();
        followTurns();
    }

    void scale(const MobilizedBody& mobod, Real factor) {
        for (int i = 0; i < mobod.getNumU(m_state); ++i)
            m_weights[mobod.getFirstUIndex(m_state) + i] *= factor;
    }

    void realize() { m_system.realize(m_state, Stage::Velocity); }

    /** Without the rows of quaternions. **/
    int getNumPositionRows() const {
        return m_state.getNQErr() - m_matter.getNumQuaternionsInUse(m_state);
    }

    /** Speeds that move the frames of a coordinate. **/
    std::vector<int> findSpeeds(const JointGoal& goal) const {
        std::vector<int> speeds;
        const auto add = [&](const MobilizedBody& mobod) {
            for (int i = 0; i < mobod.getNumU(m_state); ++i)
                speeds.push_back(mobod.getFirstUIndex(m_state) + i);
        };
        const bool isPair = goal.joint.getEquations().getNumFrames() == 2;  // no coupler
        const int frames = isPair ? 0 : goal.coordinate;
        for (const Attachment* frame :
             {&goal.joint.getFrameF(frames), &goal.joint.getFrameM(frames)}) {
            for (MobilizedBodyIndex at = frame->getMobilizedBodyIndex(); at != GroundIndex;) {
                const MobilizedBody& mobod = m_matter.getMobilizedBody(at);
                add(mobod);
                at = mobod.getParentMobilizedBody().getMobilizedBodyIndex();
            }
            if (!frame->isFlexible()) continue;
            const FlexibleBody body = m_bodies.getBody(frame->getFlexibleBodyIndex());
            for (int k = 0; k < body.getNumModalMobilizers(); ++k) add(body.getModalMobilizer(k));
        }
        std::sort(speeds.begin(), speeds.end());
        speeds.erase(std::unique(speeds.begin(), speeds.end()), speeds.end());
        return speeds;
    }

    /** Row ∂c/∂u; rates are linear in the speeds. **/
    Vector calcGradient(const JointGoal& goal) const {
        Vector gradient(m_state.getNU(), Real(0));
        State moving = copyState(m_state);
        for (const int j : findSpeeds(goal)) {
            moving.updU() = 0;
            moving.updU()[j] = 1;
            m_system.realize(moving, Stage::Velocity);
            gradient[j] = goal.joint.calcCoordinateDots(moving)[goal.coordinate];
        }
        return gradient;
    }

    /** Returns the δ that satisfies m rows of G and the goals with these right-hand sides and
    minimises the kinetic energy of `before` + δ: like an impulse, independent of units and
    axes. **/
    Vector solve(int m, const Vector& errors, const Vector& changes, const Vector& before) const {
        const int n = m_state.getNU(), numGoals = int(m_goals.size());
        const Eigen::LLT<Eigen::MatrixXd> metric(calcMetric());
        Matrix G;
        m_matter.calcG(m_state, G);
        Eigen::MatrixXd A(m + numGoals, n);
        Eigen::VectorXd right(m + numGoals);
        for (int i = 0; i < m; ++i) {
            for (int j = 0; j < n; ++j) A(i, j) = G(i, j);
            right[i] = errors[i];
        }
        for (int i = 0; i < numGoals; ++i) {
            A.row(m + i) = viewVector(calcGradient(m_goals[size_t(i)])).transpose();
            right[m + i] = changes[i];
        }
        right += A * viewVector(before);
        for (int j = 0; j < n; ++j)
            if (m_weights[j] == Infinity) A.col(j).setZero();
        // ½ yᵀWy is ½ |z|² with z = Lᵀy.
        A = metric.matrixL().solve(A.transpose()).transpose().eval();
        Matrix scaled(m + numGoals, n);
        Vector scaledRight(m + numGoals);
        for (int i = 0; i < m + numGoals; ++i) {
            const Real length = A.row(i).norm(), scale = length > 0 ? 1 / length : 1;
            for (int j = 0; j < n; ++j) scaled(i, j) = scale * A(i, j);
            scaledRight[i] = scale * right[i];
        }
        Vector z;
        FactorQTZ(scaled, Conditioning).solve(scaledRight, z);
        const Eigen::VectorXd change = metric.matrixU().solve(viewVector(z));
        Vector delta(n);
        for (int j = 0; j < n; ++j) delta[j] = change[j] - before[j];
        return delta;
    }

    /** The mass matrix with weighted modes; rows and columns of held speeds are those of the
    identity. **/
    Eigen::MatrixXd calcMetric() const {
        const int n = m_state.getNU();
        Matrix M;
        m_matter.calcM(m_state, M);
        constexpr Real Least = 1e-12;  // relative to a diagonal entry; massless bodies make the
                                       // matrix singular
        Real largest = 0;
        for (int j = 0; j < n; ++j) largest = std::max(largest, M(j, j));
        Eigen::MatrixXd metric(n, n);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                const bool isHeld = m_weights[i] == Infinity || m_weights[j] == Infinity;
                metric(i, j) = isHeld ? Real(i == j) : m_weights[i] * M(i, j) * m_weights[j];
            }
        for (int j = 0; j < n; ++j)
            metric(j, j) =
                metric(j, j) > 0 ? (1 + Least) * metric(j, j) : std::max(largest, Real(1));
        return metric;
    }

    const FlexibleBodySubsystem& m_bodies;
    const MultibodySystem& m_system;
    const SimbodyMatterSubsystem& m_matter;
    const std::vector<JointGoal>& m_goals;
    const Bending m_bending;
    bool m_isSettled = true;  ///< shapes have converged
    State m_state, m_closed;  ///< current State; State with closed joints at the start
    const Vector m_given;     ///< speeds before the joints were closed
    Vector m_weights;
    std::vector<Mode> m_modes;
    /** Coordinates of the goals, with whole turns, or their rates. **/
    std::vector<Real> m_reached, m_wanted;
    bool m_countsTurns = false;
};

enum class Wish { Value, Rate };

/** @throws unless each goal is a finite value of an existing coordinate of this system, and none is
repeated. **/
void checkGoals(const FlexibleBodySubsystem& bodies, const std::vector<JointGoal>& goals,
                Wish wish) {
    const char* what = wish == Wish::Value ? "value" : "rate";
    const std::string method =
        wish == Wish::Value ? "setJointCoordinates(): " : "setJointRates(): ";
    for (size_t i = 0; i < goals.size(); ++i) {
        const Joint& joint = goals[i].joint;
        const std::string name = "joint '" + joint.getName() + "'";
        if (!joint.isIn(bodies))
            throw std::invalid_argument(method + name + " is of another system");
        Joint::Coordinate(joint, goals[i].coordinate);  // throws if there is no such coordinate
        const std::string owner =
            " of coordinate " + std::to_string(goals[i].coordinate) + " of " + name;
        if (!std::isfinite(goals[i].value))
            throw std::invalid_argument(method + "the " + what + owner + " is " +
                                        std::to_string(goals[i].value) + "; it must be a number");
        for (size_t k = 0; k < i; ++k)
            if (goals[k].joint.getIndex() == joint.getIndex() &&
                goals[k].coordinate == goals[i].coordinate)
                throw std::runtime_error(
                    "'" + joint.getName() + "' does not allow it: coordinate " +
                    std::to_string(goals[i].coordinate) + " is given two " + what + "s, " +
                    std::to_string(goals[k].value) + " and " + std::to_string(goals[i].value));
    }
}

/** @param lead  returns whether the guide has reached its goals **/
template <class Lead>
void reachGoals(const FlexibleBodySubsystem& bodies, State& state,
                const std::vector<JointGoal>& goals, AngleWay angleWay, const Lead& lead) {
    std::string culprit, deformation;
    for (const Bending bending : {Bending::Held, Bending::Free}) {
        JointGuide guide(bodies, state, goals, bending, angleWay);
        const bool isThere = lead(guide);
        if (isThere) deformation = guide.describeDeformation();
        if (isThere && deformation.empty()) {
            state = guide.getState();
            bodies.getMultibodySystem().realize(state, Stage::Velocity);
            return;
        }
        // With held shapes the obstructing joint is easiest to identify.
        if (culprit.empty()) culprit = guide.findWorstJoint();
    }
    throw std::runtime_error(culprit + " does not allow it" +
                             (deformation.empty() ? "" : ": " + deformation));
}

}  // namespace

void setJointCoordinates(const FlexibleBodySubsystem& bodies, State& state,
                         const std::vector<JointGoal>& goals, AngleWay angleWay) {
    checkGoals(bodies, goals, Wish::Value);
    const auto lead = [](JointGuide& guide) { return guide.leadCoordinates(); };
    if (angleWay == AngleWay::Whole) try {
            return reachGoals(bodies, state, goals, AngleWay::Whole, lead);
        } catch (const std::runtime_error&) {
            // The joint does not allow whole turns.
        }
    reachGoals(bodies, state, goals, AngleWay::Shorter, lead);
    if (angleWay == AngleWay::Shorter) return;
    for (const JointGoal& goal : goals)
        bodies.getGuts().setTurn(state, goal.joint.getIndex(), goal.coordinate, goal.value);
    bodies.getMultibodySystem().realize(state, Stage::Velocity);
}

void Joint::setCoordinate(State& state, Real value, int coordinate) const {
    setJointCoordinates(*FlexibleBodySubsystem::find(*m_system), state,
                        {{*this, coordinate, value}});
}

void Joint::setCoordinateRate(State& state, Real rate, int coordinate) const {
    setJointRates(*FlexibleBodySubsystem::find(*m_system), state, {{*this, coordinate, rate}});
}

void setJointRates(const FlexibleBodySubsystem& bodies, State& state,
                   const std::vector<JointGoal>& goals) {
    checkGoals(bodies, goals, Wish::Rate);
    reachGoals(bodies, state, goals, AngleWay::Shorter,
               [](JointGuide& guide) { return guide.changeRates(); });
}

}  // namespace simflex
