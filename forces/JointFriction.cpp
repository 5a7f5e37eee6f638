#include "simflex/forces/JointFriction.h"

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

using namespace SimTK;

/** Frame motions of a contact, and gradients of its sliding rates. **/
struct JointFriction::Sliding {
    Sliding(const JointFriction& friction, const State& state, int contact)
        : F(friction.m_joint.getFrameF().calcMotion(state)),
          M(friction.m_joint.getFrameM().calcMotion(state)) {
        friction.getEquations().calcGradients(contact, F.X, M.X, D_F, D_M);
    }
    Real calcRate(int i) const {
        return ~D_F[i][0] * F.V[0] + ~D_F[i][1] * F.V[1] + ~D_M[i][0] * M.V[0] +
               ~D_M[i][1] * M.V[1];
    }

    FrameMotion F, M;
    SpatialVec D_F[FrictionEquations::MaxRates], D_M[FrictionEquations::MaxRates];
};

JointFriction::JointFriction(FlexibleBodySubsystem& subsystem, const Joint& joint,
                             const FrictionCoefficients& coefficients)
    : m_subsystem(&subsystem), m_joint(joint) {
    if (!joint.isIn(subsystem))
        throw std::invalid_argument("friction of joint '" + joint.getName() +
                                    "': it is a joint of another system");
    FlexibleBodySubsystem::Guts& guts = subsystem.updGuts();
    try {
        guts.setFriction(joint.getIndex(),
                         std::make_shared<const FrictionEquations>(
                             guts.joint(joint.getIndex()).equations, coefficients));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("friction of joint '" + joint.getName() + "': " + error.what());
    }
}

JointFriction::JointFriction(const FlexibleBodySubsystem& subsystem, const Joint& joint)
    : m_subsystem(&subsystem), m_joint(joint) {
    if (!exists(subsystem, joint))
        throw std::invalid_argument("joint '" + joint.getName() + "' has no friction");
}

bool JointFriction::exists(const FlexibleBodySubsystem& subsystem, const Joint& joint) {
    return subsystem.getGuts().joint(joint.getIndex()).friction != nullptr;
}

const FrictionEquations& JointFriction::getEquations() const {
    return *m_subsystem->getGuts().joint(m_joint.getIndex()).friction;
}

const FrictionCoefficients& JointFriction::getCoefficients() const {
    return getEquations().getCoefficients();
}

int JointFriction::getNumContacts() const {
    return getEquations().getNumContacts();
}

int JointFriction::getNumRates(int contact) const {
    return getEquations().getNumRates(contact);
}

bool JointFriction::turns() const {
    const std::string kind = m_joint.getEquations().getKind();
    return kind == "Pin" || kind == "Ball" || kind == "Universal";
}

int JointFriction::getNumRates() const {
    int count = 0;
    for (int k = 0; k < getNumContacts(); ++k) count += getEquations().getNumRates(k);
    return count;
}

JointFriction::Contact JointFriction::calcContact(const State& state, const Vector& multipliers,
                                                  const Vector& dryForces, int number) const {
    const Sliding sliding(*this, state, number);
    const FrictionEquations& equations = getEquations();
    int first = 0;
    for (int k = 0; k < number; ++k) first += equations.getNumRates(k);
    Contact contact;
    for (int i = 0; i < equations.getNumRates(number); ++i) {
        contact.rates[i] = sliding.calcRate(i);
        contact.force[i] = dryForces[first + i] - getCoefficients().viscous * contact.rates[i];
        contact.power += contact.force[i] * contact.rates[i];
    }
    const JointEquations& joint = m_joint.getEquations();
    SpatialVec D[2 * JointEquations::MaxEquations];
    Real gradient[JointEquations::MaxEquations];
    const FrameMotion* frames[] = {&sliding.F, &sliding.M};
    joint.calcJacobian({}, frames, D);
    contact.load = equations.calcLoad(number, sliding.F.X, D + joint.getNumEquations(),
                                      &multipliers[0], gradient);
    return contact;
}

SpatialVec JointFriction::calcForce(const State& state, const Vector& dryForces, Joint::Side on,
                                    Joint::Axes axes) const {
    SpatialVec sum(Vec3(0), Vec3(0));
    int next = 0;
    for (int k = 0; k < getNumContacts(); ++k) {
        const Sliding sliding(*this, state, k);
        for (int i = 0; i < getNumRates(k); ++i) {
            const Real force = dryForces[next++] - getCoefficients().viscous * sliding.calcRate(i);
            sum += force * (on == Joint::Side::F ? sliding.D_F[i] : sliding.D_M[i]);
        }
    }
    if (axes == Joint::Axes::Ground) return sum;
    return ~(axes == Joint::Axes::F ? m_joint.getFrameF() : m_joint.getFrameM())
                .calcMotion(state)
                .X.R() *
           sum;
}

}  // namespace simflex
