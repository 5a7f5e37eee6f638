#pragma once
/** @file
Small Simbody programs, each about one mechanism that its author may build on: what they make with
SimTK's own classes must move the same under SimTK::Integrator and under ours. **/

#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "Simbody.h"

namespace simflex::test {

/** When handlers and reporters were called. **/
struct Call {
    std::string who;
    SimTK::Real time;
};

/** What a program's main() holds before it makes an integrator. **/
struct Model {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};  ///< force elements of Simbody's refer to it
    SimTK::State state;                            ///< given to initialize()
    SimTK::Real duration = 2;                      ///< [s]
    SimTK::Real longestStep = SimTK::NaN;          ///< where its author sets one [s]
    std::vector<Call> calls;                       ///< what its handlers note
    std::vector<std::shared_ptr<void>> kept;       ///< what else elements of Simbody's refer to
    std::shared_ptr<void> handles;  ///< subsystems, bodies, forces: may be gone when it runs
    /** What else is to be compared; works without the handles. **/
    std::function<SimTK::Vector(const SimTK::State&)> observe;

    void note(const std::string& who, const SimTK::State& at) {
        calls.push_back({who, at.getTime()});
    }

    /** Makes the handles, which stay with the model until they are dropped. **/
    template <class Handles>
    Handles& make() {
        const auto made = std::make_shared<Handles>(*this);
        handles = made;
        return *made;
    }

    template <class Subsystem, class... Arguments>
    Subsystem& keep(Arguments&... arguments) {
        const auto made = std::make_shared<Subsystem>(arguments...);
        kept.push_back(made);
        return *made;
    }
};

struct Program {
    const char* name;
    std::unique_ptr<Model> (*build)();
    /** Accuracy of Simbody's integrator; larger where forces are not smooth to that. **/
    SimTK::Real referenceAccuracy = 1e-9;
};

std::ostream& operator<<(std::ostream& out, const Program& program);

/** @name By what they are about **/
/**@{**/
std::vector<Program> getMemoryPrograms();     ///< forces that remember
std::vector<Program> getEventPrograms();      ///< handlers, triggers, reporters
std::vector<Program> getMechanismPrograms();  ///< bodies, constraints, contact, cables
/**@}**/

/** Bodies under forces of which some refer to the author's handle of their subsystem, as
Force::Gravity and the discrete forces do in Simbody 3.7. **/
struct Basics {
    explicit Basics(Model& model)
        : matter(model.matter), forces(model.keep<SimTK::GeneralForceSubsystem>(model.system)) {}
    SimTK::SimbodyMatterSubsystem& matter;
    SimTK::GeneralForceSubsystem& forces;
};

/** A body of mass m with inertia of a ball of radius 0.1 m. **/
inline SimTK::Body::Rigid ball(SimTK::Real m) {
    return SimTK::Body::Rigid(
        SimTK::MassProperties(m, SimTK::Vec3(0), m * SimTK::UnitInertia::sphere(0.1)));
}

/** The force subsystem that the system owns: outlives its author's handle. **/
inline const SimTK::Subsystem& findOwned(const SimTK::MultibodySystem& system,
                                         const SimTK::Subsystem& handle) {
    return system.getSubsystem(handle.getMySubsystemIndex());
}

}  // namespace simflex::test
