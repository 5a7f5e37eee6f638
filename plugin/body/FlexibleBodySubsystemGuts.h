#pragma once
/** @file
Implementation of FlexibleBodySubsystem (private header). **/

#include <map>
#include <memory>
#include <vector>

#include "simflex/body/BodyLoad.h"
#include "simflex/body/FlexibleBodyEquations.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/ForceElement.h"
#include "simflex/body/FrictionEquations.h"
#include "simflex/body/InertiaCoupling.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/StateEquation.h"

namespace simflex {

struct FlexibleBodyRecord {
    std::string name;
    std::shared_ptr<const FlexibleBodyModel> model;
    std::shared_ptr<const FlexibleBodyModel> stiffened;  ///< null without stiffening data
    std::shared_ptr<const FlexibleBodyModel> rigid;      ///< without modes
    bool isStiffenedByDefault = true;
    FlexibleBodyIndex index;
    SimTK::MobilizedBodyIndex frame;
    std::vector<SimTK::MobilizedBodyIndex> carriers;
    Eigen::VectorXd damping;  ///< n_f modal damping coefficients d_i [1/s]: force −d_i ξ̇_i
    /** Off-diagonal modal damping, n_f×n_f with a zero diagonal: additional force −Dξ̇. Empty:
    none. **/
    Eigen::MatrixXd dampingCoupling;

    std::vector<BodyLoad> loads;

    int numModes() const { return model->n; }
};

struct JointRecord {
    std::string name;
    std::shared_ptr<const JointEquations> equations;
    std::vector<Attachment> frames;  ///< F, M; for a coupler the pairs of all coordinates
    SimTK::ConstraintIndex constraint;
    std::shared_ptr<const FrictionEquations> friction;  ///< null: none
    std::vector<int> turns;  ///< by coordinate, index of the state that counts its turns; −1 or
                             ///< missing: not counted

    int getTurns(int coordinate) const {
        return size_t(coordinate) < turns.size() ? turns[size_t(coordinate)] : -1;
    }
};

class TurnState;

class FlexibleBodySubsystem::Guts : public SimTK::ForceSubsystem::Guts {
public:
    Guts(const SimTK::SimbodyMatterSubsystem& matter)
        : SimTK::ForceSubsystem::Guts("FlexibleBodySubsystem", "0.1"),
          m_matterIndex(matter.getMySubsystemIndex()) {}

    const SimTK::SimbodyMatterSubsystem& getMatter() const {
        return SimTK::SimbodyMatterSubsystem::downcast(getSystem().getSubsystem(m_matterIndex));
    }
    SimTK::SimbodyMatterSubsystem& updMatter() {
        return SimTK::SimbodyMatterSubsystem::updDowncast(updSystem().updSubsystem(m_matterIndex));
    }

    /** @throws std::invalid_argument if an attachment is on a body of another system.
    @param owner  the attached element, for the message **/
    void requireOwn(const Attachment& attachment, const std::string& owner) const;
    /** Appends a number to a name that another body, or another joint of the same kind, has. **/
    void makeUnique(FlexibleBodyRecord& record) const;
    void makeUnique(JointRecord& record) const;
    FlexibleBodyIndex addBody(FlexibleBodyRecord record);
    JointIndex addJoint(JointRecord record);
    void setFriction(JointIndex index, std::shared_ptr<const FrictionEquations> friction);
    void addForceElement(std::unique_ptr<ForceElement> element);
    int addState(std::unique_ptr<StateEquation> equation);
    /** Starts to count the turns of a joint's coordinate. Reuses the state of another joint that
    counts the same coordinate. @param start, lead  see TurnState
    @returns the index of the state
    @pre the coordinate is periodic. **/
    int countTurns(JointIndex joint, int coordinate, SimTK::Real start,
                   const JointEquations::MotionFunction& lead);
    /** Adds to the damping coefficients of a body, n_f [1/s]. **/
    void addModalDamping(FlexibleBodyIndex index, const SimTK::Array_<SimTK::Real>& coefficients);
    /** Adds a full n_f×n_f damping matrix [1/s]. **/
    void addDampingMatrix(FlexibleBodyIndex index, const Eigen::MatrixXd& D);

    void addLoad(FlexibleBodyIndex index, BodyLoad load);

    /** Returns the shared evaluation model of a part, checked and built once for all its bodies.
    @throws std::invalid_argument if the part is not valid. **/
    std::shared_ptr<const FlexibleBodyModel> obtainModel(
        const std::shared_ptr<const ReducedBody>& part);
    /** Returns the model with geometric stiffening, null if the part has no data for it. **/
    std::shared_ptr<const FlexibleBodyModel> obtainStiffenedModel(
        const std::shared_ptr<const ReducedBody>& part);

    /** Returns the model without modes. **/
    std::shared_ptr<const FlexibleBodyModel> obtainRigidModel(
        const std::shared_ptr<const ReducedBody>& part);

    /** Returns whether every mode is locked at zero. **/
    bool isRigid(const SimTK::State& state, const FlexibleBodyRecord& body) const;

    /** @name Geometric stiffening, an Instance-stage variable of each body with stiffening data **/
    /**@{**/
    enum class Stiffening { Off, On };
    Stiffening getStiffening(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    /** @throws std::invalid_argument if the part has no stiffening data. **/
    void setStiffening(SimTK::State& state, FlexibleBodyIndex index, Stiffening stiffening) const;
    void setStiffeningByDefault(FlexibleBodyIndex index, Stiffening stiffening);
    /** Returns the evaluation model in use. **/
    const FlexibleBodyModel& getModel(const SimTK::State& state,
                                      const FlexibleBodyRecord& body) const {
        return getStiffening(state, body) == Stiffening::On ? *body.stiffened : *body.model;
    }
    /** Returns the order in ξ of the displacements of this body's interfaces. **/
    FrameAtXi::Order getFrameOrder(const SimTK::State& state,
                                   const FlexibleBodyRecord& body) const {
        return getStiffening(state, body) == Stiffening::On ? FrameAtXi::Order::Second
                                                            : FrameAtXi::Order::First;
    }
    /**@}**/

    const std::vector<FlexibleBodyRecord>& bodies() const { return m_bodies; }
    void nameBody(SimTK::MobilizedBodyIndex body, const std::string& name) {
        m_bodyNames[body] = name;
    }
    /** Returns the name set by nameBody(), or "". **/
    std::string findBodyName(SimTK::MobilizedBodyIndex body) const;
    const std::vector<JointRecord>& joints() const { return m_joints; }
    const std::vector<std::shared_ptr<const ForceElement>>& forceElements() const {
        return m_forceElements;
    }
    const std::vector<std::shared_ptr<const StateEquation>>& states() const { return m_states; }
    const StateEquation& state(int index) const { return *m_states.at(size_t(index)); }
    /** Returns null if the turns of this coordinate are not counted. **/
    const TurnState* findTurns(JointIndex joint, int coordinate) const;
    const FlexibleBodyRecord& body(FlexibleBodyIndex index) const { return m_bodies.at(index); }
    const JointRecord& joint(JointIndex index) const { return m_joints.at(index); }

    Eigen::VectorXd getXi(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    Eigen::VectorXd getXiDot(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    BodyFrame getBodyFrame(const SimTK::State& state, const FlexibleBodyRecord& body) const;

    /** Computes pose and velocity of an attachment. Stage::Velocity. **/
    FrameMotion calcMotion(const SimTK::State& state, const Attachment& attachment) const;
    SimTK::Array_<FrameMotion> calcMotions(const SimTK::State& state,
                                           const SimTK::Array_<Attachment>& attachments) const;

    /** Adds a force (torque, force) in Ground at an attachment's origin to forces on bodies and on
    mobilities. Stage::Position. **/
    void addInAttachmentForce(const SimTK::State& state, const Attachment& attachment,
                              const SimTK::SpatialVec& F_G,
                              SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                              SimTK::Vector& mobilityForces) const;

    /** What drives a joint in a State. Stage::Time. **/
    JointEquations::Drive calcDrive(const SimTK::State& state, JointIndex index) const;
    /** Position at which a lock holds its coordinate, an Instance-stage variable; 0 for other
    joints. **/
    SimTK::Real getHeld(const SimTK::State& state, JointIndex index) const;
    void setHeld(SimTK::State& state, JointIndex index, SimTK::Real value) const;

    /** Returns the index of the first StateEquation among all z of a State. Stage::Model. **/
    int getFirstZ(const SimTK::State& state) const {
        return int(state.getZStart(getMySubsystemIndex()));
    }
    /** Inputs for elements and equations; valid until these values of the State change. **/
    ElementInputs getInputs(const SimTK::State& state) const;
    /** Initialises all StateEquations. Stage::Velocity. **/
    void startStates(SimTK::State& state) const;
    /** Moves an angle to the turn nearest to `value`. No effect on coordinates whose turns are not
    counted. Stage::Velocity. **/
    void setTurn(SimTK::State& state, JointIndex joint, int coordinate, SimTK::Real value) const;

    /** Enables or disables the forces of this subsystem, inertia coupling included, in one State
    (Stage::Instance): the BGE solver evaluates them itself. **/
    void setNativeForcesEnabled(SimTK::State& state, bool enabled) const;

    /** Makes Simbody compute these accelerations (in its own numbering) where they are free and
    unconstrained, for elements that need accelerations known already. The forces required for them
    replace the subsystem's own. **/
    void setKnownAccelerations(SimTK::State& state, const SimTK::Vector& uDot) const;

    /** Refuses enabled joints with friction, which Simbody's own accelerations would ignore.
    Stage::Instance. @throws std::invalid_argument naming the joint. **/
    void refuseFriction(const SimTK::State& state) const;
    /** Marks a State as published by an integrator that handles joint friction: it may be realized
    further as long as its time does not change. **/
    void setShown(SimTK::State& state) const;

    /** Sets the weights of flexible bodies' speeds: the displacement in metres that a unit of each
    causes. Stage::Model. **/
    void setDisplacementWeights(SimTK::State& state) const;

    SimTK::Real calcPotentialEnergy(const SimTK::State& state) const override;

protected:
    SimTK::Subsystem::Guts* cloneImpl() const override { return new Guts(*this); }
    int realizeSubsystemTopologyImpl(SimTK::State& state) const override;
    int realizeSubsystemDynamicsImpl(const SimTK::State& state) const override;
    int realizeSubsystemAccelerationImpl(const SimTK::State& state) const override;

private:
    /** Forces applied when Simbody realizes a State (Stage::Instance). **/
    enum NativeForces { None, Own, ForKnownAccelerations };

    /** @throws std::invalid_argument naming a force subsystem added after this one. **/
    void checkOrder() const;
    void addInBodyForces(const SimTK::State& state, FlexibleBodyIndex index,
                         SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                         SimTK::Vector& mobilityForces) const;
    void addInModalForces(const SimTK::State& state, const FlexibleBodyRecord& body,
                          const Eigen::VectorXd& modal, SimTK::Vector& mobilityForces) const;

    SimTK::SubsystemIndex m_matterIndex;
    std::vector<FlexibleBodyRecord> m_bodies;
    std::vector<JointRecord> m_joints;
    std::map<SimTK::MobilizedBodyIndex, std::string> m_bodyNames;
    std::vector<std::shared_ptr<const ForceElement>> m_forceElements;
    std::vector<std::shared_ptr<const StateEquation>> m_states;
    std::map<const ReducedBody*, std::shared_ptr<const FlexibleBodyModel>> m_models, m_stiffened,
        m_rigid;
    mutable SimTK::DiscreteVariableIndex m_nativeForces, m_knownUDot;
    mutable std::shared_ptr<InertiaCoupling> m_coupling;             ///< null if no body has modes
    mutable std::vector<SimTK::DiscreteVariableIndex> m_stiffening;  ///< by body; invalid: no data
    mutable std::vector<SimTK::DiscreteVariableIndex> m_held;        ///< by joint; invalid: no lock
    mutable SimTK::DiscreteVariableIndex m_shownTime;  ///< invalid: no joint has friction
};

inline Eigen::Vector3d toEigen(const SimTK::Vec3& v) {
    return {v[0], v[1], v[2]};
}
inline SimTK::Vec3 toSimTK(const Eigen::Vector3d& v) {
    return {v[0], v[1], v[2]};
}

/** Returns the name given by FlexibleBodySubsystem::nameBody(), else "body 3" (`word` and its
index). **/
std::string describeBody(const SimTK::SimbodyMatterSubsystem& matter,
                         SimTK::MobilizedBodyIndex body, const std::string& word = "body");

}  // namespace simflex
