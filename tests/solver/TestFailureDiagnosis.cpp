// Failure messages name the object, time, size and remedy.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

template <class F>
std::string messageOf(F f) {
    try {
        f();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

const MassProperties Stone(1, Vec3(0), Inertia(0.1, 0.2, 0.25));

struct Rigid {
    Rigid()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter) {}

    std::string initialize() {
        BdfIntegrator integrator(system);
        return messageOf([&] { integrator.initialize(system.realizeTopology()); });
    }
    std::string run(Real time) {
        BdfIntegrator integrator(system);
        return messageOf([&] {
            integrator.initialize(system.realizeTopology());
            integrator.stepTo(time);
        });
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
};

/** The same with a flexible boom on a ball joint. **/
struct Boom : Rigid {
    Boom() : body(flexible, makePointMassPart().body, "boom") {
        Joint::Ball(flexible, matter.Ground(), body.interface("A"), "hinge");
    }
    FlexibleBody body;
};

//---------------------------------------------------------------------------------------------------------
// constraints

TEST(FailureDiagnosis, TwoJointsThatContradictEachOtherAreBothNamed) {
    Rigid model;
    MobilizedBody::Free body(model.matter.Ground(), Body::Rigid(Stone));
    Joint::Pin(model.flexible, model.matter.Ground(), Attachment(body, Transform()), "left");
    Joint::Ball(model.flexible, Attachment(model.matter.Ground(), Transform(Vec3(0.3, 0, 0))),
                Attachment(body, Transform(Vec3(0.2, 0, 0))), "right");
    EXPECT_THAT(model.initialize(),
                AllOf(HasSubstr("cannot be assembled at t = 0 s"), HasSubstr("joint 'left'"),
                      HasSubstr("joint 'right'"), HasSubstr("keeps an error of 0.05"),
                      HasSubstr("contradict each other"), HasSubstr("Leave one")));
}

TEST(FailureDiagnosis, JointsOutOfReachOfEachOtherAreNotCalledContradictory) {
    Rigid model;
    MobilizedBody::Pin arm(model.matter.Ground(), Body::Rigid(Stone));
    Joint::Ball(model.flexible, Attachment(model.matter.Ground(), Transform(Vec3(5, 1, 0))),
                Attachment(arm, Transform(Vec3(1, 0, 0))), "far");
    EXPECT_THAT(model.initialize(),
                AllOf(HasSubstr("cannot be assembled"), HasSubstr("'far'"), HasSubstr("allowed")));
}

TEST(FailureDiagnosis, MotionsThatFightAreBothNamed) {
    Rigid model;
    MobilizedBody::Pin body(model.matter.Ground(), Body::Rigid(Stone));
    const auto drive = [&](const char* name, Real rate) {
        Joint::PrescribedRotation(
            model.flexible, model.matter.Ground(), Attachment(body, Transform()),
            [rate](Real t) { return Vec3(rate * t, rate, 0); }, name);
    };
    drive("fast", 3);
    drive("slow", 2);
    EXPECT_THAT(model.initialize(),
                AllOf(HasSubstr("no speeds satisfy the joints at t = 0 s"), HasSubstr("'fast'"),
                      HasSubstr("'slow'"), HasSubstr("keeps an error of 0.5"),
                      HasSubstr("contradict each other"), HasSubstr("Leave one of the motions")));
}

/** A crank of 1 m and a rod of 1.5 m to a slider that is driven along x. **/
struct PushedSlider : Rigid {
    PushedSlider() {
        Joint::Ball(flexible, Attachment(rod, Transform(Vec3(1.5, 0, 0))),
                    Attachment(slider, Transform()), "wrist");
        Joint::PrescribedTranslation(
            flexible, matter.Ground(), Attachment(slider, Transform()), XAxis,
            [](Real t) { return Vec3(2 + t, 1, 0); }, "push");
        state = system.realizeTopology();
        crank.setOneQ(state, 0, 0.8);
        rod.setOneQ(state, 0, -1.3);
        slider.setOneQ(state, 0, 2);
    }
    MobilizedBody::Pin crank{matter.Ground(), Body::Rigid(Stone)};
    MobilizedBody::Pin rod{crank, Transform(Vec3(1, 0, 0)), Body::Rigid(Stone), Transform()};
    MobilizedBody::Slider slider{matter.Ground(), Body::Rigid(Stone)};
    State state;
};

TEST(FailureDiagnosis, AMotionBeyondTheReachOfAMechanismIsASingularPosition) {
    PushedSlider model;
    for (const bool isAlpha : {false, true}) {
        BdfIntegrator bdf(model.system);
        GeneralizedAlphaIntegrator alpha(model.system);
        ImplicitIntegrator& integrator = isAlpha ? static_cast<ImplicitIntegrator&>(alpha) : bdf;
        integrator.initialize(model.state);
        EXPECT_THAT(messageOf([&] { integrator.stepTo(1); }),
                    AllOf(HasSubstr("no step could be taken from t = 0."),
                          ::testing::AnyOf(
                              HasSubstr("singular position, where the equations of joint 'wrist' "
                                        "and joint 'push' depend on each other"),
                              HasSubstr("singular position: equation 1 of 'push' follows from "
                                        "'wrist'")),
                          HasSubstr("Start beside it"), HasSubstr("keep motions within reach"),
                          HasSubstr("last good State")));
        // The links are collinear at x = 2.5.
        EXPECT_NEAR(integrator.getTime(), 0.5, 1e-3);
    }
}

TEST(FailureDiagnosis, SpeedsThatCannotBeProjectedAreCalledSpeeds) {
    // A single long step through which the mechanism nearly straightens.
    PushedSlider model;
    BdfIntegrator integrator(model.system);
    integrator.setFixedStep(0.25);
    integrator.initialize(model.state);
    EXPECT_THAT(
        messageOf([&] { integrator.stepTo(0.25); }),
        AllOf(HasSubstr("no step could be taken from t = 0 s (h = 0.25 s): the speeds cannot be "
                        "brought onto the joints: joint 'wrist' keeps an error of"),
              HasSubstr("m/s or rad/s"), HasSubstr("allow shorter steps"),
              Not(HasSubstr("setConstraintTolerance"))));
}

TEST(FailureDiagnosis, AMotionThatJumpsIsNamedWithTimeAndSize) {
    Rigid model;
    MobilizedBody::Pin body(model.matter.Ground(), Body::Rigid(Stone));
    Joint::PrescribedRotation(
        model.flexible, model.matter.Ground(), Attachment(body, Transform()),
        [](Real t) { return Vec3(t < 0.25 ? 0.1 : 0.5, 0, 0); }, "drive");
    EXPECT_THAT(model.run(1),
                AllOf(HasSubstr("no step could be taken from t = 0.2"),
                      HasSubstr("motion 'drive' jumps by 0."), HasSubstr("change smoothly")));
}

//---------------------------------------------------------------------------------------------------------
// forces

/** A Simbody force element: f along y on a body. **/
class Custom : public Force::Custom::Implementation {
public:
    Custom(const MobilizedBody& body, std::function<Real(const State&)> f)
        : m_body(body), m_f(std::move(f)) {}
    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        m_body.applyBodyForce(state, SpatialVec(Vec3(0), Vec3(0, m_f(state), 0)), bodyForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_body;
    std::function<Real(const State&)> m_f;
};

TEST(FailureDiagnosis, NaNFromAUsersForceNamesTheForceAndTheBody) {
    Rigid model;
    MobilizedBody::Free body(model.matter.Ground(), Body::Rigid(Stone));
    Force::MobilityLinearSpring(model.forces, body, MobilizerQIndex(4), 10, 0);
    Force::Custom(model.forces, new Custom(body, [](const State& state) {
                      return state.getTime() < 0.1 ? 0. : std::sqrt(0.1 - state.getTime());
                  }));
    EXPECT_THAT(model.run(1), AllOf(HasSubstr("no step could be taken from t = 0."),
                                    HasSubstr("rigid tree at body 1"), HasSubstr("not finite"),
                                    HasSubstr("force element 2 is not at t = 0.1"),
                                    HasSubstr("return finite numbers")));
}

TEST(FailureDiagnosis, NaNFromALoadNamesWhereItActs) {
    Boom model;
    AttachmentForce(model.flexible, model.body.interface("B"),
                    [](Real t) { return SpatialVec(Vec3(0), Vec3(0, t > 0.01 ? NaN : 1, 0)); });
    EXPECT_THAT(model.run(1),
                AllOf(HasSubstr("'boom' are not finite"), HasSubstr("the load on 'boom.B' is not"),
                      HasSubstr("return finite numbers")));
}

TEST(FailureDiagnosis, NaNAtTheStartIsRefusedBeforeTheFirstStep) {
    Boom model;
    AttachmentForce(model.flexible, model.body.interface("B"),
                    [](Real) { return SpatialVec(Vec3(0), Vec3(NaN, 0, 0)); });
    EXPECT_THAT(model.initialize(), AllOf(HasSubstr("'boom' are not finite"),
                                          HasSubstr("the load on 'boom.B' is not at t = 0 s")));
}

TEST(FailureDiagnosis, AMotionThatTurnsNaNNamesItsJoint) {
    Rigid model;
    MobilizedBody::Pin body(model.matter.Ground(), Body::Rigid(Stone));
    Joint::PrescribedRotation(
        model.flexible, model.matter.Ground(), Attachment(body, Transform()),
        [](Real t) { return Vec3(t < 0.1 ? 0. : NaN, 0, 0); }, "drive");
    EXPECT_THAT(model.run(1),
                AllOf(HasSubstr("not finite"), HasSubstr("the motion 'drive' is not at t = 0.1")));
}

TEST(FailureDiagnosis, AForceTooStiffForTheIterationIsNamedWithWhatToDo) {
    Rigid model;
    MobilizedBody::Slider body(model.matter.Ground(), Body::Rigid(Stone));
    // Without its stiffness in the Newton matrix, a step of 1 ms cannot converge.
    Force::TwoPointLinearSpring(model.forces, model.matter.Ground(), Vec3(-1, 0, 0), body, Vec3(0),
                                1e9, 1);
    State state = model.system.realizeTopology();
    body.setOneQ(state, 0, 0.1);
    BdfIntegrator integrator(model.system);
    integrator.setBlockForm(BdfIntegrator::BlockForm::Arrow);
    integrator.setMinimumStepSize(1e-3);
    integrator.setInitialStepSize(1e-3);
    integrator.initialize(state);
    EXPECT_THAT(
        messageOf([&] { integrator.stepTo(1); }),
        AllOf(HasSubstr("Newton's iteration does not converge"), HasSubstr("rigid tree at body 1"),
              HasSubstr("force element 1, 1e+08 N"), HasSubstr("addForceJacobian()")));
}

TEST(FailureDiagnosis, AnErrorThatStaysTooLargeNamesTheModeOrCoordinate) {
    Boom model;
    AttachmentForce(model.flexible, model.body.interface("B"), [](Real t) {
        return SpatialVec(Vec3(0), Vec3(0, 0, t > 0.01 ? 5e3 * std::sin(1e7 * t) : 0));
    });
    BdfIntegrator integrator(model.system);
    integrator.setMinimumStepSize(1e-4);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_THAT(
        messageOf([&] { integrator.stepTo(0.1); }),
        AllOf(HasSubstr("the error test keeps failing"), HasSubstr("allowed 1e-06"),
              HasSubstr("of 'boom'"), HasSubstr("jumps or is noisy"), HasSubstr("setAccuracy()")));
}

//---------------------------------------------------------------------------------------------------------
// masses

/** ż jumps from 0 to 1e9 at 0.01 s and has no effect. **/
class Burst : public Force::Custom::Implementation {
public:
    explicit Burst(const Subsystem& subsystem) : m_subsystem(subsystem) {}
    void realizeTopology(State& state) const override {
        m_z = m_subsystem.allocateZ(state, Vector(1, Real(0)));
    }
    void realizeAcceleration(const State& state) const override {
        m_subsystem.updZDot(state)[m_z] = state.getTime() > 0.01 ? 1e9 : 0;
    }
    void calcForce(const State&, Vector_<SpatialVec>&, Vector_<Vec3>&, Vector&) const override {}
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const Subsystem& m_subsystem;
    mutable ZIndex m_z;
};

TEST(FailureDiagnosis, AnErrorOfAnAuxiliaryVariableIsNotPutOnACoordinate) {
    Rigid model;
    MobilizedBody::Pin(model.matter.Ground(), Body::Rigid(Stone));
    Force::Custom(model.forces, new Burst(model.forces));
    BdfIntegrator integrator(model.system);
    integrator.setMinimumStepSize(1e-4);
    integrator.initialize(model.system.realizeTopology());
    EXPECT_THAT(
        messageOf([&] { integrator.stepTo(0.1); }),
        AllOf(HasSubstr("most of it in variable z[0] of '"), HasSubstr("jumps or is noisy")));
}

TEST(FailureDiagnosis, AMasslessBodyInATreeIsNamed) {
    Rigid model;
    MobilizedBody::Pin first(model.matter.Ground(), Body::Rigid(Stone));
    MobilizedBody::Slider second(first, Transform(Vec3(1, 0, 0)), Body::Massless(), Transform());
    EXPECT_THAT(model.initialize(), AllOf(HasSubstr("rigid tree at body 1"), HasSubstr("singular"),
                                          HasSubstr("speed 1 of 1 of mobilized body 2"),
                                          HasSubstr("no mass"), HasSubstr("weld it")));
}

/** Neither body of a pair of opposed slides is massless by itself: the second can cancel the motion
of the first. **/
TEST(FailureDiagnosis, ASpeedThatUndoesAnotherIsNamed) {
    Rigid model;
    MobilizedBody::Pin first(model.matter.Ground(), Body::Rigid(Stone));
    MobilizedBody::Slider there(first, Transform(Vec3(1, 0, 0)), Body::Massless(), Transform());
    const Rotation turned(Pi, ZAxis);
    MobilizedBody::Slider back(there, Transform(turned), Body::Rigid(Stone), Transform(turned));
    EXPECT_THAT(model.initialize(), AllOf(HasSubstr("rigid tree at body 1"), HasSubstr("singular"),
                                          HasSubstr("speed 1 of 1 of mobilized body 3")));
}

TEST(FailureDiagnosis, APointMassThatMayTurnIsNamed) {
    Rigid model;
    MobilizedBody::Ball ball(model.matter.Ground(),
                             Body::Rigid(MassProperties(1, Vec3(0), Inertia(0))));
    EXPECT_THAT(model.initialize(), AllOf(HasSubstr("singular"), HasSubstr("of mobilized body 1"),
                                          HasSubstr("no mass or inertia")));
}

}  // namespace
}  // namespace simflex::test
