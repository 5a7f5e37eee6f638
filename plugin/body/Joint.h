#pragma once
/** @file
Joints between two attachments, F and M, with the axes of Simbody's mobilizer of the same name: Pin
turns about the common z axis, Slider slides along F's x axis. A joint is a Simbody Constraint on
the body frames and modal mobilizers, so native Simbody integrators see it; BdfIntegrator evaluates
it directly.

    Joint::Pin pin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin");

A Joint is a handle: copies refer to the same joint. **/

#include <array>
#include <functional>

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class JointEquations;

class Joint {
public:
    class Ball;                ///< origins coincide (3 equations)
    class Pin;                 ///< origins and z axes coincide (5)
    class Slider;              ///< M slides along F's x axis, axes parallel (5)
    class Weld;                ///< frames coincide (6)
    class Cylinder;            ///< M turns about and slides along the common z axis (4)
    class Universal;           ///< origins coincide, F's x axis is normal to M's y axis (4)
    class Planar;              ///< M moves in F's xy plane and turns about z (3)
    class Screw;               ///< Cylinder whose displacement is pitch times its angle (5)
    class PointOnLine;         ///< M's origin is on F's z axis (2)
    class PointInPlane;        ///< M's origin is in F's xy plane (1)
    class Rod;                 ///< origins are `length` apart (1)
    class PrescribedRotation;  ///< angle of M about F's z axis is a function of time (1); add it to
                               ///< a Pin or Cylinder
    class PrescribedTranslation;  ///< M's displacement along an axis of F is one (1); add it to a
                                  ///< Slider or Cylinder
    class PrescribedPosition;     ///< M's origin in F is a function of time (3)

    /** Value, rate and acceleration [rad or m, per s, per s²] at a time. **/
    using MotionFunction = std::function<SimTK::Vec3(SimTK::Real time)>;
    using AngleFunction = MotionFunction;
    /** Position, velocity and acceleration in F's axes [m, m/s, m/s²] at a time. **/
    using PositionFunction = std::function<std::array<SimTK::Vec3, 3>(SimTK::Real time)>;

    enum class Side { F, M };
    enum class Axes { Ground, F, M };

    const std::string& getName() const;
    JointIndex getIndex() const { return m_index; }
    int getNumEquations() const;
    const Attachment& getFrameF() const;
    const Attachment& getFrameM() const;
    /** The Simbody constraint that stands for this joint in native runs. **/
    SimTK::ConstraintIndex getConstraintIndex() const;
    const JointEquations& getEquations() const;

    /** Position errors [m, 1], size getNumEquations(). Stage::Velocity. **/
    SimTK::Vector calcPositionErrors(const SimTK::State& state) const;

    /** @name Coordinates of the joint [rad, m]
    In the order of q of Simbody's mobilizer of the same name: Cylinder (angle, displacement),
    Universal (about F's x axis, about M's y axis), Planar (angle, x, y). PointOnLine has z,
    PointInPlane (x, y), prescribed motions what they prescribe; Ball, Weld and Rod have none.
    Angles are in (−π, π], but a Screw's counts turns. Stage::Velocity. **/
    /**@{**/
    int getNumCoordinates() const;
    SimTK::Vector calcCoordinates(const SimTK::State& state) const;
    SimTK::Vector calcCoordinateDots(const SimTK::State& state) const;
    /**@}**/

    /** λ in a native run. Stage::Acceleration. Implicit runs: ImplicitIntegrator::getMultipliers.
     * **/
    SimTK::Vector getMultipliers(const SimTK::State& state) const;

    /** Spatial force (torque, force) that the joint puts on the body that carries F or M, taken at
    the origin of F or M, in axes of Ground, F or M [N m, N]. Stage::Velocity. **/
    SimTK::SpatialVec calcReaction(const SimTK::State& state, const SimTK::Vector& multipliers,
                                   Side on, Side at, Axes axes = Axes::Ground) const;
    /** The same in a native run. Stage::Acceleration. **/
    SimTK::SpatialVec calcReaction(const SimTK::State& state, Side on, Side at,
                                   Axes axes = Axes::Ground) const {
        return calcReaction(state, getMultipliers(state), on, at, axes);
    }

    /** Force or torque with which a prescribed motion drives M, one for each equation, along its
    coordinate [N, N m]: times the coordinate's rate it is the power put in.
    @throws std::logic_error if the joint prescribes no motion. **/
    SimTK::Vector calcDrivingForces(const SimTK::Vector& multipliers) const;

    /** Spatial force (torque, force) that multipliers λ put on M at its origin, in Ground: −D_Mᵀλ.
     * Stage::Velocity. **/
    SimTK::SpatialVec calcForceOnM(const SimTK::State& state,
                                   const SimTK::Vector& multipliers) const;

protected:
    Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
          const Attachment& F, const Attachment& M, const std::string& name);

private:
    friend class FlexibleBodySubsystem;
    void checkSize(const SimTK::Vector& multipliers) const;
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
};

class Joint::Slider : public Joint {
public:
    Slider(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
           const std::string& name = "");
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
};

class Joint::PrescribedTranslation : public Joint {
public:
    /** @throws std::invalid_argument if `displacement` is empty. **/
    PrescribedTranslation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                          const Attachment& M, SimTK::CoordinateAxis axis,
                          MotionFunction displacement, const std::string& name = "");
};

class Joint::PrescribedPosition : public Joint {
public:
    /** @throws std::invalid_argument if `position` is empty. **/
    PrescribedPosition(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                       PositionFunction position, const std::string& name = "");
};

}  // namespace simflex
