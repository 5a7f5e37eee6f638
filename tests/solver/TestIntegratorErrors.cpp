// Impossible requests are refused by name, and the last State is kept.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
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
