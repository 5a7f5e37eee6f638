#pragma once
/** @file
How a model begins to move: its integrator, its start, and why it does not. **/

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

/** The integrator of the method with the settings of the model's `solver`; not
initialized. **/
std::unique_ptr<ImplicitIntegrator> makeIntegrator(const Model& model);

/** What changes the meaning of an equilibrium, and what else there is to know of it, in sentences:
"the equilibrium is unstable: …". **/
struct EquilibriumNotes {
    std::vector<std::string> warnings, remarks;
};
EquilibriumNotes describeEquilibrium(const StaticEquilibrium& equilibrium);

/** What has left the range in which its equations describe it, where an analysis stands: flexible
bodies (see LinearRangeReporter) and connectors. Says it once of each, also where models follow one
another that have other values of their parameters. **/
class RangeWarnings {
public:
    std::vector<std::string> describe(const Model& model, const SimTK::State& state);

private:
    std::set<std::pair<int, LinearRangeReporter::Kind>> m_bodies;
    std::set<int> m_elements;
};

/** Where analyses begin: the initial State, brought to static equilibrium or steady motion first if
`initial.start` says so.
@param notes  of that equilibrium
@param observer  see StaticEquilibrium::setObserver() **/
SimTK::State findStart(const Model& model, EquilibriumNotes& notes,
                       const std::function<void()>& observer = {});

/** What of the model has no part in its static equilibrium although analyses begin there: initial
speeds, friction. Each a warning: "begins at …". **/
std::vector<std::string> describeLosses(const Model& model);

/** Joints with friction, "'pin', 'slide'"; empty if there are none. **/
std::string nameRubbingJoints(const Model& model);

/** A message, and what law had no value in what failed. **/
std::string explainFailure(const Model& model, const std::string& message);
/** Does what laws may make fail.
@throws std::runtime_error with explainFailure(); what it throws itself where all have values **/
void doWithLaws(const Model& model, const std::function<void()>& work);

}  // namespace model
}  // namespace simflex
