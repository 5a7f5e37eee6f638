// Impossible requests are refused by name, and the last State is kept.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/TimeStepper.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

struct Model {
    Model()
        : matter(system),
          flexible(system, matter),
          body(flexible, test::makePointMassPart().body, "boom") {}
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    FlexibleBodySubsystem flexible;
    FlexibleBody body;
};

/** Returns the message of the exception that f throws; empty if none. **/
template <class F>
std::string messageOf(F f) {
    try {
        f();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

void expectContains(const std::string& message, std::initializer_list<const char*> words) {
    for (const char* word : words)
        EXPECT_NE(message.find(word), std::string::npos) << "'" << word << "' in: " << message;
}

TEST(IntegratorErrors, JointsThatCannotMeetNameTheJointAndItsError) {
    Model model;
    Joint::Ball(model.flexible, model.matter.Ground(), model.body.interface("A"), "left");
    Joint::Ball(model.flexible, Attachment(model.matter.Ground(), Transform(Vec3(50, 0, 0))),
                model.body.interface("A"), "far away");
    State state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    expectContains(messageOf([&] { integrator.initialize(state); }),
                   {"cannot be assembled", "error of", "allowed"});
    EXPECT_THROW(integrator.stepTo(1), std::logic_error);
}

TEST(IntegratorErrors, UnsupportedParts) {
    {
        Model model;
        MobilizedBody frame =
            model.matter.updMobilizedBody(model.body.getFrame().getMobilizedBodyIndex());
        MobilizedBody::Pin onFrame(frame, Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
        const State state = model.system.realizeTopology();
        BdfIntegrator integrator(model.system);
        expectContains(messageOf([&] { integrator.initialize(state); }),
                       {"mobilized body", "frame of flexible body 'boom'"});
    }
}

TEST(IntegratorErrors, BadSettingsAreRefused) {
    Model model;
    BdfIntegrator integrator(model.system);
    EXPECT_THROW(integrator.setAccuracy(0), std::invalid_argument);
    EXPECT_THROW(integrator.setAccuracy(NaN), std::invalid_argument);
    EXPECT_THROW(integrator.setMaximumOrder(6), std::invalid_argument);
    EXPECT_THROW(integrator.setNumThreads(0), std::invalid_argument);
    integrator.setMaximumStepSize(1e-6);
    integrator.setMinimumStepSize(1e-3);
    expectContains(messageOf([&] { integrator.initialize(model.system.realizeTopology()); }),
                   {"setMaximumStepSize", "setMinimumStepSize"});
    EXPECT_THROW(integrator.getState(), std::logic_error);
    const State state;
    EXPECT_THROW(integrator.initialize(state), std::invalid_argument);
}

TEST(IntegratorErrors, SettingsOfARunThatHasBegunAreRefused) {
    Model model;
    BdfIntegrator bdf(model.system);
    GeneralizedAlphaIntegrator alpha(model.system);
    const State state = model.system.realizeTopology();
    bdf.initialize(state);
    alpha.initialize(state);
    ImplicitIntegrator& any = bdf;
    const auto refuses = [](const char* setting, const std::function<void()>& set) {
        expectContains(messageOf(set), {setting, "initialize"});
    };
    refuses("setFormulation", [&] { any.setFormulation(ImplicitIntegrator::Formulation::Index3); });
    refuses("setNewtonTolerances", [&] { any.setNewtonTolerances({}); });
    refuses("addForceJacobian",
            [&] { any.addForceJacobian({model.body.getFrame().getMobilizedBodyIndex()}); });
    refuses("addBreakTimes", [&] { any.addBreakTimes(std::vector<Real>{0.5}); });
    refuses("addBreakTimes", [&] { any.addBreakTimes([](Real t) { return t + 1; }); });
    refuses("setTriggerSamples", [&] { any.setTriggerSamples(2); });
    refuses("setProjectInitialState", [&] { any.setProjectInitialState(false); });
    refuses("setMaximumOrder", [&] { bdf.setMaximumOrder(3); });
    refuses("setFixedOrder", [&] { bdf.setFixedOrder(3); });
    refuses("setSpectralRadius", [&] { alpha.setSpectralRadius(0.5); });
}

TEST(IntegratorErrors, ALoadThatTurnsNaNStopsTheRunAndKeepsTheLastGoodState) {
    Model model;
    Joint::Ball(model.flexible, model.matter.Ground(), model.body.interface("A"), "hinge");
    AttachmentForce(model.flexible, model.body.interface("B"),
                    [](Real t) { return SpatialVec(Vec3(0), Vec3(0, t > 0.01 ? NaN : 1, 0)); });
    const State state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(0.005);
    expectContains(messageOf([&] { integrator.stepTo(0.1); }),
                   {"no step could be taken", "t = 0.0", "boom", "not finite"});
    EXPECT_TRUE(integrator.getState().getQ().normInf() < Infinity);
    // The last good State is just before the load failed.
    EXPECT_NEAR(integrator.getTime(), 0.01, 1e-4);
}

TEST(IntegratorErrors, AnIntegratorThatWasMovedFromSaysSo) {
    Model model;
    const State state = model.system.realizeTopology();
    BdfIntegrator before(model.system), after(std::move(before));
    for (const std::function<void()>& use : std::vector<std::function<void()>>{
             [&] { before.initialize(state); }, [&] { before.stepTo(1); },
             [&] { before.setAccuracy(1e-3); }, [&] { before.setMaximumOrder(3); },
             [&] { before.getState(); }, [&] { before.getNumStepsTaken(); },
             [&] { simflex::TimeStepper(model.system, before).initialize(state); }}) {
        expectContains(messageOf(use), {"moved from"});
        EXPECT_THROW(use(), std::logic_error);
    }
    after.initialize(state);
}

TEST(IntegratorErrors, AReporterThatStepsIsRefused) {
    struct Reporter : PeriodicEventReporter {
        explicit Reporter(std::function<void()> report)
            : PeriodicEventReporter(0.03), m_report(std::move(report)) {}
        void handleEvent(const State&) const override { m_report(); }
        std::function<void()> m_report;
    };
    Model model;
    std::unique_ptr<BdfIntegrator> integrator;
    std::function<void()> misuse;
    model.system.addEventReporter(new Reporter([&] { misuse(); }));
    const State state = model.system.realizeTopology();
    for (const std::function<void()>& what : std::vector<std::function<void()>>{
             [&] { integrator->stepTo(0.2); }, [&] { integrator->stepOnce(); },
             [&] { integrator->stepTo(0.2, Infinity); }, [&] { integrator->initialize(state); },
             [&] { integrator->handle([](State&) { return false; }); }}) {
        integrator = std::make_unique<BdfIntegrator>(model.system);
        integrator->initialize(state);
        misuse = what;
        expectContains(messageOf([&] { integrator->stepTo(0.1); }), {"by a reporter", "stepTo"});
        // The error is in the reporter, not in the run.
        misuse = [] {};
        integrator->stepTo(0.1);
        EXPECT_EQ(integrator->getTime(), 0.1);
    }
}

/** A falling stone whose force, reporter, handler and subsystem call `use` with their names. **/
struct CallingStone {
    using Use = std::function<void(const std::string& caller, Real time)>;
    class Weight : public Force::Custom::Implementation {
    public:
        explicit Weight(const CallingStone& model) : m_model(model) {}
        void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                       Vector& mobilityForces) const override {
            m_model.stone.applyOneMobilityForce(state, 0, -9.81, mobilityForces);
            m_model.call("force", state.getTime());
        }
        Real calcPotentialEnergy(const State&) const override { return 0; }

    private:
        const CallingStone& m_model;
    };
    struct Reporter : PeriodicEventReporter {
        explicit Reporter(const CallingStone& m) : PeriodicEventReporter(0.03), model(m) {}
        void handleEvent(const State& state) const override {
            model.call("reporter", state.getTime());
        }
        const CallingStone& model;
    };
    struct Handler : PeriodicEventHandler {
        explicit Handler(const CallingStone& m) : PeriodicEventHandler(0.04), model(m) {}
        void handleEvent(State& state, Real, bool&) const override {
            model.call("handler", state.getTime());
        }
        const CallingStone& model;
    };
    class Guts : public Subsystem::Guts {
    public:
        explicit Guts(const CallingStone& model) : Subsystem::Guts("Caller"), m_model(model) {}
        Guts* cloneImpl() const override { return new Guts(m_model); }
        void handleEventsImpl(State& state, Event::Cause cause, const Array_<EventId>&,
                              const HandleEventsOptions&, HandleEventsResults&) const override {
            if (cause == Event::Cause::Initialization)
                m_model.call("initialization", state.getTime());
        }

    private:
        const CallingStone& m_model;
    };

    CallingStone() {
        Force::Custom(forces, new Weight(*this));
        system.addEventReporter(new Reporter(*this));
        system.addEventHandler(new Handler(*this));
        subsystem.adoptSubsystemGuts(new Guts(*this));
        system.adoptSubsystem(subsystem);
        start = system.realizeTopology();
        integrator = std::make_unique<BdfIntegrator>(system);
        integrator->setStepObserver([this](Real time) {
            call("observer", time);
            return true;
        });
    }
    void call(const char* caller, Real time) const {
        if (use) use(caller, time);
    }
    std::vector<Real> run() {
        integrator->initialize(start);
        integrator->stepTo(0.1);
        return {stone.getOneQ(integrator->getState(), 0), stone.getOneU(integrator->getState(), 0),
                integrator->getTime(), Real(integrator->getNumStepsTaken()),
                Real(integrator->getNumIterations())};
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody::Slider stone{matter.Ground(),
                                Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))};
    Subsystem subsystem;
    State start;
    std::unique_ptr<BdfIntegrator> integrator;
    Use use;
};

/** Calls a method once from within an integration, which is to go on as if it had not. **/
void expectRefusedWithin(const char* caller, const char* method,
                         const std::function<void(CallingStone&)>& misuse,
                         std::initializer_list<const char*> words) {
    SCOPED_TRACE(std::string(method) + " by " + caller);
    CallingStone undisturbed, model;
    std::string message;
    bool isDone = false;
    model.use = [&](const std::string& from, Real time) {
        if (isDone || from != caller || (from != "initialization" && time < 0.02)) return;
        isDone = true;
        message = messageOf([&] { misuse(model); });
    };
    EXPECT_EQ(model.run(), undisturbed.run());
    EXPECT_TRUE(isDone);
    expectContains(message, {method});
    expectContains(message, words);
}

TEST(IntegratorErrors, NothingChangesAnIntegrationFromWithin) {
    struct Misuse {
        const char* method;
        std::function<void(CallingStone&)> call;
    };
    std::stringstream checkpoint;
    for (const char* caller : {"initialization", "reporter", "handler", "observer", "force"})
        for (const Misuse& misuse : std::vector<Misuse>{
                 {"initialize", [](CallingStone& m) { m.integrator->initialize(m.start); }},
                 {"initialize",
                  [](CallingStone& m) { m.integrator->initialize(Array_<State>(1, m.start)); }},
                 {"stepTo", [](CallingStone& m) { m.integrator->stepTo(0.2); }},
                 {"stepTo", [](CallingStone& m) { m.integrator->stepTo(0.2, Infinity); }},
                 {"stepTo",
                  [](CallingStone& m) {
                      simflex::TimeStepper(m.system, *m.integrator).stepTo(0.2);
                  }},
                 {"stepOnce", [](CallingStone& m) { m.integrator->stepOnce(); }},
                 {"stepBy", [](CallingStone& m) { m.integrator->stepBy(0.1); }},
                 {"reinitialize",
                  [](CallingStone& m) { m.integrator->reinitialize(Stage::Report, true); }},
                 {"handle",
                  [](CallingStone& m) { m.integrator->handle([](State&) { return true; }); }},
                 {"updAdvancedState", [](CallingStone& m) { m.integrator->updAdvancedState(); }},
                 {"writeCheckpoint",
                  [&](CallingStone& m) { m.integrator->writeCheckpoint(checkpoint); }},
                 {"readCheckpoint",
                  [&](CallingStone& m) { m.integrator->readCheckpoint(checkpoint, m.start); }}})
            expectRefusedWithin(caller, misuse.method, misuse.call,
                                {"by a reporter, handler, observer or force", "between calls"});
}

TEST(IntegratorErrors, SettingsOfARunAreRefusedWhileItBegins) {
    for (const auto& [method, set] :
         std::vector<std::pair<const char*, std::function<void(BdfIntegrator&)>>>{
             {"setMaximumOrder", [](BdfIntegrator& i) { i.setMaximumOrder(3); }},
             {"setTriggerSamples", [](BdfIntegrator& i) { i.setTriggerSamples(3); }},
             {"addBreakTimes", [](BdfIntegrator& i) { i.addBreakTimes({0.01}); }}})
        for (const char* caller : {"initialization", "reporter"})
            expectRefusedWithin(caller, method,
                                [&set = set](CallingStone& m) { set(*m.integrator); },
                                {"an integration keeps the settings it began with"});
}

TEST(IntegratorErrors, AForceMayNotAskForWhatItsEvaluationWouldDisturb) {
    for (const auto& [method, ask] :
         std::vector<std::pair<const char*, std::function<void(BdfIntegrator&)>>>{
             {"getUDot", [](BdfIntegrator& i) { i.getUDot(); }},
             {"getMultipliers", [](BdfIntegrator& i) { i.getMultipliers(); }},
             {"getAdvancedState", [](BdfIntegrator& i) { i.getAdvancedState(); }},
             {"showAdvancedState", [](BdfIntegrator& i) { i.showAdvancedState(); }},
             {"setFinalTime", [](BdfIntegrator& i) { i.setFinalTime(0.05); }}})
        expectRefusedWithin("force", method, [&ask = ask](CallingStone& m) { ask(*m.integrator); },
                            {"by a force", "between calls"});
}

TEST(IntegratorErrors, AValueOfTheStateThatIsNotANumberIsNamed) {
    Model model;
    MobilizedBody::Ball ball(model.matter.Ground(),
                             Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    const State good = model.system.realizeTopology();
    const int q = int(ball.getFirstQIndex(good)), u = int(ball.getFirstUIndex(good));
    const auto refuse = [&](const std::function<void(State&)>& spoil,
                            std::initializer_list<const char*> words) {
        State state = good;
        spoil(state);
        BdfIntegrator integrator(model.system);
        const std::string message = messageOf([&] { integrator.initialize(state); });
        expectContains(message, words);
        expectContains(message, {"initialize()", "in the State"});
    };
    refuse([](State& state) { state.setTime(NaN); }, {"the time is not a number"});
    refuse([&](State& state) { state.updQ()[q + 2] = NaN; }, {"coordinate 2 of mobilized body"});
    refuse([&](State& state) { state.updU()[u] = Infinity; }, {"speed 0 of", "infinite"});
    refuse([](State& state) { state.updQ()[3] = NaN; }, {"coordinate 3 of", "boom"});
}

TEST(IntegratorErrors, AMasslessRigidBodyIsNamed) {
    Model model;
    MobilizedBody::Slider slider(model.matter.Ground(), Body::Massless());
    const State state = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    expectContains(messageOf([&] { integrator.initialize(state); }),
                   {"singular", "rigid tree", "mass"});
}

}  // namespace
}  // namespace simflex
