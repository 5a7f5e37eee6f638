#include "simflex/body/FlexibleBodySubsystem.h"

#include <algorithm>

#include "simflex/body/Assembly.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/Joint.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/ModalMobilizer.h"
#include "simflex/body/StateCopy.h"
#include "simflex/body/TurnState.h"

namespace simflex {

using namespace SimTK;

//-------------------------------------------------------------------------------------------------------------
// handle

FlexibleBodySubsystem::FlexibleBodySubsystem(MultibodySystem& system,
                                             SimbodyMatterSubsystem& matter) {
    if (find(system))
        throw std::invalid_argument(
            "FlexibleBodySubsystem: the system has one already; add all flexible bodies to it");
    adoptSubsystemGuts(new Guts(matter));
    system.addForceSubsystem(*this);
}

const FlexibleBodySubsystem* FlexibleBodySubsystem::find(const System& system) {
    for (SubsystemIndex i(0); i < system.getNumSubsystems(); ++i) {
        const Subsystem& subsystem = system.getSubsystem(i);
        if (dynamic_cast<const Guts*>(&subsystem.getSubsystemGuts()))
            return static_cast<const FlexibleBodySubsystem*>(&subsystem);
    }
    return nullptr;
}

const FlexibleBodySubsystem::Guts& FlexibleBodySubsystem::getGuts() const {
    return dynamic_cast<const Guts&>(getSubsystemGuts());
}

FlexibleBodySubsystem::Guts& FlexibleBodySubsystem::updGuts() {
    return dynamic_cast<Guts&>(updSubsystemGuts());
}

const MultibodySystem& FlexibleBodySubsystem::getMultibodySystem() const {
    return MultibodySystem::downcast(getSystem());
}

int FlexibleBodySubsystem::getNumBodies() const {
    return int(getGuts().bodies().size());
}

FlexibleBody FlexibleBodySubsystem::getBody(FlexibleBodyIndex index) const {
    getGuts().body(index);
    return FlexibleBody(getMultibodySystem(), getMySubsystemIndex(), index);
}

void FlexibleBodySubsystem::nameBody(SimTK::MobilizedBodyIndex body, const std::string& name) {
    updGuts().nameBody(body, name);
}

int FlexibleBodySubsystem::getNumJoints() const {
    return int(getGuts().joints().size());
}

Joint FlexibleBodySubsystem::getJoint(JointIndex index) const {
    getGuts().joint(index);
    return Joint(getMultibodySystem(), getMySubsystemIndex(), index);
}

void FlexibleBodySubsystem::adoptForceElement(std::unique_ptr<ForceElement> element) {
    updGuts().addForceElement(std::move(element));
}

bool FlexibleBodySubsystem::hasElementsWithRange() const {
    const auto& elements = getGuts().forceElements();
    return std::any_of(elements.begin(), elements.end(),
                       [](const auto& element) { return element->hasRange(); });
}

std::map<int, std::string> FlexibleBodySubsystem::describeElementsOutOfRange(const State& state,
                                                                             Real elapsed) const {
    std::map<int, std::string> found;
    const auto& elements = getGuts().forceElements();
    for (size_t e = 0; e < elements.size(); ++e) {
        if (!elements[e]->hasRange()) continue;
        const std::string reason = elements[e]->describeOutOfRange(
            getGuts().calcMotions(state, elements[e]->getAttachments()), elapsed);
        if (!reason.empty()) found[int(e)] = elements[e]->describe() + " " + reason;
    }
    return found;
}

int FlexibleBodySubsystem::adoptState(std::unique_ptr<StateEquation> equation) {
    return updGuts().addState(std::move(equation));
}

int FlexibleBodySubsystem::getNumStates() const {
    return int(getGuts().states().size());
}

const std::string& FlexibleBodySubsystem::getStateName(int index) const {
    return getGuts().state(index).getName();
}

Real FlexibleBodySubsystem::getStateValue(const State& state, int index) const {
    getGuts().state(index);
    return getGuts().getZ(state)[index];
}

void FlexibleBodySubsystem::setStateValue(State& state, int index, Real value) const {
    getGuts().state(index);
    getGuts().updZ(state)[index] = value;
}

Real FlexibleBodySubsystem::calcKineticEnergy(const State& state) const {
    const Guts& own = getGuts();
    Real energy = own.getMatter().calcKineticEnergy(state);
    for (int b = 0; b < getNumBodies(); ++b) {
        // Replace Simbody's ½m|v|² + ½ωᵀI₀ω + ½|ξ̇|² by the full kinetic energy.
        const FlexibleBodyRecord& record = own.body(FlexibleBodyIndex(b));
        const BodyFrame frame = own.getBodyFrame(state, record);
        const Eigen::Vector3d omega = toEigen(frame.omega_B);
        energy += getBody(FlexibleBodyIndex(b)).calcKineticEnergy(state) -
                  0.5 * (record.model->mass * frame.v_G.normSqr() +
                         omega.dot(record.model->inertia * omega) +
                         own.getXiDot(state, record).squaredNorm());
    }
    return energy;
}

SpatialVec FlexibleBodySubsystem::calcMomentum(const State& state) const {
    const Guts& own = getGuts();
    const SimbodyMatterSubsystem& matter = own.getMatter();
    std::vector<char> isFlexible(size_t(matter.getNumBodies()), 0);
    SpatialVec momentum(Vec3(0), Vec3(0));
    for (int b = 0; b < getNumBodies(); ++b) {
        const FlexibleBodyRecord& record = own.body(FlexibleBodyIndex(b));
        isFlexible[size_t(record.frame)] = 1;
        for (MobilizedBodyIndex carrier : record.carriers) isFlexible[size_t(carrier)] = 1;
        momentum += getBody(FlexibleBodyIndex(b)).calcMomentum(state);
    }
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        if (isFlexible[size_t(i)]) continue;
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        const SpatialVec own_G = mobod.calcBodyMomentumAboutBodyMassCenterInGround(state);
        const Vec3 center = mobod.findMassCenterLocationInGround(state);
        momentum += SpatialVec(own_G[0] + center % own_G[1], own_G[1]);
    }
    return momentum;
}

Real FlexibleBodySubsystem::calcPotentialEnergy(const State& state) const {
    return getMultibodySystem().calcPotentialEnergy(state);
}

Real FlexibleBodySubsystem::calcEnergy(const State& state) const {
    return calcKineticEnergy(state) + calcPotentialEnergy(state);
}

void FlexibleBodySubsystem::initializeNative(State& state, Real tolerance) const {
    getMultibodySystem().realizeModel(state);
    requireLinearRange(*this, state, "FlexibleBodySubsystem::initializeNative()");
    getGuts().refuseFriction(state);
    try {
        closeJoints(state, tolerance);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(std::string("FlexibleBodySubsystem::initializeNative(): ") +
                                 error.what());
    }
}

void FlexibleBodySubsystem::closeJoints(State& state, Real tolerance) const {
    const MultibodySystem& system = getMultibodySystem();
    const Guts& own = getGuts();
    system.realizeModel(state);
    requireLinearRange(*this, state, "FlexibleBodySubsystem::closeJoints()");
    system.realize(state, Stage::Velocity);
    const State start = copyState(state);
    try {
        // As ImplicitIntegrator::initialize() does, with prescribed values set first.
        system.prescribe(state);
        const State prescribed = copyState(state);
        bool isProjected = getNumBodies() == 0;
        if (isProjected) try {
                system.project(state, tolerance);
            } catch (const std::exception&) {
                copyState(prescribed, state);
                isProjected = false;
            }
        if (!isProjected) assemble(system, state, tolerance);
        system.realize(state, Stage::Velocity);
        requireUnforcedShapes(*this, start, state);
    } catch (const std::exception&) {
        copyState(start, state);
        throw;
    }
    own.setDisplacementWeights(state);
    system.realize(state, Stage::Velocity);
    own.startStates(state);
}

void FlexibleBodySubsystem::lockModes(Assembler& assembler) const {
    for (const FlexibleBodyRecord& body : getGuts().bodies())
        for (MobilizedBodyIndex carrier : body.carriers) assembler.lockMobilizer(carrier);
}

//---------------------------------------------------------------------------------------------------------------
// guts

StateEquation::StateEquation(std::string name, Real initialValue, Real scale)
    : m_name(std::move(name)), m_initialValue(initialValue), m_scale(scale) {
    if (!std::isfinite(initialValue))
        throw std::invalid_argument("StateEquation '" + m_name +
                                    "': the initial value is not a number");
    if (!(scale > 0 && std::isfinite(scale)))
        throw std::invalid_argument("StateEquation '" + m_name + "': the scale is " +
                                    std::to_string(scale) + "; it must be a positive number");
}

int FlexibleBodySubsystem::Guts::addState(std::unique_ptr<StateEquation> equation) {
    m_states.push_back(std::move(equation));
    invalidateSubsystemTopologyCache();
    return int(m_states.size()) - 1;
}

ElementInputs FlexibleBodySubsystem::Guts::getInputs(const State& state) const {
    return {state.getTime(), m_states.empty() ? nullptr : &getZ(state)[0]};
}

void FlexibleBodySubsystem::Guts::startStates(State& state) const {
    for (size_t i = 0; i < m_states.size(); ++i) {
        const Real value = getZ(state)[int(i)];
        const Real start = m_states[i]->calcStart(
            getInputs(state), value, calcMotions(state, m_states[i]->getAttachments()));
        if (start != value) updZ(state)[int(i)] = start;
    }
}

int FlexibleBodySubsystem::Guts::countTurns(JointIndex index, int coordinate, Real start,
                                            const JointEquations::MotionFunction& lead) {
    JointRecord& own = m_joints.at(size_t(index));
    if (own.getTurns(coordinate) >= 0) return own.getTurns(coordinate);
    const auto findFrame = [](const JointRecord& joint, int number) {
        return &joint.frames[joint.equations->getNumFrames() > 2 ? size_t(2 * number) : 0];
    };
    const JointCoordinate& wanted = own.equations->getCoordinate(coordinate);
    const Attachment* const frames = findFrame(own, coordinate);
    own.turns.resize(size_t(own.equations->getNumCoordinates()), -1);
    int& state = own.turns[size_t(coordinate)];
    // Couplers use angles of other joints.
    for (const JointRecord& other : m_joints)
        for (int k = 0; k < int(other.turns.size()); ++k)
            if (other.turns[size_t(k)] >= 0 && other.equations->getCoordinate(k) == wanted &&
                isSame(findFrame(other, k)[0], frames[0]) &&
                isSame(findFrame(other, k)[1], frames[1]))
                return state = other.turns[size_t(k)];
    return state = addState(std::make_unique<TurnState>(
               "turns of '" + own.name + "', coordinate " + std::to_string(coordinate), wanted,
               frames[0], frames[1], start, lead));
}

const TurnState* FlexibleBodySubsystem::Guts::findTurns(JointIndex index, int coordinate) const {
    const int turns = joint(index).getTurns(coordinate);
    return turns < 0 ? nullptr : static_cast<const TurnState*>(&state(turns));
}

void FlexibleBodySubsystem::Guts::setTurn(State& state, JointIndex index, int coordinate,
                                          Real value) const {
    const TurnState* const turns = findTurns(index, coordinate);
    if (!turns) return;
    const Real time = state.getTime();
    const Array_<FrameMotion> frames = calcMotions(state, turns->getAttachments());
    const Real angle =
        turns->calcAngle(time, turns->calcCount(time, value), frames[0].X, frames[1].X);
    updZ(state)[joint(index).getTurns(coordinate)] = turns->calcCount(time, angle);
}

std::string FlexibleBodySubsystem::Guts::findBodyName(SimTK::MobilizedBodyIndex body) const {
    const auto found = m_bodyNames.find(body);
    return found != m_bodyNames.end() ? found->second : "";
}

void FlexibleBodySubsystem::Guts::requireOwn(const Attachment& attachment,
                                             const std::string& owner) const {
    if (attachment.isIn(static_cast<const FlexibleBodySubsystem&>(getOwnerSubsystemHandle())))
        return;
    throw std::invalid_argument(owner + ": its frame on " + attachment.getName() +
                                " is on a body of another system, or of none; all that it holds "
                                "together must be in the system of its FlexibleBodySubsystem");
}

namespace {

/** Appends the smallest number that makes the name unique. **/
template <class IsTaken>
std::string findFreeName(const std::string& name, const IsTaken& isTaken) {
    std::string free = name;
    for (int number = 2; isTaken(free); ++number) free = name + ' ' + std::to_string(number);
    return free;
}

}  // namespace

void FlexibleBodySubsystem::Guts::makeUnique(FlexibleBodyRecord& record) const {
    record.name = findFreeName(record.name, [&](const std::string& name) {
        return std::any_of(m_bodies.begin(), m_bodies.end(),
                           [&](const FlexibleBodyRecord& other) { return other.name == name; });
    });
}

void FlexibleBodySubsystem::Guts::makeUnique(JointRecord& record) const {
    // A motion may share the name of the joint that it drives. Locks may share names, too.
    if (record.equations->isLock()) return;
    const std::string kind = record.equations->getKind();
    record.name = findFreeName(record.name, [&](const std::string& name) {
        return std::any_of(m_joints.begin(), m_joints.end(), [&](const JointRecord& other) {
            return other.name == name && other.equations->getKind() == kind;
        });
    });
}

FlexibleBodyIndex FlexibleBodySubsystem::Guts::addBody(FlexibleBodyRecord record) {
    record.damping.setZero(record.numModes());
    record.index = FlexibleBodyIndex(int(m_bodies.size()));
    m_bodies.push_back(std::move(record));
    invalidateSubsystemTopologyCache();
    return FlexibleBodyIndex(int(m_bodies.size()) - 1);
}

JointIndex FlexibleBodySubsystem::Guts::addJoint(JointRecord record) {
    m_joints.push_back(std::move(record));
    invalidateSubsystemTopologyCache();
    return JointIndex(int(m_joints.size()) - 1);
}

void FlexibleBodySubsystem::Guts::setFriction(JointIndex index,
                                              std::shared_ptr<const FrictionEquations> friction) {
    m_joints.at(size_t(index)).friction = std::move(friction);
    invalidateSubsystemTopologyCache();
}

void FlexibleBodySubsystem::Guts::addForceElement(std::unique_ptr<ForceElement> element) {
    for (const Attachment& attachment : element->getAttachments())
        requireOwn(attachment, element->getName().empty()
                                   ? "a force element"
                                   : "force element '" + element->getName() + "'");
    m_forceElements.push_back(std::move(element));
    invalidateSubsystemTopologyCache();
}

std::shared_ptr<const FlexibleBodyModel> FlexibleBodySubsystem::Guts::obtainModel(
    const std::shared_ptr<const ReducedBody>& part) {
    auto& model = m_models[part.get()];
    if (!model) {
        part->validate();
        model = std::make_shared<const FlexibleBodyModel>(part);
    }
    return model;
}

std::shared_ptr<const FlexibleBodyModel> FlexibleBodySubsystem::Guts::obtainStiffenedModel(
    const std::shared_ptr<const ReducedBody>& part) {
    if (!part->stiffening) return nullptr;
    auto& model = m_stiffened[part.get()];
    if (!model) model = obtainModel(part)->makeStiffened();
    return model;
}

std::shared_ptr<const FlexibleBodyModel> FlexibleBodySubsystem::Guts::obtainRigidModel(
    const std::shared_ptr<const ReducedBody>& part) {
    auto& model = m_rigid[part.get()];
    if (!model) model = obtainModel(part)->makeRigid();
    return model;
}

bool FlexibleBodySubsystem::Guts::isRigid(const State& state,
                                          const FlexibleBodyRecord& body) const {
    return std::all_of(body.carriers.begin(), body.carriers.end(), [&](MobilizedBodyIndex carrier) {
        const MobilizedBody& mobod = getMatter().getMobilizedBody(carrier);
        return mobod.getLockLevel(state) == Motion::Position &&
               mobod.getLockValueAsVector(state).normInf() == 0;
    });
}

FlexibleBodySubsystem::Guts::Stiffening FlexibleBodySubsystem::Guts::getStiffening(
    const State& state, const FlexibleBodyRecord& body) const {
    if (!body.stiffened) return Stiffening::Off;
    const DiscreteVariableIndex variable = m_stiffening[size_t(body.index)];
    return Value<int>::downcast(getDiscreteVariable(state, variable)).get() ? Stiffening::On
                                                                            : Stiffening::Off;
}

namespace {

void refuseWithoutData(const FlexibleBodyRecord& body) {
    if (body.stiffened) return;
    throw std::invalid_argument(
        "FlexibleBody '" + body.name + "': its part '" + body.model->part->name +
        "' has no geometric stiffness; reduce it with `simflex reduce --stiffening`, or with "
        "ReductionOptions::stiffening");
}

}  // namespace

void FlexibleBodySubsystem::Guts::setStiffening(State& state, FlexibleBodyIndex index,
                                                Stiffening stiffening) const {
    if (stiffening == Stiffening::On) refuseWithoutData(body(index));
    if (getStiffening(state, body(index)) == stiffening) return;
    Value<int>::updDowncast(updDiscreteVariable(state, m_stiffening[size_t(index)])) =
        stiffening == Stiffening::On;
}

void FlexibleBodySubsystem::Guts::setStiffeningByDefault(FlexibleBodyIndex index,
                                                         Stiffening stiffening) {
    if (stiffening == Stiffening::On) refuseWithoutData(body(index));
    m_bodies.at(index).isStiffenedByDefault = stiffening == Stiffening::On;
    invalidateSubsystemTopologyCache();
}

void FlexibleBodySubsystem::Guts::addModalDamping(FlexibleBodyIndex index,
                                                  const Array_<Real>& coefficients) {
    m_bodies.at(index).damping +=
        Eigen::Map<const Eigen::VectorXd>(coefficients.cbegin(), body(index).numModes());
    invalidateSubsystemTopologyCache();
}

void FlexibleBodySubsystem::Guts::addDampingMatrix(FlexibleBodyIndex index,
                                                   const Eigen::MatrixXd& D) {
    FlexibleBodyRecord& record = m_bodies.at(index);
    record.damping += D.diagonal();
    Eigen::MatrixXd coupling = D;
    coupling.diagonal().setZero();
    if (record.dampingCoupling.size() == 0) record.dampingCoupling.setZero(D.rows(), D.cols());
    record.dampingCoupling += coupling;
    invalidateSubsystemTopologyCache();
}

void FlexibleBodySubsystem::Guts::addLoad(FlexibleBodyIndex index, BodyLoad load) {
    m_bodies.at(index).loads.push_back(std::move(load));
    invalidateSubsystemTopologyCache();
}

namespace {

/** Gathers a body's modes from all coordinates or speeds. @param findFirst  index of a modal
mobilizer's first entry **/
template <class FindFirst>
Eigen::VectorXd gatherModes(const SimbodyMatterSubsystem& matter, const Vector& all,
                            const FlexibleBodyRecord& body, const FindFirst& findFirst) {
    Eigen::VectorXd modes(body.numModes());
    int i = 0;
    for (MobilizedBodyIndex carrier : body.carriers) {
        const int first = findFirst(matter.getMobilizedBody(carrier));
        const int count = std::min(int(ModalMobilizer::MaxModes), body.numModes() - i);
        for (int k = 0; k < count; ++k) modes[i++] = all[first + k];
    }
    return modes;
}

}  // namespace

Eigen::VectorXd FlexibleBodySubsystem::Guts::getXi(const State& state,
                                                   const FlexibleBodyRecord& body) const {
    return gatherModes(
        getMatter(), getMatter().getQ(state), body,
        [&](const MobilizedBody& carrier) { return int(carrier.getFirstQIndex(state)); });
}

Eigen::VectorXd FlexibleBodySubsystem::Guts::getXiDot(const State& state,
                                                      const FlexibleBodyRecord& body) const {
    return gatherModes(
        getMatter(), getMatter().getU(state), body,
        [&](const MobilizedBody& carrier) { return int(carrier.getFirstUIndex(state)); });
}

BodyFrame FlexibleBodySubsystem::Guts::getBodyFrame(const State& state,
                                                    const FlexibleBodyRecord& body) const {
    const MobilizedBody& mobod = getMatter().getMobilizedBody(body.frame);
    const Transform& X_GB = mobod.getBodyTransform(state);
    const SpatialVec& V_GB = mobod.getBodyVelocity(state);
    return {X_GB.R(), X_GB.p(), ~X_GB.R() * V_GB[0], V_GB[1]};
}

FrameMotion FlexibleBodySubsystem::Guts::calcMotion(const State& state,
                                                    const Attachment& attachment) const {
    if (!attachment.isFlexible()) {
        const MobilizedBody& mobod =
            getMatter().getMobilizedBody(attachment.getMobilizedBodyIndex());
        FrameMotion motion;
        motion.X = mobod.getBodyTransform(state);
        motion.V = mobod.getBodyVelocity(state);
        return shiftMotion(motion, attachment.getFrame());
    }
    const FlexibleBodyRecord& record = body(attachment.getFlexibleBodyIndex());
    const Eigen::VectorXd xi = getXi(state, record), xiDot = getXiDot(state, record);
    const FrameAtXi frame(attachment.getFlexibleFrame(), xi.data(), getFrameOrder(state, record));
    return frame.calcMotion(getBodyFrame(state, record), xiDot.data());
}

Array_<FrameMotion> FlexibleBodySubsystem::Guts::calcMotions(
    const State& state, const Array_<Attachment>& attachments) const {
    Array_<FrameMotion> motions;
    for (const Attachment& attachment : attachments)
        motions.push_back(calcMotion(state, attachment));
    return motions;
}

Vector FlexibleBodySubsystem::getHolding(const State& state) const {
    const SimbodyMatterSubsystem& matter = getGuts().getMatter();
    const int numConstraints = matter.getNumConstraints();
    Vector holding(numConstraints + getNumJoints());
    for (ConstraintIndex c(0); c < numConstraints; ++c)
        holding[c] = matter.getConstraint(c).isDisabled(state) ? 0 : 1;
    for (JointIndex j(0); j < getNumJoints(); ++j)
        holding[numConstraints + j] = getGuts().getHeld(state, j);
    return holding;
}

void FlexibleBodySubsystem::setHolding(State& state, const Vector& holding) const {
    const SimbodyMatterSubsystem& matter = getGuts().getMatter();
    const int numConstraints = matter.getNumConstraints();
    if (holding.size() != numConstraints + getNumJoints())
        throw std::invalid_argument("the list of what is held is that of another system");
    for (ConstraintIndex c(0); c < numConstraints; ++c) {
        const Constraint& constraint = matter.getConstraint(c);
        if (constraint.isDisabled(state) != (holding[c] != 0)) continue;
        if (holding[c] != 0)
            constraint.enable(state);
        else
            constraint.disable(state);
    }
    for (JointIndex j(0); j < getNumJoints(); ++j)
        if (getGuts().joint(j).equations->isLock())
            getGuts().setHeld(state, j, holding[numConstraints + j]);
}

JointEquations::Drive FlexibleBodySubsystem::Guts::calcDrive(const State& state,
                                                             JointIndex index) const {
    return joint(index).equations->calcDrive(state.getTime(), getHeld(state, index));
}

Real FlexibleBodySubsystem::Guts::getHeld(const State& state, JointIndex index) const {
    const DiscreteVariableIndex variable = m_held.at(size_t(index));
    return variable.isValid() ? Value<Real>::downcast(getDiscreteVariable(state, variable)).get()
                              : 0;
}

void FlexibleBodySubsystem::Guts::setHeld(State& state, JointIndex index, Real value) const {
    Value<Real>::updDowncast(updDiscreteVariable(state, m_held.at(size_t(index)))) = value;
}

void FlexibleBodySubsystem::Guts::setDisplacementWeights(State& state) const {
    const SimbodyMatterSubsystem& matter = getMatter();
    Vector& all = state.updUWeights(matter.getMySubsystemIndex());
    for (const FlexibleBodyRecord& record : m_bodies) {
        const FlexibleBodyModel& model = *record.model;
        const int frame = int(matter.getMobilizedBody(record.frame).getFirstUIndex(state));
        for (int a = 0; a < 3; ++a) {
            all[frame + a] = model.radius;
            all[frame + 3 + a] = 1;
        }
        int i = 0;
        for (MobilizedBodyIndex carrier : record.carriers) {
            const MobilizedBody& mobod = matter.getMobilizedBody(carrier);
            const int first = int(mobod.getFirstUIndex(state)), count = mobod.getNumU(state);
            for (int k = 0; k < count; ++k, ++i) all[first + k] = model.displacementPerMode[i];
        }
    }
}

void FlexibleBodySubsystem::Guts::setNativeForcesEnabled(State& state, bool enabled) const {
    Value<int>::updDowncast(updDiscreteVariable(state, m_nativeForces)) = enabled ? Own : None;
}

void FlexibleBodySubsystem::Guts::setKnownAccelerations(State& state, const Vector& uDot) const {
    if (Value<int>::downcast(getDiscreteVariable(state, m_nativeForces)).get() !=
        ForKnownAccelerations)
        Value<int>::updDowncast(updDiscreteVariable(state, m_nativeForces)) = ForKnownAccelerations;
    Value<Vector>::updDowncast(updDiscreteVariable(state, m_knownUDot)) = uDot;
}

void FlexibleBodySubsystem::Guts::refuseFriction(const State& state) const {
    for (const JointRecord& joint : m_joints)
        if (joint.friction && !getMatter().getConstraint(joint.constraint).isDisabled(state))
            throw std::invalid_argument(
                "joint '" + joint.name +
                "' has friction, which Simbody's own accelerations and integrators leave out: take "
                "an integrator of simflex, such as RadauIntegrator");
}

void FlexibleBodySubsystem::Guts::setShown(State& state) const {
    if (m_shownTime.isValid())
        Value<Real>::updDowncast(updDiscreteVariable(state, m_shownTime)) = state.getTime();
}

Real FlexibleBodySubsystem::Guts::calcPotentialEnergy(const State& state) const {
    Real energy = 0;
    for (const FlexibleBodyRecord& record : m_bodies) {
        const Eigen::VectorXd xi = getXi(state, record);
        energy += 0.5 * xi.dot(record.model->omegaSquared.cwiseProduct(xi));
    }
    for (const auto& element : m_forceElements)
        energy += element->calcPotentialEnergy(getInputs(state),
                                               calcMotions(state, element->getAttachments()));
    return energy;
}

int FlexibleBodySubsystem::Guts::realizeSubsystemTopologyImpl(State& state) const {
    checkOrder();
    m_nativeForces = allocateDiscreteVariable(state, Stage::Instance, new Value<int>(Own));
    m_knownUDot = allocateDiscreteVariable(state, Stage::Dynamics, new Value<Vector>());
    const bool rubs = std::any_of(m_joints.begin(), m_joints.end(), [](const JointRecord& joint) {
        return joint.friction != nullptr;
    });
    m_shownTime = rubs ? allocateDiscreteVariable(state, Stage::Dynamics, new Value<Real>(NaN))
                       : DiscreteVariableIndex();
    const bool hasModes =
        std::any_of(m_bodies.begin(), m_bodies.end(),
                    [](const FlexibleBodyRecord& body) { return body.numModes() > 0; });
    if (!m_states.empty()) {
        Vector initial(int(m_states.size()));
        for (int i = 0; i < initial.size(); ++i)
            initial[i] = m_states[size_t(i)]->getInitialValue();
        allocateZ(state, initial);
    }
    m_coupling = hasModes ? InertiaCoupling::make(getMultibodySystem()) : nullptr;
    m_stiffening.assign(m_bodies.size(), DiscreteVariableIndex());
    for (const FlexibleBodyRecord& record : m_bodies)
        if (record.stiffened)
            m_stiffening[size_t(record.index)] = allocateDiscreteVariable(
                state, Stage::Instance, new Value<int>(record.isStiffenedByDefault));
    m_held.assign(m_joints.size(), DiscreteVariableIndex());
    for (size_t j = 0; j < m_joints.size(); ++j)
        if (m_joints[j].equations->isLock())
            m_held[j] = allocateDiscreteVariable(state, Stage::Instance, new Value<Real>(0));
    return 0;
}

void FlexibleBodySubsystem::Guts::checkOrder() const {
    const System& system = getSystem();
    for (SubsystemIndex s(getMySubsystemIndex() + 1); s < system.getNumSubsystems(); ++s) {
        const Subsystem& later = system.getSubsystem(s);
        if (dynamic_cast<const ForceSubsystem::Guts*>(&later.getSubsystemGuts()))
            throw std::invalid_argument(
                "force subsystem '" + later.getName() + "' (subsystem " + std::to_string(int(s)) +
                ") was added after the FlexibleBodySubsystem (subsystem " +
                std::to_string(int(getMySubsystemIndex())) +
                "), which must know all forces: construct it before the FlexibleBodySubsystem; "
                "its elements may be added at any time");
    }
}

int FlexibleBodySubsystem::Guts::realizeSubsystemDynamicsImpl(const State& state) const {
    const int acting = Value<int>::downcast(getDiscreteVariable(state, m_nativeForces)).get();
    if (acting == None) return 0;
    const MultibodySystem& system = getMultibodySystem();
    Vector_<SpatialVec>& bodyForces = system.updRigidBodyForces(state, Stage::Dynamics);
    Vector& mobilityForces = system.updMobilityForces(state, Stage::Dynamics);

    if (acting == ForKnownAccelerations) {
        const Vector& uDot = Value<Vector>::downcast(getDiscreteVariable(state, m_knownUDot)).get();
        Vector lacking;
        getMatter().calcResidualForceIgnoringConstraints(state, mobilityForces, bodyForces, uDot,
                                                         lacking);
        mobilityForces += lacking;
        return 0;
    }

    if (m_shownTime.isValid() &&
        Value<Real>::downcast(getDiscreteVariable(state, m_shownTime)).get() != state.getTime())
        refuseFriction(state);

    // Must come first, while the arrays hold the forces of all other subsystems only.
    if (m_coupling) m_coupling->addInForces(state, bodyForces, mobilityForces);

    for (int b = 0; b < int(m_bodies.size()); ++b)
        addInBodyForces(state, FlexibleBodyIndex(b), bodyForces, mobilityForces);

    for (const auto& element : m_forceElements) {
        const Array_<Attachment>& attachments = element->getAttachments();
        Array_<SpatialVec> forces(attachments.size(), SpatialVec(Vec3(0), Vec3(0)));
        const Array_<FrameMotion> frames = calcMotions(state, attachments);
        element->addInForces(getInputs(state), frames, forces);
        if (element->hasTimedForce())
            element->addInTimedForce(element->calcTimedForce(state.getTime()), frames, forces);
        for (unsigned k = 0; k < attachments.size(); ++k)
            addInAttachmentForce(state, attachments[k], forces[k], bodyForces, mobilityForces);
    }
    return 0;
}

int FlexibleBodySubsystem::Guts::realizeSubsystemAccelerationImpl(const State& state) const {
    if (m_states.empty()) return 0;
    Vector& zDot = updZDot(state);
    for (size_t i = 0; i < m_states.size(); ++i)
        zDot[int(i)] = m_states[i]->calcRate(getInputs(state),
                                             calcMotions(state, m_states[i]->getAttachments()));
    return 0;
}

void FlexibleBodySubsystem::Guts::addInBodyForces(const State& state, FlexibleBodyIndex index,
                                                  Vector_<SpatialVec>& bodyForces,
                                                  Vector& mobilityForces) const {
    const FlexibleBodyRecord& record = body(index);
    const FlexibleBodyModel& model = getModel(state, record);
    const Eigen::VectorXd xi = getXi(state, record), xiDot = getXiDot(state, record);
    const BodyFrame frame = getBodyFrame(state, record);
    const Eigen::Vector3d omega = toEigen(frame.omega_B);

    FlexibleBodyData data;
    data.resize(model);
    calcInertia(model, xi, xiDot, data);
    Eigen::Vector3d rotation;
    Eigen::VectorXd modes(model.n);
    calcVelocityTerms(model, data, omega, rotation, modes);

    // Simbody already includes ω×I₀ω of the frame body.
    rotation -= omega.cross(model.inertia * omega);
    bodyForces[record.frame][0] -= frame.R_GB * toSimTK(rotation);
    modes += model.omegaSquared.cwiseProduct(xi) + record.damping.cwiseProduct(xiDot);
    if (record.dampingCoupling.size() > 0) modes += record.dampingCoupling * xiDot;
    modes = -modes;
    Vec3 torque_B(0), force_G(0);
    std::vector<Real> scales;
    for (const BodyLoad& load : record.loads) scales.push_back(load.scale(state.getTime()));
    addInLoads(record.loads, scales.data(), frame.R_GB, xi.data(), torque_B, force_G, modes.data());
    bodyForces[record.frame] += SpatialVec(frame.R_GB * torque_B, force_G);
    addInModalForces(state, record, modes, mobilityForces);
}

void FlexibleBodySubsystem::Guts::addInAttachmentForce(const State& state,
                                                       const Attachment& attachment,
                                                       const SpatialVec& F_G,
                                                       Vector_<SpatialVec>& bodyForces,
                                                       Vector& mobilityForces) const {
    if (!attachment.isFlexible()) {
        const MobilizedBodyIndex index = attachment.getMobilizedBodyIndex();
        const Vec3 r = getMatter().getMobilizedBody(index).getBodyTransform(state).R() *
                       attachment.getFrame().p();
        bodyForces[index] += SpatialVec(F_G[0] + r % F_G[1], F_G[1]);
        return;
    }
    const FlexibleBodyRecord& record = body(attachment.getFlexibleBodyIndex());
    const Eigen::VectorXd xi = getXi(state, record);
    const FrameAtXi frame(attachment.getFlexibleFrame(), xi.data(), getFrameOrder(state, record));
    const BodyFrame bodyFrame = getBodyFrame(state, record);
    Eigen::VectorXd modal = Eigen::VectorXd::Zero(record.numModes());
    Vec3 torque_B(0), force_G(0);
    addInFrameForce(frame.getTangent(), frame.getPose(), bodyFrame.R_GB, F_G, torque_B, force_G,
                    modal.data());
    bodyForces[record.frame] += SpatialVec(bodyFrame.R_GB * torque_B, force_G);
    addInModalForces(state, record, modal, mobilityForces);
}

void FlexibleBodySubsystem::Guts::addInModalForces(const State& state,
                                                   const FlexibleBodyRecord& body,
                                                   const Eigen::VectorXd& modal,
                                                   Vector& mobilityForces) const {
    int i = 0;
    for (MobilizedBodyIndex carrier : body.carriers) {
        const MobilizedBody& mobod = getMatter().getMobilizedBody(carrier);
        const int first = int(mobod.getFirstUIndex(state)), count = mobod.getNumU(state);
        for (int k = 0; k < count; ++k) mobilityForces[first + k] += modal[i++];
    }
}

std::string describeBody(const SimTK::SimbodyMatterSubsystem& matter,
                         SimTK::MobilizedBodyIndex body, const std::string& word) {
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(matter.getSystem());
    const std::string name = flexible ? flexible->getGuts().findBodyName(body) : "";
    return name.empty() ? word + ' ' + std::to_string(int(body)) : name;
}

}  // namespace simflex
