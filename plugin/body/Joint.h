#pragma once
/** @file
Joints between two attachments, F and M, with the axes of Simbody's mobilizer of the same name: Pin
rotates about the common z axis, Slider slides along F's x axis. A joint is a Simbody Constraint on
the body frames and modal mobilizers, so native Simbody integrators see it; BdfIntegrator evaluates
it directly.

    Joint::Pin pin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin");

Prescribed motions move M as a function of time and report the force this requires. Gears and
couplers relate coordinates of joints to each other, among four or more bodies:

    Joint::Gear gear(flexible, inputBearing, 17, outputBearing, 43, "reduction");
    Joint::Coupler rack(flexible, {{slide, 1}, {pinionBearing, -radius}});

A Joint is a handle: copies refer to the same joint. **/

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/JointCoordinate.h"

namespace simflex {

class JointEquations;

class Joint {
public:
    class Ball;                ///< origins coincide (3 equations)
    class Pin;                 ///< origins and z axes coincide (5)
    class Slider;              ///< M slides along F's x axis without rotation (5)
    class Weld;                ///< frames coincide (6)
    class Cylinder;            ///< M rotates about and slides along the common z axis (4)
    class Universal;           ///< origins coincide, F's x axis is normal to M's y axis (4)
    class Planar;              ///< M moves in F's xy plane and rotates about z (3)
    class Screw;               ///< Cylinder whose displacement is pitch times its angle (5)
    class PointOnLine;         ///< M's origin is on F's z axis (2)
    class PointInPlane;        ///< M's origin is in F's xy plane (1)
    class Rod;                 ///< origins are `length` apart (1)
    class PrescribedRotation;  ///< M's angle about F's z axis is a function of time (1); add it to
                               ///< a Pin or Cylinder
    class PrescribedTranslation;  ///< M's displacement along an axis of F is a function of time
                                  ///< (1); add it to a Slider or Cylinder
    class PrescribedPosition;     ///< M's origin in F is a function of time (3)
    class PrescribedPose;         ///< M's pose in F is a function of time (6)
    class Gear;                   ///< teeth of two wheels mesh (1)
    class Lock;                   ///< locks a coordinate at its value (1); initially unlocked
    class Coupler;                ///< a linear relation between coordinates of joints (1)

    class Coordinate;  ///< argument of gears, couplers and locks

    /** Value, rate and acceleration [rad or m, per s, per s²] at a time; evaluated once per
    time. **/
    using MotionFunction = std::function<SimTK::Vec3(SimTK::Real time)>;
    using AngleFunction = MotionFunction;
    /** Position, velocity and acceleration in F's axes [m, m/s, m/s²] at a time. **/
    using PositionFunction = std::function<std::array<SimTK::Vec3, 3>(SimTK::Real time)>;
    /** Pose, velocity (ω, v) and acceleration (α, a) at a time, measured and expressed in F. **/
    using PoseFunction = std::function<FrameMotion(SimTK::Real time)>;
    /** A function of time with two derivatives. **/
    using FunctionOfTime = std::shared_ptr<const SimTK::Function>;

    enum class Side { F, M };
    enum class Axes { Ground, F, M };

    /** Returns the given name, or one made of its frames' names. A number is appended for another
    joint of the same type and name. **/
    const std::string& getName() const;
    JointIndex getIndex() const { return m_index; }
    /** Returns whether this is a joint of the subsystem. **/
    bool isIn(const FlexibleBodySubsystem& subsystem) const;
    int getNumEquations() const;
    /** A coupler has frames F and M for each of its coordinates.
    @throws std::out_of_range if there is no such coordinate. **/
    const Attachment& getFrameF(int coordinate = 0) const;
    const Attachment& getFrameM(int coordinate = 0) const;
    /** Returns the Simbody constraint that represents this joint in native runs. **/
    SimTK::ConstraintIndex getConstraintIndex() const;
    const JointEquations& getEquations() const;

    /** Returns getNumEquations() position errors [m, rad, 1]. Stage::Velocity. **/
    SimTK::Vector calcPositionErrors(const SimTK::State& state) const;

    /** @name Coordinates of the joint [rad, m]
    In the order of q of Simbody's mobilizer of the same name: Cylinder (angle, displacement),
    Universal (about F's x axis, about M's y axis), Planar (angle, x, y). PointOnLine has z,
    PointInPlane (x, y), prescribed motions the prescribed coordinate (PrescribedPose x, y, z),
    couplers the coupled ones; Ball, Weld and Rod have none. Angles are in (−π, π], except a Screw's
    and those whose turns are counted (see Signal::turnedAngle()), which are unbounded.
    Stage::Velocity. **/
    /**@{**/
    int getNumCoordinates() const;
    SimTK::Vector calcCoordinates(const SimTK::State& state) const;
    SimTK::Vector calcCoordinateDots(const SimTK::State& state) const;
    /** Moves the mechanism, with all joints closed, until a coordinate has this value, or sets
    speeds that give the coordinate this rate. As setJointCoordinates() and setJointRates() in
    JointGoals.h for one coordinate; throws the same exceptions. **/
    void setCoordinate(SimTK::State& state, SimTK::Real value, int coordinate = 0) const;
    void setCoordinateRate(SimTK::State& state, SimTK::Real rate, int coordinate = 0) const;
    /**@}**/

    /** Returns λ in a native run. Stage::Acceleration. In implicit runs use
    ImplicitIntegrator::getMultipliers(). **/
    SimTK::Vector getMultipliers(const SimTK::State& state) const;

    /** Returns the spatial force (torque, force) of the joint on the body that carries F or M, at
    the origin of F or M, in axes of Ground, F or M [N m, N]. Stage::Velocity.
    @param coordinate  of a coupler: selects its F and M **/
    SimTK::SpatialVec calcReaction(const SimTK::State& state, const SimTK::Vector& multipliers,
                                   Side on, Side at, Axes axes = Axes::Ground,
                                   int coordinate = 0) const;
    /** As above, in a native run. Stage::Acceleration. **/
    SimTK::SpatialVec calcReaction(const SimTK::State& state, Side on, Side at,
                                   Axes axes = Axes::Ground, int coordinate = 0) const {
        return calcReaction(state, getMultipliers(state), on, at, axes, coordinate);
    }

    /** Returns the force or torque by which a prescribed motion drives M, one per equation, along
    its coordinate [N, N m]; times the coordinate's rate it is the power supplied. For a
    PrescribedPose: the force, then the torque at M's origin, in M's axes.
    @throws std::logic_error if the joint prescribes no motion. **/
    SimTK::Vector calcDrivingForces(const SimTK::Vector& multipliers) const;

    /** Returns the force or torque by which a coupler drives each of its coordinates, M forward and
    F backward [N, N m]. For a gear these are the torques on its wheels; divided by a wheel's radius
    they are the tooth force.
    @throws std::logic_error if the joint is no coupler. **/
    SimTK::Vector calcCouplingForces(const SimTK::Vector& multipliers) const;

    /** Returns the spatial force (torque, force) of the multipliers λ on M at its origin, in
    Ground: −D_Mᵀλ. Stage::Velocity. **/
    SimTK::SpatialVec calcForceOnM(const SimTK::State& state,
                                   const SimTK::Vector& multipliers) const;

protected:
    Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
          std::vector<Attachment> frames, const std::string& name);

private:
    friend class FlexibleBodySubsystem;
    void checkSize(const SimTK::Vector& multipliers) const;
    size_t findFrames(int coordinate) const;
    class Motions;
    Joint(const SimTK::MultibodySystem& system, SimTK::SubsystemIndex subsystem, JointIndex index)
        : m_system(&system), m_subsystem(subsystem), m_index(index) {}

    const FlexibleBodySubsystem::Guts& guts() const;

    const SimTK::MultibodySystem* m_system;
    SimTK::SubsystemIndex m_subsystem;
    JointIndex m_index;
};

class Joint::Ball : public Joint {
public:
    Ball(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
         const std::string& name = "");
};

class Joint::Pin : public Joint {
public:
    Pin(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
        const std::string& name = "");

    /** Angle and rate as in MobilizedBody::Pin, the angle in (−π, π] [rad, rad/s]. Stage::Velocity;
    see setCoordinate(). **/
    SimTK::Real getAngle(const SimTK::State& state) const { return calcCoordinates(state)[0]; }
    SimTK::Real getRate(const SimTK::State& state) const { return calcCoordinateDots(state)[0]; }
    void setAngle(SimTK::State& state, SimTK::Real angle) const { setCoordinate(state, angle); }
    void setRate(SimTK::State& state, SimTK::Real rate) const { setCoordinateRate(state, rate); }
};

class Joint::Slider : public Joint {
public:
    Slider(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
           const std::string& name = "");

    /** Length and rate as in MobilizedBody::Slider [m, m/s]. Stage::Velocity; see
    setCoordinate(). **/
    SimTK::Real getLength(const SimTK::State& state) const { return calcCoordinates(state)[0]; }
    SimTK::Real getRate(const SimTK::State& state) const { return calcCoordinateDots(state)[0]; }
    void setLength(SimTK::State& state, SimTK::Real length) const { setCoordinate(state, length); }
    void setRate(SimTK::State& state, SimTK::Real rate) const { setCoordinateRate(state, rate); }
};

class Joint::Weld : public Joint {
public:
    Weld(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
         const std::string& name = "");
};

class Joint::Cylinder : public Joint {
public:
    Cylinder(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
             const std::string& name = "");
};

class Joint::Universal : public Joint {
public:
    Universal(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
              const std::string& name = "");
};

class Joint::Planar : public Joint {
public:
    Planar(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
           const std::string& name = "");
};

class Joint::Screw : public Joint {
public:
    /** @param pitch  displacement per radian [m/rad], negative for a left-hand thread.
    @throws std::invalid_argument if it is 0 or not finite. **/
    Screw(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
          SimTK::Real pitch, const std::string& name = "");
};

class Joint::PointOnLine : public Joint {
public:
    PointOnLine(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                const std::string& name = "");
};

class Joint::PointInPlane : public Joint {
public:
    PointInPlane(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                 const std::string& name = "");
};

class Joint::Rod : public Joint {
public:
    /** @throws std::invalid_argument if the length is not finite and positive. **/
    Rod(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
        SimTK::Real length, const std::string& name = "");
};

class Joint::PrescribedRotation : public Joint {
public:
    /** @throws std::invalid_argument if `angle` is empty. **/
    PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                       AngleFunction angle, const std::string& name = "");
    PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                       FunctionOfTime angle, const std::string& name = "");
};

class Joint::PrescribedTranslation : public Joint {
public:
    /** @throws std::invalid_argument if `displacement` is empty. **/
    PrescribedTranslation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                          const Attachment& M, SimTK::CoordinateAxis axis,
                          MotionFunction displacement, const std::string& name = "");
    PrescribedTranslation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                          const Attachment& M, SimTK::CoordinateAxis axis,
                          FunctionOfTime displacement, const std::string& name = "");
};

class Joint::PrescribedPosition : public Joint {
public:
    /** @throws std::invalid_argument if `position` is empty. **/
    PrescribedPosition(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                       PositionFunction position, const std::string& name = "");
};

class Joint::PrescribedPose : public Joint {
public:
    /** @throws std::invalid_argument if `pose` is empty. **/
    PrescribedPose(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                   PoseFunction pose, const std::string& name = "");
};

/** A coordinate of frame M in frame F: of a joint, or of any two attachments, such as the frames of
a native mobilizer. **/
class Joint::Coordinate {
public:
    /** Coordinate `index` of a joint, see calcCoordinates(). Implicit, so that a Pin or Slider can
    be passed for its coordinate.
    @throws std::out_of_range if the joint has no such coordinate. **/
    Coordinate(const Joint& joint, int index = 0);
    /** Angle of M's x axis about F's z axis. **/
    static Coordinate makeAngle(const Attachment& F, const Attachment& M);
    /** Displacement of M's origin along an axis of F. **/
    static Coordinate makeDisplacement(const Attachment& F, const Attachment& M,
                                       SimTK::CoordinateAxis axis);

    const Attachment& getFrameF() const { return m_F; }
    const Attachment& getFrameM() const { return m_M; }
    const JointCoordinate& getCoordinate() const { return m_coordinate; }

private:
    Coordinate(const Attachment& F, const Attachment& M, const JointCoordinate& coordinate)
        : m_F(F), m_M(M), m_coordinate(coordinate) {}

    Attachment m_F, m_M;
    JointCoordinate m_coordinate;
};

/** `n_A θ_A + n_B θ_B = phase`, modulo one tooth: whole turns of the wheels are not tracked.
Assembly meshes the nearest teeth. BdfIntegrator and GeneralizedAlphaIntegrator reduce steps with
errors above 1/24 of a tooth, so that no tooth is skipped; with Simbody's integrators choose an
accuracy far finer than a tooth. The position error is in radians of wheel A. **/
class Joint::Gear : public Joint {
public:
    /** @param A, B  angles of the wheels about their axes F z, seen from the same side
    @param teethA, teethB  numbers of teeth, of opposite sign for an internal gear or opposed axes
    @throws std::invalid_argument if a coordinate is no angle or a number of teeth is 0. **/
    Gear(FlexibleBodySubsystem& subsystem, const Coordinate& A, int teethA, const Coordinate& B,
         int teethB, const std::string& name = "");
    /** @param phase  [rad]; default 0 **/
    Gear(FlexibleBodySubsystem& subsystem, const Coordinate& A, int teethA, const Coordinate& B,
         int teethB, SimTK::Real phase, const std::string& name = "");
};

/** `Σ c_i q_i = constant`, modulo whole turns of the angles among the q_i. Coefficients of angles
must have a ratio of integers up to 1000, as in belts and gear trains: the relation then has a
period, as a gear has its tooth. **/
class Joint::Coupler : public Joint {
public:
    struct Term {
        Coordinate coordinate;
        SimTK::Real coefficient;
    };
    /** @throws std::invalid_argument if there are no terms, a number is not finite or a coefficient
    is 0, or the coefficients of angles have no such ratio. **/
    Coupler(FlexibleBodySubsystem& subsystem, const std::vector<Term>& terms,
            const std::string& name = "");
    Coupler(FlexibleBodySubsystem& subsystem, const std::vector<Term>& terms, SimTK::Real constant,
            const std::string& name = "");
};

/** Holds a coordinate at its value from lock() until unlock(), as a brake, clutch or latch does;
for event handlers. Unlocked in a new State. **/
class Joint::Lock : public Joint {
public:
    Lock(FlexibleBodySubsystem& subsystem, const Coordinate& coordinate,
         const std::string& name = "");

    /** Locks the coordinate at its current value. Speeds are unchanged: assemble() makes them
    consistent. Stage::Velocity. **/
    void lock(SimTK::State& state) const;
    /** @param value  [rad or m] **/
    void lockAt(SimTK::State& state, SimTK::Real value) const;
    void unlock(SimTK::State& state) const;
    bool isLocked(const SimTK::State& state) const;
    /** Returns the lock position, the last one if unlocked [rad or m]. **/
    SimTK::Real getLockValue(const SimTK::State& state) const;
};

}  // namespace simflex
