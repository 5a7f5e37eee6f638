#pragma once
/** @file
Constraint equations between frames F and M: errors, their time derivatives, and the rows D_F, D_M
with

    ė_k = D_F[k]·V_F + D_M[k]·V_M − θ̇(t)      V = (ω, v) in Ground

A joint is a short list of rows:
- Coincident axis a: `e = (p_M − p_F)_a` in Ground;
- OnAxis f: `e = f·(p_M − p_F)` with f an axis of F;
- Perpendicular (f, m): `e = f·m` with f an axis of F and m of M;
- Angle: `e = atan2(y_F·x_M, x_F·x_M) − θ(t)`, wrapped to (−π, π];
- Screw: `e = z − pθ` with z along F's z axis, θ as above and pitch p [m/rad]; of all turns the one
  nearest to z/p counts, so that z tells them apart;
- Distance: `e = |p_M − p_F| − length`.
OnAxis and Angle rows may be driven: a function of time is subtracted. **/

#include <array>
#include <functional>

#include "simflex/body/FrameMotion.h"

namespace simflex {

class JointEquations {
public:
    static constexpr int MaxEquations = 6;
    static constexpr int MaxCoordinates = 3;
    /** Value, rate and acceleration at a time. **/
    using MotionFunction = std::function<SimTK::Vec3(SimTK::Real)>;
    /** Position, velocity and acceleration at a time. **/
    using PositionFunction = std::function<std::array<SimTK::Vec3, 3>(SimTK::Real)>;

    enum class RowKind { Coincident, OnAxis, Perpendicular, Angle, Screw, Distance };
    struct Row {
        RowKind kind;
        int axisF = 0, axisM = 0;
        int motion = -1;  ///< that drives this row, if any
    };

    /** A coordinate that a joint leaves free. Displacement: `f·(p_M − p_F)` with axis `sine[0]` of
    F; Angle: `atan2(f·m, f'·m')`, axes (F, M) `sine` and `cosine`; ScrewAngle: an Angle on the turn
    nearest to z/p. **/
    enum class CoordinateKind { Displacement, Angle, ScrewAngle };
    struct Coordinate {
        CoordinateKind kind;
        int sine[2] = {0, 0}, cosine[2] = {0, 0};
    };

    static JointEquations makeBall();
    static JointEquations makePin();
    static JointEquations makeSlider();
    static JointEquations makeWeld();
    static JointEquations makeCylinder();
    static JointEquations makeUniversal();
    static JointEquations makePlanar();
    /** @pre pitch finite, not 0. **/
    static JointEquations makeScrew(SimTK::Real pitch);
    static JointEquations makePointOnLine();
    static JointEquations makePointInPlane();
    /** @pre length finite, > 0. **/
    static JointEquations makeRod(SimTK::Real length);
    static JointEquations makePrescribedRotation(MotionFunction angle);
    static JointEquations makePrescribedTranslation(SimTK::CoordinateAxis axis,
                                                    MotionFunction displacement);
    static JointEquations makePrescribedPosition(PositionFunction position);

    const char* getKind() const { return m_kind; }
    int getNumEquations() const { return int(m_rows.size()); }
    bool dependsOnTime() const { return bool(m_motions[0]); }

    /** Writes getNumEquations() position errors [m or 1 or rad]. **/
    void calcErrors(SimTK::Real time, const SimTK::Transform& F, const SimTK::Transform& M,
                    SimTK::Real* errors) const;

    /** Writes the time derivatives of the errors. **/
    void calcErrorDots(SimTK::Real time, const FrameMotion& F, const FrameMotion& M,
                       SimTK::Real* errorDots) const;

    /** Writes the second time derivatives of the errors, from the frames' A. **/
    void calcErrorDotDots(SimTK::Real time, const FrameMotion& F, const FrameMotion& M,
                          SimTK::Real* errorDotDots) const;

    /** Writes the rows D_F, D_M, each getNumEquations() spatial vectors (angular, linear part). **/
    void calcJacobian(const SimTK::Transform& F, const SimTK::Transform& M, SimTK::SpatialVec* D_F,
                      SimTK::SpatialVec* D_M) const;

    /** Derivative of the velocity errors with respect to time alone: minus the rate of the function
     * that drives a row, else zero. **/
    void addInTimeRate(SimTK::Real time, SimTK::Real* errorDots) const;

    /** True if M's axes lie on the wrong branch of this joint's equations: errors small but axes
    opposed or exchanged, as after assembling a weld half a turn away. @pre the errors are small.
    **/
    bool isFlipped(const SimTK::Transform& F, const SimTK::Transform& M) const;

    /** Coordinates left free, in the order of Simbody's mobilizer of the same name. **/
    int getNumCoordinates() const { return int(m_coordinates.size()); }
    /** Writes getNumCoordinates() coordinates [rad, m]; angles in (−π, π], a Screw's over all
     * turns.
     * **/
    void calcCoordinates(const SimTK::Transform& F, const SimTK::Transform& M,
                         SimTK::Real* coordinates) const;
    void calcCoordinateDots(const FrameMotion& F, const FrameMotion& M,
                            SimTK::Real* coordinateDots) const;

private:
    JointEquations(const char* kind, std::initializer_list<Row> rows,
                   std::initializer_list<Coordinate> coordinates)
        : m_kind(kind), m_rows(rows), m_coordinates(coordinates) {}

    const char* m_kind;
    SimTK::Array_<Row> m_rows;
    SimTK::Array_<Coordinate> m_coordinates;
    MotionFunction m_motions[3];
    SimTK::Real m_pitch = 0;   ///< [m/rad]
    SimTK::Real m_length = 0;  ///< [m]
};

}  // namespace simflex
