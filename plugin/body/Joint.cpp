#include "simflex/body/Joint.h"

#include "simflex/body/JointConstraint.h"

namespace simflex {

using namespace SimTK;

Joint::Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
             const Attachment& F, const Attachment& M, const std::string& name)
    : m_system(&subsystem.getMultibodySystem()), m_subsystem(subsystem.getMySubsystemIndex()) {
    JointRecord record{name, std::move(equations), F, M, ConstraintIndex()};
    if (name.empty()) record.name = F.getName() + " - " + M.getName();
    if (!F.isFlexible() && !M.isFlexible() &&
        F.getMobilizedBodyIndex() == M.getMobilizedBodyIndex())
        throw std::invalid_argument("joint '" + record.name +
                                    "' holds two frames of the same rigid body together");
    FlexibleBodySubsystem::Guts& guts = subsystem.updGuts();
    record.constraint = addJointConstraint(guts, guts.updMatter(), record);
    m_index = guts.addJoint(std::move(record));
}

const FlexibleBodySubsystem::Guts& Joint::guts() const {
    return dynamic_cast<const FlexibleBodySubsystem::Guts&>(
        m_system->getSubsystem(m_subsystem).getSubsystemGuts());
}

const std::string& Joint::getName() const {
    return guts().joint(m_index).name;
}
int Joint::getNumEquations() const {
    return getEquations().getNumEquations();
}
const Attachment& Joint::getFrameF() const {
    return guts().joint(m_index).F;
}
const Attachment& Joint::getFrameM() const {
    return guts().joint(m_index).M;
}
ConstraintIndex Joint::getConstraintIndex() const {
    return guts().joint(m_index).constraint;
}
const JointEquations& Joint::getEquations() const {
    return *guts().joint(m_index).equations;
}

Vector Joint::calcPositionErrors(const State& state) const {
    Vector errors(getNumEquations());
    getEquations().calcErrors(state.getTime(), getFrameF().calcMotion(state).X,
                              getFrameM().calcMotion(state).X, errors.updContiguousScalarData());
    return errors;
}

SpatialVec Joint::calcForceOnM(const State& state, const Vector& multipliers) const {
    if (multipliers.size() != getNumEquations())
        throw std::invalid_argument("joint '" + getName() + "' has " +
                                    std::to_string(getNumEquations()) + " multipliers, not " +
                                    std::to_string(multipliers.size()));
    SpatialVec D_F[JointEquations::MaxEquations], D_M[JointEquations::MaxEquations];
    getEquations().calcJacobian(getFrameF().calcMotion(state).X, getFrameM().calcMotion(state).X,
                                D_F, D_M);
    SpatialVec force(Vec3(0), Vec3(0));
    for (int k = 0; k < getNumEquations(); ++k) force -= multipliers[k] * D_M[k];
    return force;
}

namespace {

std::shared_ptr<const JointEquations> share(JointEquations equations) {
    return std::make_shared<const JointEquations>(std::move(equations));
}

Joint::AngleFunction checkGiven(Joint::AngleFunction angle, const std::string& name) {
    if (!angle) throw std::invalid_argument("joint '" + name + "': no angle function given");
    return angle;
}

}  // namespace

Joint::Ball::Ball(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                  const std::string& name)
    : Joint(subsystem, share(JointEquations::makeBall()), F, M, name) {}

Joint::Pin::Pin(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                const std::string& name)
    : Joint(subsystem, share(JointEquations::makePin()), F, M, name) {}

Joint::Slider::Slider(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                      const std::string& name)
    : Joint(subsystem, share(JointEquations::makeSlider()), F, M, name) {}

Joint::Weld::Weld(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                  const std::string& name)
    : Joint(subsystem, share(JointEquations::makeWeld()), F, M, name) {}

Joint::PrescribedRotation::PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                              const Attachment& M, AngleFunction angle,
                                              const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedRotation(checkGiven(std::move(angle), name))), F, M,
            name) {}

}  // namespace simflex
