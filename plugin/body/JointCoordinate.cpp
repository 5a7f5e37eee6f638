#include "simflex/body/JointCoordinate.h"

#include <cmath>

#include "simflex/body/TurningAxis.h"

namespace simflex {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

Real calcAngle(const JointCoordinate& angle, const Transform& F, const Transform& M) {
    return std::atan2(~axisOf(F, angle.sine[0]) * axisOf(M, angle.sine[1]),
                      ~axisOf(F, angle.cosine[0]) * axisOf(M, angle.cosine[1]));
}

/** Returns an angle on the turn nearest to z/pitch. **/
Real countTurns(const JointCoordinate& coordinate, const Transform& F, const Transform& M,
                Real angle) {
    const Real turned = ~axisOf(F, 2) * (M.p() - F.p()) / coordinate.pitch;
    return turned - std::remainder(turned - angle, 2 * SimTK::Pi);
}

}  // namespace

Real JointCoordinate::calcValue(const Transform& F, const Transform& M) const {
    switch (kind) {
        case Kind::Displacement:
            return ~axisOf(F, sine[0]) * (M.p() - F.p());
        case Kind::Angle:
            return calcAngle(*this, F, M);
        case Kind::ScrewAngle:
            return countTurns(*this, F, M, calcAngle(*this, F, M));
    }
    return SimTK::NaN;
}

Vec3 JointCoordinate::calcMotion(const FrameMotion& F, const FrameMotion& M) const {
    if (kind == Kind::Displacement) {
        const TurningVector f = turningAxisOf(F, sine[0]);
        const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1],
                   acceleration = M.A[1] - F.A[1];
        return {~f.value * offset, ~f.rate * offset + ~f.value * velocity,
                ~f.acceleration * offset + 2 * (~f.rate * velocity) + ~f.value * acceleration};
    }
    const Vec3 s = calcDotProduct(turningAxisOf(F, sine[0]), turningAxisOf(M, sine[1]));
    const Vec3 c = calcDotProduct(turningAxisOf(F, cosine[0]), turningAxisOf(M, cosine[1]));
    const Real squared = s[0] * s[0] + c[0] * c[0];
    const Real rate = (c[0] * s[1] - s[0] * c[1]) / squared;
    const Real growth = 2 * (c[0] * c[1] + s[0] * s[1]) / squared;
    const Real angle = std::atan2(s[0], c[0]);
    return {kind == Kind::Angle ? angle : countTurns(*this, F.X, M.X, angle), rate,
            (c[0] * s[2] - s[0] * c[2]) / squared - rate * growth};
}

void JointCoordinate::calcGradient(const Transform& F, const Transform& M, SpatialVec& D_F,
                                   SpatialVec& D_M) const {
    if (kind == Kind::Displacement) {
        const Vec3 f = axisOf(F, sine[0]);
        D_F = {f % (M.p() - F.p()), -f};
        D_M = {Vec3(0), f};
        return;
    }
    const Vec3 f1 = axisOf(F, sine[0]), m1 = axisOf(M, sine[1]);
    const Vec3 f2 = axisOf(F, cosine[0]), m2 = axisOf(M, cosine[1]);
    const Real s = ~f1 * m1, c = ~f2 * m2;
    const Vec3 normal = (c * (m1 % f1) - s * (m2 % f2)) / (s * s + c * c);
    D_F = {-normal, Vec3(0)};
    D_M = {normal, Vec3(0)};
}

}  // namespace simflex
