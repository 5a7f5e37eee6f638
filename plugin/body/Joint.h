#pragma once
/** @file
Joints between two attachments, F and M, with Simbody's axis conventions: Pin turns about the common
z axis, Slider slides along F's x axis. A joint is a Simbody Constraint on the body frames and modal
mobilizers, so native Simbody integrators see it; BdfIntegrator evaluates it directly.

    Joint::Pin pin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin");

A Joint is a handle: copies refer to the same joint. **/

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
    class PrescribedRotation;  ///< angle of M about F's z axis is a function of time (1); add it to
                               ///< a Pin

    /** Angle, rate and acceleration [rad, rad/s, rad/s²] at a time. **/
    using AngleFunction = std::function<SimTK::Vec3(SimTK::Real time)>;

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

    /** Spatial force (torque, force) that multipliers λ put on M at its origin, in Ground: −D_Mᵀλ.
     * Stage::Velocity. **/
    SimTK::SpatialVec calcForceOnM(const SimTK::State& state,
                                   const SimTK::Vector& multipliers) const;

protected:
    Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
          const Attachment& F, const Attachment& M, const std::string& name);

private:
    friend class FlexibleBodySubsystem;
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

class Joint::PrescribedRotation : public Joint {
public:
    /** @throws std::invalid_argument if `angle` is empty. **/
    PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                       AngleFunction angle, const std::string& name = "");
};

}  // namespace simflex
