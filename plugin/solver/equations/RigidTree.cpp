#include "simflex/solver/equations/RigidTree.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/** NaN if one is. **/
template <class Items, class Calc>
double calcLargest(const Items& items, const Calc& calc) {
    double largest = 0;
    for (const auto& item : items) {
        const double value = calc(item);
        largest = value <= largest ? largest : value;
        if (std::isnan(largest)) break;
    }
    return largest;
}

Vector3d asVector3d(const Vec3& v) {
    return {v[0], v[1], v[2]};
}

/** Inertial spatial force M_B A + b of a rigid body about its origin, in Ground. **/
SpatialVec calcInertialForce(const MassProperties& mass, const Transform& X_GB, const Vec3& omega,
                             const SpatialVec& A) {
    const Vec3 c = X_GB.R() * mass.getMassCenter();
    const Mat33 I = X_GB.R() * mass.getInertia().toMat33() * ~X_GB.R();
    const Real m = mass.getMass();
    return {I * A[0] + omega % (I * omega) + m * (c % A[1]),
            m * (A[1] + A[0] % c + omega % (omega % c))};
}

}  // namespace

RigidTree::RigidTree(const SimbodyMatterSubsystem& matter,
                     const std::vector<MobilizedBodyIndex>& roots, const State& state)
    : m_matter(matter) {
    constexpr size_t MostNamed = 4;
    for (size_t k = 0; k < roots.size(); ++k) {
        if (k <= MostNamed)
            name += (k == 0          ? ""
                     : k < MostNamed ? ", "
                                     : " and others after ") +
                    describeBody(matter, roots[k], k == 0 ? "rigid tree at body" : "body");
        const int q0 = numQ, u0 = numU;
        addBody(matter, roots[k], -1, state);
        m_roots.push_back({q0, numQ - q0, u0, numU - u0});
    }
    m_forces.resize(m_bodies.size());
    m_motions.resize(m_bodies.size());
    m_composites.resize(m_bodies.size());
    classifyTurning(matter, state);
    m_needsSimbody = m_hasUnknownTurning || !agreesWithSimbody(matter, state);
    if (m_needsSimbody) checkVelocities(matter, state);

    // The weights of a long chain cost more than a step.
    constexpr double WorthAStep = 32;  // terms for each body
    double terms = 0;
    for (const RigidBody& body : m_bodies)
        for (int b = int(&body - m_bodies.data()); b >= 0; b = m_bodies[size_t(b)].parent) ++terms;
    m_stepsBetweenWeights = std::max(1, int(terms / (WorthAStep * double(m_bodies.size()))));
    m_uWeights.resize(numU);
    m_qWeights.setZero(numQ);
    calcWeights();
}

void RigidTree::followPose() {
    if (++m_stepsSinceWeights < m_stepsBetweenWeights) return;
    m_stepsSinceWeights = 0;
    calcWeights();
}

void RigidTree::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_stepsSinceWeights);
    for (int i = 0; i < numU; ++i) checkpoint.visit(m_uWeights[i]);
    for (int i = 0; i < numQ; ++i) checkpoint.visit(m_qWeights[i]);
}

void RigidTree::calcWeights() {
    m_uWeights.setConstant(1e-300);  // squares, at first
    for (const RigidBody& body : m_bodies) {
        const Real m = body.mass.getMass();
        if (!(m > 0)) continue;
        const Real gyrationSquared = std::max(Real(0), body.mass.calcCentralInertia().trace()) / m;
        const Vec3 c = body.X_GB * body.mass.getMassCenter();
        for (const RigidBody* ancestor = &body; ancestor;
             ancestor = ancestor->parent < 0 ? nullptr : &m_bodies[size_t(ancestor->parent)])
            for (int k = 0; k < ancestor->nu; ++k) {
                const SpatialVec& H = ancestor->H[k];
                const Vec3 v = H[1] + H[0] % (c - ancestor->X_GB.p());
                double& weight = m_uWeights[ancestor->u0 + k];
                weight = std::max(weight, gyrationSquared * H[0].normSqr() + v.normSqr());
            }
    }
    m_uWeights = m_uWeights.cwiseSqrt();
    for (const RigidBody& body : m_bodies) {
        if (body.nu == 0) continue;
        const bool isUnknown = body.turning == Turning::KnownToSimbodyOnly;
        const int nq = isUnknown ? body.nq : numTurningQ(body);
        const int nu = isUnknown ? body.nu : numTurningU(body);
        for (int k = 0; k < body.nq; ++k)
            m_qWeights[body.q0 + k] =
                k < nq ? (hasQuaternion(body) ? 2 : 1) * m_uWeights.segment(body.u0, nu).maxCoeff()
                       : m_uWeights[body.u0 + nu + (k - nq)];
    }
}

void RigidTree::multiplyByN(const RigidBody& body, const double* q, const double* u, double* qDot) {
    const int nq = numTurningQ(body), nu = numTurningU(body);
    Vec3 omega(0);
    for (int k = 0; k < nu; ++k) omega[k] = u[k];
    const bool inBody =
        body.turning == Turning::LineQuaternion || body.turning == Turning::LineBodyXYZ;
    if (hasQuaternion(body)) {
        Map<Vector4d>(qDot, 4) =
            0.5 * multiplyQuaternion(Map<const Vector4d>(q), asVector3d(omega), inBody);
    } else if (nq == 3) {
        const Vec3 angles(q[0], q[1], q[2]);
        const Vec3 rates = (inBody ? Rotation::calcNForBodyXYZInBodyFrame(angles)
                                   : Rotation::calcNForBodyXYZInParentFrame(angles)) *
                           omega;
        for (int k = 0; k < 3; ++k) qDot[k] = rates[k];
    }
    for (int k = nq; k < body.nq; ++k) qDot[k] = u[nu + (k - nq)];
}

int RigidTree::addFrame(MobilizedBodyIndex index, const Transform& X_BF) {
    for (size_t b = 0; b < m_bodies.size(); ++b)
        if (m_bodies[b].index == index) m_frameData.push_back({int(b), X_BF});
    frames.emplace_back();
    return int(frames.size()) - 1;
}

bool RigidTree::contains(MobilizedBodyIndex index) const {
    return std::any_of(m_bodies.begin(), m_bodies.end(),
                       [&](const RigidBody& body) { return body.index == index; });
}

RigidTree::Slots RigidTree::findSlots(MobilizedBodyIndex index) const {
    for (const RigidBody& body : m_bodies)
        if (body.index == index) return {body.q0, body.nq, body.u0, body.nu};
    throw std::out_of_range(name + " has no body " + std::to_string(int(index)));
}

void RigidTree::putSpeeds(const double* u, Vector& stateU) const {
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nu; ++k) stateU[body.stateU0 + k] = u[body.u0 + k];
}

void RigidTree::putCoordinates(const double* q, const double* u, Vector& stateQ,
                               Vector& stateU) const {
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nq; ++k) stateQ[body.stateQ0 + k] = q[body.q0 + k];
    putSpeeds(u, stateU);
}

void RigidTree::realizeBody(RigidBody& body, const double* q, const double* u) const {
    const double *qb = q + body.q0, *ub = u + body.u0;
    // Of M in F, expressed in F: pose, columns (ω, v) of H, and Ḣu.
    Transform X_FM;
    SpatialVec H[6], bias(Vec3(0), Vec3(0));
    for (SpatialVec& column : H) column = SpatialVec(Vec3(0), Vec3(0));
    const Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    // Body-fixed turns about x, y, z, as many as the first `count`.
    const auto turn = [&](int count) {
        const CoordinateAxis axes[3] = {XAxis, YAxis, ZAxis};
        Rotation R;
        Vec3 omega(0);
        for (int k = 0; k < count; ++k) {
            H[k][0] = R * (k == 0 ? x : k == 1 ? y : z);
            bias[0] += omega % (H[k][0] * ub[k]);
            omega += H[k][0] * ub[k];
            R = R * Rotation(qb[k], axes[k]);
        }
        X_FM.updR() = R;
    };
    const auto turnFreely = [&] {
        X_FM.updR() = body.turning == Turning::BodyXYZ
                          ? Rotation(BodyRotationSequence, qb[0], XAxis, qb[1], YAxis, qb[2], ZAxis)
                          : rotationOf(qb);
        for (int k = 0; k < 3; ++k) H[k][0][k] = 1;
    };
    const auto shiftFreely = [&](int q0, int first) {
        X_FM.updP() = Vec3::getAs(qb + q0);
        for (int k = 0; k < 3; ++k) H[first + k][1][k] = 1;
    };
    switch (body.mobilizer) {
        case Mobilizer::Weld:
            break;
        case Mobilizer::Pin:
            X_FM.updR() = Rotation(qb[0], ZAxis);
            H[0][0] = z;
            break;
        case Mobilizer::Slider:
            X_FM.updP() = Vec3(qb[0], 0, 0);
            H[0][1] = x;
            break;
        case Mobilizer::Cylinder:
            X_FM = Transform(Rotation(qb[0], ZAxis), Vec3(0, 0, qb[1]));
            H[0][0] = H[1][1] = z;
            break;
        case Mobilizer::Screw:
            X_FM = Transform(Rotation(qb[0], ZAxis), Vec3(0, 0, body.pitch * qb[0]));
            H[0] = SpatialVec(z, body.pitch * z);
            break;
        case Mobilizer::Universal:
            turn(2);
            break;
        case Mobilizer::Planar:
            X_FM = Transform(Rotation(qb[0], ZAxis), Vec3(qb[1], qb[2], 0));
            H[0][0] = z;
            H[1][1] = x;
            H[2][1] = y;
            break;
        case Mobilizer::BendStretch: {
            const Rotation R(qb[0], ZAxis);
            const Vec3 outwards = R * x, along = R * y;
            X_FM = Transform(R, qb[1] * outwards);
            H[0] = SpatialVec(z, qb[1] * along);
            H[1][1] = outwards;
            bias[1] = -ub[0] * ub[0] * qb[1] * outwards + 2 * ub[0] * ub[1] * along;
            break;
        }
        case Mobilizer::Gimbal:
            turn(3);
            break;
        case Mobilizer::Bushing:
            turn(3);
            shiftFreely(3, 3);
            break;
        case Mobilizer::Translation:
            shiftFreely(0, 0);
            break;
        case Mobilizer::Ball:
            turnFreely();
            break;
        case Mobilizer::Free:
            turnFreely();
            shiftFreely(numTurningQ(body), 3);
            break;
        case Mobilizer::Other:
            break;
    }

    Transform X_GP;
    SpatialVec V_P(Vec3(0), Vec3(0)), A_P(Vec3(0), Vec3(0));
    if (body.parent >= 0) {
        const RigidBody& parent = m_bodies[body.parent];
        X_GP = parent.X_GB;
        V_P = parent.V;
        A_P = parent.biasA;
    }
    const Transform X_GF = X_GP * body.X_PF, X_GM = X_GF * X_FM;
    body.X_GB = X_GM * body.X_MB;
    const Vec3 r = X_GM.p() - X_GP.p(), s = body.X_GB.p() - X_GM.p();

    Vec3 omegaRel(0), vRel(0);
    for (int k = 0; k < body.nu; ++k) {
        const Vec3 hOmega = X_GF.R() * H[k][0], hV = X_GF.R() * H[k][1];
        omegaRel += hOmega * ub[k];
        vRel += hV * ub[k];
        body.H[k] = SpatialVec(hOmega, hV + hOmega % s);
    }

    const Vec3 omega = V_P[0] + omegaRel, vM = V_P[1] + V_P[0] % r + vRel;
    body.V = {omega, vM + omega % s};
    const Vec3 alpha = A_P[0] + V_P[0] % omegaRel + X_GF.R() * bias[0];
    const Vec3 aM =
        A_P[1] + A_P[0] % r + V_P[0] % (V_P[0] % r) + 2 * (V_P[0] % vRel) + X_GF.R() * bias[1];
    body.biasA = {alpha, aM + alpha % s + omega % (omega % s)};
}

void RigidTree::realizeBodyFromSimbody(RigidBody& body, const State& state) const {
    const MobilizedBody& mobod = m_matter.getMobilizedBody(body.index);
    body.X_GB = mobod.getBodyTransform(state);
    body.V = mobod.getBodyVelocity(state);
    body.biasA = m_matter.getTotalCoriolisAcceleration(state, body.index);
    for (int k = 0; k < body.nu; ++k) body.H[k] = mobod.getHCol(state, MobilizerUIndex(k));
}

void RigidTree::realize(const EvaluationContext& context, const double* q, const double* u) {
    for (RigidBody& body : m_bodies) {
        if (m_needsSimbody)
            realizeBodyFromSimbody(body, *context.state);
        else
            realizeBody(body, q, u);
    }
    for (size_t k = 0; k < m_frameData.size(); ++k) {
        const RigidBody& body = m_bodies[m_frameData[k].body];
        FrameMotion motion;
        motion.X = body.X_GB;
        motion.V = body.V;
        frames[k] = shiftMotion(motion, m_frameData[k].X_BF);
    }
}

SpatialVec RigidTree::calcAcceleration(int index, const double* uDot) const {
    const RigidBody& body = m_bodies[size_t(index)];
    SpatialVec A = body.biasA;
    for (const RigidBody* ancestor = &body; ancestor;
         ancestor = ancestor->parent < 0 ? nullptr : &m_bodies[size_t(ancestor->parent)]) {
        const Vec3 shift = body.X_GB.p() - ancestor->X_GB.p();
        for (int k = 0; k < ancestor->nu; ++k) {
            const SpatialVec& H = ancestor->H[k];
            A += uDot[ancestor->u0 + k] * SpatialVec(H[0], H[1] + H[0] % shift);
        }
    }
    return A;
}

void RigidTree::addInTransposed(int index, const SpatialVec& F_G, double* r) const {
    const Vec3& origin = m_bodies[size_t(index)].X_GB.p();
    for (int b = index; b >= 0; b = m_bodies[size_t(b)].parent) {
        const RigidBody& body = m_bodies[size_t(b)];
        const Vec3 moment = F_G[0] + (origin - body.X_GB.p()) % F_G[1];
        for (int k = 0; k < body.nu; ++k)
            r[body.u0 + k] += dot(body.H[k][0], moment) + dot(body.H[k][1], F_G[1]);
    }
}

void RigidTree::addInForces(double* r) {
    // Every body follows its parent.
    for (size_t b = m_bodies.size(); b-- > 0;) {
        const RigidBody& body = m_bodies[b];
        const SpatialVec& F = m_forces[b];
        for (int k = 0; k < body.nu; ++k)
            r[body.u0 + k] += dot(body.H[k][0], F[0]) + dot(body.H[k][1], F[1]);
        if (body.parent < 0) continue;
        const RigidBody& parent = m_bodies[size_t(body.parent)];
        m_forces[size_t(body.parent)] +=
            SpatialVec(F[0] + (body.X_GB.p() - parent.X_GB.p()) % F[1], F[1]);
    }
}

void RigidTree::calcResidual(const EvaluationContext& context, const double* q, const double* u,
                             const double* uDot, double* r) {
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        const RigidBody& body = m_bodies[b];
        SpatialVec& A = m_motions[b];
        A = SpatialVec(Vec3(0), Vec3(0));
        if (body.parent >= 0) {
            const SpatialVec& A_P = m_motions[size_t(body.parent)];
            const Vec3 shift = body.X_GB.p() - m_bodies[size_t(body.parent)].X_GB.p();
            A = SpatialVec(A_P[0], A_P[1] + A_P[0] % shift);
        }
        for (int k = 0; k < body.nu; ++k) A += uDot[body.u0 + k] * body.H[k];
        const Vec3 weight = body.mass.getMass() * context.gravity->atBody[body.index];
        m_forces[b] = calcInertialForce(body.mass, body.X_GB, body.V[0], body.biasA + A) -
                      SpatialVec((body.X_GB.R() * body.mass.getMassCenter()) % weight, weight);
    }
    std::fill(r, r + numU, 0.0);
    if (context.mobilities)
        for (const RigidBody& body : m_bodies)
            for (int k = 0; k < body.nu; ++k)
                r[body.u0 + k] -=
                    context.mobilities->calcForce(body.stateU0 + k, q[body.q0 + k], u[body.u0 + k]);
    addInForces(r);
}

void RigidTree::subtractForce(int frame, const SpatialVec& F_G, double* r) const {
    addInRow(frame, -F_G, r);
}

void RigidTree::subtractSimbodyForces(const Vector_<SpatialVec>& bodyForces,
                                      const Vector& mobilityForces, double* r) {
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        const RigidBody& body = m_bodies[b];
        m_forces[b] = -bodyForces[body.index];
        for (int k = 0; k < body.nu; ++k) r[body.u0 + k] -= mobilityForces[body.stateU0 + k];
    }
    addInForces(r);
}

void RigidTree::addInRow(int frame, const SpatialVec& d, double* row) const {
    const int body = m_frameData[frame].body;
    const Vec3 shift = frames[frame].X.p() - m_bodies[size_t(body)].X_GB.p();
    addInTransposed(body, SpatialVec(d[0] + shift % d[1], d[1]), row);
}

SpatialVec RigidTree::calcFrameAcceleration(int frame, const double*, const double* uDot) const {
    const RigidBody& body = m_bodies[m_frameData[frame].body];
    FrameMotion motion;
    motion.X = body.X_GB;
    motion.V = body.V;
    motion.A = calcAcceleration(m_frameData[frame].body, uDot);
    return shiftMotion(motion, m_frameData[frame].X_BF).A;
}

void RigidTree::formMassMatrix(double factor, NewtonSystem::Block& block) {
    block.form = NewtonSystem::Block::Form::Symmetric;
    Map<MatrixXd> M(block.matrix.data(), numU, numU);
    M.setZero();
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        Composite& composite = m_composites[b];
        const RigidBody& body = m_bodies[b];
        composite.mass = body.mass.getMass();
        composite.moment = composite.mass * (body.X_GB.R() * body.mass.getMassCenter());
        composite.inertia =
            body.X_GB.R() * body.mass.getInertia().toMat33() * ~body.X_GB.R().asMat33();
    }
    for (size_t b = m_bodies.size(); b-- > 0;) {
        const RigidBody& body = m_bodies[b];
        const Composite& own = m_composites[b];
        for (int k = 0; k < body.nu; ++k) {
            // Force that accelerates the composite body along speed k, propagated to the root.
            const SpatialVec& H = body.H[k];
            SpatialVec F(own.inertia * H[0] + own.moment % H[1],
                         own.mass * H[1] - own.moment % H[0]);
            F *= factor;
            const int column = body.u0 + k;
            const Vec3* origin = &body.X_GB.p();
            for (const RigidBody* outer = &body; outer;
                 outer = outer->parent < 0 ? nullptr : &m_bodies[size_t(outer->parent)]) {
                F[0] += (*origin - outer->X_GB.p()) % F[1];
                origin = &outer->X_GB.p();
                for (int l = 0; l < outer->nu; ++l)
                    M(outer->u0 + l, column) = M(column, outer->u0 + l) =
                        dot(outer->H[l][0], F[0]) + dot(outer->H[l][1], F[1]);
            }
        }
        if (body.parent < 0) continue;
        Composite& parent = m_composites[size_t(body.parent)];
        const Vec3 d = body.X_GB.p() - m_bodies[size_t(body.parent)].X_GB.p();
        const Vec3& h = own.moment;
        parent.inertia += own.inertia + 2 * dot(d, h) * Mat33(1) - (d * ~h + h * ~d) +
                          own.mass * (dot(d, d) * Mat33(1) - d * ~d);
        parent.moment += h + own.mass * d;
        parent.mass += own.mass;
    }
}

void RigidTree::formNewtonBlock(const NewtonFactors& factors, BlockDerivatives derivatives,
                                const EvaluationContext& context, const double* q, const double* u,
                                const double* uDot, NewtonSystem::Block& block) {
    constexpr int LargestDense = 30;  // speeds: fewer are eliminated faster as a matrix
    if (derivatives == BlockDerivatives::Constant || !knowsDerivatives())
        return formMassMatrix(1 / factors.mass, block);
    formTangent(factors, context, q, u, uDot, block.tree);
    const bool isTree = derivatives == BlockDerivatives::ByBodies && numU > LargestDense;
    block.form = isTree ? NewtonSystem::Block::Form::Tree : NewtonSystem::Block::Form::General;
    if (!isTree) block.tree.expand(numU, block.matrix.data(), m_treeWorkspace);
}

void RigidTree::formMassBlock(NewtonSystem::Block& block) {
    formMassMatrix(1, block);
}

std::optional<Vector> RigidTree::askForQDot(const EvaluationContext& context,
                                            const double* u) const {
    std::optional<Vector> qDot;  // a Vector takes memory even when empty
    if (!m_hasUnknownTurning) return qDot;
    Vector simbodyU(context.state->getNU(), Real(0));
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nu; ++k) simbodyU[body.stateU0 + k] = u[body.u0 + k];
    m_matter.multiplyByN(*context.state, false, simbodyU, qDot.emplace());
    return qDot;
}

void RigidTree::integrateQ(const EvaluationContext& context, const double* qHist, double gamma,
                           const double* u, double* q) const {
    // Newton's method makes q and the State's q agree.
    const std::optional<Vector> simbodyQDot = askForQDot(context, u);
    for (const RigidBody& body : m_bodies) {
        const double *history = qHist + body.q0, *speeds = u + body.u0;
        double* coordinates = q + body.q0;
        if (body.turning == Turning::KnownToSimbodyOnly) {
            for (int k = 0; k < body.nq; ++k)
                coordinates[k] = history[k] + gamma * (*simbodyQDot)[body.stateQ0 + k];
            continue;
        }
        const int nq = numTurningQ(body), nu = numTurningU(body);
        if (hasQuaternion(body)) {
            const Vector3d omega(speeds[0], speeds[1], nu > 2 ? speeds[2] : 0);
            const bool inBody = body.turning == Turning::LineQuaternion;
            Map<Vector4d>(coordinates, 4) =
                integrateQuaternion(Map<const Vector4d>(history), gamma, omega, inBody);
        } else if (nq == 3) {
            // Contracts by γ|ω| a pass.
            constexpr int MaxPasses = 50;
            constexpr double Smallest = 1e-15;
            std::copy_n(history, 3, coordinates);
            double change = 1;
            double qDot[LargestNumQ];
            for (int pass = 0; pass < MaxPasses && change > Smallest; ++pass) {
                multiplyByN(body, coordinates, speeds, qDot);
                change = 0;
                for (int k = 0; k < 3; ++k) {
                    const double next = history[k] + gamma * qDot[k];
                    change = std::max(change, std::abs(next - coordinates[k]));
                    coordinates[k] = next;
                }
            }
        }
        for (int k = nq; k < body.nq; ++k)
            coordinates[k] = history[k] + gamma * speeds[nu + (k - nq)];
    }
}

void RigidTree::calcQDot(const EvaluationContext& context, const double* q, const double* u,
                         double* qDot) const {
    const std::optional<Vector> simbodyQDot = askForQDot(context, u);
    for (const RigidBody& body : m_bodies) {
        if (body.turning != Turning::KnownToSimbodyOnly)
            multiplyByN(body, q + body.q0, u + body.u0, qDot + body.q0);
        else
            for (int k = 0; k < body.nq; ++k) qDot[body.q0 + k] = (*simbodyQDot)[body.stateQ0 + k];
    }
}

void RigidTree::displaceQ(const EvaluationContext& context, const double* delta, double* q) const {
    if (m_hasUnknownTurning) {
        integrateQ(context, q, 1, delta, q);
        normalizeQ(q);
        return;
    }
    for (const RigidBody& body : m_bodies) displaceQ(body, delta + body.u0, q + body.q0);
}

void RigidTree::displaceQ(const RigidBody& body, const double* delta, double* q) const {
    double change[LargestNumQ];
    multiplyByN(body, q, delta, change);
    if (hasQuaternion(body)) {
        const int nu = numTurningU(body);
        Map<Vector4d> quaternion(q);
        quaternion =
            displaceQuaternion(quaternion, Vector3d(delta[0], delta[1], nu > 2 ? delta[2] : 0),
                               body.turning == Turning::LineQuaternion);
    }
    for (int k = hasQuaternion(body) ? 4 : 0; k < body.nq; ++k) q[k] += change[k];
}

void RigidTree::moveQ(const EvaluationContext& context, const double* delta, double* q) const {
    if (m_hasUnknownTurning) return displaceQ(context, delta, q);
    for (const RigidBody& body : m_bodies) {
        if (hasQuaternion(body) || numTurningQ(body) != 3) {
            displaceQ(body, delta + body.u0, q + body.q0);
            continue;
        }
        // q += N(half-way) δ, found by iteration.
        constexpr int MaxPasses = 50;
        constexpr double Smallest = 1e-15;
        double* angles = q + body.q0;
        const double start[3] = {angles[0], angles[1], angles[2]};
        double middle[LargestNumQ], change[LargestNumQ];
        std::copy_n(angles, body.nq, middle);
        for (int pass = 0; pass < MaxPasses; ++pass) {
            multiplyByN(body, middle, delta + body.u0, change);
            double moved = 0;
            for (int k = 0; k < 3; ++k) {
                const double next = start[k] + 0.5 * change[k];
                moved = std::max(moved, std::abs(next - middle[k]));
                middle[k] = next;
            }
            if (moved <= Smallest) break;
        }
        displaceQ(body, delta + body.u0, angles);
        for (int k = 0; k < 3; ++k) angles[k] = start[k] + change[k];
    }
}

void RigidTree::weighQ(const double* q, const double* uWeights, const double* deltaQ,
                       double* weighed) const {
    for (const RigidBody& body : m_bodies) {
        const double *w = uWeights + body.u0, *dq = deltaQ + body.q0;
        double* own = weighed + body.q0;
        const bool isUnknown = body.turning == Turning::KnownToSimbodyOnly;
        const int nq = isUnknown ? body.nq : numTurningQ(body);
        const int nu = isUnknown ? body.nu : numTurningU(body);
        for (int k = nq; k < body.nq; ++k) own[k] = w[nu + (k - nq)] * dq[k];
        if (nq == 0) continue;
        const double least = *std::min_element(w, w + nu), most = *std::max_element(w, w + nu);
        if (isUnknown || least == most) {
            for (int k = 0; k < nq; ++k) own[k] = most * dq[k];
            continue;
        }
        MatrixXd N(nq, nu);
        double unit[LargestNumQ] = {}, column[LargestNumQ];
        for (int k = 0; k < nu; ++k) {
            unit[k] = 1;
            multiplyByN(body, q + body.q0, unit, column);
            unit[k] = 0;
            N.col(k) = Map<const VectorXd>(column, nq);
        }
        const VectorXd du =
            solveSymmetric(N.transpose() * N, N.transpose() * Map<const VectorXd>(dq, nq));
        Map<VectorXd>(own, nq) = N * du.cwiseProduct(Map<const VectorXd>(w, nu));
    }
}

void RigidTree::takeSpeeds(const Vector& simbody, double* u) const {
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nu; ++k) u[body.u0 + k] = simbody[body.stateU0 + k];
}

void RigidTree::turnAlong(const double* fromQ, const double* toQ, double* u) const {
    const auto rotate = [](const RigidBody& body, const double* q) {
        return hasQuaternion(body) ? rotationOf(q + body.q0)
                                   : Rotation(BodyRotationSequence, q[body.q0], XAxis,
                                              q[body.q0 + 1], YAxis, q[body.q0 + 2], ZAxis);
    };
    for (const RigidBody& body : m_bodies) {
        if (body.turning != Turning::Quaternion && body.turning != Turning::BodyXYZ) continue;
        Vec3& omega = Vec3::updAs(u + body.u0);
        omega = rotate(body, toQ) * (~rotate(body, fromQ) * omega);
    }
}

bool RigidTree::isUsable(const double* q, const double* u) const {
    return Block::isUsable(q, u) &&
           std::all_of(m_bodies.begin(), m_bodies.end(), [&](const RigidBody& body) {
               return !hasQuaternion(body) || isUsableQuaternion(q + body.q0);
           });
}

void RigidTree::normalizeQ(double* q) const {
    for (const RigidBody& body : m_bodies)
        if (hasQuaternion(body)) Map<Vector4d>(q + body.q0, 4).normalize();
}

void RigidTree::alignQ(const double* reference, double* q) const {
    for (const RigidBody& body : m_bodies)
        if (hasQuaternion(body)) alignQuaternion(reference + body.q0, q + body.q0);
}

double RigidTree::calcDisplacement(const Root& root, const double* delta) const {
    return Map<const VectorXd>(delta + root.firstU, root.numU)
        .cwiseProduct(m_uWeights.segment(root.firstU, root.numU))
        .norm();
}

void RigidTree::getDisplacements(double* ofSpeeds) const {
    std::copy_n(m_uWeights.data(), numU, ofSpeeds);
}

double RigidTree::calcQDisplacement(const Root& root, const double* deltaQ) const {
    return Map<const VectorXd>(deltaQ + root.firstQ, root.numQ)
        .cwiseProduct(m_qWeights.segment(root.firstQ, root.numQ))
        .norm();
}

double RigidTree::calcDisplacement(const double* delta) const {
    return calcLargest(m_roots, [&](const Root& root) { return calcDisplacement(root, delta); });
}

double RigidTree::calcQDisplacement(const double* deltaQ) const {
    return calcLargest(m_roots, [&](const Root& root) { return calcQDisplacement(root, deltaQ); });
}

double RigidTree::calcUDisplacement(const double* deltaU, double h) const {
    return h * calcDisplacement(deltaU);
}

void RigidTree::getFromState(const State& state, double* q, double* u) const {
    for (const RigidBody& body : m_bodies) {
        for (int k = 0; k < body.nq; ++k) q[body.q0 + k] = state.getQ()[body.stateQ0 + k];
        for (int k = 0; k < body.nu; ++k) u[body.u0 + k] = state.getU()[body.stateU0 + k];
    }
}

void RigidTree::putIntoState(const double* q, const double* u, State& state) const {
    Vector &stateQ = state.updQ(), &stateU = state.updU();
    putCoordinates(q, u, stateQ, stateU);
}

void RigidTree::putUDot(const double*, const double* uDot, Vector& simbodyUDot) const {
    for (const RigidBody& body : m_bodies)
        for (int k = 0; k < body.nu; ++k) simbodyUDot[body.stateU0 + k] = uDot[body.u0 + k];
}

std::string RigidTree::describeSpeed(int speed) const {
    return describe("speed", speed, &RigidBody::u0, &RigidBody::nu);
}

std::string RigidTree::describeCoordinate(int coordinate) const {
    return describe("coordinate", coordinate, &RigidBody::q0, &RigidBody::nq);
}

std::string RigidTree::describe(const char* what, int index, int RigidBody::*first,
                                int RigidBody::*count) const {
    for (const RigidBody& body : m_bodies)
        if (body.*first <= index && index < body.*first + body.*count)
            return what + (" " + std::to_string(index - body.*first + 1)) + " of " +
                   std::to_string(body.*count) + " of " +
                   describeBody(m_matter, body.index, "mobilized body");
    return "'" + name + "'";
}

}  // namespace simflex
