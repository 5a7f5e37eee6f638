#include "simflex/body/JointEquations.h"

#include <cmath>

namespace simflex {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr int X = 0, Y = 1, Z = 2;

/** A vector that turns with ω, and its first two derivatives. **/
struct TurningVector {
    Vec3 value, rate, acceleration;
    TurningVector(const Vec3& axis, const FrameMotion& frame)
        : value(axis),
          rate(frame.V[0] % axis),
          acceleration(frame.A[0] % axis + frame.V[0] % rate) {}
};

Vec3 axisOf(const Transform& frame, int axis) {
    return Vec3(frame.R().col(axis));
}

/** Value, rate and acceleration of f·m. **/
Vec3 calcDotProduct(const TurningVector& f, const TurningVector& m) {
    return {~f.value * m.value, ~f.rate * m.value + ~f.value * m.rate,
            ~f.acceleration * m.value + 2 * (~f.rate * m.rate) + ~f.value * m.acceleration};
}

/** Sine-like and cosine-like products of the angle row. **/
struct AngleProducts {
    Vec3 sine, cosine;
    AngleProducts(const FrameMotion& F, const FrameMotion& M)
        : sine(calcDotProduct({axisOf(F.X, Y), F}, {axisOf(M.X, X), M})),
          cosine(calcDotProduct({axisOf(F.X, X), F}, {axisOf(M.X, X), M})) {}
};

}  // namespace

JointEquations JointEquations::makeBall() {
    return {"Ball", {{RowKind::Coincident, X}, {RowKind::Coincident, Y}, {RowKind::Coincident, Z}}};
}

JointEquations JointEquations::makePin() {
    return {"Pin",
            {{RowKind::Coincident, X},
             {RowKind::Coincident, Y},
             {RowKind::Coincident, Z},
             {RowKind::Perpendicular, X, Z},
             {RowKind::Perpendicular, Y, Z}}};
}

JointEquations JointEquations::makeSlider() {
    return {"Slider",
            {{RowKind::OnAxis, Y},
             {RowKind::OnAxis, Z},
             {RowKind::Perpendicular, X, Y},
             {RowKind::Perpendicular, Y, Z},
             {RowKind::Perpendicular, Z, X}}};
}

JointEquations JointEquations::makeWeld() {
    return {"Weld",
            {{RowKind::Coincident, X},
             {RowKind::Coincident, Y},
             {RowKind::Coincident, Z},
             {RowKind::Perpendicular, X, Y},
             {RowKind::Perpendicular, Y, Z},
             {RowKind::Perpendicular, Z, X}}};
}

JointEquations JointEquations::makePrescribedRotation(AngleFunction angle) {
    JointEquations equations("PrescribedRotation", {{RowKind::Angle}});
    equations.m_angle = std::move(angle);
    return equations;
}

void JointEquations::calcErrors(Real time, const Transform& F, const Transform& M,
                                Real* errors) const {
    const Vec3 offset = M.p() - F.p();
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errors++ = offset[row.axisF];
                break;
            case RowKind::OnAxis:
                *errors++ = ~axisOf(F, row.axisF) * offset;
                break;
            case RowKind::Perpendicular:
                *errors++ = ~axisOf(F, row.axisF) * axisOf(M, row.axisM);
                break;
            case RowKind::Angle: {
                const Real angle =
                    std::atan2(~axisOf(F, Y) * axisOf(M, X), ~axisOf(F, X) * axisOf(M, X));
                *errors++ = std::remainder(angle - m_angle(time)[0], 2 * SimTK::Pi);
                break;
            }
        }
    }
}

void JointEquations::calcErrorDots(Real time, const FrameMotion& F, const FrameMotion& M,
                                   Real* errorDots) const {
    const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1];
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errorDots++ = velocity[row.axisF];
                break;
            case RowKind::OnAxis: {
                const TurningVector f(axisOf(F.X, row.axisF), F);
                *errorDots++ = ~f.rate * offset + ~f.value * velocity;
                break;
            }
            case RowKind::Perpendicular:
                *errorDots++ =
                    calcDotProduct({axisOf(F.X, row.axisF), F}, {axisOf(M.X, row.axisM), M})[1];
                break;
            case RowKind::Angle: {
                const AngleProducts p(F, M);
                const Real squared = p.sine[0] * p.sine[0] + p.cosine[0] * p.cosine[0];
                *errorDots++ = (p.cosine[0] * p.sine[1] - p.sine[0] * p.cosine[1]) / squared -
                               m_angle(time)[1];
                break;
            }
        }
    }
}

void JointEquations::calcErrorDotDots(Real time, const FrameMotion& F, const FrameMotion& M,
                                      Real* errorDotDots) const {
    const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1],
               acceleration = M.A[1] - F.A[1];
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errorDotDots++ = acceleration[row.axisF];
                break;
            case RowKind::OnAxis: {
                const TurningVector f(axisOf(F.X, row.axisF), F);
                *errorDotDots++ =
                    ~f.acceleration * offset + 2 * (~f.rate * velocity) + ~f.value * acceleration;
                break;
            }
            case RowKind::Perpendicular:
                *errorDotDots++ =
                    calcDotProduct({axisOf(F.X, row.axisF), F}, {axisOf(M.X, row.axisM), M})[2];
                break;
            case RowKind::Angle: {
                const AngleProducts p(F, M);
                const Real squared = p.sine[0] * p.sine[0] + p.cosine[0] * p.cosine[0];
                const Real rate = (p.cosine[0] * p.sine[1] - p.sine[0] * p.cosine[1]) / squared;
                const Real growth =
                    2 * (p.cosine[0] * p.cosine[1] + p.sine[0] * p.sine[1]) / squared;
                *errorDotDots++ = (p.cosine[0] * p.sine[2] - p.sine[0] * p.cosine[2]) / squared -
                                  rate * growth - m_angle(time)[2];
                break;
            }
        }
    }
}

void JointEquations::calcJacobian(const Transform& F, const Transform& M, SpatialVec* D_F,
                                  SpatialVec* D_M) const {
    const Vec3 offset = M.p() - F.p();
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident: {
                Vec3 axis(0);
                axis[row.axisF] = 1;
                *D_F++ = {Vec3(0), -axis};
                *D_M++ = {Vec3(0), axis};
                break;
            }
            case RowKind::OnAxis: {
                const Vec3 f = axisOf(F, row.axisF);
                *D_F++ = {f % offset, -f};
                *D_M++ = {Vec3(0), f};
                break;
            }
            case RowKind::Perpendicular: {
                const Vec3 normal = axisOf(M, row.axisM) % axisOf(F, row.axisF);
                *D_F++ = {-normal, Vec3(0)};
                *D_M++ = {normal, Vec3(0)};
                break;
            }
            case RowKind::Angle: {
                const Vec3 m = axisOf(M, X), sineNormal = m % axisOf(F, Y),
                           cosineNormal = m % axisOf(F, X);
                const Real sine = ~axisOf(F, Y) * m, cosine = ~axisOf(F, X) * m;
                const Vec3 normal =
                    (cosine * sineNormal - sine * cosineNormal) / (sine * sine + cosine * cosine);
                *D_F++ = {-normal, Vec3(0)};
                *D_M++ = {normal, Vec3(0)};
                break;
            }
        }
    }
}

void JointEquations::addInTimeRate(Real time, Real* errorDots) const {
    for (const Row& row : m_rows) {
        if (row.kind == RowKind::Angle) *errorDots -= m_angle(time)[1];
        ++errorDots;
    }
}

bool JointEquations::isFlipped(const Transform& F, const Transform& M) const {
    bool axisUsed[3] = {false, false, false};
    int perpendicular = 0;
    for (const Row& row : m_rows) {
        if (row.kind != RowKind::Perpendicular) continue;
        axisUsed[row.axisM] = true;
        ++perpendicular;
    }
    // Two rows hold one common axis (Pin's z), three hold all. Where the rows vanish, an axis is
    // along its own, opposed to it, or, with three rows, along another one of F.
    for (int axis = 0; axis < 3; ++axis)
        if ((perpendicular == 3 || axisUsed[axis]) && ~axisOf(F, axis) * axisOf(M, axis) < 0.5)
            return true;
    return false;
}

}  // namespace simflex
