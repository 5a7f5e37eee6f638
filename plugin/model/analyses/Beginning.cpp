#include "simflex/model/analyses/Beginning.h"

#include <algorithm>
#include <utility>

#include "simflex/base/Progress.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/model/file/KnownTimes.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"

namespace simflex {
namespace model {

using SimTK::State;

namespace {

using Integrator = ImplicitIntegrator;

/** Conditions that hold for less than a quarter of a step may be missed. **/
constexpr int TriggerSamples = 4;

/** Each text once, with its count, in order of first occurrence. **/
std::vector<std::pair<std::string, int>> countEqual(const std::vector<std::string>& texts) {
    std::vector<std::pair<std::string, int>> counts;
    for (const std::string& text : texts) {
        const auto found = std::find_if(counts.begin(), counts.end(),
                                        [&](const auto& entry) { return entry.first == text; });
        if (found == counts.end())
            counts.emplace_back(text, 1);
        else
            ++found->second;
    }
    return counts;
}

void setSteps(const ModelValue& solver, Integrator& integrator) {
    const auto set = [&](const char* key, void (Integrator::*method)(SimTK::Real)) {
        const ModelValue value = solver.get(key);
        if (value.isGiven()) (integrator.*method)(value.getNumber());
    };
    // Model files give the accuracy in metres.
    integrator.setAccuracyNorm(Integrator::AccuracyNorm::Displacement);
    set("accuracy", &Integrator::setAccuracy);
    set("constraint_tolerance", &Integrator::setConstraintTolerance);
    set("initial_step", &Integrator::setInitialStepSize);
    set("maximum_step", &Integrator::setMaximumStepSize);
    set("minimum_step", &Integrator::setMinimumStepSize);
    set("fixed_step", &Integrator::setFixedStep);
}

}  // namespace

std::unique_ptr<Integrator> makeIntegrator(const Model& model) {
    const ModelValue solver = model.getFile().get("solver");
    const bool isIndex3 = solver.get("formulation").getText() == "index3";
    const std::string method = solver.get("method").getText();
    const auto belongsTo = [&](const char* key, const char* owner) {
        if (method != owner && solver.get(key).isGiven())
            solver.get(key).fail("belongs to method " + std::string(owner) + ", not " + method);
    };
    belongsTo("maximum_order", "bdf");
    belongsTo("spectral_radius", "generalized_alpha");
    std::unique_ptr<Integrator> integrator;
    if (method == "radau") {
        if (isIndex3)
            solver.get("formulation")
                .fail("belongs to methods bdf and generalized_alpha, not radau");
        integrator = std::make_unique<RadauIntegrator>(model.getSystem());
    } else if (method == "generalized_alpha") {
        auto alpha = std::make_unique<GeneralizedAlphaIntegrator>(model.getSystem());
        if (solver.get("spectral_radius").isGiven())
            alpha->setSpectralRadius(solver.get("spectral_radius").getNumber());
        integrator = std::move(alpha);
    } else {
        auto bdf = std::make_unique<BdfIntegrator>(model.getSystem());
        if (solver.get("maximum_order").isGiven())
            bdf->setMaximumOrder(solver.get("maximum_order").getInteger());
        integrator = std::move(bdf);
    }
    setSteps(solver, *integrator);
    // Joints engage and close by impulses, so inertia is the norm.
    integrator->setProjectionNorm(Integrator::ProjectionNorm::Inertia);
    integrator->setTriggerSamples(TriggerSamples);
    integrator->addBreakTimes(KnownTimes(model.getFile()));
    if (isIndex3) integrator->setFormulation(Integrator::Formulation::Index3);
    const std::string form = solver.get("block_form").getText();
    if (form == "arrow") integrator->setBlockForm(Integrator::BlockForm::Arrow);
    if (form == "dense") integrator->setBlockForm(Integrator::BlockForm::Dense);
    if (solver.get("threads").isGiven())
        integrator->setNumThreads(solver.get("threads").getInteger());
    if (solver.get("maximum_iterations").isGiven()) {
        Integrator::NewtonTolerances tolerances;
        tolerances.maxIterations = solver.get("maximum_iterations").getInteger();
        integrator->setNewtonTolerances(tolerances);
    }
    solver.checkRead();
    return integrator;
}

EquilibriumNotes describeEquilibrium(const StaticEquilibrium& equilibrium) {
    EquilibriumNotes notes;
    const auto inWays = [](int count) {
        return count > 1 ? " in " + std::to_string(count) + " ways" : std::string();
    };
    for (const auto& [motion, count] : countEqual(equilibrium.getUnstableMotions()))
        notes.warnings.push_back(
            "the equilibrium is unstable: " + motion + inWays(count) +
            " at the least disturbance; begin elsewhere, or let a damped motion settle to a stable "
            "one");
    if (equilibrium.isByDampedMotion())
        notes.warnings.push_back(
            "the equilibrium is where a strongly damped motion comes to rest: Newton's iteration "
            "does not converge from the start, and there may be other equilibria");
    if (equilibrium.getBranch() != StaticEquilibrium::Branch::Own)
        notes.warnings.push_back(equilibrium.describeBranch());
    for (const auto& [motion, count] : countEqual(equilibrium.getFreeMotions()))
        notes.remarks.push_back(motion + inWays(count) + ": nothing holds it");
    return notes;
}

std::vector<std::string> RangeWarnings::describe(const Model& model, const State& state) {
    std::vector<std::string> warnings;
    model.getSystem().realize(state, SimTK::Stage::Velocity);
    LinearRangeReporter reporter(model.getFlexibleBodies(), 1,
                                 [&](const std::string& message) { warnings.push_back(message); });
    reporter.setWarned(m_bodies);
    reporter.handleEvent(state);
    m_bodies = reporter.getWarned();
    for (const auto& [element, text] : model.getFlexibleBodies().describeElementsOutOfRange(state))
        if (m_elements.insert(element).second) warnings.push_back(text);
    return warnings;
}

State findStart(const Model& model, EquilibriumNotes& notes,
                const std::function<void()>& observer) {
    const State state = model.makeInitialState();
    const std::string start = model.getFile().get("initial").get("start").getText();
    if (start == "as_placed") return state;
    StaticEquilibrium equilibrium(model.getSystem());
    equilibrium.setObserver(observer);
    if (start == "static")
        equilibrium.solve(state);
    else
        equilibrium.solveSteadyMotion(state);
    notes = describeEquilibrium(equilibrium);
    return equilibrium.getState();
}

std::vector<std::string> describeLosses(const Model& model) {
    std::vector<std::string> losses;
    if (model.makeInitialState().getU().normInf() != 0)
        losses.push_back(
            "begins at static equilibrium, where everything is at rest: the model's initial "
            "velocities have no effect");
    const std::string rubbing = nameRubbingJoints(model);
    if (!rubbing.empty())
        losses.push_back("begins at a static equilibrium that is found without the friction of " +
                         rubbing);
    return losses;
}

std::string nameRubbingJoints(const Model& model) {
    std::vector<std::string> names;
    for (const Model::JointEntry& entry : model.getJoints())
        if (JointFriction::exists(model.getFlexibleBodies(), entry.joint))
            names.push_back("'" + entry.name + "'");
    return joinNames(names);
}

std::string explainFailure(const Model& model, const std::string& message) {
    const std::string& law = model.getLawFailure();
    return law.empty() ? message : message + "; " + law;
}

void doWithLaws(const Model& model, const std::function<void()>& work) {
    model.forgetLawFailure();
    try {
        work();
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception& error) {
        if (model.getLawFailure().empty()) throw;
        throw std::runtime_error(explainFailure(model, error.what()));
    }
}

}  // namespace model
}  // namespace simflex
