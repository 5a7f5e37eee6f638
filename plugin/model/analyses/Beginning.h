#pragma once
/** @file
Start of a model's motion: its integrator, its first State, and explanations of failures. **/

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simflex/body/LinearRangeReporter.h"
#include "simflex/model/Model.h"
#include "simflex/solver/ImplicitIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace model {

/** Makes the integrator that the model's `solver` asks for, with its settings; not initialized. **/
std::unique_ptr<ImplicitIntegrator> makeIntegrator(const Model& model);

/** Warnings that affect the meaning of an equilibrium, and further remarks, in sentences: "the
equilibrium is unstable: …". **/
struct EquilibriumNotes {
    std::vector<std::string> warnings, remarks;
};
EquilibriumNotes describeEquilibrium(const StaticEquilibrium& equilibrium);

/** Warns of flexible bodies (see LinearRangeReporter) and connectors outside the valid range of
their equations at the State of an analysis. Warns once of each, even over several models that
differ in their parameters. **/
class RangeWarnings {
public:
    std::vector<std::string> describe(const Model& model, const SimTK::State& state);

private:
    std::set<std::pair<int, LinearRangeReporter::Kind>> m_bodies;
    std::set<int> m_elements;
};

/** Finds the State at which analyses start: the initial State, brought to static equilibrium or
steady motion first if `initial.start` says so.
@param notes  on that equilibrium
@param observer  see StaticEquilibrium::setObserver() **/
SimTK::State findStart(const Model& model, EquilibriumNotes& notes,
                       const std::function<void()>& observer = {});

/** Warnings for features of the model that its static equilibrium ignores although analyses start
there: initial speeds and friction. Each reads "begins at …". **/
std::vector<std::string> describeLosses(const Model& model);

/** Joints with friction, "'pin', 'slide'"; empty if none. **/
std::string nameRubbingJoints(const Model& model);

/** Adds to a message the law that had no value, if any. **/
std::string explainFailure(const Model& model, const std::string& message);
/** Runs work that may fail because a law has no value.
@throws std::runtime_error with explainFailure(); other exceptions of `work` unchanged if all laws
had values **/
void doWithLaws(const Model& model, const std::function<void()>& work);

}  // namespace model
}  // namespace simflex
