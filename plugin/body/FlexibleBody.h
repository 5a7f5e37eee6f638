#pragma once
/** @file
A flexible part in a SimTK::MultibodySystem.

Its frame B is a MobilizedBody::Free on Ground with the undeformed mass properties; its modal
coordinates ξ are the q of ModalMobilizer bodies. Both are ordinary Simbody mobilizers, so that ξ, ξ̇
can be initialised, locked and measured. setRigid() holds them all; to hold some for good, make the
body of a part with fewer modes (simflex/part/ModeSelection.h).

    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    auto part = std::make_shared<const ReducedBody>(readReducedBody("crank.h5"));
    FlexibleBody crank(flexible, part);
    Joint::Pin shaft(flexible, matter.Ground(), crank.interface("shaft"));

A FlexibleBody is a handle: copies refer to the same body. **/

#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

class FlexibleBody {
public:
    /** Adds the part to the system; `name` defaults to the part's. A name that another flexible
    body has gets a number behind it, "rod 2".
    @throws std::invalid_argument if the part is not valid. **/
    FlexibleBody(FlexibleBodySubsystem& subsystem, std::shared_ptr<const ReducedBody> part,
                 const std::string& name = "");

    const std::string& getName() const;
    FlexibleBodyIndex getIndex() const { return m_index; }
    int getNumModes() const { return getPart().numModes; }
    const ReducedBody& getPart() const { return *getPartHandle(); }
    const std::shared_ptr<const ReducedBody>& getPartHandle() const;

    /** The mobilized body of frame B (origin at the undeformed centre of mass). **/
    const SimTK::MobilizedBody& getFrame() const;
    /** Carrier of modes 6k … 6k+5. **/
    const SimTK::MobilizedBody& getModalMobilizer(int k) const;
    int getNumModalMobilizers() const;

    /** @name Geometric stiffening
    The stiffness that modes gain (or lose) by rotation of the body and by forces and moments on its
    interfaces; without it a rod that turns fast gets too soft, or collapses. It needs a part that
    was reduced with it (`simflex reduce --stiffening`), and is then on unless it is disabled.
    Interfaces move to second order in ξ: bending draws the ends of a rod together. Loads elsewhere,
    on nodes, and gravity stiffen nothing. A variable of the State, Stage::Instance. **/
    /**@{**/
    /** True if the part has the data. **/
    bool hasStiffening() const { return getPart().stiffening.has_value(); }
    /** Whether States start without it; false unless set. Topological.
    @throws std::invalid_argument for `false` if the part has no data, saying how to get them. **/
    void setStiffeningDisabledByDefault(bool isDisabled);
    /** @throws std::invalid_argument if the part has no data, saying how to get them.
    Stage::Topology. **/
    void enableStiffening(SimTK::State& state) const;
    void disableStiffening(SimTK::State& state) const;
    bool isStiffeningEnabled(const SimTK::State& state) const;
    /**@}**/

    /** @name Rigid or flexible
    A switch of the State, Stage::Instance: nothing is rebuilt, and event handlers may use it. It
    locks or unlocks the modal mobilizers, so that Simbody's own integrators obey it as well; in
    the implicit ones a rigid body costs no more than its frame's six speeds.

        crank.setRigid(state);       // undeformed from here on
        crank.setFlexible(state);    // its modes move again, from rest
    **/
    /**@{**/
    /** Sets modal coordinates and speeds to zero and holds them there. The frame keeps its pose and
    velocity: what was a deformation or a vibration is lost. Joints that no longer meet are
    assembled when an implicit integrator takes the State, from its handlers too; before a run of
    Simbody's own integrators, and in its handlers, call FlexibleBodySubsystem::initializeNative().
    To keep the deformed shape instead, lock() every getModalMobilizer(). **/
    void setRigid(SimTK::State& state) const;
    /** Frees all modes, also those that were locked one mobilizer at a time; coordinates and speeds
    stay what they are, zero after setRigid(). A part without modes stays rigid. **/
    void setFlexible(SimTK::State& state) const;
    /** True if every mode is held at zero. **/
    bool isRigid(const SimTK::State& state) const;
    /** Whether States start rigid; false unless set. Topological. **/
    void setRigidByDefault(bool isRigid);
    bool isRigidByDefault() const;
    /**@}**/

    /** Attachments, see Attachment::onInterface() and onNode(). **/
    Attachment interface(const std::string& name,
                         const SimTK::Transform& X_IA = SimTK::Transform()) const {
        return Attachment::onInterface(*this, name, X_IA);
    }
    Attachment node(int nodeNumber, const SimTK::Transform& X_NA = SimTK::Transform()) const {
        return Attachment::onNode(*this, nodeNumber, X_NA);
    }

    /** @name Nodes by place, in the coordinates of the part's deck or geometry [m]; those of B lie
    parallel, with their origin at getPart().centerOfMass **/
    /**@{**/
    /** Number in the deck of the node nearest to a point; of several the first. O(nodes).
    @throws std::invalid_argument if the point is not finite or the part has no nodes. **/
    int findNearestNode(const SimTK::Vec3& point) const;
    /** Where a node of the undeformed part is. @throws std::out_of_range. **/
    SimTK::Vec3 getNodePosition(int nodeNumber) const;
    /**@}**/

    /** @name State access. Stage::Model suffices, except for the pose: Stage::Position. **/
    /**@{**/
    SimTK::Transform getFramePose(const SimTK::State& state) const;  ///< X_GB
    SimTK::SpatialVec getFrameVelocity(
        const SimTK::State& state) const;  ///< (ω, v) in Ground; Stage::Velocity
    SimTK::Vector getModalCoordinates(const SimTK::State& state) const;  ///< ξ
    SimTK::Vector getModalSpeeds(const SimTK::State& state) const;       ///< ξ̇
    void setFramePose(SimTK::State& state, const SimTK::Transform& X_GB) const;
    void setFrameVelocity(SimTK::State& state, const SimTK::SpatialVec& V_GB) const;
    void setModalCoordinates(SimTK::State& state, const SimTK::Vector& xi) const;
    void setModalSpeeds(SimTK::State& state, const SimTK::Vector& xiDot) const;
    /** Places the undeformed part so that interface `name` has pose X_GI. **/
    void setPoseByInterface(SimTK::State& state, const std::string& name,
                            const SimTK::Transform& X_GI) const;
    /**@}**/

    /** @name Quantities of the deformed body. Energies and momentum: Stage::Velocity;
     * displacements: Stage::Position. **/
    /**@{**/
    SimTK::Real calcKineticEnergy(const SimTK::State& state) const;
    SimTK::Real calcStrainEnergy(const SimTK::State& state) const;
    /** Strain energy of each mode, ½Ω_i²ξ_i² [J]. **/
    SimTK::Vector calcModalStrainEnergies(const SimTK::State& state) const;
    /** Angular momentum about Ground's origin and linear momentum, in Ground [kg m²/s, kg m/s]. **/
    SimTK::SpatialVec calcMomentum(const SimTK::State& state) const;
    /** Location in Ground of a mesh node [m], of first order in ξ. @throws std::out_of_range. **/
    SimTK::Vec3 calcNodeLocation(const SimTK::State& state, int nodeNumber) const;
    /** Elastic displacement Φξ of a mesh node in B [m]. @throws std::out_of_range. **/
    SimTK::Vec3 calcNodeDisplacement(const SimTK::State& state, int nodeNumber) const;
    /** Largest |Φξ| over the mesh [m]. Of large meshes it looks at small parts only. **/
    SimTK::Real calcLargestDisplacement(const SimTK::State& state) const;
    /**@}**/

private:
    friend class FlexibleBodySubsystem;
    friend class Attachment;
    FlexibleBody(const SimTK::MultibodySystem& system, SimTK::SubsystemIndex subsystem,
                 FlexibleBodyIndex index)
        : m_system(&system), m_subsystem(subsystem), m_index(index) {}

    const FlexibleBodySubsystem::Guts& guts() const;
    FlexibleBodySubsystem::Guts& updGuts();

    const SimTK::MultibodySystem* m_system;
    SimTK::SubsystemIndex m_subsystem;
    FlexibleBodyIndex m_index;
};

}  // namespace simflex
