#pragma once
/** @file
Small Simbody programs, each about one mechanism that users may rely on. Models made with SimTK's
own classes must move the same under SimTK::Integrator and under ours. **/

#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

#include "Simbody.h"

namespace simflex::test {

/** Call times of handlers and reporters. **/
struct Call {
    std::string who;
    SimTK::Real time;
};

/** The objects of a program's main() before it makes an integrator. **/
struct Model {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};  ///< Simbody's force elements refer to it
    SimTK::State state;                            ///< given to initialize()
    SimTK::Real duration = 2;                      ///< [s]
    SimTK::Real longestStep = SimTK::NaN;          ///< if set by the author [s]
    std::vector<Call> calls;                       ///< recorded by its handlers
    std::vector<std::shared_ptr<void>> kept;       ///< other objects that Simbody elements refer to
    std::shared_ptr<void> handles;  ///< subsystems, bodies, forces: may be gone during the run
    /** Other quantities for the comparison; works without the handles. **/
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
    /** Accuracy of Simbody's integrator; looser where the forces' smoothness limits it. **/
    SimTK::Real referenceAccuracy = 1e-9;
};

std::ostream& operator<<(std::ostream& out, const Program& program);

/** @name Programs by topic **/
/**@{**/
std::vector<Program> getMemoryPrograms();     ///< forces with memory
std::vector<Program> getEventPrograms();      ///< handlers, triggers, reporters
std::vector<Program> getMechanismPrograms();  ///< bodies, constraints, contact, cables
/**@}**/

/** Bodies with forces, some of which refer to the author's handle of their subsystem, as
Force::Gravity and the discrete forces do in Simbody 3.7. **/
struct Basics {
    explicit Basics(Model& model)
        : matter(model.matter), forces(model.keep<SimTK::GeneralForceSubsystem>(model.system)) {}
    SimTK::SimbodyMatterSubsystem& matter;
    SimTK::GeneralForceSubsystem& forces;
};

/** Returns a body of mass m with the inertia of a ball of radius 0.1 m. **/
inline SimTK::Body::Rigid ball(SimTK::Real m) {
    return SimTK::Body::Rigid(
        SimTK::MassProperties(m, SimTK::Vec3(0), m * SimTK::UnitInertia::sphere(0.1)));
}

/** Returns the force subsystem owned by the system, which outlives its author's handle. **/
inline const SimTK::Subsystem& findOwned(const SimTK::MultibodySystem& system,
                                         const SimTK::Subsystem& handle) {
    return system.getSubsystem(handle.getMySubsystemIndex());
}

}  // namespace simflex::test
