#include "simflex/body/JointEquations.h"

#include <cmath>

namespace simflex {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr int X = 0, Y = 1, Z = 2;

using Row = JointEquations::Row;
using RowKind = JointEquations::RowKind;
using Coordinate = JointEquations::Coordinate;
using CoordinateKind = JointEquations::CoordinateKind;

const Coordinate AngleAboutZ{CoordinateKind::Angle, {Y, X}, {X, X}};

Coordinate makeDisplacement(int axis) {
    return {CoordinateKind::Displacement, {axis, axis}};
}

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

TurningVector turningAxisOf(const FrameMotion& frame, int axis) {
    return {axisOf(frame.X, axis), frame};
}

/** Value, rate and acceleration of f·m. **/
Vec3 calcDotProduct(const TurningVector& f, const TurningVector& m) {
    return {~f.value * m.value, ~f.rate * m.value + ~f.value * m.rate,
            ~f.acceleration * m.value + 2 * (~f.rate * m.rate) + ~f.value * m.acceleration};
}

/** Value, rate and acceleration of f·(p_M − p_F). **/
Vec3 calcDisplacement(const FrameMotion& F, const FrameMotion& M, int axis) {
    const TurningVector f = turningAxisOf(F, axis);
    const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1],
               acceleration = M.A[1] - F.A[1];
    return {~f.value * offset, ~f.rate * offset + ~f.value * velocity,
            ~f.acceleration * offset + 2 * (~f.rate * velocity) + ~f.value * acceleration};
}

/** Value, rate and acceleration of |p_M − p_F|. **/
Vec3 calcDistance(const FrameMotion& F, const FrameMotion& M) {
    const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1],
               acceleration = M.A[1] - F.A[1];
    const Real distance = offset.norm(), rate = ~offset * velocity / distance;
    return {distance, rate,
            (~offset * acceleration + ~velocity * velocity - rate * rate) / distance};
}

Real calcAngle(const Transform& F, const Transform& M, const Coordinate& angle = AngleAboutZ) {
    return std::atan2(~axisOf(F, angle.sine[0]) * axisOf(M, angle.sine[1]),
                      ~axisOf(F, angle.cosine[0]) * axisOf(M, angle.cosine[1]));
}

/** Value, rate and acceleration of an angle. **/
Vec3 calcAngle(const FrameMotion& F, const FrameMotion& M, const Coordinate& angle = AngleAboutZ) {
    const Vec3 sine =
        calcDotProduct(turningAxisOf(F, angle.sine[0]), turningAxisOf(M, angle.sine[1]));
    const Vec3 cosine =
        calcDotProduct(turningAxisOf(F, angle.cosine[0]), turningAxisOf(M, angle.cosine[1]));
    const Real squared = sine[0] * sine[0] + cosine[0] * cosine[0];
    const Real rate = (cosine[0] * sine[1] - sine[0] * cosine[1]) / squared;
    const Real growth = 2 * (cosine[0] * cosine[1] + sine[0] * sine[1]) / squared;
    return {std::atan2(sine[0], cosine[0]), rate,
            (cosine[0] * sine[2] - sine[0] * cosine[2]) / squared - rate * growth};
}

/** The angle's derivative with respect to ω_M, and minus that to ω_F. **/
Vec3 calcAngleNormal(const Transform& F, const Transform& M) {
    const Vec3 m = axisOf(M, X), sineNormal = m % axisOf(F, Y), cosineNormal = m % axisOf(F, X);
    const Real sine = ~axisOf(F, Y) * m, cosine = ~axisOf(F, X) * m;
    return (cosine * sineNormal - sine * cosineNormal) / (sine * sine + cosine * cosine);
}

/** Order 0, 1 or 2 of the function of time that drives a row, or 0. **/
Real getMotion(const Row& row, const JointEquations::MotionFunction* motions, Real time,
               int order) {
    return row.motion < 0 ? 0 : motions[row.motion](time)[order];
}

}  // namespace

JointEquations JointEquations::makeBall() {
    return {
        "Ball", {{RowKind::Coincident, X}, {RowKind::Coincident, Y}, {RowKind::Coincident, Z}}, {}};
}

JointEquations JointEquations::makePin() {
    return {"Pin",
            {{RowKind::Coincident, X},
             {RowKind::Coincident, Y},
             {RowKind::Coincident, Z},
             {RowKind::Perpendicular, X, Z},
             {RowKind::Perpendicular, Y, Z}},
            {AngleAboutZ}};
}

JointEquations JointEquations::makeSlider() {
    return {"Slider",
            {{RowKind::OnAxis, Y},
             {RowKind::OnAxis, Z},
             {RowKind::Perpendicular, X, Y},
             {RowKind::Perpendicular, Y, Z},
             {RowKind::Perpendicular, Z, X}},
            {makeDisplacement(X)}};
}

JointEquations JointEquations::makeWeld() {
    return {"Weld",
            {{RowKind::Coincident, X},
             {RowKind::Coincident, Y},
             {RowKind::Coincident, Z},
             {RowKind::Perpendicular, X, Y},
             {RowKind::Perpendicular, Y, Z},
             {RowKind::Perpendicular, Z, X}},
            {}};
}

JointEquations JointEquations::makeCylinder() {
    return {"Cylinder",
            {{RowKind::OnAxis, X},
             {RowKind::OnAxis, Y},
             {RowKind::Perpendicular, X, Z},
             {RowKind::Perpendicular, Y, Z}},
            {AngleAboutZ, makeDisplacement(Z)}};
}

JointEquations JointEquations::makeUniversal() {
    return {"Universal",
            {{RowKind::Coincident, X},
             {RowKind::Coincident, Y},
             {RowKind::Coincident, Z},
             {RowKind::Perpendicular, X, Y}},
            {{CoordinateKind::Angle, {Z, Y}, {Y, Y}}, {CoordinateKind::Angle, {X, Z}, {X, X}}}};
}

JointEquations JointEquations::makePlanar() {
    return {"Planar",
            {{RowKind::OnAxis, Z}, {RowKind::Perpendicular, X, Z}, {RowKind::Perpendicular, Y, Z}},
            {AngleAboutZ, makeDisplacement(X), makeDisplacement(Y)}};
}

JointEquations JointEquations::makeScrew(Real pitch) {
    JointEquations equations("Screw",
                             {{RowKind::OnAxis, X},
                              {RowKind::OnAxis, Y},
                              {RowKind::Perpendicular, X, Z},
                              {RowKind::Perpendicular, Y, Z},
                              {RowKind::Screw}},
                             {{CoordinateKind::ScrewAngle, {Y, X}, {X, X}}});
    equations.m_pitch = pitch;
    return equations;
}

JointEquations JointEquations::makePointOnLine() {
    return {"PointOnLine", {{RowKind::OnAxis, X}, {RowKind::OnAxis, Y}}, {makeDisplacement(Z)}};
}

JointEquations JointEquations::makePointInPlane() {
    return {"PointInPlane", {{RowKind::OnAxis, Z}}, {makeDisplacement(X), makeDisplacement(Y)}};
}

JointEquations JointEquations::makeRod(Real length) {
    JointEquations equations("Rod", {{RowKind::Distance}}, {});
    equations.m_length = length;
    return equations;
}

JointEquations JointEquations::makePrescribedRotation(MotionFunction angle) {
    JointEquations equations("PrescribedRotation", {{RowKind::Angle, 0, 0, 0}}, {AngleAboutZ});
    equations.m_motions[0] = std::move(angle);
    return equations;
}

JointEquations JointEquations::makePrescribedTranslation(SimTK::CoordinateAxis axis,
                                                         MotionFunction displacement) {
    JointEquations equations("PrescribedTranslation", {{RowKind::OnAxis, int(axis), 0, 0}},
                             {makeDisplacement(axis)});
    equations.m_motions[0] = std::move(displacement);
    return equations;
}

JointEquations JointEquations::makePrescribedPosition(PositionFunction position) {
    JointEquations equations(
        "PrescribedPosition",
        {{RowKind::OnAxis, X, 0, 0}, {RowKind::OnAxis, Y, 0, 1}, {RowKind::OnAxis, Z, 0, 2}},
        {makeDisplacement(X), makeDisplacement(Y), makeDisplacement(Z)});
    for (int a = 0; a < 3; ++a)
        equations.m_motions[a] = [position, a](Real time) {
            const std::array<Vec3, 3> p = position(time);
            return Vec3(p[0][a], p[1][a], p[2][a]);
        };
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
                *errors++ = ~axisOf(F, row.axisF) * offset - getMotion(row, m_motions, time, 0);
                break;
            case RowKind::Perpendicular:
                *errors++ = ~axisOf(F, row.axisF) * axisOf(M, row.axisM);
                break;
            case RowKind::Angle:
                *errors++ = std::remainder(calcAngle(F, M) - getMotion(row, m_motions, time, 0),
                                           2 * SimTK::Pi);
                break;
            case RowKind::Screw:
                *errors++ =
                    m_pitch * std::remainder(~axisOf(F, Z) * offset / m_pitch - calcAngle(F, M),
                                             2 * SimTK::Pi);
                break;
            case RowKind::Distance:
                *errors++ = offset.norm() - m_length;
                break;
        }
    }
}

void JointEquations::calcErrorDots(Real time, const FrameMotion& F, const FrameMotion& M,
                                   Real* errorDots) const {
    const Vec3 velocity = M.V[1] - F.V[1];
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errorDots++ = velocity[row.axisF];
                break;
            case RowKind::OnAxis:
                *errorDots++ =
                    calcDisplacement(F, M, row.axisF)[1] - getMotion(row, m_motions, time, 1);
                break;
            case RowKind::Perpendicular:
                *errorDots++ =
                    calcDotProduct(turningAxisOf(F, row.axisF), turningAxisOf(M, row.axisM))[1];
                break;
            case RowKind::Angle:
                *errorDots++ = calcAngle(F, M)[1] - getMotion(row, m_motions, time, 1);
                break;
            case RowKind::Screw:
                *errorDots++ = calcDisplacement(F, M, Z)[1] - m_pitch * calcAngle(F, M)[1];
                break;
            case RowKind::Distance:
                *errorDots++ = calcDistance(F, M)[1];
                break;
        }
    }
}

void JointEquations::calcErrorDotDots(Real time, const FrameMotion& F, const FrameMotion& M,
                                      Real* errorDotDots) const {
    const Vec3 acceleration = M.A[1] - F.A[1];
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errorDotDots++ = acceleration[row.axisF];
                break;
            case RowKind::OnAxis:
                *errorDotDots++ =
                    calcDisplacement(F, M, row.axisF)[2] - getMotion(row, m_motions, time, 2);
                break;
            case RowKind::Perpendicular:
                *errorDotDots++ =
                    calcDotProduct(turningAxisOf(F, row.axisF), turningAxisOf(M, row.axisM))[2];
                break;
            case RowKind::Angle:
                *errorDotDots++ = calcAngle(F, M)[2] - getMotion(row, m_motions, time, 2);
                break;
            case RowKind::Screw:
                *errorDotDots++ = calcDisplacement(F, M, Z)[2] - m_pitch * calcAngle(F, M)[2];
                break;
            case RowKind::Distance:
                *errorDotDots++ = calcDistance(F, M)[2];
                break;
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
                const Vec3 normal = calcAngleNormal(F, M);
                *D_F++ = {-normal, Vec3(0)};
                *D_M++ = {normal, Vec3(0)};
                break;
            }
            case RowKind::Screw: {
                const Vec3 f = axisOf(F, Z), normal = m_pitch * calcAngleNormal(F, M);
                *D_F++ = {f % offset + normal, -f};
                *D_M++ = {-normal, f};
                break;
            }
            case RowKind::Distance: {
                const Vec3 direction = offset / offset.norm();
                *D_F++ = {Vec3(0), -direction};
                *D_M++ = {Vec3(0), direction};
                break;
            }
        }
    }
}

void JointEquations::addInTimeRate(Real time, Real* errorDots) const {
    for (const Row& row : m_rows) *errorDots++ -= getMotion(row, m_motions, time, 1);
}

bool JointEquations::isFlipped(const Transform& F, const Transform& M) const {
    bool axisUsed[3] = {false, false, false};
    int perpendicular = 0;
    for (const Row& row : m_rows) {
        if (row.kind != RowKind::Perpendicular) continue;
        axisUsed[row.axisM] = true;
        ++perpendicular;
    }
    // One row (Universal) has no other branch, two hold one common axis (Pin's z), three hold all.
    // Where the rows vanish, an axis is along its own, opposed to it, or, with three rows, along
    // another one of F.
    if (perpendicular < 2) return false;
    for (int axis = 0; axis < 3; ++axis)
        if ((perpendicular == 3 || axisUsed[axis]) && ~axisOf(F, axis) * axisOf(M, axis) < 0.5)
            return true;
    return false;
}

void JointEquations::calcCoordinates(const Transform& F, const Transform& M,
                                     Real* coordinates) const {
    const Vec3 offset = M.p() - F.p();
    for (const Coordinate& coordinate : m_coordinates) {
        switch (coordinate.kind) {
            case CoordinateKind::Displacement:
                *coordinates++ = ~axisOf(F, coordinate.sine[0]) * offset;
                break;
            case CoordinateKind::Angle:
                *coordinates++ = calcAngle(F, M, coordinate);
                break;
            case CoordinateKind::ScrewAngle: {
                const Real turned = ~axisOf(F, Z) * offset / m_pitch;
                *coordinates++ =
                    turned - std::remainder(turned - calcAngle(F, M, coordinate), 2 * SimTK::Pi);
                break;
            }
        }
    }
}

void JointEquations::calcCoordinateDots(const FrameMotion& F, const FrameMotion& M,
                                        Real* coordinateDots) const {
    for (const Coordinate& coordinate : m_coordinates)
        *coordinateDots++ = coordinate.kind == CoordinateKind::Displacement
                                ? calcDisplacement(F, M, coordinate.sine[0])[1]
                                : calcAngle(F, M, coordinate)[1];
}

}  // namespace simflex
