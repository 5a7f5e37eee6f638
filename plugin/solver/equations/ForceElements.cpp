#include "simflex/solver/equations/ForceElements.h"

#include <typeinfo>

namespace simflex {

using namespace SimTK;

bool isGeneralForceSubsystem(const Subsystem& subsystem) {
    if (!dynamic_cast<const ForceSubsystem::Guts*>(&subsystem.getSubsystemGuts())) return false;
    // Simbody 3.7's isInstanceOf() takes any force subsystem for one.
    try {
        GeneralForceSubsystem::downcast(ForceSubsystem::downcast(subsystem)).getNumForces();
        return true;
    } catch (const std::bad_cast&) {
        return false;
    }
}

Array_<const GeneralForceSubsystem*> listGeneralForceSubsystems(const MultibodySystem& system) {
    Array_<const GeneralForceSubsystem*> list;
    for (SubsystemIndex s(0); s < system.getNumSubsystems(); ++s)
        if (isGeneralForceSubsystem(system.getSubsystem(s)))
            list.push_back(
                &GeneralForceSubsystem::downcast(ForceSubsystem::downcast(system.getSubsystem(s))));
    return list;
}

const GeneralForceSubsystem* findForceSubsystem(const MultibodySystem& system, const Force& force) {
    const ForceIndex index = force.getForceIndex();
    for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(system))
        if (index < forces->getNumForces() &&
            &forces->getForce(index).getImpl() == &force.getImpl())
            return forces;
    return nullptr;
}

void disableAllBut(const Force& force, const MultibodySystem& system, State& state) {
    const GeneralForceSubsystem* owner =
        force.isEmptyHandle() ? nullptr : findForceSubsystem(system, force);
    for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(system))
        for (ForceIndex f(0); f < forces->getNumForces(); ++f)
            if (forces != owner || f != force.getForceIndex())
                forces->setForceIsDisabled(state, f, true);
}

bool isHeldForce(const Force& force) {
    return Force::DiscreteForces::isInstanceOf(force) ||
           Force::MobilityConstantForce::isInstanceOf(force) ||
           Force::MobilityDiscreteForce::isInstanceOf(force) ||
           Force::ConstantTorque::isInstanceOf(force);
}

const Force::Custom::Implementation& getImplementation(const Force::Custom& force) {
    struct Opened : Force::Custom {
        static auto get() { return &Opened::getImplementation; }
    };
    return (force.*Opened::get())();
}

}  // namespace simflex
