/** @file
Joints as Simbody constraints: errors, constraint matrix and forces of the Constraint behind each
joint. **/

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/Joint.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

enum class Kind {
    Ball,
    Pin,
    Slider,
    Weld,
    Cylinder,
    Universal,
    Planar,
    Screw,
    PointOnLine,
    PointInPlane,
    Rod,
    PrescribedRotation,
    PrescribedTranslation,
    PrescribedPosition,
    PrescribedPose,
    Gear,
    Coupler
};
enum class Sides {
    FlexibleFlexible,
    FlexibleRigid,
    RigidFlexible,
    RigidGround,
    SameFlexible,
    NodeRigid
};

const Kind AllKinds[] = {Kind::Ball,
                         Kind::Pin,
                         Kind::Slider,
                         Kind::Weld,
                         Kind::Cylinder,
                         Kind::Universal,
                         Kind::Planar,
                         Kind::Screw,
                         Kind::PointOnLine,
                         Kind::PointInPlane,
                         Kind::Rod,
                         Kind::PrescribedRotation,
                         Kind::PrescribedTranslation,
                         Kind::PrescribedPosition,
                         Kind::PrescribedPose,
                         Kind::Gear,
                         Kind::Coupler};
const char* const KindNames[] = {"Ball",
                                 "Pin",
                                 "Slider",
                                 "Weld",
                                 "Cylinder",
                                 "Universal",
                                 "Planar",
                                 "Screw",
                                 "PointOnLine",
                                 "PointInPlane",
                                 "Rod",
                                 "PrescribedRotation",
                                 "PrescribedTranslation",
                                 "PrescribedPosition",
                                 "PrescribedPose",
                                 "Gear",
                                 "Coupler"};

const Sides AllSides[] = {Sides::FlexibleFlexible, Sides::FlexibleRigid, Sides::RigidFlexible,
                          Sides::RigidGround,      Sides::SameFlexible,  Sides::NodeRigid};

const char* const SidesNames[] = {"FlexibleFlexible", "FlexibleRigid", "RigidFlexible",
                                  "RigidGround",      "SameFlexible",  "NodeRigid"};

void PrintTo(Kind kind, std::ostream* out) {
    *out << KindNames[int(kind)];
}
void PrintTo(Sides sides, std::ostream* out) {
    *out << SidesNames[int(sides)];
}

/** Two flexible bodies, a rigid chain of two and Ground, with one joint; a random state off the
constraint. **/
class JointConstraintTest
    : public ::testing::TestWithParam<std::tuple<Kind, Sides, bool /*geometric stiffening*/>> {
protected:
    JointConstraintTest() {
        matter.setShowDefaultGeometry(false);
        PointMassPartOptions options;
        if (std::get<2>(GetParam())) options.stiffening = 2;
        first = std::make_unique<FlexibleBody>(flexible, makePointMassPart(options).body, "first");
        options.seed = 2;
        options.numModes = 8;
        second =
            std::make_unique<FlexibleBody>(flexible, makePointMassPart(options).body, "second");
        const Body::Rigid rigid(MassProperties(2, Vec3(0.1, 0, 0.2), Inertia(1, 1.2, 1.4)));
        MobilizedBody::Free base(matter.Ground(), rigid);
        link = MobilizedBody::Universal(base, Transform(Vec3(0.3, 0.1, 0)), rigid,
                                        Transform(Vec3(0, 0.2, 0)));
        const auto [F, M] = makeSides();
        joint = std::make_unique<Joint>(makeJoint(F, M));

        state = system.realizeTopology();
        std::uniform_real_distribution<double> unit(-1, 1);
        std::mt19937 random(99);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.3 * unit(random);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = unit(random);
        uDot.resize(state.getNU());
        for (int i = 0; i < uDot.size(); ++i) uDot[i] = unit(random);
        state.setTime(0.3);
        for (FlexibleBody* body : {first.get(), second.get()}) {
            body->setModalCoordinates(state, 0.1 * body->getModalCoordinates(state));
            body->setModalSpeeds(state, 0.2 * body->getModalSpeeds(state));
        }
        system.realize(state, Stage::Position);
        normalizeQuaternions(state);
        system.realize(state, Stage::Velocity);
    }

    std::pair<Attachment, Attachment> makeSides() {
        const Transform X(Rotation(0.4, UnitVec3(1, 2, -1)), Vec3(0.1, -0.2, 0.15));
        const Transform Y(Rotation(-0.8, UnitVec3(0, 1, 1)), Vec3(-0.05, 0.1, 0.2));
        switch (std::get<1>(GetParam())) {
            case Sides::FlexibleFlexible:
                return {first->interface("B", X), second->interface("A", Y)};
            case Sides::FlexibleRigid:
                return {first->interface("A", X), Attachment(link, Y)};
            case Sides::RigidFlexible:
                return {Attachment(link, X), second->interface("B", Y)};
            case Sides::RigidGround:
                return {Attachment(link, X), Attachment(matter.Ground(), Y)};
            case Sides::SameFlexible:
                return {first->interface("A", X), first->interface("B", Y)};
            case Sides::NodeRigid:
                return {second->node(6, X), Attachment(link, Y)};
        }
        throw std::logic_error("no such sides");
    }

    Joint makeJoint(const Attachment& F, const Attachment& M) {
        using Coordinate = Joint::Coordinate;
        switch (std::get<0>(GetParam())) {
            case Kind::Ball:
                return Joint::Ball(flexible, F, M);
            case Kind::Pin:
                return Joint::Pin(flexible, F, M);
            case Kind::Slider:
                return Joint::Slider(flexible, F, M);
            case Kind::Weld:
                return Joint::Weld(flexible, F, M);
            case Kind::Cylinder:
                return Joint::Cylinder(flexible, F, M);
            case Kind::Universal:
                return Joint::Universal(flexible, F, M);
            case Kind::Planar:
                return Joint::Planar(flexible, F, M);
            case Kind::PointOnLine:
                return Joint::PointOnLine(flexible, F, M);
            case Kind::PointInPlane:
                return Joint::PointInPlane(flexible, F, M);
            case Kind::Screw:
                return Joint::Screw(flexible, F, M, 0.3);
            case Kind::Rod:
                return Joint::Rod(flexible, F, M, 0.5);
            case Kind::PrescribedTranslation:
                return Joint::PrescribedTranslation(flexible, F, M, YAxis, [](Real t) {
                    return Vec3(std::sin(t), std::cos(t), -std::sin(t));
                });
            case Kind::PrescribedPosition:
                return Joint::PrescribedPosition(flexible, F, M, [](Real t) {
                    return std::array<Vec3, 3>{Vec3(t * t, t, std::sin(t)),
                                               Vec3(2 * t, 1, std::cos(t)),
                                               Vec3(2, 0, -std::sin(t))};
                });
            case Kind::PrescribedPose:
                return Joint::PrescribedPose(flexible, F, M, [](Real t) {
                    FrameMotion pose;
                    pose.X = Transform(Rotation(std::sin(t), UnitVec3(1, 2, 2)), Vec3(t * t, t, 1));
                    pose.V = {std::cos(t) * Vec3(UnitVec3(1, 2, 2)), Vec3(2 * t, 1, 0)};
                    pose.A = {-std::sin(t) * Vec3(UnitVec3(1, 2, 2)), Vec3(2, 0, 0)};
                    return pose;
                });
            case Kind::Gear:
                return Joint::Gear(
                    flexible, Coordinate::makeAngle(F, M), 19,
                    Coordinate::makeAngle(first->interface("A"), second->interface("B")), -23);
            case Kind::Coupler:
                return Joint::Coupler(
                    flexible,
                    {{Coordinate::makeDisplacement(second->node(3), link, ZAxis), 2.5},
                     {Coordinate::makeAngle(matter.Ground(), first->interface("B")), 0.3},
                     {Coordinate::makeAngle(F, M), -0.7},
                     {Coordinate::makeDisplacement(F, M, XAxis), 1}},
                    0.2);
            case Kind::PrescribedRotation:
                return Joint::PrescribedRotation(flexible, F, M, [](Real t) {
                    return Vec3(0.2 + std::sin(3 * t), 3 * std::cos(3 * t), -9 * std::sin(3 * t));
                });
        }
        throw std::logic_error("no such joint");
    }

    void normalizeQuaternions(State& s) const {
        matter.normalizeQuaternions(s);
        system.realize(s, Stage::Position);
    }

    const Constraint& constraint() const {
        return matter.getConstraint(joint->getConstraintIndex());
    }

    /** Returns the state after a small time along u and uDot, to first order in q and u. **/
    State stateAfter(Real h) const {
        State moved = state;
        moved.setTime(state.getTime() + h);
        moved.updQ() = state.getQ() + h * state.getQDot();
        moved.updU() = state.getU() + h * uDot;
        system.realize(moved, Stage::Velocity);
        return moved;
    }

    template <class Function>
    static Vector differentiate(Function function) {
        const Real h = 2e-5;
        return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h);
    }

    /** Returns F and M; for couplers, those of every coordinate. **/
    std::vector<Attachment> sides() const {
        std::vector<Attachment> frames;
        for (int i = 0; i < joint->getEquations().getNumFrames() / 2; ++i) {
            frames.push_back(joint->getFrameF(i));
            frames.push_back(joint->getFrameM(i));
        }
        return frames;
    }

    template <class Evaluate>
    void withFrames(Evaluate evaluate) const {
        std::vector<FrameMotion> motions;
        for (const Attachment& side : sides()) motions.push_back(side.calcMotion(state));
        std::vector<const FrameMotion*> frames;
        for (const FrameMotion& motion : motions) frames.push_back(&motion);
        evaluate(frames.data());
    }

    std::vector<SpatialVec> calcJacobian() const {
        std::vector<SpatialVec> D(sides().size() * size_t(joint->getNumEquations()));
        withFrames([&](JointEquations::Frames frames) {
            joint->getEquations().calcJacobian(joint->getEquations().calcDrive(state.getTime()),
                                               frames, D.data());
        });
        return D;
    }

    /** Returns the rows of our Jacobian in Simbody's speeds, which have ω in Ground rather than in
    B. **/
    Matrix calcOwnRows() const {
        const int m = joint->getNumEquations();
        Matrix rows(m, state.getNU(), Real(0));
        const std::vector<SpatialVec> D = calcJacobian();
        for (int side = 0; side < int(sides().size()); ++side)
            for (int k = 0; k < m; ++k)
                addInRow(sides()[size_t(side)], D[size_t(side * m + k)], k, rows);
        return rows;
    }

    void addInRow(const Attachment& attachment, const SpatialVec& d, int k, Matrix& rows) const {
        if (!attachment.isFlexible()) {
            Matrix J;
            matter.calcFrameJacobian(state, attachment.getMobilizedBodyIndex(),
                                     attachment.getFrame().p(), J);
            for (int j = 0; j < rows.ncol(); ++j)
                for (int a = 0; a < 6; ++a) rows(k, j) += d[a / 3][a % 3] * J(a, j);
            return;
        }
        const FlexibleBody body = flexible.getBody(attachment.getFlexibleBodyIndex());
        const Vector xi = body.getModalCoordinates(state);
        const FrameAtXi frame(attachment.getFlexibleFrame(), &xi[0],
                              attachment.getFrameOrder(state));
        const Rotation R_GB = body.getFramePose(state).R();
        std::vector<double> row(6 + body.getNumModes(), 0.0);
        addInConstraintRow(frame.getTangent(), frame.getPose(), R_GB, d, row.data());
        const Vec3 atOmega_G = R_GB * Vec3(row[0], row[1], row[2]);
        const int u = int(body.getFrame().getFirstUIndex(state));
        for (int a = 0; a < 3; ++a) {
            rows(k, u + a) += atOmega_G[a];
            rows(k, u + 3 + a) += row[3 + a];
        }
        for (int i = 0; i < body.getNumModes(); ++i)
            rows(k, int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6) += row[6 + i];
    }

    static Real largestOf(const Matrix& A) {
        Real largest = 0;
        for (int i = 0; i < A.nrow(); ++i)
            for (int j = 0; j < A.ncol(); ++j) largest = std::max(largest, std::abs(A(i, j)));
        return largest;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::unique_ptr<FlexibleBody> first, second;
    MobilizedBody link;
    std::unique_ptr<Joint> joint;
    State state;
    Vector uDot;
};

INSTANTIATE_TEST_SUITE_P(Joints, JointConstraintTest,
                         ::testing::Combine(::testing::ValuesIn(AllKinds),
                                            ::testing::ValuesIn(AllSides), ::testing::Bool()),
                         [](const auto& tested) {
                             return std::string(KindNames[int(std::get<0>(tested.param))]) + "_" +
                                    SidesNames[int(std::get<1>(tested.param))] +
                                    (std::get<2>(tested.param) ? "_stiffened" : "");
                         });

TEST_P(JointConstraintTest, SimbodysPositionErrorsAreTheJoints) {
    const Vector errors = constraint().getPositionErrorsAsVector(state);
    ASSERT_EQ(errors.size(), joint->getNumEquations());
    EXPECT_LT((errors - joint->calcPositionErrors(state)).normInf(), 1e-15);
    EXPECT_GT(errors.norm(), 0.01);
}

TEST_P(JointConstraintTest, VelocityErrorsAreDerivativesOfPositionErrors) {
    const Vector expected = differentiate(
        [&](Real h) { return constraint().getPositionErrorsAsVector(stateAfter(h)); });
    EXPECT_LT((constraint().getVelocityErrorsAsVector(state) - expected).normInf(), 1e-9);
}

TEST_P(JointConstraintTest, AccelerationErrorsAreDerivativesOfVelocityErrors) {
    const Vector expected = differentiate(
        [&](Real h) { return constraint().getVelocityErrorsAsVector(stateAfter(h)); });
    Vector errors;
    matter.calcConstraintAccelerationErrors(state, uDot, errors);
    EXPECT_LT((errors - expected).normInf(), 1e-7);
}

TEST_P(JointConstraintTest, ConstraintMatrixIsThatOfTheSolversRows) {
    Matrix G;
    matter.calcG(state, G);
    EXPECT_LT(largestOf(G - calcOwnRows()), 1e-13);
    // And G u, with the part that depends on time alone, is the velocity error.
    Vector rate(joint->getNumEquations(), Real(0));
    withFrames([&](JointEquations::Frames frames) {
        joint->getEquations().addInTimeRate(joint->getEquations().calcDrive(state.getTime()),
                                            frames, &rate[0]);
    });
    EXPECT_LT((G * state.getU() + rate - constraint().getVelocityErrorsAsVector(state)).normInf(),
              1e-13);
}

/** Gᵀλ from the joint's forces and λᵀG from its errors agree: forces do no work on speeds with Gu =
0. **/
TEST_P(JointConstraintTest, ForcesDoNoWorkOnAdmissibleVelocities) {
    Matrix G, Gt;
    matter.calcG(state, G);
    matter.calcGTranspose(state, Gt);
    EXPECT_LT(largestOf(Matrix(G - ~Gt)), 1e-13);
}

TEST_P(JointConstraintTest, ForceOnMHasThePowerOfTheConstraintOnM) {
    const int m = joint->getNumEquations();
    Vector lambda(m);
    for (int k = 0; k < m; ++k) lambda[k] = k + 1;
    const SpatialVec force = joint->calcForceOnM(state, lambda);
    const SpatialVec V_M = joint->getFrameM().calcMotion(state).V;
    // The power on all sides is −λᵀGu; with M fixed, that of the others remains.
    const std::vector<SpatialVec> D = calcJacobian();
    Matrix G;
    matter.calcG(state, G);
    Real power = -~lambda * (G * state.getU());
    for (int side = 0; side < int(sides().size()); ++side) {
        const SpatialVec V = sides()[size_t(side)].calcMotion(state).V;
        for (int k = 0; k < m && side != 1; ++k) {
            const SpatialVec& d = D[size_t(side * m + k)];
            power += lambda[k] * (~d[0] * V[0] + ~d[1] * V[1]);
        }
    }
    EXPECT_NEAR(~force[0] * V_M[0] + ~force[1] * V_M[1], power, 1e-12);
    EXPECT_THROW(joint->calcForceOnM(state, Vector(m + 1, Real(0))), std::invalid_argument);
}

TEST_P(JointConstraintTest, EveryEquationTakesOneFreedom) {
    Matrix G;
    matter.calcG(state, G);
    FactorSVD svd(G);
    Vector singular;
    svd.getSingularValues(singular);
    ASSERT_EQ(singular.size(), joint->getNumEquations());
    EXPECT_GT(min(singular), 1e-6 * max(singular)) << singular;
}

/** Reactions on both sides, moved to one point, balance except for the couple of rows along
Ground's axes while the origins are apart; `axes` only rotates components. **/
TEST_P(JointConstraintTest, ReactionsOnBothSidesAreInBalance) {
    Vector lambda(joint->getNumEquations());
    for (int k = 0; k < lambda.size(); ++k) lambda[k] = 1 + k;
    using Side = Joint::Side;
    const SpatialVec onM = joint->calcReaction(state, lambda, Side::M, Side::M);
    const SpatialVec onF = joint->calcReaction(state, lambda, Side::F, Side::M);
    EXPECT_LT((onM[1] + onF[1]).norm(), 1e-13);
    const Kind kind = std::get<0>(GetParam());
    const bool coincident =
        kind == Kind::Ball || kind == Kind::Pin || kind == Kind::Weld || kind == Kind::Universal;
    const Transform F = joint->getFrameF().calcMotion(state).X,
                    M = joint->getFrameM().calcMotion(state).X;
    const Vec3 couple = coincident ? (F.p() - M.p()) % onF[1] : Vec3(0);
    EXPECT_LT((onM[0] + onF[0] - couple).norm(), 1e-13);
    const SpatialVec inM = joint->calcReaction(state, lambda, Side::M, Side::M, Joint::Axes::M);
    EXPECT_LT((M.R() * inM[0] - onM[0]).norm() + (M.R() * inM[1] - onM[1]).norm(), 1e-13);
    const SpatialVec atF = joint->calcReaction(state, lambda, Side::M, Side::F, Joint::Axes::F);
    EXPECT_LT((F.R() * atF[0] - onM[0] - (M.p() - F.p()) % onM[1]).norm(), 1e-13);
}

TEST_P(JointConstraintTest, CoordinateRatesAreDerivativesOfCoordinates) {
    if (joint->getNumCoordinates() == 0) return;
    const Vector expected =
        differentiate([&](Real h) { return joint->calcCoordinates(stateAfter(h)); });
    EXPECT_LT((joint->calcCoordinateDots(state) - expected).normInf(), 1e-9);
}

/** A rigid body hangs on a weld: the multipliers' force on it is its weight, upwards. **/
TEST(JointForce, WeldCarriesTheWeightOfTheHangingBody) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem general(system);
    Force::Gravity gravity(general, matter, Vec3(0, -10, 0));
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free hanging(matter.Ground(),
                                Body::Rigid(MassProperties(3, Vec3(0), Inertia(1))));
    const Joint::Weld weld(flexible, matter.Ground(),
                           Attachment(hanging, Transform(Vec3(-0.5, 0, 0))));
    State state = system.realizeTopology();
    hanging.setQToFitTransform(state, Transform(Vec3(0.5, 0, 0)));
    system.realize(state, Stage::Acceleration);
    const SpatialVec force = weld.calcForceOnM(
        state, matter.getConstraint(weld.getConstraintIndex()).getMultipliersAsVector(state));
    EXPECT_LT((force[1] - Vec3(0, 30, 0)).norm(), 1e-12);
    EXPECT_LT((force[0] - Vec3(0, 0, 15)).norm(), 1e-12);
}

template <class Make>
void expectRefusal(Make make, const std::string& expected) {
    try {
        make();
        ADD_FAILURE() << "not refused: " << expected;
    } catch (const std::exception& error) {
        EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
}

TEST(JointErrors, NonsenseParametersAreRefusedByName) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free body(matter.Ground(),
                                   Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    const Attachment F(matter.Ground()), M(body);
    for (const Real pitch : {NaN, Infinity, 0.0})
        expectRefusal([&] { Joint::Screw(flexible, F, M, pitch, "lead screw"); },
                      "joint 'lead screw': pitch " + String(pitch).toLower());
    for (const Real length : {NaN, Infinity, 0.0, -1.0})
        expectRefusal([&] { Joint::Rod(flexible, F, M, length, "strut"); },
                      "joint 'strut': length " + String(length).toLower());
    expectRefusal(
        [&] {
            Joint::PrescribedTranslation(flexible, F, M, XAxis, Joint::MotionFunction(), "ram");
        },
        "joint 'ram': no displacement function");
    expectRefusal([&] { Joint::PrescribedPosition(flexible, F, M, {}, "robot"); },
                  "joint 'robot': no position function");
    expectRefusal([&] { Joint::PrescribedPose(flexible, F, M, {}, "hexapod"); },
                  "joint 'hexapod': no pose function");
    using Function = std::shared_ptr<const SimTK::Function>;
    expectRefusal([&] { Joint::PrescribedRotation(flexible, F, M, Function(), "servo"); },
                  "joint 'servo': no angle function");
    expectRefusal(
        [&] {
            const Function ofTwo = std::make_shared<Function::element_type::Constant>(1, 2);
            Joint::PrescribedRotation(flexible, F, M, ofTwo, "servo");
        },
        "joint 'servo': the angle function has 2 arguments");
    const auto angle = Joint::Coordinate::makeAngle(F, M);
    const auto x = Joint::Coordinate::makeDisplacement(F, M, XAxis);
    expectRefusal([&] { Joint::Gear(flexible, angle, 0, angle, 20, "gear"); },
                  "joint 'gear': number of teeth 0");
    expectRefusal([&] { Joint::Gear(flexible, angle, 20, x, 20, "gear"); },
                  "joint 'gear' is a gear of a displacement");
    expectRefusal([&] { Joint::Gear(flexible, angle, 20, angle, 20, NaN, "gear"); },
                  "joint 'gear': phase nan");
    expectRefusal([&] { Joint::Coupler(flexible, {}, "belt"); },
                  "joint 'belt' couples no coordinates");
    expectRefusal(
        [&] {
            Joint::Coupler(flexible, {{angle, 0}}, "belt");
        },
        "joint 'belt': coefficient 0");
    expectRefusal(
        [&] {
            Joint::Coupler(flexible, {{angle, 1}}, Infinity, "belt");
        },
        "joint 'belt': constant inf");
    expectRefusal(
        [&] {
            Joint::Coupler(flexible, {{angle, 1}, {angle, Pi}}, "belt");
        },
        "joint 'belt': angles have coefficients 1 and 3.14159");
    expectRefusal(
        [&] { Joint::Pin(flexible, F, Attachment(body, Transform(Vec3(NaN, 0, 0))), "hinge"); },
        "joint 'hinge': frame M on body 1");
    expectRefusal([&] { Joint::Pin(flexible, body, body, "hinge"); }, "same rigid body");
    EXPECT_EQ(flexible.getNumJoints(), 0);
    const Joint::Pin pin(flexible, F, M, "hinge");
    expectRefusal([&] { pin.calcDrivingForces(Vector(5, Real(0))); },
                  "joint 'hinge' is a Pin and prescribes no motion");
    expectRefusal([&] { pin.calcCouplingForces(Vector(5, Real(0))); },
                  "joint 'hinge' is a Pin and couples no coordinates");
    expectRefusal([&] { pin.getFrameM(1); },
                  "joint 'hinge', a Pin, has 1 pairs of frames, none of number 1");
    expectRefusal([&] { Joint::Coordinate(pin, 1); },
                  "joint 'hinge', a Pin, has 1 coordinates, none of number 1");
}

TEST(JointForce, SimbodyAssemblesAJointBetweenFlexibleBodies) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = makePointMassPart().body;
    const FlexibleBody first(flexible, part), second(flexible, part);
    const Joint::Weld base(flexible, matter.Ground(), first.interface("A"));
    const Joint::Pin pin(flexible, first.interface("B"), second.interface("A"));
    State state = system.realizeTopology();
    first.setPoseByInterface(state, "A", Transform(Vec3(0.01, -0.02, 0)));
    second.setFramePose(state, Transform(Rotation(0.1, YAxis), Vec3(0.4, 0.02, 0.03)));
    system.realize(state, Stage::Velocity);
    EXPECT_GT(pin.calcPositionErrors(state).norm(), 0.01);
    system.project(state, 1e-12);
    EXPECT_LT(pin.calcPositionErrors(state).norm(), 1e-11);
    EXPECT_LT(base.calcPositionErrors(state).norm(), 1e-11);
}

}  // namespace
}  // namespace simflex::test
