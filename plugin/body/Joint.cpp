#include "simflex/body/Joint.h"

#include "simflex/body/JointConstraint.h"

#include <sstream>

namespace simflex {

using namespace SimTK;

namespace {

void refuseUnlessFinite(const Attachment& attachment, const char* side, const std::string& joint) {
    const Transform& X =
        attachment.isFlexible() ? attachment.getFlexibleFrame().X_IA : attachment.getFrame();
    if (X.p().isFinite() && X.R().isFinite()) return;
    std::ostringstream text;
    text << "joint '" << joint << "': frame " << side << " on " << attachment.getName()
         << " has a position " << X.p() << " or axes that are not finite";
    throw std::invalid_argument(text.str());
}

}  // namespace

Joint::Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
             const Attachment& F, const Attachment& M, const std::string& name)
    : m_system(&subsystem.getMultibodySystem()), m_subsystem(subsystem.getMySubsystemIndex()) {
    JointRecord record{name, std::move(equations), F, M, ConstraintIndex()};
    if (name.empty()) record.name = F.getName() + " - " + M.getName();
    if (!F.isFlexible() && !M.isFlexible() &&
        F.getMobilizedBodyIndex() == M.getMobilizedBodyIndex())
        throw std::invalid_argument("joint '" + record.name +
                                    "' holds two frames of the same rigid body together");
    refuseUnlessFinite(F, "F", record.name);
    refuseUnlessFinite(M, "M", record.name);
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

int Joint::getNumCoordinates() const {
    return getEquations().getNumCoordinates();
}

Vector Joint::calcCoordinates(const State& state) const {
    Real coordinates[JointEquations::MaxCoordinates];
    getEquations().calcCoordinates(getFrameF().calcMotion(state).X, getFrameM().calcMotion(state).X,
                                   coordinates);
    return Vector(getNumCoordinates(), coordinates);
}

Vector Joint::calcCoordinateDots(const State& state) const {
    Real dots[JointEquations::MaxCoordinates];
    getEquations().calcCoordinateDots(getFrameF().calcMotion(state), getFrameM().calcMotion(state),
                                      dots);
    return Vector(getNumCoordinates(), dots);
}

Vector Joint::getMultipliers(const State& state) const {
    return guts().getMatter().getConstraint(getConstraintIndex()).getMultipliersAsVector(state);
}

void Joint::checkSize(const Vector& multipliers) const {
    if (multipliers.size() != getNumEquations())
        throw std::invalid_argument("joint '" + getName() + "' has " +
                                    std::to_string(getNumEquations()) + " multipliers, not " +
                                    std::to_string(multipliers.size()));
}

SpatialVec Joint::calcReaction(const State& state, const Vector& multipliers, Side on, Side at,
                               Axes axes) const {
    checkSize(multipliers);
    const Transform F = getFrameF().calcMotion(state).X, M = getFrameM().calcMotion(state).X;
    SpatialVec D_F[JointEquations::MaxEquations], D_M[JointEquations::MaxEquations];
    getEquations().calcJacobian(F, M, D_F, D_M);
    SpatialVec force(Vec3(0), Vec3(0));
    for (int k = 0; k < getNumEquations(); ++k)
        force -= multipliers[k] * (on == Side::F ? D_F[k] : D_M[k]);
    if (on != at) {
        const Vec3 lever = on == Side::F ? F.p() - M.p() : M.p() - F.p();
        force[0] += lever % force[1];
    }
    if (axes == Axes::Ground) return force;
    const Rotation& R = axes == Axes::F ? F.R() : M.R();
    return {~R * force[0], ~R * force[1]};
}

SpatialVec Joint::calcForceOnM(const State& state, const Vector& multipliers) const {
    return calcReaction(state, multipliers, Side::M, Side::M);
}

Vector Joint::calcDrivingForces(const Vector& multipliers) const {
    if (!getEquations().dependsOnTime())
        throw std::logic_error("joint '" + getName() + "' is a " + getEquations().getKind() +
                               " and prescribes no motion; ask for calcReaction()");
    checkSize(multipliers);
    return -multipliers;
}

namespace {

std::shared_ptr<const JointEquations> share(JointEquations equations) {
    return std::make_shared<const JointEquations>(std::move(equations));
}

template <class Function>
Function checkGiven(Function function, const char* what, const std::string& name) {
    if (!function)
        throw std::invalid_argument("joint '" + name + "': no " + what + " function given");
    return function;
}

std::invalid_argument makeRefusal(const std::string& name, const char* what, Real value,
                                  const char* allowed) {
    std::ostringstream text;
    text << "joint '" << name << "': " << what << " " << value << ", but must be " << allowed;
    return std::invalid_argument(text.str());
}

Real checkPitch(Real pitch, const std::string& name) {
    if (isFinite(pitch) && pitch != 0) return pitch;
    throw makeRefusal(name, "pitch", pitch, "finite and not 0; without pitch it is a Pin");
}

Real checkLength(Real length, const std::string& name) {
    if (isFinite(length) && length > 0) return length;
    throw makeRefusal(name, "length", length, "finite and positive; of length 0 it is a Ball");
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
            share(JointEquations::makePrescribedRotation(
                checkGiven(std::move(angle), "angle", name))),
            F, M, name) {}

Joint::Cylinder::Cylinder(FlexibleBodySubsystem& subsystem, const Attachment& F,
                          const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeCylinder()), F, M, name) {}

Joint::Universal::Universal(FlexibleBodySubsystem& subsystem, const Attachment& F,
                            const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeUniversal()), F, M, name) {}

Joint::Planar::Planar(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                      const std::string& name)
    : Joint(subsystem, share(JointEquations::makePlanar()), F, M, name) {}

Joint::Screw::Screw(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                    Real pitch, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeScrew(checkPitch(pitch, name))), F, M, name) {}

Joint::PointOnLine::PointOnLine(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makePointOnLine()), F, M, name) {}

Joint::PointInPlane::PointInPlane(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                  const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makePointInPlane()), F, M, name) {}

Joint::Rod::Rod(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                Real length, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeRod(checkLength(length, name))), F, M, name) {}

Joint::PrescribedTranslation::PrescribedTranslation(FlexibleBodySubsystem& subsystem,
                                                    const Attachment& F, const Attachment& M,
                                                    CoordinateAxis axis,
                                                    MotionFunction displacement,
                                                    const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedTranslation(
                axis, checkGiven(std::move(displacement), "displacement", name))),
            F, M, name) {}

Joint::PrescribedPosition::PrescribedPosition(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                              const Attachment& M, PositionFunction position,
                                              const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedPosition(
                checkGiven(std::move(position), "position", name))),
            F, M, name) {}

}  // namespace simflex
