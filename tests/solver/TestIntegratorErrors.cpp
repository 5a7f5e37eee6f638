// What cannot be done is refused by name, and what was reached is kept.

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
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

/** Message of the exception that f throws; empty if none. **/
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
    // The last good State is the one just before the load broke.
    EXPECT_NEAR(integrator.getTime(), 0.01, 1e-4);
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
