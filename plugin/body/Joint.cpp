#include "simflex/body/Joint.h"

#include <cmath>
#include <sstream>

#include "simflex/body/JointConstraint.h"
#include "simflex/body/TurnState.h"

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

class Joint::Motions {
public:
    Motions(const Joint& joint, const State& state) {
        for (const Attachment& frame : joint.guts().joint(joint.m_index).frames)
            m_motions.push_back(frame.calcMotion(state));
        for (const FrameMotion& motion : m_motions) m_frames.push_back(&motion);
    }
    JointEquations::Frames frames() const { return m_frames.data(); }
    const FrameMotion& operator[](size_t i) const { return m_motions[i]; }

private:
    std::vector<FrameMotion> m_motions;
    std::vector<const FrameMotion*> m_frames;
};

Joint::Joint(FlexibleBodySubsystem& subsystem, std::shared_ptr<const JointEquations> equations,
             std::vector<Attachment> frames, const std::string& name)
    : m_system(&subsystem.getMultibodySystem()), m_subsystem(subsystem.getMySubsystemIndex()) {
    JointRecord record{name, std::move(equations), std::move(frames), ConstraintIndex(), nullptr,
                       {}};
    if (name.empty())
        for (size_t i = 0; i < record.frames.size(); ++i)
            record.name += (i == 0 ? "" : i % 2 == 0 ? ", " : " - ") + record.frames[i].getName();
    FlexibleBodySubsystem::Guts& guts = subsystem.updGuts();
    for (const Attachment& frame : record.frames)
        guts.requireOwn(frame, "joint '" + record.name + "'");
    for (size_t i = 0; i < record.frames.size(); i += 2) {
        const Attachment &F = record.frames[i], &M = record.frames[i + 1];
        if (!F.isFlexible() && !M.isFlexible() &&
            F.getMobilizedBodyIndex() == M.getMobilizedBodyIndex())
            throw std::invalid_argument("joint '" + record.name +
                                        "' holds two frames of the same rigid body together");
        refuseUnlessFinite(F, "F", record.name);
        refuseUnlessFinite(M, "M", record.name);
    }
    guts.makeUnique(record);
    record.constraint = addJointConstraint(guts, guts.updMatter(), record);
    m_index = guts.addJoint(std::move(record));
}

bool Joint::isIn(const FlexibleBodySubsystem& subsystem) const {
    return m_system == &subsystem.getMultibodySystem() &&
           m_subsystem == subsystem.getMySubsystemIndex();
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
size_t Joint::findFrames(int coordinate) const {
    const int numPairs = getEquations().getNumFrames() / 2;
    if (coordinate >= 0 && coordinate < numPairs) return size_t(2 * coordinate);
    throw std::out_of_range("joint '" + getName() + "', a " + getEquations().getKind() + ", has " +
                            std::to_string(numPairs) + " pairs of frames, none of number " +
                            std::to_string(coordinate));
}
const Attachment& Joint::getFrameF(int coordinate) const {
    return guts().joint(m_index).frames[findFrames(coordinate)];
}
const Attachment& Joint::getFrameM(int coordinate) const {
    return guts().joint(m_index).frames[findFrames(coordinate) + 1];
}
ConstraintIndex Joint::getConstraintIndex() const {
    return guts().joint(m_index).constraint;
}
const JointEquations& Joint::getEquations() const {
    return *guts().joint(m_index).equations;
}

Vector Joint::calcPositionErrors(const State& state) const {
    Vector errors(getNumEquations());
    getEquations().calcErrors(guts().calcDrive(state, m_index), Motions(*this, state).frames(),
                              errors.updContiguousScalarData());
    return errors;
}

int Joint::getNumCoordinates() const {
    return getEquations().getNumCoordinates();
}

Vector Joint::calcCoordinates(const State& state) const {
    Vector coordinates(getNumCoordinates());
    const Motions motions(*this, state);
    getEquations().calcCoordinates(motions.frames(), coordinates.updContiguousScalarData());
    for (int k = 0; k < coordinates.size(); ++k)
        if (const TurnState* const turns = guts().findTurns(m_index, k)) {
            const size_t pair = getEquations().getNumFrames() > 2 ? size_t(2 * k) : 0;
            const Real z = guts().getZ(state)[guts().joint(m_index).getTurns(k)];
            coordinates[k] =
                turns->calcAngle(state.getTime(), z, motions[pair].X, motions[pair + 1].X);
        }
    return coordinates;
}

Vector Joint::calcCoordinateDots(const State& state) const {
    Vector dots(getNumCoordinates());
    getEquations().calcCoordinateDots(Motions(*this, state).frames(),
                                      dots.updContiguousScalarData());
    return dots;
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
                               Axes axes, int coordinate) const {
    checkSize(multipliers);
    const JointEquations& equations = getEquations();
    const size_t first = findFrames(coordinate), numRows = size_t(equations.getNumEquations());
    const Motions motions(*this, state);
    const Transform &F = motions[first].X, &M = motions[first + 1].X;
    std::vector<SpatialVec> D(numRows * size_t(equations.getNumFrames()));
    equations.calcJacobian(guts().calcDrive(state, m_index), motions.frames(), D.data());
    const SpatialVec* rows = &D[numRows * (on == Side::F ? first : first + 1)];
    SpatialVec force(Vec3(0), Vec3(0));
    for (size_t k = 0; k < numRows; ++k) force -= multipliers[int(k)] * rows[k];
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

Vector Joint::calcCouplingForces(const Vector& multipliers) const {
    if (!getEquations().isCoupler())
        throw std::logic_error("joint '" + getName() + "' is a " + getEquations().getKind() +
                               " and couples no coordinates; ask for calcReaction()");
    checkSize(multipliers);
    Vector forces(getNumCoordinates());
    for (int i = 0; i < forces.size(); ++i)
        forces[i] = -multipliers[0] * getEquations().getCoefficients()[unsigned(i)];
    return forces;
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

/** Wraps a function of time and its two derivatives. **/
Joint::MotionFunction makeMotion(Joint::FunctionOfTime function, const char* what,
                                 const std::string& name) {
    if (!function) return {};
    if (function->getArgumentSize() != 1 || function->getMaxDerivativeOrder() < 2)
        throw std::invalid_argument("joint '" + name + "': the " + what + " function has " +
                                    std::to_string(function->getArgumentSize()) +
                                    " arguments and " +
                                    std::to_string(function->getMaxDerivativeOrder()) +
                                    " derivatives, but must have 1, time, and at least 2");
    return [function = std::move(function)](Real time) {
        // Allocated once: this is called in the Newton iteration.
        thread_local Vector argument(1);
        thread_local const Array_<int> first(1, 0), second(2, 0);
        argument[0] = time;
        return Vec3(function->calcValue(argument), function->calcDerivative(first, argument),
                    function->calcDerivative(second, argument));
    };
}

/** Returns the largest period of the sum: a turn of any angle is an integer multiple of it. **/
Real findPeriod(const std::vector<Joint::Coupler::Term>& terms, const std::string& name) {
    constexpr int Largest = 1000;
    constexpr Real Tolerance = 1e-12;
    Real first = 0, unit = 0;
    for (const Joint::Coupler::Term& term : terms) {
        if (!term.coordinate.getCoordinate().isPeriodic()) continue;
        const Real coefficient = std::abs(term.coefficient);
        if (unit == 0) first = unit = coefficient;
        const auto isWhole = [&](int parts) {
            const Real multiple = coefficient / unit * parts;
            return multiple > 0.5 &&
                   std::abs(multiple - std::round(multiple)) < Tolerance * multiple;
        };
        int parts = 1;
        while (parts <= Largest && !isWhole(parts)) ++parts;
        unit /= parts;
        if (parts > Largest || first > 1.5 * Largest * unit) {
            std::ostringstream text;
            text << "joint '" << name << "': angles have coefficients " << first << " and "
                 << coefficient << ", which are in no ratio of whole numbers up to " << Largest
                 << "; choose one that is, as from numbers of teeth";
            throw std::invalid_argument(text.str());
        }
    }
    return 2 * Pi * unit;
}

std::shared_ptr<const JointEquations> makeCoupler(const std::vector<Joint::Coupler::Term>& terms,
                                                  Real constant, const std::string& name) {
    if (terms.empty())
        throw std::invalid_argument("joint '" + name +
                                    "' couples no coordinates; give one or more");
    if (!isFinite(constant)) throw makeRefusal(name, "constant", constant, "finite");
    std::vector<JointCoordinate> coordinates;
    std::vector<Real> coefficients;
    for (const Joint::Coupler::Term& term : terms) {
        if (!isFinite(term.coefficient) || term.coefficient == 0)
            throw makeRefusal(name, "coefficient", term.coefficient, "finite and not 0");
        coordinates.push_back(term.coordinate.getCoordinate());
        coefficients.push_back(term.coefficient);
    }
    return share(JointEquations::makeCoupler("Coupler", coordinates, coefficients, constant,
                                             findPeriod(terms, name)));
}

std::vector<Attachment> listFrames(const std::vector<Joint::Coupler::Term>& terms) {
    std::vector<Attachment> frames;
    for (const Joint::Coupler::Term& term : terms) {
        frames.push_back(term.coordinate.getFrameF());
        frames.push_back(term.coordinate.getFrameM());
    }
    return frames;
}

std::shared_ptr<const JointEquations> makeGear(const Joint::Coordinate& A, int teethA,
                                               const Joint::Coordinate& B, int teethB, Real phase,
                                               const std::string& name) {
    if (teethA == 0 || teethB == 0) throw makeRefusal(name, "number of teeth", 0, "not 0");
    if (!isFinite(phase)) throw makeRefusal(name, "phase", phase, "finite");
    if (!A.getCoordinate().isAngle() || !B.getCoordinate().isAngle())
        throw std::invalid_argument("joint '" + name +
                                    "' is a gear of a displacement; use a Coupler for a rack");
    return share(JointEquations::makeCoupler("Gear", {A.getCoordinate(), B.getCoordinate()},
                                             {1, Real(teethB) / teethA}, phase / teethA,
                                             2 * Pi / std::abs(teethA)));
}

}  // namespace

Joint::Ball::Ball(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                  const std::string& name)
    : Joint(subsystem, share(JointEquations::makeBall()), {F, M}, name) {}

Joint::Pin::Pin(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                const std::string& name)
    : Joint(subsystem, share(JointEquations::makePin()), {F, M}, name) {}

Joint::Slider::Slider(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                      const std::string& name)
    : Joint(subsystem, share(JointEquations::makeSlider()), {F, M}, name) {}

Joint::Weld::Weld(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                  const std::string& name)
    : Joint(subsystem, share(JointEquations::makeWeld()), {F, M}, name) {}

Joint::PrescribedRotation::PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                              const Attachment& M, AngleFunction angle,
                                              const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedRotation(
                checkGiven(std::move(angle), "angle", name))),
            {F, M}, name) {}

Joint::Cylinder::Cylinder(FlexibleBodySubsystem& subsystem, const Attachment& F,
                          const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeCylinder()), {F, M}, name) {}

Joint::Universal::Universal(FlexibleBodySubsystem& subsystem, const Attachment& F,
                            const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeUniversal()), {F, M}, name) {}

Joint::Planar::Planar(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                      const std::string& name)
    : Joint(subsystem, share(JointEquations::makePlanar()), {F, M}, name) {}

Joint::Screw::Screw(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                    Real pitch, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeScrew(checkPitch(pitch, name))), {F, M}, name) {}

Joint::PointOnLine::PointOnLine(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makePointOnLine()), {F, M}, name) {}

Joint::PointInPlane::PointInPlane(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                  const Attachment& M, const std::string& name)
    : Joint(subsystem, share(JointEquations::makePointInPlane()), {F, M}, name) {}

Joint::Rod::Rod(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                Real length, const std::string& name)
    : Joint(subsystem, share(JointEquations::makeRod(checkLength(length, name))), {F, M}, name) {}

Joint::PrescribedTranslation::PrescribedTranslation(FlexibleBodySubsystem& subsystem,
                                                    const Attachment& F, const Attachment& M,
                                                    CoordinateAxis axis,
                                                    MotionFunction displacement,
                                                    const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedTranslation(
                axis, checkGiven(std::move(displacement), "displacement", name))),
            {F, M}, name) {}

Joint::PrescribedPosition::PrescribedPosition(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                              const Attachment& M, PositionFunction position,
                                              const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedPosition(
                checkGiven(std::move(position), "position", name))),
            {F, M}, name) {}

Joint::PrescribedPose::PrescribedPose(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                      const Attachment& M, PoseFunction pose,
                                      const std::string& name)
    : Joint(subsystem,
            share(JointEquations::makePrescribedPose(checkGiven(std::move(pose), "pose", name))),
            {F, M}, name) {}

Joint::PrescribedRotation::PrescribedRotation(FlexibleBodySubsystem& subsystem, const Attachment& F,
                                              const Attachment& M, FunctionOfTime angle,
                                              const std::string& name)
    : PrescribedRotation(subsystem, F, M, makeMotion(std::move(angle), "angle", name), name) {}

Joint::PrescribedTranslation::PrescribedTranslation(FlexibleBodySubsystem& subsystem,
                                                    const Attachment& F, const Attachment& M,
                                                    CoordinateAxis axis,
                                                    FunctionOfTime displacement,
                                                    const std::string& name)
    : PrescribedTranslation(subsystem, F, M, axis,
                            makeMotion(std::move(displacement), "displacement", name), name) {}

//---------------------------------------------------------------------------------------------------------
// couplers

Joint::Coordinate::Coordinate(const Joint& joint, int index)
    : Coordinate([&] {
          const JointEquations& equations = joint.getEquations();
          if (index < 0 || index >= equations.getNumCoordinates())
              throw std::out_of_range("joint '" + joint.getName() + "', a " + equations.getKind() +
                                      ", has " + std::to_string(equations.getNumCoordinates()) +
                                      " coordinates, none of number " + std::to_string(index));
          const int pair = equations.isCoupler() ? index : 0;
          return Coordinate(joint.getFrameF(pair), joint.getFrameM(pair),
                            equations.getCoordinate(index));
      }()) {}

Joint::Coordinate Joint::Coordinate::makeAngle(const Attachment& F, const Attachment& M) {
    return {F, M, JointCoordinate::makeAngleAboutZ()};
}

Joint::Coordinate Joint::Coordinate::makeDisplacement(const Attachment& F, const Attachment& M,
                                                      CoordinateAxis axis) {
    return {F, M, JointCoordinate::makeDisplacement(int(axis))};
}

Joint::Gear::Gear(FlexibleBodySubsystem& subsystem, const Coordinate& A, int teethA,
                  const Coordinate& B, int teethB, const std::string& name)
    : Gear(subsystem, A, teethA, B, teethB, 0.0, name) {}

Joint::Gear::Gear(FlexibleBodySubsystem& subsystem, const Coordinate& A, int teethA,
                  const Coordinate& B, int teethB, Real phase, const std::string& name)
    : Joint(subsystem, makeGear(A, teethA, B, teethB, phase, name),
            {A.getFrameF(), A.getFrameM(), B.getFrameF(), B.getFrameM()}, name) {}

Joint::Coupler::Coupler(FlexibleBodySubsystem& subsystem, const std::vector<Term>& terms,
                        const std::string& name)
    : Coupler(subsystem, terms, 0.0, name) {}

Joint::Coupler::Coupler(FlexibleBodySubsystem& subsystem, const std::vector<Term>& terms,
                        Real constant, const std::string& name)
    : Joint(subsystem, makeCoupler(terms, constant, name), listFrames(terms), name) {}

Joint::Lock::Lock(FlexibleBodySubsystem& subsystem, const Coordinate& coordinate,
                  const std::string& name)
    : Joint(subsystem, share(JointEquations::makeLock(coordinate.getCoordinate())),
            {coordinate.getFrameF(), coordinate.getFrameM()}, name) {
    subsystem.updGuts().updMatter().updConstraint(getConstraintIndex()).setDisabledByDefault(true);
}

void Joint::Lock::lock(State& state) const {
    lockAt(state, calcCoordinates(state)[0]);
}

void Joint::Lock::lockAt(State& state, Real value) const {
    guts().setHeld(state, getIndex(), value);
    guts().getMatter().getConstraint(getConstraintIndex()).enable(state);
}

void Joint::Lock::unlock(State& state) const {
    guts().getMatter().getConstraint(getConstraintIndex()).disable(state);
}

bool Joint::Lock::isLocked(const State& state) const {
    return !guts().getMatter().getConstraint(getConstraintIndex()).isDisabled(state);
}

Real Joint::Lock::getLockValue(const State& state) const {
    return guts().getHeld(state, getIndex());
}

}  // namespace simflex
