#pragma once
/** @file
What a FlexibleBodySubsystem holds (private header). **/

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

/** One flexible body of the system. **/
struct FlexibleBodyRecord {
    std::string name;
    std::shared_ptr<const FlexibleBodyModel> model;
    std::shared_ptr<const FlexibleBodyModel> stiffened;  ///< null if the part has no data for it
    std::shared_ptr<const FlexibleBodyModel> rigid;      ///< without modes
    bool isStiffenedByDefault = true;
    FlexibleBodyIndex index;
    SimTK::MobilizedBodyIndex frame;
    std::vector<SimTK::MobilizedBodyIndex> carriers;
    Eigen::VectorXd damping;  ///< n_f modal damping coefficients d_i [1/s]: force −d_i ξ̇_i
    /** What couples modes, n_f×n_f with a zero diagonal: force −Dξ̇ beside it. Empty: none. **/
    Eigen::MatrixXd dampingCoupling;

    std::vector<BodyLoad> loads;

    int numModes() const { return model->n; }
};

/** One joint of the system. **/
struct JointRecord {
    std::string name;
    std::shared_ptr<const JointEquations> equations;
    std::vector<Attachment> frames;  ///< F, M; of a coupler those of every coordinate
    SimTK::ConstraintIndex constraint;
    std::shared_ptr<const FrictionEquations> friction;  ///< null: none
    std::vector<int> turns;  ///< by coordinate, the state that counts its turns; −1, or none: none

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
    @param owner  what holds on to it, for the message **/
    void requireOwn(const Attachment& attachment, const std::string& owner) const;
    /** Puts a number behind a name that another body, or another joint of the same kind, has. **/
    void makeUnique(FlexibleBodyRecord& record) const;
    void makeUnique(JointRecord& record) const;
    FlexibleBodyIndex addBody(FlexibleBodyRecord record);
    JointIndex addJoint(JointRecord record);
    void setFriction(JointIndex index, std::shared_ptr<const FrictionEquations> friction);
    void addForceElement(std::unique_ptr<ForceElement> element);
    int addState(std::unique_ptr<StateEquation> equation);
    /** Counts turns of a joint's coordinate from now on, or of the same coordinate of another joint
    that has them counted. @param start, lead  as TurnState has them
    @returns the number of the state
    @pre the coordinate is periodic. **/
    int countTurns(JointIndex joint, int coordinate, SimTK::Real start,
                   const JointEquations::MotionFunction& lead);
    /** Adds to the damping coefficients of a body, n_f [1/s]. **/
    void addModalDamping(FlexibleBodyIndex index, const SimTK::Array_<SimTK::Real>& coefficients);
    /** Adds a full n_f×n_f damping matrix [1/s]. **/
    void addDampingMatrix(FlexibleBodyIndex index, const Eigen::MatrixXd& D);

    void addLoad(FlexibleBodyIndex index, BodyLoad load);

    /** The shared evaluation model of a part; checked and built once however many bodies are made
    of it. @throws std::invalid_argument if the part is not valid. **/
    std::shared_ptr<const FlexibleBodyModel> obtainModel(
        const std::shared_ptr<const ReducedBody>& part);
    /** The same with geometric stiffening; null if the part has no data for it. **/
    std::shared_ptr<const FlexibleBodyModel> obtainStiffenedModel(
        const std::shared_ptr<const ReducedBody>& part);

    /** The same without modes. **/
    std::shared_ptr<const FlexibleBodyModel> obtainRigidModel(
        const std::shared_ptr<const ReducedBody>& part);

    /** True if every mode is locked at zero. **/
    bool isRigid(const SimTK::State& state, const FlexibleBodyRecord& body) const;

    /** @name Geometric stiffening, an Instance-stage variable of each body that has data for it **/
    /**@{**/
    enum class Stiffening { Off, On };
    Stiffening getStiffening(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    /** @throws std::invalid_argument if the part has no data for it. **/
    void setStiffening(SimTK::State& state, FlexibleBodyIndex index, Stiffening stiffening) const;
    void setStiffeningByDefault(FlexibleBodyIndex index, Stiffening stiffening);
    /** The evaluation model in use. **/
    const FlexibleBodyModel& getModel(const SimTK::State& state,
                                      const FlexibleBodyRecord& body) const {
        return getStiffening(state, body) == Stiffening::On ? *body.stiffened : *body.model;
    }
    /** Of the displacements of this body's interfaces. **/
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
    /** Of a rigid body; empty if nobody has named it. **/
    std::string findBodyName(SimTK::MobilizedBodyIndex body) const;
    const std::vector<JointRecord>& joints() const { return m_joints; }
    const std::vector<std::shared_ptr<const ForceElement>>& forceElements() const {
        return m_forceElements;
    }
    const std::vector<std::shared_ptr<const StateEquation>>& states() const { return m_states; }
    const StateEquation& state(int index) const { return *m_states.at(size_t(index)); }
    /** Null if the turns of this coordinate are not counted. **/
    const TurnState* findTurns(JointIndex joint, int coordinate) const;
    const FlexibleBodyRecord& body(FlexibleBodyIndex index) const { return m_bodies.at(index); }
    const JointRecord& joint(JointIndex index) const { return m_joints.at(index); }

    Eigen::VectorXd getXi(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    Eigen::VectorXd getXiDot(const SimTK::State& state, const FlexibleBodyRecord& body) const;
    BodyFrame getBodyFrame(const SimTK::State& state, const FlexibleBodyRecord& body) const;

    /** Pose and velocity of an attachment. Stage::Velocity. **/
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
    /** Where a lock holds its coordinate, an Instance-stage variable; 0 of other joints. **/
    SimTK::Real getHeld(const SimTK::State& state, JointIndex index) const;
    void setHeld(SimTK::State& state, JointIndex index, SimTK::Real value) const;

    /** Number of the first state's value among all z of a State. Stage::Model. **/
    int getFirstZ(const SimTK::State& state) const {
        return int(state.getZStart(getMySubsystemIndex()));
    }
    /** For elements and equations; good as long as the State has these values. **/
    ElementInputs getInputs(const SimTK::State& state) const;
    /** Begins all states where they should. Stage::Velocity. **/
    void startStates(SimTK::State& state) const;
    /** Puts an angle on the turn where it is nearest to `value`; nothing for coordinates whose
    turns are not counted. Stage::Velocity. **/
    void setTurn(SimTK::State& state, JointIndex joint, int coordinate, SimTK::Real value) const;

    /** Turns the forces of this subsystem, inertia coupling included, off or on in one State
    (Stage::Instance): the BGE solver evaluates them itself. **/
    void setNativeForcesEnabled(SimTK::State& state, bool enabled) const;

    /** Makes Simbody find these accelerations, in its own numbering, where they are free and no
    constraint is against them: for a State on which its elements ask for accelerations that are
    known already. Instead of the subsystem's forces those act that they need. **/
    void setKnownAccelerations(SimTK::State& state, const SimTK::Vector& uDot) const;

    /** Refuses joint friction in a State that Simbody is to find accelerations for, which would
    leave it out. Stage::Instance. @throws std::invalid_argument that names the joint. **/
    void refuseFriction(const SimTK::State& state) const;
    /** Says that an integrator that knows the friction of joints shows this State: as long as its
    time stays, it may be realized further. **/
    void setShown(SimTK::State& state) const;

    /** Sets the weights of flexible bodies' speeds, what a unit of each counts for: the metres that
    it causes. Stage::Model. **/
    void setDisplacementWeights(SimTK::State& state) const;

    SimTK::Real calcPotentialEnergy(const SimTK::State& state) const override;

protected:
    SimTK::Subsystem::Guts* cloneImpl() const override { return new Guts(*this); }
    int realizeSubsystemTopologyImpl(SimTK::State& state) const override;
    int realizeSubsystemDynamicsImpl(const SimTK::State& state) const override;
    int realizeSubsystemAccelerationImpl(const SimTK::State& state) const override;

private:
    /** What acts in a State when Simbody realizes it (Stage::Instance). **/
    enum NativeForces { None, Own, ForKnownAccelerations };

    /** @throws std::invalid_argument that names a force subsystem added after this one. **/
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

/** What somebody has named it by FlexibleBodySubsystem::nameBody(); else "body 3", or with another
word before its number. **/
std::string describeBody(const SimTK::SimbodyMatterSubsystem& matter,
                         SimTK::MobilizedBodyIndex body, const std::string& word = "body");

}  // namespace simflex
