#pragma once
/** @file
Constraint equations between frames F and M: errors, their time derivatives, and the rows D_F, D_M
with

    ė_k = D_F[k]·V_F + D_M[k]·V_M − θ̇(t)      V = (ω, v) in Ground

A joint is a short list of rows:
- Coincident axis a: `e = (p_M − p_F)_a` in Ground;
- OnAxis f: `e = f·(p_M − p_F)` with f an axis of F;
- Perpendicular (f, m): `e = f·m` with f an axis of F and m of M;
- Angle: `e = atan2(y_F·x_M, x_F·x_M) − θ(t)`, wrapped to (−π, π]. **/

#include <functional>

#include "simflex/body/FrameMotion.h"

namespace simflex {

class JointEquations {
public:
    static constexpr int MaxEquations = 6;
    using AngleFunction = std::function<SimTK::Vec3(SimTK::Real)>;

    enum class RowKind { Coincident, OnAxis, Perpendicular, Angle };
    struct Row {
        RowKind kind;
        int axisF = 0, axisM = 0;
    };

    static JointEquations makeBall();
    static JointEquations makePin();
    static JointEquations makeSlider();
    static JointEquations makeWeld();
    static JointEquations makePrescribedRotation(AngleFunction angle);

    const char* getKind() const { return m_kind; }
    int getNumEquations() const { return int(m_rows.size()); }
    bool dependsOnTime() const { return bool(m_angle); }

    /** Writes getNumEquations() position errors [m or 1]. **/
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

    /** Derivative of the velocity errors with respect to time alone: −θ̇(t) on Angle rows, else
     * zero. **/
    void addInTimeRate(SimTK::Real time, SimTK::Real* errorDots) const;

    /** True if M's axes lie on the wrong branch of this joint's equations: errors small but axes
    opposed or exchanged, as after assembling a weld half a turn away. @pre the errors are small.
    **/
    bool isFlipped(const SimTK::Transform& F, const SimTK::Transform& M) const;

private:
    JointEquations(const char* kind, std::initializer_list<Row> rows)
        : m_kind(kind), m_rows(rows) {}

    const char* m_kind;
    SimTK::Array_<Row> m_rows;
    AngleFunction m_angle;
};

}  // namespace simflex
