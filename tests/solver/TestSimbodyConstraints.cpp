// Simbody's own constraints inside BdfIntegrator: accelerations, multipliers and motion match
// Simbody's.

#include <gtest/gtest.h>

#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

Body::Rigid makeBrick(Real mass) {
    return Body::Rigid(
        MassProperties(mass, Vec3(0.05, -0.02, 0.03),
                       Inertia(mass * Vec3(0.02, 0.03, 0.025), mass * Vec3(1e-3, -2e-3, 5e-4))));
}

/** Rigid trees side by side: an arm with two forearms, a free box, a cart and a wheel. **/
struct Rigid {
    Rigid()
        : matter(system),
          forces(system),
          gravity(forces, matter, Vec3(1, -9.81, 2)),
          arm(matter.Ground(), Transform(Rotation(0.3, XAxis), Vec3(0)), makeBrick(1),
              Transform(Vec3(0, 0.3, 0))),
          fore(arm, Transform(Vec3(0.1, -0.3, 0)), makeBrick(0.7), Transform(Vec3(0, 0.2, 0))),
          other(arm, Transform(Vec3(-0.1, -0.3, 0.1)), makeBrick(0.5),
                Transform(Vec3(0, 0.2, 0.05))),
          box(matter.Ground(), Transform(Rotation(0.2, YAxis)), makeBrick(1.5),
              Transform(Vec3(0.1, 0, 0))),
          cart(matter.Ground(), Transform(Vec3(0, -0.2, 0.4)), makeBrick(0.8), Transform()),
          wheel(matter.Ground(), Transform(Vec3(-0.5, 0.1, 0)), makeBrick(0.6), Transform()) {}

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Pin arm;
    MobilizedBody::Ball fore;
    MobilizedBody::Universal other;
    MobilizedBody::Free box;
    MobilizedBody::Slider cart;
    MobilizedBody::Pin wheel;
};

struct Case {
    const char* name;
    std::function<Constraint(Rigid&)> add;
};

std::vector<Case> makeCases() {
    return {
        {"Rod",
         [](Rigid& r) {
             return Constraint::Rod(r.fore, Vec3(0, -0.1, 0), r.box, Vec3(-0.1, 0, 0.1), 0.5);
         }},
        {"RodWithinATree",
         [](Rigid& r) {
             return Constraint::Rod(r.fore, Vec3(0, -0.1, 0), r.other, Vec3(-0.1, 0, 0.1), 0.35);
         }},
        {"Ball",
         [](Rigid& r) {
             return Constraint::Ball(r.fore, Vec3(0, -0.2, 0), r.box, Vec3(-0.2, 0, 0));
         }},
        {"BallToGround",
         [](Rigid& r) {
             return Constraint::Ball(r.matter.Ground(), Vec3(0.5, 0.1, 0), r.box,
                                     Vec3(-0.2, 0, 0.1));
         }},
        {"Weld",
         [](Rigid& r) {
             return Constraint::Weld(r.cart, Transform(Vec3(0.3, 0.1, 0)), r.box,
                                     Transform(Vec3(-0.2, 0, 0.1)));
         }},
        {"PointInPlane",
         [](Rigid& r) {
             return Constraint::PointInPlane(r.fore, UnitVec3(1, 2, 0.3), 0.2, r.box,
                                             Vec3(-0.2, 0, 0));
         }},
        {"PointOnLine",
         [](Rigid& r) {
             return Constraint::PointOnLine(r.cart, UnitVec3(1, 2, 0.3), Vec3(0.1, 0, 0), r.box,
                                            Vec3(-0.2, 0, 0));
         }},
        {"ConstantAngle",
         [](Rigid& r) {
             return Constraint::ConstantAngle(r.fore, UnitVec3(1, 0.2, 0), r.box,
                                              UnitVec3(0, 1, 0.4), 1.2);
         }},
        {"ConstantOrientation",
         [](Rigid& r) {
             return Constraint::ConstantOrientation(r.wheel, Rotation(), r.box,
                                                    Rotation(0.1, XAxis));
         }},
        // Rack and pinion: Simbody's ȧ is the derivative of its v only if the contact point is
        // stationary on the bodies' line of centres.
        {"NoSlip1D",
         [](Rigid& r) {
             return Constraint::NoSlip1D(r.matter.Ground(), Vec3(-0.5, -0.1, 0), UnitVec3(1, 0, 0),
                                         r.cart, r.wheel);
         }},
        {"ConstantCoordinate",
         [](Rigid& r) { return Constraint::ConstantCoordinate(r.other, MobilizerQIndex(1), 0.1); }},
        {"ConstantSpeed",
         [](Rigid& r) { return Constraint::ConstantSpeed(r.fore, MobilizerUIndex(2), 2); }},
        {"ConstantAcceleration",
         [](Rigid& r) { return Constraint::ConstantAcceleration(r.arm, MobilizerUIndex(0), 3); }},
        {"CoordinateCoupler",
         [](Rigid& r) {
             return Constraint::CoordinateCoupler(
                 r.matter, new Function::Linear(Vector(Vec4(1, -2, 0.5, -0.1))),
                 Array_<MobilizedBodyIndex>{r.arm, r.wheel, r.cart},
                 Array_<MobilizerQIndex>(3, MobilizerQIndex(0)));
         }},
        {"SpeedCoupler",
         [](Rigid& r) {
             return Constraint::SpeedCoupler(
                 r.matter, new Function::Linear(Vector(Vec4(1, -2, 0.5, -0.1))),
                 Array_<MobilizedBodyIndex>{r.arm, r.wheel, r.fore},
                 Array_<MobilizerUIndex>{MobilizerUIndex(0), MobilizerUIndex(0),
                                         MobilizerUIndex(1)});
         }},
        {"PrescribedMotion",
         [](Rigid& r) {
             return Constraint::PrescribedMotion(r.matter, new Function::Sinusoid(0.4, 5, 0.3),
                                                 r.arm, MobilizerQIndex(0));
         }},
        {"PointOnPlaneContact",
         [](Rigid& r) {
             return Constraint::PointOnPlaneContact(r.cart, Transform(Rotation(0.3, XAxis)), r.box,
                                                    Vec3(-0.2, 0, 0));
         }},
        {"RollingSphereOnPlane",
         [](Rigid& r) {
             return Constraint::SphereOnPlaneContact(
                 r.matter.Ground(), Transform(Rotation(-Pi / 2, XAxis), Vec3(0, -0.3, 0)), r.box,
                 Vec3(0.02, 0, 0), 0.2, true);
         }},
        {"RollingSphereOnSphere",
         [](Rigid& r) {
             return Constraint::SphereOnSphereContact(r.cart, Vec3(0), 0.2, r.box, Vec3(0.02, 0, 0),
                                                      0.25, true);
         }},
    };
}

class SimbodyConstraints : public testing::TestWithParam<Case> {};

State makeState(Rigid& rigid) {
    State state = rigid.system.realizeTopology();
    rigid.system.realizeModel(state);
    for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.4 * std::cos(1.7 * i);
    rigid.box.setQToFitTransform(state, Transform(Rotation(0.2, ZAxis), Vec3(0.5, -0.2, 0.2)));
    rigid.arm.setOneQ(state, 0, 0.2);
    rigid.system.project(state, 1e-13);
    return state;
}

TEST_P(SimbodyConstraints, AccelerationsAndMultipliersAreSimbodys) {
    Rigid rigid;
    const Constraint constraint = GetParam().add(rigid);
    const State state = makeState(rigid);
    BdfIntegrator integrator(rigid.system);
    integrator.setConstraintTolerance(1e-12);
    integrator.initialize(state);

    State start = integrator.getState();
    rigid.system.realize(start, Stage::Acceleration);
    EXPECT_LT((start.getQ() - state.getQ()).normInf(), 1e-11);
    EXPECT_LT((start.getU() - state.getU()).normInf(), 1e-11);
    EXPECT_LT((integrator.getUDot() - start.getUDot()).normInf(),
              1e-10 * (1 + start.getUDot().normInf()));
    const Vector expected = constraint.getMultipliersAsVector(start);
    const Vector multipliers = integrator.getMultipliers(constraint);
    ASSERT_EQ(multipliers.size(), expected.size());
    EXPECT_GT(multipliers.normInf(), 1e-3);
    EXPECT_LT((multipliers - expected).normInf(), 1e-10 * (1 + expected.normInf()));
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 0);
}

TEST_P(SimbodyConstraints, MotionIsSimbodysAndEnergyIsConserved) {
    Rigid rigid;
    const Constraint constraint = GetParam().add(rigid);
    const State state = makeState(rigid);
    RungeKuttaMersonIntegrator reference(rigid.system);
    reference.setAccuracy(1e-9);
    reference.setConstraintTolerance(1e-11);
    TimeStepper stepper(rigid.system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.25);

    BdfIntegrator integrator(rigid.system);
    integrator.setAccuracy(1e-8);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    State ours = integrator.getState();
    rigid.system.realize(ours, Stage::Dynamics);
    const Real energy = rigid.system.calcEnergy(ours);
    const Real kineticEnergy = rigid.system.calcKineticEnergy(ours);
    integrator.stepTo(0.25);
    ours = integrator.getState();
    State theirs = stepper.getState();
    rigid.system.realize(ours, Stage::Dynamics);
    rigid.system.realize(theirs, Stage::Velocity);
    for (MobilizedBodyIndex i(1); i < rigid.matter.getNumBodies(); ++i) {
        const MobilizedBody& body = rigid.matter.getMobilizedBody(i);
        const Transform a = body.getBodyTransform(ours), b = body.getBodyTransform(theirs);
        EXPECT_LT((a.p() - b.p()).norm(), 2e-6) << "body " << int(i);
        EXPECT_LT((a.R().asMat33() - b.R().asMat33()).norm(), 2e-5) << "body " << int(i);
    }
    EXPECT_LT(ours.getQErr().normInf(), 1e-9);
    EXPECT_NEAR(rigid.system.calcEnergy(ours) - integrator.getWork(), energy,
                2e-5 * (1 + kineticEnergy));
}

INSTANTIATE_TEST_SUITE_P(All, SimbodyConstraints, testing::ValuesIn(makeCases()),
                         [](const testing::TestParamInfo<Case>& test) {
                             return std::string(test.param.name);
                         });

TEST(SimbodyConstraint, ABoxOnARodSwingsAsAPendulum) {
    // A point mass on a rod of length l, released at 90°: its speed at the bottom is √(2 g l).
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    const Real length = 0.7;
    MobilizedBody::Translation mass(matter.Ground(), Transform(),
                                    Body::Rigid(MassProperties(2, Vec3(0), UnitInertia(1))),
                                    Transform());
    const Constraint::Rod rod(matter.Ground(), mass, length);
    State state = system.realizeTopology();
    mass.setQToFitTranslation(state, Vec3(length, 0, 0));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    // A quarter of the period at 90° amplitude: K(sin² 45°)·√(l/g).
    const Real quarter = 1.8540746773013719 * std::sqrt(length / 9.81);
    integrator.stepTo(quarter);
    const State& now = integrator.getState();
    EXPECT_NEAR(mass.getBodyOriginLocation(now)[0], 0, 1e-6);
    EXPECT_NEAR(mass.getBodyOriginVelocity(now).norm(), std::sqrt(2 * 9.81 * length), 1e-6);
    EXPECT_NEAR(integrator.getWork(), 0, 1e-9);
}

TEST(SimbodyConstraint, APlanarFourBarLoopClosedByAWeldIsSolvedInTheLeastSquaresSense) {
    // Three pins and a Weld: a planar loop with one degree of freedom and 6 rows, 3 of them
    // redundant.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    const Body::Rigid link(MassProperties(1, Vec3(0), Inertia(0.02, 0.001, 0.02)));
    MobilizedBody::Pin crank(matter.Ground(), Transform(), link, Transform(Vec3(0, -0.2, 0)));
    MobilizedBody::Pin coupler(crank, Transform(Vec3(0, 0.2, 0)), link,
                               Transform(Vec3(0, -0.3, 0)));
    MobilizedBody::Pin rocker(matter.Ground(), Transform(Vec3(0.5, 0, 0)), link,
                              Transform(Vec3(0, -0.25, 0)));
    MobilizedBody::Pin end(rocker, Transform(Vec3(0, 0.25, 0)),
                           Body::Rigid(MassProperties(0.1, Vec3(0), Inertia(1e-3))), Transform());
    const Constraint::Weld weld(coupler, Transform(Vec3(0, 0.3, 0)), end, Transform());
    State state = system.realizeTopology();
    crank.setOneQ(state, 0, 0.1);
    coupler.setOneQ(state, 0, -1.4);
    end.setOneQ(state, 0, -1.3);
    crank.setOneU(state, 0, 2);
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.setProjectionNorm(BdfIntegrator::ProjectionNorm::Inertia);
    integrator.initialize(state);
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 3);
    State start = integrator.getState();
    system.realize(start, Stage::Acceleration);
    EXPECT_LT((integrator.getUDot() - start.getUDot()).normInf(),
              1e-7 * (1 + start.getUDot().normInf()));
    const Real energy = system.calcEnergy(start);
    integrator.stepTo(0.5);
    const State& now = integrator.getState();
    system.realize(now, Stage::Dynamics);
    EXPECT_LT(weld.getPositionErrorsAsVector(now).normInf(), 1e-9);
    EXPECT_NEAR(system.calcEnergy(now), energy, 1e-5 * std::abs(energy));
    EXPECT_GT(std::abs(crank.getOneQ(now, 0) - crank.getOneQ(start, 0)), 0.3);
}

//---------------------------------------------------------------------------------------------------------
// with flexible bodies

struct Flexible {
    Flexible()
        : matter(system),
          forces(system),
          gravity(forces, matter, Vec3(1, -9.81, 2)),
          flexible(system, matter),
          boom(flexible, test::makePointMassPart(options()).body, "boom"),
          wheel(matter.Ground(), Transform(Vec3(-0.5, 0.1, 0)), makeBrick(0.6), Transform()) {}

    static test::PointMassPartOptions options() {
        test::PointMassPartOptions options;
        options.numModes = 8;
        options.lowestFrequency = 15;
        options.highestFrequency = 60;
        return options;
    }

    /** Returns an undeformed State with all speeds nonzero. **/
    State makeState() {
        State state = system.realizeTopology();
        system.realizeModel(state);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.4 * std::cos(1.7 * i);
        return state;
    }

    MobilizedBody& frame() {
        return matter.updMobilizedBody(boom.getFrame().getMobilizedBodyIndex());
    }
    MobilizedBody& modes(int k) {
        return matter.updMobilizedBody(boom.getModalMobilizer(k).getMobilizedBodyIndex());
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody boom;
    MobilizedBody::Pin wheel;
};

struct FlexibleCase {
    const char* name;
    std::function<Constraint(Flexible&)> add;
};

std::vector<FlexibleCase> makeFlexibleCases() {
    return {
        {"RodOnTheFrame",
         [](Flexible& f) {
             return Constraint::Rod(f.wheel, Vec3(0.1, 0, 0), f.frame(), Vec3(0.1, 0.05, 0), 0.6);
         }},
        {"BallOnTheFrame",
         [](Flexible& f) {
             // Location of the station with the boom undeformed and its end A at the hinge of
             // calcEnergyDrift().
             const auto& end = f.boom.getPart().interfaces[0].position;
             const Vec3 station(0.1, 0.05, 0), hinge(-0.3, 0, 0);
             return Constraint::Ball(f.matter.Ground(),
                                     hinge - Vec3(end[0], end[1], end[2]) + station, f.frame(),
                                     station);
         }},
        {"FrameCoordinate",
         [](Flexible& f) {
             return Constraint::CoordinateCoupler(
                 f.matter, new Function::Linear(Vector(Vec3(1, -0.5, 0))),
                 Array_<MobilizedBodyIndex>{f.frame(), f.wheel},
                 Array_<MobilizerQIndex>{MobilizerQIndex(5), MobilizerQIndex(0)});
         }},
        {"FrameTurningSpeed",
         [](Flexible& f) { return Constraint::ConstantSpeed(f.frame(), MobilizerUIndex(1), 0.7); }},
        {"ModalSpeed",
         [](Flexible& f) {
             return Constraint::ConstantSpeed(f.modes(1), MobilizerUIndex(1), 0.02);
         }},
        {"ModesAndWheelCoupled",
         [](Flexible& f) {
             return Constraint::CoordinateCoupler(
                 f.matter, new Function::Linear(Vector(Vec4(1, -2, 0.01, 0))),
                 Array_<MobilizedBodyIndex>{f.modes(0), f.modes(1), f.wheel},
                 Array_<MobilizerQIndex>{MobilizerQIndex(2), MobilizerQIndex(0),
                                         MobilizerQIndex(0)});
         }},
    };
}

class FlexibleWithConstraint : public testing::TestWithParam<FlexibleCase> {};

TEST_P(FlexibleWithConstraint, AccelerationsAndMultipliersAreSimbodys) {
    Flexible model;
    const Constraint constraint = GetParam().add(model);
    State state = model.makeState();
    model.boom.setModalCoordinates(state, Vector(8, 0.01));
    BdfIntegrator integrator(model.system);
    integrator.setConstraintTolerance(1e-12);
    integrator.initialize(state);
    State start = integrator.getState();
    model.system.realize(start, Stage::Acceleration);
    EXPECT_LT((integrator.getUDot() - start.getUDot()).normInf(),
              1e-9 * (1 + start.getUDot().normInf()));
    const Vector expected = constraint.getMultipliersAsVector(start);
    EXPECT_LT((integrator.getMultipliers(constraint) - expected).normInf(),
              1e-9 * (1 + expected.normInf()));
}

/** Returns the relative change of energy minus work in 0.1 s with a hinge at the boom's end. **/
Real calcEnergyDrift(const FlexibleCase& which, Real accuracy) {
    Flexible model;
    const Joint::Ball hinge(model.flexible, Attachment(model.matter.Ground(), Vec3(-0.3, 0, 0)),
                            model.boom.interface("A"), "hinge");
    const Constraint constraint = which.add(model);
    State state = model.makeState();
    model.boom.setPoseByInterface(state, "A", Transform(Vec3(-0.3, 0, 0)));
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(accuracy);
    integrator.setMaximumOrder(3);
    integrator.initialize(state);
    model.system.realize(integrator.getState(), Stage::Dynamics);
    const Real energy = model.flexible.calcEnergy(integrator.getState());
    const Real kineticEnergy = model.flexible.calcKineticEnergy(integrator.getState());
    integrator.stepTo(0.1);
    const State& now = integrator.getState();
    model.system.realize(now, Stage::Dynamics);
    int position = 0, velocity = 0, acceleration = 0;
    constraint.getNumConstraintEquationsInUse(now, position, velocity, acceleration);
    EXPECT_LT(position > 0 ? constraint.getPositionErrorsAsVector(now).normInf() : 0, 1e-9);
    EXPECT_LT(constraint.getVelocityErrorsAsVector(now).normInf(), 1e-6);
    return std::abs(model.flexible.calcEnergy(now) - integrator.getWork() - energy) /
           (1 + kineticEnergy);
}

TEST_P(FlexibleWithConstraint, ConstraintHoldsAndEnergyLessWorkDriftsLessWithAccuracy) {
    const Real coarse = calcEnergyDrift(GetParam(), 1e-8),
               fine = calcEnergyDrift(GetParam(), 1e-10);
    EXPECT_LT(coarse, 2e-3);
    // accuracy^(p/(p+1)) with p = 3 gives a factor of 30; 8 leaves room for the step size's
    // granularity.
    EXPECT_LT(fine, coarse / 8);
}

INSTANTIATE_TEST_SUITE_P(All, FlexibleWithConstraint, testing::ValuesIn(makeFlexibleCases()),
                         [](const testing::TestParamInfo<FlexibleCase>& test) {
                             return std::string(test.param.name);
                         });

TEST(ForeignForces, ActOnFramesModesAndRigidBodiesAsInSimbody) {
    Flexible model;
    Force::TwoPointLinearSpring(model.forces, model.matter.Ground(), Vec3(0.5, 0.2, 0),
                                model.frame(), Vec3(0.1, 0.05, 0), 80, 0.3);
    Force::LinearBushing(model.forces, model.wheel, Transform(Vec3(0.1, 0, 0)), model.frame(),
                         Transform(Rotation(0.2, XAxis)), Vec6(1, 2, 3, 40, 50, 60),
                         Vec6(0.1, 0.2, 0.3, 4, 5, 6));
    Force::MobilityLinearSpring(model.forces, model.modes(1), MobilizerQIndex(1), 5, 0.2);
    Force::MobilityLinearDamper(model.forces, model.modes(0), MobilizerUIndex(3), 2);
    Force::MobilityConstantForce(model.forces, model.frame(), MobilizerUIndex(1), 0.7);
    Force::GlobalDamper(model.forces, model.matter, 0.1);
    State state = model.makeState();
    model.boom.setModalCoordinates(state, Vector(8, 0.01));
    BdfIntegrator integrator(model.system);
    integrator.initialize(state);
    State start = integrator.getState();
    model.system.realize(start, Stage::Acceleration);
    EXPECT_LT((integrator.getUDot() - start.getUDot()).normInf(),
              1e-10 * (1 + start.getUDot().normInf()));
}

TEST(ForeignForces, CompliantContactActsAsInSimbody) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    ContactTrackerSubsystem tracker(system);
    CompliantContactSubsystem contact(system, tracker);
    const ContactMaterial material(2e4, 0.1, 0.5, 0.4, 0.1);
    matter.Ground().updBody().addContactSurface(
        Transform(Rotation(-Pi / 2, ZAxis)),
        ContactSurface(ContactGeometry::HalfSpace(), material));
    Body::Rigid ball = makeBrick(1);
    ball.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(0.1), material));
    MobilizedBody::Free body(matter.Ground(), ball);
    State state = system.realizeTopology();
    body.setQToFitTranslation(state, Vec3(0, 0.12, 0));
    body.setUToFitLinearVelocity(state, Vec3(0.5, -0.4, 0));
    RungeKuttaMersonIntegrator reference(system);
    reference.setAccuracy(1e-9);
    TimeStepper stepper(system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.2);
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(state);
    integrator.stepTo(0.2);
    State theirs = stepper.getState();
    system.realize(theirs, Stage::Velocity);
    EXPECT_GT(body.getBodyOriginVelocity(theirs)[1], 0);  // it bounced
    EXPECT_LT(
        (body.getBodyOriginLocation(integrator.getState()) - body.getBodyOriginLocation(theirs))
            .norm(),
        1e-4);
}

TEST(SimbodyConstraint, AConstraintOnACarriersBodyIsRefusedByName) {
    Flexible model;
    Constraint::Rod(model.matter.Ground(), model.modes(0), 1);
    const State state = model.makeState();
    BdfIntegrator integrator(model.system);
    try {
        integrator.initialize(state);
        FAIL();
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what();
        for (const char* word : {"(Rod)", "modal mobilizer", "boom"})
            EXPECT_NE(message.find(word), std::string::npos) << message;
    }
}

TEST(SimbodyConstraint, OneThatCannotBeAssembledIsNamed) {
    Rigid rigid;
    Constraint::Rod(rigid.matter.Ground(), Vec3(0), rigid.wheel, Vec3(0), 5);
    State state = rigid.system.realizeTopology();
    BdfIntegrator integrator(rigid.system);
    try {
        integrator.initialize(state);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("Simbody constraint 0 (Rod) on bodies (0, 6)"),
                  std::string::npos)
            << error.what();
    }
}

}  // namespace
}  // namespace simflex
