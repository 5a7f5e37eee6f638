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
- Screw: `e = z − pθ` with z along F's z axis, θ as above and pitch p [m/rad]; θ is on the turn
  nearest to z/p, so z distinguishes turns;
- Distance: `e = |p_M − p_F| − length`.

OnAxis and Angle rows may be driven: a function of time is subtracted. A prescribed pose drives all
rows: they hold between F·X(t) and M.

A coupler is one row between the coordinates of several pairs of frames,

    e = Σ c_i q_i(F_i, M_i) − c₀    wrapped to ± half its period

where a turn of any angle is an integer number of periods, so that the angles within a turn suffice.
A lock is a coupler whose c₀ is stored in the State. **/

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "simflex/body/JointCoordinate.h"

namespace simflex {

class JointEquations {
public:
    static constexpr int MaxEquations = 6;
    /** Motions of the frames: F, M; for a coupler those of all coordinates, F₀, M₀, F₁, M₁ … **/
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
        int motion = -1;  ///< index of the motion that drives this row; −1: none
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
    /** @param kind    string literal
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
    /** Returns whether a row's error is a length; other errors are angles or, for a coupler,
    combinations of coordinates. **/
    bool isLength(int row) const {
        const RowKind kind = m_rows[size_t(row)].kind;
        return kind == RowKind::Coincident || kind == RowKind::OnAxis ||
               kind == RowKind::Distance || kind == RowKind::Screw;
    }
    int getNumFrames() const { return isCoupler() ? 2 * getNumCoordinates() : 2; }
    bool dependsOnTime() const { return m_motion || m_position || m_pose; }
    bool isCoupler() const { return !m_coefficients.empty(); }
    bool isLock() const { return m_isLock; }

    /** Values of the driving functions at one time and of the lock position; zero for other
    joints. **/
    struct Drive {
        SimTK::Vec3 motions[3] = {SimTK::Vec3(0), SimTK::Vec3(0), SimTK::Vec3(0)};
        FrameMotion pose;
        SimTK::Real held = 0;
    };
    /** Evaluates each function once.
    @param held  lock position from the State **/
    Drive calcDrive(SimTK::Real time, SimTK::Real held = 0) const;

    /** Writes getNumEquations() position errors [m, 1 or rad]; uses X. **/
    void calcErrors(const Drive& drive, Frames frames, SimTK::Real* errors) const;

    /** Writes the time derivatives of the errors; uses X and V. **/
    void calcErrorDots(const Drive& drive, Frames frames, SimTK::Real* errorDots) const;

    /** Writes the second time derivatives of the errors; uses X, V and A. **/
    void calcErrorDotDots(const Drive& drive, Frames frames, SimTK::Real* errorDotDots) const;

    /** Writes the rows D, getNumEquations() spatial vectors (angular, linear part) per frame, frame
    by frame; uses X. **/
    void calcJacobian(const Drive& drive, Frames frames, SimTK::SpatialVec* D) const;

    /** Adds ∂e/∂t, the part of the velocity errors due to functions of time; uses X. **/
    void addInTimeRate(const Drive& drive, Frames frames, SimTK::Real* errorDots) const;

    /** @name Large misalignment
    f·m is as small for opposed axes as for aligned ones, and a quarter turn away its derivative
    vanishes. For assembly, the Perpendicular rows of joints with two (z along z) or three of them
    (all axes aligned) can be replaced by components of the rotation vector from the aligned to the
    current axes of M: the same to first order, and valid up to half a turn. **/
    /**@{**/
    /** Returns the length of that vector [rad]; 0 for other joints. **/
    SimTK::Real calcMisalignment(const Drive& drive, Frames frames) const;
    /** Replaces Perpendicular rows in the result of calcErrors(). **/
    void alignErrors(const Drive& drive, Frames frames, SimTK::Real* errors) const;
    /** Replaces Perpendicular rows in the result of calcJacobian(). **/
    void alignJacobian(const Drive& drive, Frames frames, SimTK::SpatialVec* D) const;
    /**@}**/

    /** Returns whether M's axes are on the wrong branch of the equations: errors are small but axes
    are opposed or exchanged, as when a weld is assembled half a turn away. @pre the errors are
    small. **/
    bool isFlipped(const Drive& drive, Frames frames) const;

    /** Returns the number of free coordinates, in the order of Simbody's mobilizer of the same
    name; for a coupler, of the coupled ones. **/
    int getNumCoordinates() const { return int(m_coordinates.size()); }
    const JointCoordinate& getCoordinate(int i) const { return m_coordinates[unsigned(i)]; }
    /** Writes getNumCoordinates() coordinates [rad, m]. **/
    void calcCoordinates(Frames frames, SimTK::Real* coordinates) const;
    void calcCoordinateDots(Frames frames, SimTK::Real* coordinateDots) const;

    /** Returns the period of a coupler's error; 0: none. **/
    SimTK::Real getPeriod() const { return m_period; }
    /** Returns the pitch of a screw [m/rad]. **/
    SimTK::Real getPitch() const { return m_pitch; }
    /** Returns the coefficients c_i of a coupler. **/
    const SimTK::Array_<SimTK::Real>& getCoefficients() const { return m_coefficients; }

private:
    /** First or second time derivatives of the errors. **/
    void calcRates(int order, const Drive& drive, Frames frames, SimTK::Real* rates) const;
    JointEquations(const char* kind, std::initializer_list<Row> rows,
                   std::initializer_list<JointCoordinate> coordinates)
        : m_kind(kind), m_rows(rows), m_coordinates(coordinates) {}

    /** Returns F, or the frame that a prescribed pose drives it to, stored in `driven`. **/
    const FrameMotion& driveF(const Drive& drive, Frames frames,
                              std::optional<FrameMotion>& driven) const;
    /** Returns F and M of a coordinate. **/
    Frames framesOf(int coordinate, Frames frames) const {
        return isCoupler() ? frames + 2 * coordinate : frames;
    }
    SimTK::Real calcCoupledError(const Drive& drive, Frames frames) const;
    int countPerpendicularRows() const;
    /** Returns the rotation vector from the aligned to the current axes of M, in F. **/
    SimTK::Vec3 calcTurn(const SimTK::Transform& F, const SimTK::Transform& M) const;

    const char* m_kind;
    SimTK::Array_<Row> m_rows;
    SimTK::Array_<JointCoordinate> m_coordinates;
    MotionFunction m_motion;
    PositionFunction m_position;
    PoseFunction m_pose;
    SimTK::Array_<SimTK::Real> m_coefficients;  ///< of a coupler; otherwise empty
    SimTK::Real m_constant = 0, m_period = 0;   ///< of a coupler
    SimTK::Real m_pitch = 0;                    ///< [m/rad]
    SimTK::Real m_length = 0;                   ///< [m]
    bool m_isLock = false;
};

}  // namespace simflex
