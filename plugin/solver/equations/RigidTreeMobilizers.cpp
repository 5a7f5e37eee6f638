// Bodies and mobilizers of a rigid tree: which it evaluates itself, compared with Simbody.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::Vector4d;

void RigidTree::checkVelocities(const SimbodyMatterSubsystem& matter, const State& state) const {
    constexpr Real Step = 1e-6, Allowed = 1e-4;
    State now = copyState(state);
    for (int i = 0; i < now.getNU(); ++i) now.updU()[i] = 0;
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nu; ++k)
            now.updU()[body.stateU0 + k] = std::cos(0.3 + 1.1 * (body.u0 + k));
    const System& system = matter.getSystem();
    system.realize(now, Stage::Velocity);
    State before = copyState(now), after = copyState(now);
    before.updQ() -= Step * now.getQDot();
    after.updQ() += Step * now.getQDot();
    system.realize(before, Stage::Position);
    system.realize(after, Stage::Position);
    for (const RigidBody& body : m_bodies) {
        const MobilizedBody& mobod = matter.getMobilizedBody(body.index);
        const Transform &a = mobod.getBodyTransform(before), &b = mobod.getBodyTransform(after);
        const SpatialVec& V = mobod.getBodyVelocity(now);
        const Mat33 turned = (b.R().asMat33() - a.R().asMat33()) / (2 * Step);
        const Mat33 spin = crossMat(V[0]) * mobod.getBodyTransform(now).R().asMat33();
        const Real linear = ((b.p() - a.p()) / (2 * Step) - V[1]).norm();
        const Real difference = std::max(linear, (turned - spin).norm());
        // NaN or a large velocity means a singular position, where this check says nothing.
        if (!(difference > Allowed * (1 + V.norm()) && V.norm() < 1e3)) continue;
        throw std::invalid_argument(
            "the velocities of " + describeBody(matter, body.index, "mobilized body") +
            " are not the rates of its positions (they differ by " + std::to_string(difference) +
            "); Simbody's reversed LineOrientation and FreeLine are so with quaternions: call "
            "setUseEulerAngles(), or mend a custom mobilizer's H and N matrices");
    }
}

void RigidTree::classifyTurning(const SimbodyMatterSubsystem& matter, const State& state) {
    State trial = copyState(state);
    std::vector<double> q(size_t(numQ), 0), u(size_t(numU), 0);
    for (int i = 0; i < numU; ++i) u[size_t(i)] = 0.3 + 0.1 * i;
    getFromState(state, q.data(), u.data());
    for (int i = 0; i < numU; ++i) u[size_t(i)] = std::cos(0.3 + 1.1 * i);
    // Away from symmetric positions, with unit quaternions.
    for (int i = 0; i < numQ; ++i) q[size_t(i)] += 0.1 + 0.02 * std::sin(i);
    for (const RigidBody& body : m_bodies)
        if (body.nq > body.nu && body.nq >= 4) Map<Vector4d>(q.data() + body.q0).normalize();
    Vector stateQ = trial.getQ(), stateU = trial.getU(), expected(trial.getNQ());
    putCoordinates(q.data(), u.data(), stateQ, stateU);
    trial.updQ() = stateQ;
    matter.getSystem().realize(trial, Stage::Position);
    matter.multiplyByN(trial, false, stateU, expected);

    const bool usesAngles = matter.getUseEulerAngles(state);
    for (RigidBody& body : m_bodies) {
        const auto agrees = [&](Turning turning) {
            body.turning = turning;
            const int turningU = numTurningU(body);
            if (numTurningQ(body) > body.nq || turningU < 0 || turningU > std::min(3, body.nu))
                return false;
            double qDot[LargestNumQ];
            multiplyByN(body, q.data() + body.q0, u.data() + body.u0, qDot);
            for (int k = 0; k < body.nq; ++k)
                if (!(std::abs(qDot[k] - expected[body.stateQ0 + k]) < 1e-10)) return false;
            return true;
        };
        const bool isPlain = body.nq == body.nu && agrees(Turning::None);
        if (isPlain) continue;
        const bool isKnown = usesAngles
                                 ? agrees(Turning::BodyXYZ) || agrees(Turning::LineBodyXYZ)
                                 : agrees(Turning::Quaternion) || agrees(Turning::LineQuaternion);
        if (isKnown) continue;
        body.turning = Turning::KnownToSimbodyOnly;
        m_hasUnknownTurning = true;
    }
}

RigidTree::Mobilizer RigidTree::classify(const MobilizedBody& mobod) {
    if (MobilizedBody::Weld::isInstanceOf(mobod)) return Mobilizer::Weld;
    if (MobilizedBody::Pin::isInstanceOf(mobod)) return Mobilizer::Pin;
    if (MobilizedBody::Slider::isInstanceOf(mobod)) return Mobilizer::Slider;
    if (MobilizedBody::Screw::isInstanceOf(mobod)) return Mobilizer::Screw;
    if (MobilizedBody::Universal::isInstanceOf(mobod)) return Mobilizer::Universal;
    if (MobilizedBody::Planar::isInstanceOf(mobod)) return Mobilizer::Planar;
    if (MobilizedBody::BendStretch::isInstanceOf(mobod)) return Mobilizer::BendStretch;
    if (MobilizedBody::Gimbal::isInstanceOf(mobod)) return Mobilizer::Gimbal;
    if (MobilizedBody::Bushing::isInstanceOf(mobod)) return Mobilizer::Bushing;
    if (MobilizedBody::Translation::isInstanceOf(mobod)) return Mobilizer::Translation;
    if (MobilizedBody::Cylinder::isInstanceOf(mobod)) return Mobilizer::Cylinder;
    if (MobilizedBody::Ball::isInstanceOf(mobod)) return Mobilizer::Ball;
    if (MobilizedBody::Free::isInstanceOf(mobod)) return Mobilizer::Free;
    return Mobilizer::Other;
}

void RigidTree::addBody(const SimbodyMatterSubsystem& matter, MobilizedBodyIndex index, int parent,
                        const State& state) {
    // Depth first, but not recursive: chains may be long.
    std::vector<std::pair<MobilizedBodyIndex, int>> open{{index, parent}};
    while (!open.empty()) {
        const auto [current, inboard] = open.back();
        open.pop_back();
        const MobilizedBody& mobod = matter.getMobilizedBody(current);
        RigidBody body;
        body.index = current;
        body.parent = inboard;
        body.mobilizer = classify(mobod);
        if (body.mobilizer == Mobilizer::Screw)
            body.pitch = MobilizedBody::Screw::downcast(mobod).getDefaultPitch();
        body.X_PF = mobod.getInboardFrame(state);
        body.X_MB = ~mobod.getOutboardFrame(state);
        body.mass = mobod.getBodyMassProperties(state);
        body.nq = mobod.getNumQ(state);
        body.nu = mobod.getNumU(state);
        body.q0 = numQ;
        body.u0 = numU;
        body.stateQ0 = body.nq ? int(mobod.getFirstQIndex(state)) : 0;
        body.stateU0 = body.nu ? int(mobod.getFirstUIndex(state)) : 0;
        numQ += body.nq;
        numU += body.nu;
        const int self = int(m_bodies.size());
        m_bodies.push_back(body);
        for (MobilizedBodyIndex child(matter.getNumBodies() - 1); child > current; --child)
            if (matter.getMobilizedBody(child).getParentMobilizedBody().getMobilizedBodyIndex() ==
                current)
                open.emplace_back(child, self);
    }
}

bool RigidTree::agreesWithSimbody(const SimbodyMatterSubsystem& matter, const State& state) {
    // A reversed mobilizer has the same type as a plain one: compare motions near the given State,
    // away from special positions. Realize only the matter: others may be undefined there.
    const bool isOwn = std::none_of(m_bodies.begin(), m_bodies.end(), [](const RigidBody& body) {
        return body.mobilizer == Mobilizer::Other;
    });
    State trial = copyState(state);
    std::vector<double> q(numQ), u(numU);
    getFromState(state, q.data(), u.data());
    for (int i = 0; i < numU; ++i) u[i] += 0.3 + 0.1 * i;
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nq; ++k) q[body.q0 + k] += 0.05 + 0.01 * k;
    normalizeQ(q.data());
    bool agrees = isOwn;
    if (isOwn) {
        Vector stateQ = trial.getQ(), stateU = trial.getU();
        putCoordinates(q.data(), u.data(), stateQ, stateU);
        trial.updQ() = stateQ;
        trial.updU() = stateU;
        const Subsystem::Guts& guts = matter.getSubsystemGuts();
        guts.realizeSubsystemTime(trial);
        guts.realizeSubsystemPosition(trial);
        guts.realizeSubsystemVelocity(trial);
        for (RigidBody& body : m_bodies) {
            realizeBody(body, q.data(), u.data());
            const MobilizedBody& mobod = matter.getMobilizedBody(body.index);
            const Transform& X = mobod.getBodyTransform(trial);
            const SpatialVec difference = mobod.getBodyVelocity(trial) - body.V;
            agrees = agrees && (X.p() - body.X_GB.p()).norm() < 1e-9 * (1 + X.p().norm()) &&
                     (X.R().asMat33() - body.X_GB.R().asMat33()).norm() < 1e-9 &&
                     difference.norm() < 1e-9 * (1 + body.V.norm()) &&
                     (matter.getTotalCoriolisAcceleration(trial, body.index) - body.biasA).norm() <
                         1e-9 * (1 + body.biasA.norm());
        }
    }
    // Leave the Jacobians at the given State for the weights.
    getFromState(state, q.data(), u.data());
    for (RigidBody& body : m_bodies) {
        if (agrees)
            realizeBody(body, q.data(), u.data());
        else
            realizeBodyFromSimbody(body, state);
    }
    return agrees;
}

}  // namespace simflex
