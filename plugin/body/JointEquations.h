#pragma once
/** @file
Constraint equations between frames F and M: errors, their time derivatives, and the rows D_F, D_M
with

    ė_k = D_F[k]·V_F + D_M[k]·V_M + ∂e_k/∂t      V = (ω, v) in Ground

A joint is a short list of rows:
- Coincident axis a: `e = (p_M − p_F)_a` in Ground;
- OnAxis f: `e = f·(p_M − p_F)` with f an axis of F;
- Perpendicular (f, m): `e = f·m` with f an axis of F and m of M;
- Angle: `e = atan2(y_F·x_M, x_F·x_M) − θ(t)`, wrapped to (−π, π];
- Screw: `e = z − pθ` with z along F's z axis, θ as above and pitch p [m/rad]; of all turns the one
  nearest to z/p counts, so that z tells them apart;
- Distance: `e = |p_M − p_F| − length`.
OnAxis and Angle rows may be driven: a function of time is subtracted. A pose that is a function of
time may drive all rows: they hold between F·X(t) and M.

A coupler is one row between the coordinates of several pairs of frames,

    e = Σ c_i q_i(F_i, M_i) − c₀    wrapped to ± half its period

where a turn of any angle is a whole number of periods: so it counts turns by angles alone. A lock
is one whose c₀ is kept in a State. **/

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "simflex/body/JointCoordinate.h"

namespace simflex {

class JointEquations {
public:
    static constexpr int MaxEquations = 6;
    /** Motions of the frames: F, M; of a coupler those of every coordinate, F₀, M₀, F₁, M₁ … **/
    using Frames = const FrameMotion* const*;
    /** Value, rate and acceleration at a time. **/
    using MotionFunction = std::function<SimTK::Vec3(SimTK::Real)>;
    /** Position, velocity and acceleration at a time. **/
    using PositionFunction = std::function<std::array<SimTK::Vec3, 3>(SimTK::Real)>;
    /** Pose, velocity and acceleration in F at a time. **/
    using PoseFunction = std::function<FrameMotion(SimTK::Real)>;

    enum class RowKind { Coincident, OnAxis, Perpendicular, Angle, Screw, Distance, Coupled };
    struct Row {
        RowKind kind;
        int axisF = 0, axisM = 0;
        int motion = -1;  ///< that drives this row, if any
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
    static JointEquations makePrescribedPose(PoseFunction pose);
    /** @param kind    a literal
    @param period  0: none
    @pre as many coordinates as coefficients **/
    static JointEquations makeCoupler(const char* kind,
                                      const std::vector<JointCoordinate>& coordinates,
                                      const std::vector<SimTK::Real>& coefficients,
                                      SimTK::Real constant, SimTK::Real period);
    /** Holds a coordinate at Drive::held. **/
    static JointEquations makeLock(const JointCoordinate& coordinate);

    const char* getKind() const { return m_kind; }
    int getNumEquations() const { return int(m_rows.size()); }
    /** Whether a row's error is a length; others are angles, or coordinates' of a coupler. **/
    bool isLength(int row) const {
        const RowKind kind = m_rows[size_t(row)].kind;
        return kind == RowKind::Coincident || kind == RowKind::OnAxis ||
               kind == RowKind::Distance || kind == RowKind::Screw;
    }
    int getNumFrames() const { return isCoupler() ? 2 * getNumCoordinates() : 2; }
    bool dependsOnTime() const { return m_motion || m_position || m_pose; }
    bool isCoupler() const { return !m_coefficients.empty(); }
    bool isLock() const { return m_isLock; }

    /** What functions of time drive rows to at one time, and what a lock holds; nothing of other
     * joints. **/
    struct Drive {
        SimTK::Vec3 motions[3] = {SimTK::Vec3(0), SimTK::Vec3(0), SimTK::Vec3(0)};
        FrameMotion pose;
        SimTK::Real held = 0;
    };
    /** Asks each function once.
    @param held  of a lock, from the State **/
    Drive calcDrive(SimTK::Real time, SimTK::Real held = 0) const;

    /** Writes getNumEquations() position errors [m or 1 or rad]; from the frames' X. **/
    void calcErrors(const Drive& drive, Frames frames, SimTK::Real* errors) const;

    /** Writes the time derivatives of the errors; from X and V. **/
    void calcErrorDots(const Drive& drive, Frames frames, SimTK::Real* errorDots) const;

    /** Writes the second time derivatives of the errors; from X, V and A. **/
    void calcErrorDotDots(const Drive& drive, Frames frames, SimTK::Real* errorDotDots) const;

    /** Writes the rows D, getNumEquations() spatial vectors (angular, linear part) for each frame,
     * those of one frame together; from X. **/
    void calcJacobian(const Drive& drive, Frames frames, SimTK::SpatialVec* D) const;

    /** Adds ∂e/∂t: what functions of time alone add to the velocity errors; from X. **/
    void addInTimeRate(const Drive& drive, Frames frames, SimTK::Real* errorDots) const;

    /** @name Axes far from their place
    f·m is as small with axes opposed as with axes in place, and a quarter of a turn away its
    derivative vanishes. For assembly, Perpendicular rows of joints that have two (which hold z
    along z) or three (which hold all axes) can be exchanged for components of the rotation vector
    that turns M's axes away from their place: to first order the same, and good for half a turn.
    **/
    /**@{**/
    /** Length of that vector [rad]; 0 for other joints. **/
    SimTK::Real calcMisalignment(const Drive& drive, Frames frames) const;
    /** Over what calcErrors() has written. **/
    void alignErrors(const Drive& drive, Frames frames, SimTK::Real* errors) const;
    /** Over what calcJacobian() has written. **/
    void alignJacobian(const Drive& drive, Frames frames, SimTK::SpatialVec* D) const;
    /**@}**/

    /** True if M's axes lie on the wrong branch of this joint's equations: errors small but axes
    opposed or exchanged, as after assembling a weld half a turn away. @pre the errors are small.
    **/
    bool isFlipped(const Drive& drive, Frames frames) const;

    /** Coordinates left free, in the order of Simbody's mobilizer of the same name; those that a
     * coupler couples. **/
    int getNumCoordinates() const { return int(m_coordinates.size()); }
    const JointCoordinate& getCoordinate(int i) const { return m_coordinates[unsigned(i)]; }
    /** Writes getNumCoordinates() coordinates [rad, m]. **/
    void calcCoordinates(Frames frames, SimTK::Real* coordinates) const;
    void calcCoordinateDots(Frames frames, SimTK::Real* coordinateDots) const;

    /** Of a coupler's error; 0: none. **/
    SimTK::Real getPeriod() const { return m_period; }
    /** Of a screw [m/rad]. **/
    SimTK::Real getPitch() const { return m_pitch; }
    /** c_i of a coupler. **/
    const SimTK::Array_<SimTK::Real>& getCoefficients() const { return m_coefficients; }

private:
    /** First or second time derivatives of the errors. **/
    void calcRates(int order, const Drive& drive, Frames frames, SimTK::Real* rates) const;
    JointEquations(const char* kind, std::initializer_list<Row> rows,
                   std::initializer_list<JointCoordinate> coordinates)
        : m_kind(kind), m_rows(rows), m_coordinates(coordinates) {}

    /** F, or where a pose drives it to, which `driven` then keeps. **/
    const FrameMotion& driveF(const Drive& drive, Frames frames,
                              std::optional<FrameMotion>& driven) const;
    /** F and M of a coordinate. **/
    Frames framesOf(int coordinate, Frames frames) const {
        return isCoupler() ? frames + 2 * coordinate : frames;
    }
    SimTK::Real calcCoupledError(const Drive& drive, Frames frames) const;
    int countPerpendicularRows() const;
    /** Rotation vector of M's axes from their place, in F. **/
    SimTK::Vec3 calcTurn(const SimTK::Transform& F, const SimTK::Transform& M) const;

    const char* m_kind;
    SimTK::Array_<Row> m_rows;
    SimTK::Array_<JointCoordinate> m_coordinates;
    MotionFunction m_motion;
    PositionFunction m_position;
    PoseFunction m_pose;
    SimTK::Array_<SimTK::Real> m_coefficients;  ///< of a coupler; else empty
    SimTK::Real m_constant = 0, m_period = 0;   ///< of a coupler
    SimTK::Real m_pitch = 0;                    ///< [m/rad]
    SimTK::Real m_length = 0;                   ///< [m]
    bool m_isLock = false;
};

}  // namespace simflex
