#include "simflex/body/JointEquations.h"

#include <algorithm>
#include <cmath>

#include "simflex/body/TurningAxis.h"

namespace simflex {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr int X = 0, Y = 1, Z = 2;

using Row = JointEquations::Row;
using RowKind = JointEquations::RowKind;

constexpr JointCoordinate AngleAboutZ = JointCoordinate::makeAngleAboutZ();
constexpr auto makeDisplacement = JointCoordinate::makeDisplacement;

/** Value, rate and acceleration of |p_M − p_F|. **/
Vec3 calcDistance(const FrameMotion& F, const FrameMotion& M) {
    const Vec3 offset = M.X.p() - F.X.p(), velocity = M.V[1] - F.V[1],
               acceleration = M.A[1] - F.A[1];
    const Real distance = offset.norm(), rate = ~offset * velocity / distance;
    return {distance, rate,
            (~offset * acceleration + ~velocity * velocity - rate * rate) / distance};
}

/** Motion of F·X for a motion of X in F. **/
FrameMotion moveAlong(const FrameMotion& F, const FrameMotion& inF) {
    const SimTK::Rotation& R = F.X.R();
    const Vec3 r = R * inF.X.p(), omega = R * inF.V[0], v = R * inF.V[1];
    const Vec3 &omegaF = F.V[0], &alphaF = F.A[0];
    FrameMotion moved;
    moved.X = F.X * inF.X;
    moved.V = {omegaF + omega, F.V[1] + omegaF % r + v};
    moved.A = {alphaF + omegaF % omega + R * inF.A[0],
               F.A[1] + alphaF % r + omegaF % (omegaF % r) + 2 * (omegaF % v) + R * inF.A[1]};
    return moved;
}

/** Value (order 0) or derivative (1, 2) of the function that drives a row; 0 if there is none. **/
Real getMotion(const Row& row, const JointEquations::Drive& drive, int order) {
    return row.motion < 0 ? 0 : drive.motions[row.motion][order];
}

/** Derivative of f·m with respect to the rotation of M with aligned axes, in F. **/
Vec3 calcNormalInPlace(const Row& row) {
    Vec3 f(0), m(0);
    f[row.axisF] = 1;
    m[row.axisM] = 1;
    return m % f;
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
            {{JointCoordinate::Kind::Angle, {Z, Y}, {Y, Y}},
             {JointCoordinate::Kind::Angle, {X, Z}, {X, X}}}};
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
                             {{JointCoordinate::Kind::ScrewAngle, {Y, X}, {X, X}, pitch}});
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
    equations.m_motion = std::move(angle);
    return equations;
}

JointEquations JointEquations::makePrescribedTranslation(SimTK::CoordinateAxis axis,
                                                         MotionFunction displacement) {
    JointEquations equations("PrescribedTranslation", {{RowKind::OnAxis, int(axis), 0, 0}},
                             {makeDisplacement(axis)});
    equations.m_motion = std::move(displacement);
    return equations;
}

JointEquations JointEquations::makePrescribedPosition(PositionFunction position) {
    JointEquations equations(
        "PrescribedPosition",
        {{RowKind::OnAxis, X, 0, 0}, {RowKind::OnAxis, Y, 0, 1}, {RowKind::OnAxis, Z, 0, 2}},
        {makeDisplacement(X), makeDisplacement(Y), makeDisplacement(Z)});
    equations.m_position = std::move(position);
    return equations;
}

JointEquations JointEquations::makePrescribedPose(PoseFunction pose) {
    JointEquations equations("PrescribedPose",
                             {{RowKind::OnAxis, X},
                              {RowKind::OnAxis, Y},
                              {RowKind::OnAxis, Z},
                              {RowKind::Perpendicular, Z, Y},
                              {RowKind::Perpendicular, X, Z},
                              {RowKind::Perpendicular, Y, X}},
                             {makeDisplacement(X), makeDisplacement(Y), makeDisplacement(Z)});
    equations.m_pose = std::move(pose);
    return equations;
}

JointEquations JointEquations::makeCoupler(const char* kind,
                                           const std::vector<JointCoordinate>& coordinates,
                                           const std::vector<Real>& coefficients, Real constant,
                                           Real period) {
    JointEquations equations(kind, {{RowKind::Coupled}}, {});
    for (const JointCoordinate& coordinate : coordinates)
        equations.m_coordinates.push_back(coordinate);
    for (const Real coefficient : coefficients) equations.m_coefficients.push_back(coefficient);
    equations.m_constant = constant;
    equations.m_period = period;
    return equations;
}

JointEquations JointEquations::makeLock(const JointCoordinate& coordinate) {
    JointEquations equations =
        makeCoupler("Lock", {coordinate}, {1}, 0, coordinate.isPeriodic() ? 2 * SimTK::Pi : 0);
    equations.m_isLock = true;
    return equations;
}

JointEquations::Drive JointEquations::calcDrive(Real time, Real held) const {
    Drive drive;
    drive.held = held;
    if (m_motion) drive.motions[0] = m_motion(time);
    if (m_position) {
        const std::array<Vec3, 3> p = m_position(time);
        for (int a = 0; a < 3; ++a) drive.motions[a] = Vec3(p[0][a], p[1][a], p[2][a]);
    }
    if (m_pose) drive.pose = m_pose(time);
    return drive;
}

const FrameMotion& JointEquations::driveF(const Drive& drive, Frames frames,
                                          std::optional<FrameMotion>& driven) const {
    if (!m_pose) return *frames[0];
    return driven.emplace(moveAlong(*frames[0], drive.pose));
}

Real JointEquations::calcCoupledError(const Drive& drive, Frames frames) const {
    Real sum = -m_constant - drive.held;
    for (int i = 0; i < getNumCoordinates(); ++i)
        sum += m_coefficients[unsigned(i)] *
               getCoordinate(i).calcValue(frames[2 * i]->X, frames[2 * i + 1]->X);
    return m_period > 0 ? std::remainder(sum, m_period) : sum;
}

void JointEquations::calcErrors(const Drive& drive, Frames frames, Real* errors) const {
    std::optional<FrameMotion> driven;
    const Transform &F = driveF(drive, frames, driven).X, &M = frames[1]->X;
    const Vec3 offset = M.p() - F.p();
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *errors++ = offset[row.axisF];
                break;
            case RowKind::OnAxis:
                *errors++ = ~axisOf(F, row.axisF) * offset - getMotion(row, drive, 0);
                break;
            case RowKind::Perpendicular:
                *errors++ = ~axisOf(F, row.axisF) * axisOf(M, row.axisM);
                break;
            case RowKind::Angle:
                *errors++ = std::remainder(AngleAboutZ.calcValue(F, M) - getMotion(row, drive, 0),
                                           2 * SimTK::Pi);
                break;
            case RowKind::Screw:
                *errors++ = m_pitch * std::remainder(~axisOf(F, Z) * offset / m_pitch -
                                                         AngleAboutZ.calcValue(F, M),
                                                     2 * SimTK::Pi);
                break;
            case RowKind::Distance:
                *errors++ = offset.norm() - m_length;
                break;
            case RowKind::Coupled:
                *errors++ = calcCoupledError(drive, frames);
                break;
        }
    }
}

void JointEquations::calcErrorDots(const Drive& drive, Frames frames, Real* errorDots) const {
    calcRates(1, drive, frames, errorDots);
}

void JointEquations::calcErrorDotDots(const Drive& drive, Frames frames, Real* errorDotDots) const {
    calcRates(2, drive, frames, errorDotDots);
}

void JointEquations::calcRates(int order, const Drive& drive, Frames frames, Real* rates) const {
    std::optional<FrameMotion> driven;
    const FrameMotion &F = driveF(drive, frames, driven), &M = *frames[1];
    const Vec3 offset = order == 1 ? M.V[1] - F.V[1] : M.A[1] - F.A[1];
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident:
                *rates++ = offset[row.axisF];
                break;
            case RowKind::OnAxis:
                *rates++ = makeDisplacement(row.axisF).calcMotion(F, M)[order] -
                           getMotion(row, drive, order);
                break;
            case RowKind::Perpendicular:
                *rates++ =
                    calcDotProduct(turningAxisOf(F, row.axisF), turningAxisOf(M, row.axisM))[order];
                break;
            case RowKind::Angle:
                *rates++ = AngleAboutZ.calcMotion(F, M)[order] - getMotion(row, drive, order);
                break;
            case RowKind::Screw:
                *rates++ = makeDisplacement(Z).calcMotion(F, M)[order] -
                           m_pitch * AngleAboutZ.calcMotion(F, M)[order];
                break;
            case RowKind::Distance:
                *rates++ = calcDistance(F, M)[order];
                break;
            case RowKind::Coupled: {
                Real sum = 0;
                for (int i = 0; i < getNumCoordinates(); ++i)
                    sum += m_coefficients[unsigned(i)] *
                           getCoordinate(i).calcMotion(*frames[2 * i], *frames[2 * i + 1])[order];
                *rates++ = sum;
                break;
            }
        }
    }
}

void JointEquations::calcJacobian(const Drive& drive, Frames frames, SpatialVec* D) const {
    std::optional<FrameMotion> driven;
    const Transform &F = driveF(drive, frames, driven).X, &M = frames[1]->X;
    const Vec3 offset = M.p() - F.p();
    SpatialVec *D_F = D, *D_M = D + getNumEquations();
    for (const Row& row : m_rows) {
        switch (row.kind) {
            case RowKind::Coincident: {
                Vec3 axis(0);
                axis[row.axisF] = 1;
                *D_F = {Vec3(0), -axis};
                *D_M = {Vec3(0), axis};
                break;
            }
            case RowKind::OnAxis:
                makeDisplacement(row.axisF).calcGradient(F, M, *D_F, *D_M);
                break;
            case RowKind::Perpendicular: {
                const Vec3 normal = axisOf(M, row.axisM) % axisOf(F, row.axisF);
                *D_F = {-normal, Vec3(0)};
                *D_M = {normal, Vec3(0)};
                break;
            }
            case RowKind::Angle:
                AngleAboutZ.calcGradient(F, M, *D_F, *D_M);
                break;
            case RowKind::Screw: {
                SpatialVec angle_F, angle_M;
                makeDisplacement(Z).calcGradient(F, M, *D_F, *D_M);
                AngleAboutZ.calcGradient(F, M, angle_F, angle_M);
                *D_F -= m_pitch * angle_F;
                *D_M -= m_pitch * angle_M;
                break;
            }
            case RowKind::Distance: {
                const Vec3 direction = offset / offset.norm();
                *D_F = {Vec3(0), -direction};
                *D_M = {Vec3(0), direction};
                break;
            }
            case RowKind::Coupled:
                for (int i = 0; i < getNumCoordinates(); ++i) {
                    SpatialVec* pair = D + 2 * i;
                    getCoordinate(i).calcGradient(frames[2 * i]->X, frames[2 * i + 1]->X, pair[0],
                                                  pair[1]);
                    pair[0] *= m_coefficients[unsigned(i)];
                    pair[1] *= m_coefficients[unsigned(i)];
                }
                break;
        }
        ++D_F;
        ++D_M;
    }
    if (!driven) return;
    // The rows refer to the driven origin of F; shift them to F's own.
    const Vec3 lever = F.p() - frames[0]->X.p();
    for (int k = 0; k < getNumEquations(); ++k) D[k][0] += lever % D[k][1];
}

void JointEquations::addInTimeRate(const Drive& drive, Frames frames, Real* errorDots) const {
    if (!m_pose) {
        for (const Row& row : m_rows) *errorDots++ -= getMotion(row, drive, 1);
        return;
    }
    // Effect of the pose's own rate on the errors.
    FrameMotion F, M;
    F.X = frames[0]->X;
    M.X = frames[1]->X;
    const FrameMotion* still[] = {&F, &M};
    Real rates[MaxEquations];
    calcErrorDots(drive, still, rates);
    for (int k = 0; k < getNumEquations(); ++k) errorDots[k] += rates[k];
}

int JointEquations::countPerpendicularRows() const {
    return int(std::count_if(m_rows.begin(), m_rows.end(),
                             [](const Row& row) { return row.kind == RowKind::Perpendicular; }));
}

Vec3 JointEquations::calcTurn(const Transform& F, const Transform& M) const {
    const SimTK::Rotation R_FM = ~F.R() * M.R();
    if (countPerpendicularRows() == 3) {
        const SimTK::Vec4 angleAxis = R_FM.convertRotationToAngleAxis();
        return angleAxis[0] * angleAxis.getSubVec<3>(1);
    }
    const Vec3 z = R_FM.z(), normal(-z[1], z[0], 0);  // z of F × z of M
    const Real sine = normal.norm(), angle = std::atan2(sine, z[2]);
    return sine > 0 ? Vec3(angle / sine * normal) : Vec3(angle, 0, 0);
}

Real JointEquations::calcMisalignment(const Drive& drive, Frames frames) const {
    if (countPerpendicularRows() < 2) return 0;
    std::optional<FrameMotion> driven;
    return calcTurn(driveF(drive, frames, driven).X, frames[1]->X).norm();
}

void JointEquations::alignErrors(const Drive& drive, Frames frames, Real* errors) const {
    if (countPerpendicularRows() < 2) return;
    std::optional<FrameMotion> driven;
    const Vec3 turn = calcTurn(driveF(drive, frames, driven).X, frames[1]->X);
    for (const Row& row : m_rows) {
        if (row.kind == RowKind::Perpendicular) *errors = ~turn * calcNormalInPlace(row);
        ++errors;
    }
}

void JointEquations::alignJacobian(const Drive& drive, Frames frames, SpatialVec* D) const {
    if (countPerpendicularRows() < 2) return;
    std::optional<FrameMotion> driven;
    const Transform& F = driveF(drive, frames, driven).X;
    SpatialVec *D_F = D, *D_M = D + getNumEquations();
    for (const Row& row : m_rows) {
        if (row.kind == RowKind::Perpendicular) {
            const Vec3 normal = F.R() * calcNormalInPlace(row);
            *D_F = {-normal, Vec3(0)};
            *D_M = {normal, Vec3(0)};
        }
        ++D_F;
        ++D_M;
    }
}

bool JointEquations::isFlipped(const Drive& drive, Frames frames) const {
    std::optional<FrameMotion> driven;
    const Transform &F = driveF(drive, frames, driven).X, &M = frames[1]->X;
    bool axisUsed[3] = {false, false, false};
    int perpendicular = 0;
    for (const Row& row : m_rows) {
        if (row.kind != RowKind::Perpendicular) continue;
        axisUsed[row.axisM] = true;
        ++perpendicular;
    }
    // One row (Universal) has no other branch, two fix one common axis (Pin's z), three fix all.
    // Where the rows vanish, an axis is aligned with its own, opposed to it or, with three rows,
    // aligned with another axis of F.
    if (perpendicular < 2) return false;
    for (int axis = 0; axis < 3; ++axis)
        if ((perpendicular == 3 || axisUsed[axis]) && ~axisOf(F, axis) * axisOf(M, axis) < 0.5)
            return true;
    return false;
}

void JointEquations::calcCoordinates(Frames frames, Real* coordinates) const {
    for (int i = 0; i < getNumCoordinates(); ++i) {
        const Frames pair = framesOf(i, frames);
        *coordinates++ = getCoordinate(i).calcValue(pair[0]->X, pair[1]->X);
    }
}

void JointEquations::calcCoordinateDots(Frames frames, Real* coordinateDots) const {
    for (int i = 0; i < getNumCoordinates(); ++i) {
        const Frames pair = framesOf(i, frames);
        *coordinateDots++ = getCoordinate(i).calcMotion(*pair[0], *pair[1])[1];
    }
}

}  // namespace simflex
