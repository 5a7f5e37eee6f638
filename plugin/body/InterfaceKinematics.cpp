#include "simflex/body/InterfaceKinematics.h"

#include <cmath>

namespace simflex {

using SimTK::Mat33;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Vec3;

namespace {

/** Coefficients of the exponential and its Jacobian at angle t = |θ|, and their derivatives divided
 * by t. **/
struct Coefficients {
    Real a;       ///< sin t / t
    Real b;       ///< (1 − cos t)/t²
    Real c;       ///< (t − sin t)/t³
    Real bSlope;  ///< b'(t)/t
    Real cSlope;  ///< c'(t)/t
};

Coefficients calcCoefficients(Real squared) {
    // Below t = 1 the closed forms lose digits to cancellation: series in x = t², as many terms as
    // round-off asks.
    if (squared < 1) {
        const int terms = squared < 1e-4 ? 4 : 10;
        Coefficients k{0, 0, 0, 0, 0};
        Real power = 1, previousPower = 0, factorial = 1;  // ±x^n, ±x^(n−1), (2n+1)!
        for (int n = 0; n < terms; ++n) {
            const Real inB = 1 / (factorial * (2 * n + 2)), inC = inB / (2 * n + 3);
            k.a += power / factorial;
            k.b += power * inB;
            k.c += power * inC;
            k.bSlope -= 2 * n * previousPower * inB;
            k.cSlope -= 2 * n * previousPower * inC;
            factorial *= (2 * n + 2) * (2 * n + 3);
            previousPower = power;
            power *= -squared;
        }
        return k;
    }
    const Real t = std::sqrt(squared), sine = std::sin(t), cosine = std::cos(t);
    const Real a = sine / t, b = (1 - cosine) / squared, c = (t - sine) / (squared * t);
    return {a, b, c, (a - 2 * b) / squared, (b - 3 * c) / squared};
}

}  // namespace

Mat33 calcLeftJacobian(const Vec3& theta) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Mat33 skew = SimTK::crossMat(theta);
    return Mat33(1) + k.b * skew + k.c * skew * skew;
}

Vec3 calcLeftJacobianDotTimes(const Vec3& theta, const Vec3& thetaDot) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Real rate = ~theta * thetaDot;
    const Vec3 once = theta % thetaDot, twice = theta % once;
    // d/dt of b[θ]× + c[θ]×², applied to θ̇; [θ̇]×θ̇ = 0.
    return k.bSlope * rate * once + k.cSlope * rate * twice + k.c * (thetaDot % once);
}

Rotation calcExponential(const Vec3& theta) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Mat33 skew = SimTK::crossMat(theta);
    return Rotation(Mat33(1) + k.a * skew + k.b * skew * skew, true);
}

Vec3 multiplyShapes(const std::vector<double>& shapes, const double* coordinates) {
    const double* column = shapes.data();
    const int n = int(shapes.size() / 3);
    Real x = 0, y = 0, z = 0;
    for (int i = 0; i < n; ++i, column += 3) {
        x += column[0] * coordinates[i];
        y += column[1] * coordinates[i];
        z += column[2] * coordinates[i];
    }
    return {x, y, z};
}

FlexibleFramePose calcFramePose(const FlexibleFrame& frame, const double* xi) {
    FlexibleFramePose pose;
    pose.theta = multiplyShapes(frame.shapes->Psi, xi);
    pose.E = calcLeftJacobian(pose.theta);
    const Rotation R_BI = calcExponential(pose.theta);
    pose.rho = R_BI * frame.X_IA.p();
    pose.R_BA = R_BI * frame.X_IA.R();
    pose.r = frame.shapes->s + multiplyShapes(frame.shapes->Phi, xi) + pose.rho;
    return pose;
}

FrameMotion calcFrameMotion(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                            const BodyFrame& body, const double* xiDot) {
    const Vec3 omegaRel = pose.E * multiplyShapes(frame.shapes->Psi, xiDot);
    const Vec3 vRel = multiplyShapes(frame.shapes->Phi, xiDot) + omegaRel % pose.rho;
    FrameMotion motion;
    motion.X = SimTK::Transform(body.R_GB * pose.R_BA, body.p_GB + body.R_GB * pose.r);
    motion.V = {body.R_GB * (body.omega_B + omegaRel),
                body.v_G + body.R_GB * (body.omega_B % pose.r + vRel)};
    return motion;
}

SpatialVec calcFrameAcceleration(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                                 const BodyFrame& body, const double* xiDot, const Vec3& omegaDot_B,
                                 const Vec3& vDot_G, const double* xiDotDot) {
    const Vec3 thetaDot = multiplyShapes(frame.shapes->Psi, xiDot);
    const Vec3 omegaRel = pose.E * thetaDot;
    const Vec3 vRel = multiplyShapes(frame.shapes->Phi, xiDot) + omegaRel % pose.rho;
    const Vec3 alphaRel = pose.E * multiplyShapes(frame.shapes->Psi, xiDotDot) +
                          calcLeftJacobianDotTimes(pose.theta, thetaDot);
    const Vec3 aRel = multiplyShapes(frame.shapes->Phi, xiDotDot) + alphaRel % pose.rho +
                      omegaRel % (omegaRel % pose.rho);
    const Vec3& omega = body.omega_B;
    const Vec3 alpha_B = omegaDot_B + omega % omegaRel + alphaRel;
    const Vec3 a_B = omegaDot_B % pose.r + omega % (omega % pose.r) + 2 * (omega % vRel) + aRel;
    return {body.R_GB * alpha_B, vDot_G + body.R_GB * a_B};
}

void calcFrameForce(const FlexibleFramePose& pose, const Rotation& R_GB, const SpatialVec& F_G,
                    Vec3& torque_B, Vec3& force_G, Vec3& translation, Vec3& rotation) {
    const Vec3 torque = ~R_GB * F_G[0];
    translation = ~R_GB * F_G[1];
    torque_B = torque + pose.r % translation;
    force_G = F_G[1];
    rotation = ~pose.E * (torque + pose.rho % translation);
}

void addInFrameForce(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                     const Rotation& R_GB, const SpatialVec& F_G, Vec3& torque_B, Vec3& force_G,
                     double* modal) {
    Vec3 torque, linear, force, moment;
    calcFrameForce(pose, R_GB, F_G, torque, linear, force, moment);
    torque_B += torque;
    force_G += linear;
    const double *phi = frame.shapes->Phi.data(), *psi = frame.shapes->Psi.data();
    for (int i = 0; i < frame.numModes(); ++i, phi += 3, psi += 3)
        modal[i] += phi[0] * force[0] + phi[1] * force[1] + phi[2] * force[2] + psi[0] * moment[0] +
                    psi[1] * moment[1] + psi[2] * moment[2];
}

void addInConstraintRow(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                        const Rotation& R_GB, const SpatialVec& d, double* row) {
    Vec3 torque_B(0), force_G(0);
    addInFrameForce(frame, pose, R_GB, d, torque_B, force_G, row + 6);
    for (int a = 0; a < 3; ++a) {
        row[a] += torque_B[a];
        row[3 + a] += force_G[a];
    }
}

}  // namespace simflex
