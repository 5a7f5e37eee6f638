// Legal uses in Simbody programs: forces with memory, handles out of scope, triggers on reactions.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

Body::Rigid makeBody(Real mass) {
    return Body::Rigid(MassProperties(mass, Vec3(0), mass * Inertia(1)));
}

/** −stiffness·(largest x so far) on a slider's mobility: a spring outwards, a constant force on
return. **/
class Ratchet : public Force::Custom::Implementation {
public:
    Ratchet(const MobilizedBody& body, Real stiffness) : m_body(body), m_stiffness(stiffness) {}
    void realizeTopology(State& state) const override {
        m_largest = m_body.getMatterSubsystem()
                        .getSystem()
                        .getDefaultSubsystem()
                        .allocateAutoUpdateDiscreteVariable(state, Stage::Dynamics,
                                                            new Value<Real>(0), Stage::Position);
    }
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        const Subsystem& owner = m_body.getMatterSubsystem().getSystem().getDefaultSubsystem();
        const Real before =
            Value<Real>::downcast(owner.getDiscreteVariable(state, m_largest)).get();
        const Real largest = std::max(before, m_body.getOneQ(state, 0));
        Value<Real>::updDowncast(owner.updDiscreteVarUpdateValue(state, m_largest)) = largest;
        owner.markDiscreteVarUpdateValueRealized(state, m_largest);
        m_body.applyOneMobilityForce(state, 0, -m_stiffness * largest, mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    MobilizedBody m_body;
    Real m_stiffness;
    mutable DiscreteVariableIndex m_largest;
};

TEST(ForeignPrograms, ForcesRememberWhatWasReached) {
    // ω = 2: out to x = 1/2 in a quarter of a period, then back with u̇ = −2.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(), makeBody(1));
    Force::Custom(forces, new Ratchet(mass, 4));
    State start = system.realizeTopology();
    mass.setOneU(start, 0, 1);
    const Real back = 0.6;
    std::vector<Real> errors;
    for (Real accuracy : {1e-5, 1e-7}) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(start);
        integrator.stepTo(Pi / 4 + back);
        errors.push_back(std::abs(mass.getOneQ(integrator.getState(), 0) - (0.5 - back * back)));
        EXPECT_LT(errors.back(), 20 * std::pow(accuracy, 2.0 / 3));
    }
    EXPECT_LT(errors[1], 0.2 * errors[0]);
}

/** x = 1 + cos 3t / 2; only the system's handle remains. (Some of Simbody's force elements query
the handle that created them and must not lose it.) **/
std::unique_ptr<MultibodySystem> makeOscillator(Force* spring = nullptr) {
    auto system = std::make_unique<MultibodySystem>();
    SimbodyMatterSubsystem matter(*system);
    GeneralForceSubsystem forces(*system);
    MobilizedBody::Slider mass(matter.Ground(), makeBody(2));
    const Force::TwoPointLinearSpring own(forces, matter.Ground(), Vec3(0), mass, Vec3(0), 18, 1);
    if (spring) *spring = own;
    return system;
}

TEST(ForeignPrograms, HandlesMayGoOutOfScope) {
    for (bool hasJacobian : {false, true}) {
        Force spring;
        const auto system = makeOscillator(&spring);
        State start = system->realizeTopology();
        system->realizeModel(start);
        start.updQ()[0] = 1.5;
        BdfIntegrator integrator(*system);
        // Ground cannot move.
        if (hasJacobian) integrator.addForceJacobian(spring, {GroundIndex, MobilizedBodyIndex(1)});
        integrator.initialize(start);
        integrator.stepTo(1);
        EXPECT_NEAR(integrator.getState().getQ()[0], 1 + 0.5 * std::cos(3), 1e-3);
    }
    const auto other = makeOscillator();
    other->realizeTopology();
    Force spring;
    const auto system = makeOscillator(&spring);
    BdfIntegrator integrator(*other);
    integrator.addForceJacobian(spring);
    EXPECT_THROW(integrator.initialize(other->getDefaultState()), std::invalid_argument);
}

/** Stores a force's magnitude in a variable of the system's own subsystem. **/
class KeptElsewhere : public Force::Custom::Implementation {
public:
    explicit KeptElsewhere(const MobilizedBody& body) : m_body(body) {}
    void realizeTopology(State& state) const override {
        variable =
            state.allocateDiscreteVariable(SubsystemIndex(0), Stage::Dynamics, new Value<Real>(1));
    }
    void realizePosition(const State& state) const override {
        // Like a surface that ends.
        if (std::abs(m_body.getOneQ(state, 0)) > 0.1) throw std::domain_error("off the surface");
    }
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        m_body.applyOneMobilityForce(
            state, 0,
            Value<Real>::downcast(state.getDiscreteVariable(SubsystemIndex(0), variable)).get(),
            mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

    mutable DiscreteVariableIndex variable;

private:
    MobilizedBody m_body;
};

TEST(ForeignPrograms, VariablesAndCoordinatesAreOnlyThoseThatTheStateHas) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(), makeBody(1));
    auto* force = new KeptElsewhere(mass);
    Force::Custom(forces, force);
    State start = system.realizeTopology();
    system.realizeModel(start);
    Value<Real>::updDowncast(start.updDiscreteVariable(SubsystemIndex(0), force->variable)) = 5;
    BdfIntegrator integrator(system);
    integrator.initialize(start);
    integrator.stepTo(0.1);
    EXPECT_NEAR(mass.getOneQ(integrator.getState(), 0), 0.025, 1e-6);
}

/** Disables a rod when it would go into compression. **/
class LetGo : public TriggeredEventHandler {
public:
    explicit LetGo(const Constraint::Rod& rod)
        : TriggeredEventHandler(Stage::Acceleration), m_rod(rod) {
        getTriggerInfo().setTriggerOnRisingSignTransition(false);
    }
    Real getValue(const State& state) const override {
        return m_rod.isDisabled(state) ? -1 : m_rod.getRodTension(state);
    }
    void handleEvent(State& state, Real, bool&) const override {
        times.push_back(state.getTime());
        height = m_rod.getMobilizedBodyFromConstrainedBody(ConstrainedBodyIndex(1))
                     .getBodyOriginLocation(state)[1];
        m_rod.disable(state);
    }
    mutable std::vector<Real> times;
    mutable Real height = NaN;

private:
    Constraint::Rod m_rod;
};

TEST(ForeignPrograms, TriggersSeeReactions) {
    // A mass swings up on a rod that can only pull: with u² = 3.5 g L at the bottom it goes slack
    // at the height L/2 and continues in free flight.
    const Real g = 9.81, L = 0.8;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::UniformGravity(forces, matter, Vec3(0, -g, 0));
    MobilizedBody::Translation mass(matter.Ground(), makeBody(1));
    Constraint::Rod rod(matter.Ground(), mass, L);
    auto* letGo = new LetGo(rod);
    system.addEventHandler(letGo);
    State start = system.realizeTopology();
    mass.setQ(start, Vec3(0, -L, 0));
    mass.setU(start, Vec3(std::sqrt(3.5 * g * L), 0, 0));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-7);
    integrator.initialize(start);
    integrator.stepTo(0.7);
    ASSERT_EQ(letGo->times.size(), 1u);
    EXPECT_NEAR(letGo->height, 0.5 * L, 1e-4);
    // sin φ = 1/2 and u² = g L/2 there.
    const Real t = 0.7 - letGo->times[0], c = std::sqrt(0.75), speed = std::sqrt(0.5 * g * L);
    const Vec3 expected(L * c - 0.5 * speed * t, 0.5 * L + c * speed * t - 0.5 * g * t * t, 0);
    EXPECT_LT((mass.getBodyOriginLocation(integrator.getState()) - expected).norm(), 1e-3);
}

TEST(ForeignPrograms, WeightsOfTheStateStay) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::Translation mass(matter.Ground(), makeBody(1));
    const Constraint::Rod rod(matter.Ground(), mass, 1);
    State start = system.realizeTopology();
    mass.setQ(start, Vec3(1, 0, 0));
    system.realize(start, Stage::Instance);
    start.updUWeights() = Vector(3, Real(2));
    start.updQErrWeights() = Vector(1, Real(3));
    start.updUErrWeights() = Vector(1, Real(4));
    BdfIntegrator integrator(system);
    integrator.initialize(start);
    const State& state = integrator.getState();
    EXPECT_EQ(state.getUWeights()[0], 2);
    EXPECT_EQ(state.getQErrWeights()[0], 3);
    EXPECT_EQ(state.getUErrWeights()[0], 4);
}

/** Records times, and whether values in the State are available without a request. **/
struct Notes {
    std::vector<Real> reports, events, accelerations;
};

class NoteReport : public PeriodicEventReporter {
public:
    NoteReport(Notes& notes, Real interval) : PeriodicEventReporter(interval), m_notes(notes) {}
    void handleEvent(const State& state) const override {
        m_notes.reports.push_back(state.getTime());
    }

private:
    Notes& m_notes;
};

class NoteEvent : public PeriodicEventHandler {
public:
    NoteEvent(Notes& notes, const MobilizedBody& body, Real interval)
        : PeriodicEventHandler(interval), m_notes(notes), m_body(body) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_notes.events.push_back(state.getTime());
        m_notes.accelerations.push_back(m_body.getOneUDot(state, 0));
    }

private:
    Notes& m_notes;
    MobilizedBody m_body;
};

TEST(ForeignPrograms, ReportersSeeTheTimesOfHandlers) {
    Notes notes;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(), makeBody(1));
    Force::MobilityConstantForce(forces, mass, MobilizerUIndex(0), 3);
    system.addEventReporter(new NoteReport(notes, 0.1));  // 3·0.1 > 0.3
    system.addEventHandler(new NoteEvent(notes, mass, 0.3));
    const State start = system.realizeTopology();
    BdfIntegrator integrator(system);
    integrator.initialize(start);
    integrator.stepTo(1.25);
    ASSERT_EQ(notes.reports.size(), 13u);
    ASSERT_EQ(notes.events.size(), 5u);
    for (size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(notes.events[i], notes.reports[3 * i]);
        EXPECT_NEAR(notes.accelerations[i], 3, 1e-12);
    }
    for (size_t i = 0; i < 13; ++i) EXPECT_NEAR(notes.reports[i], 0.1 * Real(i), 1e-13);
}

}  // namespace
}  // namespace simflex
