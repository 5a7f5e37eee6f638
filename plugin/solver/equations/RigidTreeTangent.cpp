// Derivatives of a rigid tree's inertial forces, gravity and linear mobility forces: exact, in
// closed form, O(n) body by body.
//
// Motions (ω, v) and forces (n, f) about one resting point near the tree; S are the screws of a
// body's mobilizer, c its Ṡu in its own frame F:
//
//     V_B = V_P + S u,   A_B = A_P + S u̇ + V_P × S u + c,
//     F_B = I_B (A_B − g) + V_B ×* I_B V_B,   r = Sᵀ Σ F of all bodies outboard
//
// A displacement along S_j rotates everything outboard and has the same effect on all bodies there,
// as has a change of u_j:
//
//     δV = S_j × V + ν_j,   δA = S_j × A + ν_j × V + α_j,
//     δF = S_j ×* F + I α_j + D ν_j + I (S_j × g),   ∂F/∂u_j = I β_j + D S_j,
//     D x = I (x × V) + x ×* I V + V ×* I x          (of the angular part of x alone)
//
// Screws outboard turn with j: there S_j ×* F, F summed over all bodies outboard, drops out of the
// rows. With X = (S_j/mass + β_j + stiffness α_j, S_j + stiffness ν_j, stiffness S_j), of the
// latter two the angular parts, that is a TreeMatrix: Q = [I, D, I(· × g)], C_j = stiffness S_j ×*
// F. Compare R. Featherstone, Rigid Body Dynamics Algorithms, and J. Carpentier and N. Mansard,
// Analytical Derivatives of Rigid Body Dynamics Algorithms (2018).
#include <algorithm>

#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;

namespace {

SpatialVec crossMotion(const SpatialVec& a, const SpatialVec& b) {
    return {a[0] % b[0], a[0] % b[1] + a[1] % b[0]};
}

SpatialVec crossForce(const SpatialVec& a, const SpatialVec& F) {
    return {a[0] % F[0] + a[1] % F[1], a[0] % F[1]};
}

Real calcPowerOf(const SpatialVec& motion, const SpatialVec& force) {
    return dot(motion[0], force[0]) + dot(motion[1], force[1]);
}

const SpatialVec ZeroMotion{Vec3(0), Vec3(0)};

}  // namespace

/** Derivatives of the screws of a mobilizer along its own speeds, in F. **/
struct RigidTree::ScrewRates {
    bool areZero = true;
    SpatialVec along[6][6];  ///< [k][l]: of S_k along l
    SpatialVec second[6];    ///< of Σ_kl along[k][l] u_k u_l along m
};

void RigidTree::calcScrewRates(const RigidBody& body, const double* q, const double* u,
                               ScrewRates& rates) {
    const double *qb = q + body.q0, *ub = u + body.u0;
    const Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    // Turns about axes through M's origin, which the translations behind them move.
    Vec3 axes[3], directions[3] = {x, y, z}, p(0);
    int numTurns = 0, numShifts = 0;
    bool followsTurns = false;  ///< a later axis turns with the earlier ones
    switch (body.mobilizer) {
        case Mobilizer::Universal:
        case Mobilizer::Gimbal:
        case Mobilizer::Bushing: {
            followsTurns = true;
            numTurns = body.mobilizer == Mobilizer::Universal ? 2 : 3;
            const CoordinateAxis turned[3] = {XAxis, YAxis, ZAxis};
            Rotation R;
            for (int k = 0; k < numTurns; ++k) {
                axes[k] = R * directions[k];
                R = R * Rotation(qb[k], turned[k]);
            }
            if (body.mobilizer != Mobilizer::Bushing) break;
            numShifts = 3;
            p = Vec3::getAs(qb + 3);
            break;
        }
        case Mobilizer::Planar:
            numTurns = 1;
            axes[0] = z;
            numShifts = 2;
            p = Vec3(qb[1], qb[2], 0);
            break;
        case Mobilizer::Free:
            numTurns = numShifts = 3;
            std::copy_n(directions, 3, axes);
            p = Vec3::getAs(qb + numTurningQ(body));
            break;
        case Mobilizer::BendStretch: {
            // S₁ alone turns.
            const Rotation R(qb[0], ZAxis);
            rates.areZero = false;
            for (auto& row : rates.along) std::fill_n(row, 6, ZeroMotion);
            std::fill_n(rates.second, 6, ZeroMotion);
            rates.along[1][0] = {Vec3(0), R * y};
            rates.second[0] = {Vec3(0), -ub[0] * ub[1] * (R * x)};
            return;
        }
        default:  // screws that stand still in F
            rates.areZero = true;
            return;
    }
    rates.areZero = false;
    for (auto& row : rates.along) std::fill_n(row, 6, ZeroMotion);
    std::fill_n(rates.second, 6, ZeroMotion);
    Vec3 turned[3][3];  // of axis k along l
    for (int k = 0; k < numTurns; ++k)
        for (int l = 0; l < numTurns; ++l) {
            turned[k][l] = followsTurns && l < k ? axes[l] % axes[k] : Vec3(0);
            rates.along[k][l] = {turned[k][l], p % turned[k][l]};
        }
    for (int k = 0; k < numTurns; ++k)
        for (int i = 0; i < numShifts; ++i) {
            rates.along[k][numTurns + i] = {Vec3(0), directions[i] % axes[k]};
            for (int m = 0; m < numTurns; ++m) {
                const Vec3 v = directions[i] % turned[k][m];
                rates.second[m] += SpatialVec(Vec3(0), v * ub[k] * ub[numTurns + i]);
                rates.second[numTurns + i] += SpatialVec(Vec3(0), v * ub[k] * ub[m]);
            }
        }
    for (int k = 0; k < numTurns; ++k)
        for (int l = 0; followsTurns && l < k; ++l)
            for (int m = 0; m < numTurns; ++m) {
                const Vec3 a = (turned[l][m] % axes[k] + axes[l] % turned[k][m]) * (ub[k] * ub[l]);
                rates.second[m] += SpatialVec(a, p % a);
            }
}

SpatialVec RigidTree::carryFromF(const RigidBody& body, const SpatialVec& screw) const {
    const Transform X_GF =
        (body.parent < 0 ? Transform() : m_bodies[size_t(body.parent)].X_GB) * body.X_PF;
    const Vec3 omega = X_GF.R() * screw[0];
    return {omega, X_GF.R() * screw[1] +
                       (X_GF.p() - m_tangents[size_t(&body - m_bodies.data())].reference) % omega};
}

void RigidTree::calcTangents(const EvaluationContext& context, const double* q, const double* u,
                             const double* uDot) {
    m_tangents.resize(m_bodies.size());
    m_speedTangents.resize(size_t(numU));
    ScrewRates rates;
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        const RigidBody& body = m_bodies[b];
        const BodyTangent* parent = body.parent < 0 ? nullptr : &m_tangents[size_t(body.parent)];
        BodyTangent& own = m_tangents[b];
        own.reference = parent ? parent->reference : body.X_GB.p();
        const SpatialVec V_P = parent ? parent->V : ZeroMotion,
                         A_P = parent ? parent->A : ZeroMotion;
        const double *ub = u + body.u0, *uDotB = uDot + body.u0;
        SpeedTangent* speeds = m_speedTangents.data() + body.u0;
        const Vec3 origin = body.X_GB.p() - own.reference;
        SpatialVec Su = ZeroMotion, SuDot = ZeroMotion;
        for (int k = 0; k < body.nu; ++k) {
            speeds[k].S = {body.H[k][0], body.H[k][1] + origin % body.H[k][0]};
            Su += ub[k] * speeds[k].S;
            SuDot += uDotB[k] * speeds[k].S;
        }
        own.V = V_P + Su;
        own.A = A_P + SuDot + crossMotion(V_P, Su);
        calcScrewRates(body, q, u, rates);
        if (!rates.areZero) {
            SpatialVec c = ZeroMotion;
            for (int k = 0; k < body.nu; ++k)
                for (int l = 0; l < body.nu; ++l) c += ub[k] * ub[l] * rates.along[k][l];
            own.A += carryFromF(body, c);
        }
        for (int j = 0; j < body.nu; ++j) {
            SpeedTangent& speed = speeds[j];
            SpatialVec nu = -crossMotion(speed.S, own.V), alpha = -crossMotion(speed.S, own.A);
            speed.beta = crossMotion(V_P, speed.S) - crossMotion(speed.S, own.V);
            if (!rates.areZero) {
                SpatialVec ofSu = ZeroMotion, ofSuDot = ZeroMotion, ofBoth = ZeroMotion;
                for (int k = 0; k < body.nu; ++k) {
                    ofSu += ub[k] * rates.along[k][j];
                    ofSuDot += uDotB[k] * rates.along[k][j];
                    ofBoth += ub[k] * (rates.along[k][j] + rates.along[j][k]);
                }
                ofSu = carryFromF(body, ofSu);
                nu += ofSu;
                alpha += carryFromF(body, ofSuDot + rates.second[j]) + crossMotion(V_P, ofSu);
                speed.beta += carryFromF(body, ofBoth);
            }
            speed.alpha = alpha - crossMotion(nu, own.V);
            speed.nu = nu[0];
        }

        const Real m = body.mass.getMass();
        const Rotation& R = body.X_GB.R();
        const Vec3 fromOrigin = R * body.mass.getMassCenter(), c = origin + fromOrigin, h = m * c;
        const auto spread = [](const Vec3& v) { return dot(v, v) * Mat33(1) - v * ~v; };
        const Vec3 &omega = own.V[0], &v = own.V[1],
                   g = context.gravity->atBody[size_t(body.index)];
        own.mass = m;
        own.moment = h;
        own.inertia = R * body.mass.getInertia().toMat33() * ~R.asMat33() +
                      m * (spread(c) - spread(fromOrigin));
        own.weight = m * g;
        const Vec3 n = own.inertia * omega + h % v;
        own.momentum = m * v - h % omega;
        const Mat33 turn = crossMat(omega), move = crossMat(v), centre = crossMat(h);
        own.gyration =
            turn * own.inertia - own.inertia * turn - move * centre - centre * move - crossMat(n);
        own.byGravity = -(centre * crossMat(g));
        const Vec3 a = own.A[1] - g;
        own.force = SpatialVec(own.inertia * own.A[0] + h % a, m * a - h % own.A[0]) +
                    crossForce(own.V, SpatialVec(n, own.momentum));
    }
    // Every body follows its parent.
    for (size_t b = m_bodies.size(); b-- > 0;)
        if (m_bodies[b].parent >= 0)
            m_tangents[size_t(m_bodies[b].parent)].force += m_tangents[b].force;
}

void RigidTree::sizeTree(BasicTreeMatrix<double>& tree) const {
    if (tree.nodes.size() == m_bodies.size()) return;
    std::vector<BasicTreeMatrix<double>::Node> nodes;
    for (const RigidBody& body : m_bodies) nodes.push_back({body.parent, body.u0, body.nu});
    tree.resize(std::move(nodes), numU);
}

void RigidTree::formInertia(BasicTreeMatrix<double>& tree) const {
    sizeTree(tree);
    std::vector<Vec3> references(m_bodies.size());
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        const RigidBody& body = m_bodies[b];
        references[b] = body.parent < 0 ? body.X_GB.p() : references[size_t(body.parent)];
        const Vec3 origin = body.X_GB.p() - references[b];
        const Rotation& R = body.X_GB.R();
        const Real m = body.mass.getMass();
        const Vec3 fromOrigin = R * body.mass.getMassCenter(), c = origin + fromOrigin;
        const auto spread = [](const Vec3& v) { return dot(v, v) * Mat33(1) - v * ~v; };
        const Mat33 inertia = R * body.mass.getInertia().toMat33() * ~R.asMat33() +
                              m * (spread(c) - spread(fromOrigin)),
                    moment = m * crossMat(c);
        Map<Eigen::Matrix<double, 6, 12>> Q(tree.inertia.data() + 72 * b);
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) {
                Q(i, k) = inertia(i, k);
                Q(i, 3 + k) = moment(i, k);
                Q(3 + i, k) = -moment(i, k);
                Q(3 + i, 3 + k) = i == k ? m : 0;
            }
        for (int k = 0; k < body.nu; ++k) {
            const SpatialVec S(body.H[k][0], body.H[k][1] + origin % body.H[k][0]);
            const size_t speed = size_t(body.u0 + k);
            for (int i = 0; i < 6; ++i)
                tree.motions[12 * speed + size_t(i)] = tree.screws[6 * speed + size_t(i)] =
                    S[i / 3][i % 3];
        }
    }
}

void RigidTree::formTangent(const NewtonFactors& factors, const EvaluationContext& context,
                            const double* q, const double* u, const double* uDot,
                            BasicTreeMatrix<double>& tree) {
    calcTangents(context, q, u, uDot);
    sizeTree(tree);
    const double stiffness = factors.stiffness;
    const auto put = [](const SpatialVec& v, double* to) {
        std::copy_n(&v[0][0], 3, to);
        std::copy_n(&v[1][0], 3, to + 3);
    };
    ScrewRates rates;
    for (size_t b = 0; b < m_bodies.size(); ++b) {
        const RigidBody& body = m_bodies[b];
        const BodyTangent& own = m_tangents[b];
        const Mat33 moment = crossMat(own.moment);
        Map<Eigen::Matrix<double, 6, 12>> Q(tree.inertia.data() + 72 * b);
        const auto set = [&](int row, int column, const Mat33& values) {
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) Q(row + i, column + k) = values(i, k);
        };
        set(0, 0, own.inertia);
        set(0, 3, moment);
        set(0, 6, own.gyration);
        set(0, 9, own.byGravity);
        set(3, 0, -moment);
        set(3, 3, own.mass * Mat33(1));
        set(3, 6, -2 * crossMat(own.momentum));
        set(3, 9, -crossMat(own.weight));
        calcScrewRates(body, q, u, rates);
        for (int j = 0; j < body.nu; ++j) {
            const size_t speed = size_t(body.u0 + j);
            const SpeedTangent& tangent = m_speedTangents[speed];
            double* X = tree.motions.data() + 12 * speed;
            put(tangent.S, tree.screws.data() + 6 * speed);
            put(tangent.S / factors.mass + tangent.beta + stiffness * tangent.alpha, X);
            put({tangent.S[0] + stiffness * tangent.nu, stiffness * tangent.S[0]}, X + 6);
            const SpatialVec turned = stiffness * crossForce(tangent.S, own.force);
            put(turned, tree.turned.data() + 6 * speed);
            double* E = tree.own.data() + 6 * speed;
            for (int k = 0; k < body.nu; ++k) {
                E[k] = calcPowerOf(m_speedTangents[size_t(body.u0 + k)].S, turned);
                if (!rates.areZero)
                    E[k] += stiffness * calcPowerOf(carryFromF(body, rates.along[k][j]), own.force);
            }
            if (!context.mobilities) continue;
            const MobilityForces& forces = *context.mobilities;
            double unit[LargestNumQ] = {}, qDot[LargestNumQ];
            unit[j] = 1;
            multiplyByN(body, q + body.q0, unit, qDot);
            for (int k = 0; k < body.nu; ++k)
                E[k] += stiffness * forces.stiffness[size_t(body.stateU0 + k)] * qDot[k];
            E[j] += forces.damping[size_t(body.stateU0 + j)];
        }
    }
}

}  // namespace simflex
