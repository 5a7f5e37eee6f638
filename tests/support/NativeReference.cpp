#include "support/NativeReference.h"

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex::test {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using SimTK::MobilizedBodyIndex;
using SimTK::SpatialVec;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vec3;
using SimTK::Vector;
using SimTK::Vector_;

namespace {

VectorXd toVectorXd(const Vector& v) {
    VectorXd copy(v.size());
    for (int i = 0; i < v.size(); ++i) copy[i] = v[i];
    return copy;
}

/** Simbody's indices of the body's speeds: 6 of the frame, then the modes. **/
std::vector<int> findSpeeds(const FlexibleBody& body, const State& state) {
    std::vector<int> speeds;
    const int first = int(body.getFrame().getFirstUIndex(state));
    for (int i = 0; i < 6; ++i) speeds.push_back(first + i);
    for (int i = 0; i < body.getNumModes(); ++i)
        speeds.push_back(int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6);
    return speeds;
}

}  // namespace

PointMassMotion getMotion(const FlexibleMasses& body, const State& state) {
    const auto toVector3d = [](const Vec3& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
    PointMassMotion motion(body.body.getNumModes());
    const SimTK::Transform X_GB = body.body.getFramePose(state);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) motion.R_GB(i, j) = X_GB.R().asMat33()(i, j);
    const SpatialVec V_GB = body.body.getFrameVelocity(state);
    motion.p_GB = toVector3d(X_GB.p());
    motion.omega_B = motion.R_GB.transpose() * toVector3d(V_GB[0]);
    motion.v_G = toVector3d(V_GB[1]);
    motion.xi = toVectorXd(body.body.getModalCoordinates(state));
    motion.xiDot = toVectorXd(body.body.getModalSpeeds(state));
    return motion;
}

NativeReference calcNativeReference(const SimTK::MultibodySystem& system,
                                    const FlexibleBodySubsystem& flexible,
                                    const std::vector<FlexibleMasses>& bodies, const State& state,
                                    const Vector& known) {
    const SimTK::SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    State now = state;
    flexible.getGuts().setNativeForcesEnabled(now, false);
    system.realize(now, Stage::Dynamics);
    const Vector_<SpatialVec> foreign = system.getRigidBodyForces(now, Stage::Dynamics);
    const Vector mobilityForces = system.getMobilityForces(now, Stage::Dynamics);
    const int nu = now.getNU();

    // Simbody's own inertia of frame and carriers, which is replaced below.
    const Vector_<SpatialVec> noForces(matter.getNumBodies(), SpatialVec(Vec3(0), Vec3(0)));
    const auto calcResidual = [&](const Vector& uDot) {
        Vector own, applied, inertia;
        matter.calcResidualForceIgnoringConstraints(now, mobilityForces, foreign, uDot, applied);
        matter.calcResidualForceIgnoringConstraints(now, Vector(nu, 0.0), noForces, uDot, inertia);
        VectorXd residual = toVectorXd(applied);
        for (const FlexibleMasses& item : bodies) {
            const std::vector<int> speeds = findSpeeds(item.body, now);
            const int n = item.body.getNumModes();
            PointMassMotion motion = getMotion(item, now);
            for (int a = 0; a < 3; ++a) {
                motion.omegaDot_B[a] = uDot[speeds[size_t(a)]];
                motion.vDot_G[a] = uDot[speeds[size_t(3 + a)]];
            }
            motion.omegaDot_B =
                motion.R_GB.transpose() * motion.omegaDot_B;  // converts from Ground
            for (int i = 0; i < n; ++i) motion.xiDotDot[i] = uDot[speeds[size_t(6 + i)]];
            VectorXd forces = calcInertiaForces(item.part, motion);
            forces.head<3>() = motion.R_GB * forces.head<3>();
            for (int i = 0; i < n; ++i) {
                const double omegaSquared = item.part.body->omegaSquared[size_t(i)];
                forces[6 + i] += omegaSquared * motion.xi[i] +
                                 2 * item.dampingRatio * std::sqrt(omegaSquared) * motion.xiDot[i];
            }
            for (int i = 0; i < 6 + n; ++i)
                residual[speeds[size_t(i)]] += forces[i] - inertia[speeds[size_t(i)]];
        }
        return residual;
    };
    const auto calcErrors = [&](const Vector& uDot) {
        Vector errors;
        matter.calcConstraintAccelerationErrors(now, uDot, errors);
        return toVectorXd(errors);
    };

    // Unknown accelerations; the known ones are in `base`.
    std::vector<int> unknown;
    Vector base(nu, 0.0);
    for (MobilizedBodyIndex b(1); b < matter.getNumBodies(); ++b) {
        const SimTK::MobilizedBody& mobod = matter.getMobilizedBody(b);
        for (int k = 0; k < mobod.getNumU(now); ++k) {
            const int i = int(mobod.getFirstUIndex(now)) + k;
            if (mobod.getUDotMotionMethod(now) == SimTK::Motion::Free)
                unknown.push_back(i);
            else
                base[i] = known[i];
        }
    }
    const VectorXd residual = calcResidual(base), errors = calcErrors(base);
    const int n = int(unknown.size()), m = int(errors.size());
    MatrixXd K = MatrixXd::Zero(n + m, n + m);
    VectorXd b(n + m);
    for (int j = 0; j < n; ++j) {
        Vector uDot = base;
        uDot[unknown[size_t(j)]] += 1;
        const VectorXd column = calcResidual(uDot) - residual;
        for (int i = 0; i < n; ++i) K(i, j) = column[unknown[size_t(i)]];
        K.block(n, j, m, 1) = calcErrors(uDot) - errors;
        K.block(j, n, 1, m) = K.block(n, j, m, 1).transpose();
        b[j] = -residual[unknown[size_t(j)]];
    }
    b.tail(m) = -errors;
    const VectorXd x = K.completeOrthogonalDecomposition().solve(b);
    NativeReference reference{toVectorXd(base), x.tail(m)};
    for (int j = 0; j < n; ++j) reference.uDot[unknown[size_t(j)]] += x[j];
    return reference;
}

SimTK::Real calcPowerOfForces(const FlexibleBodySubsystem& flexible, const SimTK::State& state) {
    const SimTK::MultibodySystem& system = flexible.getMultibodySystem();
    system.realize(state, SimTK::Stage::Acceleration);
    const SimTK::Vector u = state.getU(), uDot = state.getUDot();
    const auto energyAt = [&](SimTK::Real t) {
        SimTK::State moved = state;
        moved.updU() = u + t * uDot;
        system.realize(moved, SimTK::Stage::Velocity);
        return flexible.calcKineticEnergy(moved);
    };
    const SimTK::Real h = 1 / uDot.norm();  // quadratic: exact for any h
    return (energyAt(h) - energyAt(-h)) / (2 * h);
}

}  // namespace simflex::test
