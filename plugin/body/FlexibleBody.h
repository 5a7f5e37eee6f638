#pragma once
/** @file
A flexible part in a SimTK::MultibodySystem.

Its frame B is a MobilizedBody::Free on Ground with the undeformed mass properties. Its modal
coordinates ξ are the q of ModalMobilizer bodies. Both are ordinary Simbody mobilizers, so ξ and ξ̇
can be initialised, locked and measured. setRigid() holds all modes; to remove some permanently, use
a part with fewer modes (simflex/part/ModeSelection.h).

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
    /** Adds the part to the system; `name` defaults to the part's. A number is appended to a name
    that another flexible body has: "rod 2".
    @throws std::invalid_argument if the part is not valid. **/
    FlexibleBody(FlexibleBodySubsystem& subsystem, std::shared_ptr<const ReducedBody> part,
                 const std::string& name = "");

    const std::string& getName() const;
    FlexibleBodyIndex getIndex() const { return m_index; }
    int getNumModes() const { return getPart().numModes; }
    const ReducedBody& getPart() const { return *getPartHandle(); }
    const std::shared_ptr<const ReducedBody>& getPartHandle() const;

    /** Returns the mobilized body of frame B (origin at the undeformed centre of mass). **/
    const SimTK::MobilizedBody& getFrame() const;
    /** Returns the carrier of modes 6k … 6k+5. **/
    const SimTK::MobilizedBody& getModalMobilizer(int k) const;
    int getNumModalMobilizers() const;

    /** @name Geometric stiffening
    Stiffness that modes gain or lose from rotation of the body and from forces and moments on its
    interfaces. Without it a rapidly rotating rod is too soft or even collapses. The part must be
    reduced with `simflex reduce --stiffening`; stiffening is then on unless it is disabled.
    Interface displacements are of second order in ξ: bending draws the ends of a rod together.
    Gravity and loads at other nodes cause no stiffening. A State variable of Stage::Instance. **/
    /**@{**/
    bool hasStiffening() const { return getPart().stiffening.has_value(); }
    /** Sets whether new States start without stiffening; default false. Topological.
    @throws std::invalid_argument for `false` if the part has no data, saying how to compute
    them. **/
    void setStiffeningDisabledByDefault(bool isDisabled);
    /** Stage::Topology. @throws std::invalid_argument if the part has no data, saying how to
    compute them. **/
    void enableStiffening(SimTK::State& state) const;
    void disableStiffening(SimTK::State& state) const;
    bool isStiffeningEnabled(const SimTK::State& state) const;
    /**@}**/

    /** @name Rigid or flexible
    A State variable of Stage::Instance: nothing is rebuilt, and event handlers may change it. It
    locks or unlocks the modal mobilizers, so Simbody's own integrators respect it as well. In the
    implicit integrators a rigid body costs no more than the six speeds of its frame.

        crank.setRigid(state);       // undeformed from here on
        crank.setFlexible(state);    // its modes move again, from rest  **/
    /**@{**/
    /** Sets modal coordinates and speeds to zero and holds them there. The frame keeps its pose and
    velocity; deformation and vibration are lost. Joints opened by this are closed when an implicit
    integrator takes over the State, also after its event handlers. With Simbody's own integrators,
    call FlexibleBodySubsystem::initializeNative() before the run and in event handlers. To keep the
    deformed shape instead, lock() every getModalMobilizer(). **/
    void setRigid(SimTK::State& state) const;
    /** Frees all modes, including individually locked mobilizers. Coordinates and speeds are
    unchanged: zero after setRigid(). A part without modes stays rigid. **/
    void setFlexible(SimTK::State& state) const;
    /** Returns whether every mode is locked at zero. **/
    bool isRigid(const SimTK::State& state) const;
    /** Sets whether new States start rigid; default false. Topological. **/
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

    /** @name Nodes by position, in the coordinates of the part's deck or geometry [m]; parallel to
    B, whose origin is at getPart().centerOfMass **/
    /**@{**/
    /** Returns the deck number of the node nearest to a point, the first of several. O(nodes).
    @throws std::invalid_argument if the point is not finite or the part has no nodes. **/
    int findNearestNode(const SimTK::Vec3& point) const;
    /** Returns the undeformed position of a node. @throws std::out_of_range. **/
    SimTK::Vec3 getNodePosition(int nodeNumber) const;
    /**@}**/

    /** @name State access. Stage::Model suffices, except where noted and for the pose:
    Stage::Position. **/
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
    displacements: Stage::Position. **/
    /**@{**/
    SimTK::Real calcKineticEnergy(const SimTK::State& state) const;
    SimTK::Real calcStrainEnergy(const SimTK::State& state) const;
    /** Returns the strain energy of each mode, ½Ω_i²ξ_i² [J]. **/
    SimTK::Vector calcModalStrainEnergies(const SimTK::State& state) const;
    /** Returns the angular momentum about Ground's origin and the linear momentum, in Ground [kg
    m²/s, kg m/s]. **/
    SimTK::SpatialVec calcMomentum(const SimTK::State& state) const;
    /** Returns the location of a mesh node in Ground [m], to first order in ξ. @throws
    std::out_of_range. **/
    SimTK::Vec3 calcNodeLocation(const SimTK::State& state, int nodeNumber) const;
    /** Returns the elastic displacement Φξ of a mesh node in B [m]. @throws std::out_of_range. **/
    SimTK::Vec3 calcNodeDisplacement(const SimTK::State& state, int nodeNumber) const;
    /** Returns the largest |Φξ| over the mesh [m]. Searches only a small part of a large mesh. **/
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
