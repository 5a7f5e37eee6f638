// Checkpoints of an integration.

#include <algorithm>

#include "simflex/base/Checkpoint.h"
#include "simflex/base/Hash.h"
#include "simflex/base/NumberText.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vector;

namespace {

void visitStatistics(Checkpoint& c, IntegratorStatistics& s) {
    c.visit(s.stepsTaken, s.stepsAttempted, s.errorTestFailures, s.convergenceFailures,
            s.projectionFailures, s.nonFiniteFailures);
    for (long& steps : s.stepsAtOrder) c.visit(steps);
    c.visit(s.smallestStep, s.largestStep, s.timeCovered, s.sumOfSquaredLogRatios, s.stepRatios);
    c.visit(s.newtonIterations, s.divergentIterations, s.linearSolves, s.factorizations,
            s.denseFactorizations, s.projections, s.redundantConstraints);
    c.visit(s.starts, s.reports, s.scheduledEvents, s.triggeredEvents, s.timeAdvancedEvents);
    c.visit(s.evaluationSeconds, s.factorSeconds, s.schurSeconds, s.backSubstitutionSeconds,
            s.simbodySeconds, s.outputSeconds, s.totalSeconds);
}

/** Values of all triggers of the model, or none. **/
void visitTriggers(Checkpoint& c, Vector& values, int numTriggers) {
    const std::size_t size = c.visitSize(std::size_t(values.size()), sizeof(Real));
    if (size != 0 && size != std::size_t(numTriggers))
        Checkpoint::refuse("it holds " + std::to_string(size) + " values of event triggers, " +
                           "this model has " + std::to_string(numTriggers));
    values.resize(int(size));
    if (size > 0) c.visitBytes(&values[0], size * sizeof(Real));
}

/** Compares a count of the model with that in the checkpoint. **/
void visitCount(Checkpoint& c, int count, const std::string& what) {
    int written = count;
    c.visit(written);
    if (written != count)
        Checkpoint::refuse("it is of another model, with " + std::to_string(written) + " " + what +
                           " instead of " + std::to_string(count));
}

void visitName(Checkpoint& c, const std::string& name, const char* what) {
    std::string written = name;
    c.visit(written);
    if (written != name)
        Checkpoint::refuse(std::string("it is of another model: ") + what + " '" + name +
                           "' is called '" + written + "' there");
}

void visitConstants(Checkpoint& c, std::uint64_t constants, const std::string& what) {
    std::uint64_t written = constants;
    c.visit(written);
    if (written != constants)
        Checkpoint::refuse("it is of another model: " + what + " has changed since");
}

std::uint64_t calcChecksum(const SimTK::MobilizedBody& body) {
    const SimTK::MassProperties& mass = body.getDefaultMassProperties();
    const SimTK::Transform &F = body.getDefaultInboardFrame(), &M = body.getDefaultOutboardFrame();
    std::vector<Real> numbers{mass.getMass()};
    const SimTK::Vec3 center = mass.getMassCenter();
    const SimTK::Vec3 moments = mass.getInertia().getMoments();
    const SimTK::Vec3 products = mass.getInertia().getProducts();
    for (const SimTK::Vec3& vector : {center, moments, products, F.p(), M.p()})
        for (int i = 0; i < 3; ++i) numbers.push_back(vector[i]);
    for (const SimTK::Transform* frame : {&F, &M})
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) numbers.push_back(frame->R()[i][j]);
    Hash hash;
    hash.add(numbers);
    return hash.get();
}

std::uint64_t calcChecksum(const FrictionEquations* friction) {
    Hash hash;
    if (!friction) return hash.get();
    const FrictionCoefficients& own = friction->getCoefficients();
    hash.add(
        std::vector<Real>{own.coulomb, own.breakaway, own.viscous, own.radius, own.axialRadius});
    return hash.get();
}

std::uint64_t calcChecksum(const FlexibleBodyRecord& body) {
    Hash hash;
    hash.addBytes(body.model->omegaSquared.data(),
                  std::size_t(body.model->omegaSquared.size()) * sizeof(Real));
    hash.addBytes(body.damping.data(), std::size_t(body.damping.size()) * sizeof(Real));
    return hash.get();
}

}  // namespace

void ImplicitIntegrator::Implementation::visitModel(Checkpoint& c) const {
    const SimTK::SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    visitCount(c, m_system.getNumSubsystems(), "subsystems");
    visitCount(c, matter.getNumBodies(), "mobilized bodies");
    visitCount(c, matter.getNumConstraints(), "constraints");
    if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(m_system)) {
        const FlexibleBodySubsystem::Guts& guts = flexible->getGuts();
        visitCount(c, int(guts.bodies().size()), "flexible bodies");
        visitCount(c, int(guts.joints().size()), "joints");
        visitCount(c, int(guts.forceElements().size()), "force elements");
        visitCount(c, int(guts.states().size()), "state equations");
        for (const FlexibleBodyRecord& body : guts.bodies()) {
            visitName(c, body.name, "flexible body");
            visitCount(c, body.numModes(), "modes of '" + body.name + "'");
            visitConstants(c, calcChecksum(body),
                           "stiffness or damping of flexible body '" + body.name + "'");
        }
        for (const JointRecord& joint : guts.joints()) {
            visitName(c, joint.name, "joint");
            visitCount(c, joint.equations->getNumEquations(), "equations of '" + joint.name + "'");
            visitConstants(c, calcChecksum(joint.friction.get()),
                           "friction of joint '" + joint.name + "'");
        }
    }
    for (SimTK::MobilizedBodyIndex b(1); b < matter.getNumBodies(); ++b)
        visitConstants(c, calcChecksum(matter.getMobilizedBody(b)),
                       "mass or frames of mobilized body " + std::to_string(int(b)));
}

void ImplicitIntegrator::Implementation::visitSettings(Checkpoint& c,
                                                       const StepSettings& ours) const {
    visitName(c, name, "integrator");
    constexpr ImplicitIntegrator::NewtonTolerances ByDefault{0, 0, 0, 0, 0};
    const NewtonTolerances newton = ours.ownNewtonTolerances.value_or(ByDefault);
    std::vector<std::pair<std::string, double>> all = m_scheme->listSettings();
    const std::vector<std::pair<std::string, double>> common = {
        {"setAccuracy", ours.accuracy},
        {"setAccuracyNorm", double(ours.accuracyNorm)},
        {"setUseInfinityNorm", ours.useInfinityNorm},
        {"setConstraintTolerance", ours.ownConstraintTolerance.value_or(0)},
        {"setProjectionNorm", double(projectionNorm)},
        {"setFormulation", double(ours.formulation)},
        {"setBlockForm", double(ours.blockForm)},
        {"setInitialStepSize", ours.initialStep},
        {"setMaximumStepSize", ours.maximumStep},
        {"setMinimumStepSize", ours.minimumStep},
        {"setFixedStep", ours.fixedStep},
        {"setTriggerSamples", double(triggerSamples)},
        {"setAllowInterpolation", double(allowInterpolation)},
        {"setProjectInterpolatedStates", double(ours.projectInterpolatedStates)},
        {"setForceFullNewton", double(ours.forceFullNewton)},
        {"setNewtonTolerances: displacement", newton.displacement},
        {"setNewtonTolerances: multiplier", newton.multiplier},
        {"setNewtonTolerances: bodyResidual", newton.bodyResidual},
        {"setNewtonTolerances: constraintResidual", newton.constraintResidual},
        {"setNewtonTolerances: maxIterations", double(newton.maxIterations)},
        {"addForceJacobian, times called", double(ours.differentiated.size())},
        {"addBreakTimes, times called", double(ours.breaks.numSources())}};
    all.insert(all.end(), common.begin(), common.end());
    for (const auto& [setting, value] : all) {
        double written = value;
        c.visit(written);
        if (written == value) continue;
        int digits = 6;
        while (writeGeneral(written, digits) == writeGeneral(value, digits) && digits < 17)
            ++digits;
        Checkpoint::refuse("another setting was used when it was written: " + setting + " " +
                           writeGeneral(written, digits) + " instead of " +
                           writeGeneral(value, digits) +
                           ". An integration is continued with the settings it began with; to "
                           "change one, initialize() from the State reached");
    }
}

void ImplicitIntegrator::Implementation::visitProgress(Checkpoint& c) {
    m_visible.visit(c);
    m_stepper->visit(c);
    m_events.visit(c);
    c.visit(stepsTaken.firstLength, stepsTaken.lastLength);
    c.visitWithin(stepsTaken.lastOrder, 0, 5, "the last order");
    visitTriggers(c, m_triggersBefore, m_events.getNumTriggers());
    visitTriggers(c, m_triggersAfter, m_events.getNumTriggers());
    c.visit(m_hasTriggered, m_isTimeAdvancePending, m_isTerminated, m_isFinished);
    c.visit(m_isIntervalStart, m_isFinalTimeReturned, m_isOver);
    int pending = int(m_pending);
    c.visitWithin(pending, 0, int(Pending::HandledTrigger), "what is to be returned");
    m_pending = Pending(pending);
    c.visit(m_triggered.window[0], m_triggered.window[1]);
    // Values before are known from the start, values after only at an event.
    if (m_events.getNumTriggers() > 0 &&
        (m_triggersBefore.size() == 0 || (m_hasTriggered && m_triggersAfter.size() == 0)))
        Checkpoint::refuse("it holds no values of this model's " +
                           std::to_string(m_events.getNumTriggers()) + " event triggers");
    if (m_events.getNumTriggers() == 0 && m_hasTriggered)
        Checkpoint::refuse("it stands at a triggered event, this model has no triggers");
    visitStatistics(c, statistics);
}

void ImplicitIntegrator::Implementation::writeCheckpoint(std::ostream& stream) {
    runAlone([&] {
        acceptAdvancedState();
        getState();
        balanceVisible();
        m_image.requireWritable(m_state);
        Checkpoint checkpoint;
        visitModel(checkpoint);
        visitSettings(checkpoint, settings);
        m_image.write(m_builtFrom, checkpoint);
        m_image.write(m_state, checkpoint);
        visitProgress(checkpoint);
        checkpoint.write(stream);
    });
}

void ImplicitIntegrator::Implementation::readCheckpoint(std::istream& stream, const State& start) {
    requireNotRunning("readCheckpoint");
    runAlone([&] {
        Checkpoint checkpoint(stream);
        requireTopology(m_system, start, name + "::readCheckpoint()");
        visitModel(checkpoint);
        visitSettings(checkpoint, m_waiting);  // which prepare() takes
        State builtFrom = copyState(start);
        m_system.realize(builtFrom, Stage::Instance);
        m_image.startFrom(builtFrom);
        m_image.read(checkpoint, builtFrom);
        State now = copyState(start);
        m_system.realize(now, Stage::Instance);
        m_image.read(checkpoint, now);

        prepare(builtFrom);
        visitProgress(checkpoint);
        checkpoint.requireEnd();
        if (!std::isfinite(m_visible.t) || isLater(getNewestTime(), m_visible.t))
            Checkpoint::refuse("what it shows is later than its last point");
        copyState(now, m_state);
        m_system.realize(m_state, Stage::Velocity);
        updEquations().takeVariables(m_events.getAutoUpdates(), m_state);
        copyState(m_state, m_scratch);
        m_stateIsCurrent = false;
        m_isBalanced = true;
        noteFinalTime();
        if (m_pending == Pending::HandledTrigger) noteTriggeredEvents();
        m_isInitialized = true;
        refreshAdvancedState();
    });
}

}  // namespace simflex
