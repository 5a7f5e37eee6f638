// Every mobilizer of Simbody inside BdfIntegrator, forward and reversed, with quaternions and Euler
// angles: initial accelerations and motion match Simbody's.

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

/** A bead on a circle of radius R in F's xy-plane, M's x axis pointing outwards. **/
class Circle : public MobilizedBody::Custom::Implementation {
public:
    explicit Circle(SimbodyMatterSubsystem& matter) : Implementation(matter, 1, 1) {}
    Implementation* clone() const override { return new Circle(*this); }
    Transform calcMobilizerTransformFromQ(const State&, int, const Real* q) const override {
        return Transform(Rotation(q[0], ZAxis), R * Vec3(std::cos(q[0]), std::sin(q[0]), 0));
    }
    SpatialVec multiplyByHMatrix(const State& state, int, const Real* u) const override {
        return u[0] * column(state);
    }
    void multiplyByHTranspose(const State& state, const SpatialVec& F, int,
                              Real* f) const override {
        f[0] = dot(column(state)[0], F[0]) + dot(column(state)[1], F[1]);
    }
    SpatialVec multiplyByHDotMatrix(const State& state, int, const Real* u) const override {
        return u[0] * columnDot(state);
    }
    void multiplyByHDotTranspose(const State& state, const SpatialVec& F, int,
                                 Real* f) const override {
        f[0] = dot(columnDot(state)[1], F[1]);
    }
    void setQToFitTransform(const State&, const Transform& X, int, Real* q) const override {
        q[0] = std::atan2(X.p()[1], X.p()[0]);
    }
    void setUToFitVelocity(const State&, const SpatialVec& V, int, Real* u) const override {
        u[0] = V[0][2];
    }

private:
    static constexpr Real R = 0.25;
    SpatialVec column(const State& state) const {
        const Real q = getQ(state)[0];
        return {Vec3(0, 0, 1), R * Vec3(-std::sin(q), std::cos(q), 0)};
    }
    SpatialVec columnDot(const State& state) const {
        const Real q = getQ(state)[0], u = getU(state)[0];
        return {Vec3(0), R * u * Vec3(-std::cos(q), -std::sin(q), 0)};
    }
};

/** A custom ball joint: its angular coordinates become quaternions or angles in Simbody. **/
class HandMadeBall : public MobilizedBody::Custom::Implementation {
public:
    explicit HandMadeBall(SimbodyMatterSubsystem& matter) : Implementation(matter, 3, 4, 4) {}
    Implementation* clone() const override { return new HandMadeBall(*this); }
    Transform calcMobilizerTransformFromQ(const State&, int nq, const Real* q) const override {
        Rotation R;
        if (nq == 4)
            R.setRotationFromQuaternion(Quaternion(Vec4::getAs(q)));
        else
            R.setRotationToBodyFixedXYZ(Vec3::getAs(q));
        return Transform(R);
    }
    SpatialVec multiplyByHMatrix(const State&, int, const Real* u) const override {
        return {Vec3::getAs(u), Vec3(0)};
    }
    void multiplyByHTranspose(const State&, const SpatialVec& F, int, Real* f) const override {
        Vec3::updAs(f) = F[0];
    }
    SpatialVec multiplyByHDotMatrix(const State&, int, const Real*) const override {
        return {Vec3(0), Vec3(0)};
    }
    void multiplyByHDotTranspose(const State&, const SpatialVec&, int, Real* f) const override {
        Vec3::updAs(f) = Vec3(0);
    }
    // Where q̇ ≠ u, Simbody needs q̇ = N u and related operators.
    void multiplyByN(const State& state, bool transpose, int, const Real* in, int nOut,
                     Real* out) const override {
        const Vector q = getQ(state);
        if (q.size() == 4)
            multiply(Rotation::calcUnnormalizedNForQuaternion(Vec4::getAs(&q[0])), transpose, in,
                     nOut, out);
        else
            multiply(Rotation::calcNForBodyXYZInParentFrame(Vec3::getAs(&q[0])), transpose, in,
                     nOut, out);
    }
    void multiplyByNInv(const State& state, bool transpose, int, const Real* in, int nOut,
                        Real* out) const override {
        const Vector q = getQ(state);
        if (q.size() == 4)
            multiply(Rotation::calcUnnormalizedNInvForQuaternion(Vec4::getAs(&q[0])), transpose, in,
                     nOut, out);
        else
            multiply(Rotation::calcNInvForBodyXYZInParentFrame(Vec3::getAs(&q[0])), transpose, in,
                     nOut, out);
    }
    void multiplyByNDot(const State& state, bool transpose, int, const Real* in, int nOut,
                        Real* out) const override {
        const Vector q = getQ(state), qDot = getQDot(state);
        if (q.size() == 4)
            multiply(Rotation::calcUnnormalizedNDotForQuaternion(Vec4::getAs(&qDot[0])), transpose,
                     in, nOut, out);
        else
            multiply(Rotation::calcNDotForBodyXYZInParentFrame(Vec3::getAs(&q[0]),
                                                               Vec3::getAs(&qDot[0])),
                     transpose, in, nOut, out);
    }
    void setQToFitTransform(const State&, const Transform& X, int nq, Real* q) const override {
        if (nq == 4)
            Vec4::updAs(q) = X.R().convertRotationToQuaternion().asVec4();
        else
            Vec3::updAs(q) = X.R().convertRotationToBodyFixedXYZ();
    }
    void setUToFitVelocity(const State&, const SpatialVec& V, int, Real* u) const override {
        Vec3::updAs(u) = V[0];
    }

private:
    template <int M, int N, int CS, int RS>
    static void multiply(const Mat<M, N, Real, CS, RS>& A, bool transpose, const Real* in, int nOut,
                         Real* out) {
        for (int i = 0; i < nOut; ++i) {
            out[i] = 0;
            for (int j = 0; j < (transpose ? M : N); ++j)
                out[i] += (transpose ? A(j, i) : A(i, j)) * in[j];
        }
    }
};

using Direction = MobilizedBody::Direction;

struct Kind {
    const char* name;
    std::function<MobilizedBody(SimbodyMatterSubsystem&, MobilizedBody& parent,
                                const Transform& X_PF, const Body& body, const Transform& X_BM,
                                Direction)>
        make;
};

template <class Mobilizer>
Kind plain(const char* name) {
    return {name, [](SimbodyMatterSubsystem&, MobilizedBody& parent, const Transform& X_PF,
                     const Body& body, const Transform& X_BM, Direction direction) {
                return Mobilizer(parent, X_PF, body, X_BM, direction);
            }};
}

std::vector<Kind> makeKinds() {
    return {
        plain<MobilizedBody::Pin>("Pin"),
        plain<MobilizedBody::Slider>("Slider"),
        plain<MobilizedBody::Universal>("Universal"),
        plain<MobilizedBody::Cylinder>("Cylinder"),
        plain<MobilizedBody::BendStretch>("BendStretch"),
        plain<MobilizedBody::Planar>("Planar"),
        plain<MobilizedBody::SphericalCoords>("SphericalCoords"),
        plain<MobilizedBody::Gimbal>("Gimbal"),
        plain<MobilizedBody::Bushing>("Bushing"),
        plain<MobilizedBody::Ball>("Ball"),
        plain<MobilizedBody::Translation>("Translation"),
        plain<MobilizedBody::Free>("Free"),
        plain<MobilizedBody::LineOrientation>("LineOrientation"),
        plain<MobilizedBody::FreeLine>("FreeLine"),
        {"Weld", [](SimbodyMatterSubsystem&, MobilizedBody& parent, const Transform& X_PF,
                    const Body& body, const Transform& X_BM,
                    Direction) { return MobilizedBody::Weld(parent, X_PF, body, X_BM); }},
        {"Screw",
         [](SimbodyMatterSubsystem&, MobilizedBody& parent, const Transform& X_PF, const Body& body,
            const Transform& X_BM, Direction direction) {
             return MobilizedBody::Screw(parent, X_PF, body, X_BM, 0.07, direction);
         }},
        {"Ellipsoid",
         [](SimbodyMatterSubsystem&, MobilizedBody& parent, const Transform& X_PF, const Body& body,
            const Transform& X_BM, Direction direction) {
             return MobilizedBody::Ellipsoid(parent, X_PF, body, X_BM, Vec3(0.1, 0.2, 0.15),
                                             direction);
         }},
        {"FunctionBased",
         [](SimbodyMatterSubsystem&, MobilizedBody& parent, const Transform& X_PF, const Body& body,
            const Transform& X_BM, Direction direction) {
             // Two coordinates: a rotation about x and y with a coupled shift along z.
             const Array_<const Function*> functions{new Function::Linear(Vector(Vec2(1, 0.1))),
                                                     new Function::Linear(Vector(Vec2(1, 0))),
                                                     new Function::Constant(0.2, 0),
                                                     new Function::Constant(0.1, 0),
                                                     new Function::Constant(0, 0),
                                                     new Function::Sinusoid(0.3, 1.5, 0.2)};
             const Array_<Array_<int>> coordinates{Array_<int>(1, 0), Array_<int>(1, 1),
                                                   Array_<int>(),     Array_<int>(),
                                                   Array_<int>(),     Array_<int>(1, 0)};
             return MobilizedBody::FunctionBased(parent, X_PF, body, X_BM, 2, functions,
                                                 coordinates, direction);
         }},
        {"CustomCircle",
         [](SimbodyMatterSubsystem& matter, MobilizedBody& parent, const Transform& X_PF,
            const Body& body, const Transform& X_BM, Direction direction) {
             return MobilizedBody::Custom(parent, new Circle(matter), X_PF, body, X_BM, direction);
         }},
        {"CustomBall",
         [](SimbodyMatterSubsystem& matter, MobilizedBody& parent, const Transform& X_PF,
            const Body& body, const Transform& X_BM, Direction direction) {
             return MobilizedBody::Custom(parent, new HandMadeBall(matter), X_PF, body, X_BM,
                                          direction);
         }},
    };
}

struct Case {
    Kind kind;
    Direction direction;
    bool useEulerAngles;
};

/** Reversed and with quaternions, Simbody 3.7's q̇ of these mobilizers is inconsistent with their
velocities: its integrators lose energy. simflex refuses them. **/
bool isLine(const Kind& kind) {
    return std::string(kind.name).find("Line") != std::string::npos;
}

std::vector<Case> makeCases() {
    std::vector<Case> cases;
    for (const Kind& kind : makeKinds())
        for (Direction direction : {MobilizedBody::Forward, MobilizedBody::Reverse})
            for (bool useEulerAngles : {false, true})
                if (useEulerAngles || direction == MobilizedBody::Forward || !isLine(kind))
                    cases.push_back({kind, direction, useEulerAngles});
    return cases;
}

class Mobilizers : public testing::TestWithParam<Case> {};

TEST_P(Mobilizers, MoveAsInSimbody) {
    const Case& which = GetParam();
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, Vec3(1, -9.81, 2));
    MobilizedBody::Pin base(matter.Ground(), Transform(Rotation(0.3, XAxis), Vec3(0.1, 0, 0)),
                            makeBrick(1), Transform(Vec3(0, 0.3, 0)));
    MobilizedBody middle = which.kind.make(
        matter, base, Transform(Rotation(0.4, YAxis), Vec3(0, -0.3, 0)), makeBrick(0.7),
        Transform(Rotation(0.2, XAxis), Vec3(0.1, 0.2, 0)), which.direction);
    MobilizedBody::Ball tip(middle, Transform(Vec3(0, -0.2, 0.1)), makeBrick(0.4),
                            Transform(Vec3(0, 0.1, 0)));
    State state = system.realizeTopology();
    matter.setUseEulerAngles(state, which.useEulerAngles);
    system.realizeModel(state);
    // Away from the singularities of angles and polar coordinates.
    for (int k = 0; k < middle.getNumQ(state); ++k)
        middle.setOneQ(state, k, middle.getOneQ(state, k) + 0.3 + 0.1 * k);
    for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.4 * std::cos(1.7 * i);
    system.project(state);  // normalizes quaternions

    RungeKuttaMersonIntegrator reference(system);
    reference.setAccuracy(1e-10);
    TimeStepper stepper(system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.2);

    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);
    State start = integrator.getState();
    system.realize(start, Stage::Acceleration);
    EXPECT_LT((integrator.getUDot() - start.getUDot()).normInf(),
              1e-10 * (1 + start.getUDot().normInf()));
    integrator.stepTo(0.2);
    const State& ours = integrator.getState();
    State theirs = stepper.getState();
    system.realize(theirs, Stage::Velocity);
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& body = matter.getMobilizedBody(i);
        const Transform a = body.getBodyTransform(ours), b = body.getBodyTransform(theirs);
        EXPECT_LT((a.p() - b.p()).norm(), 3e-7) << "body " << int(i);
        EXPECT_LT((a.R().asMat33() - b.R().asMat33()).norm(), 3e-6) << "body " << int(i);
    }
}

INSTANTIATE_TEST_SUITE_P(All, Mobilizers, testing::ValuesIn(makeCases()),
                         [](const testing::TestParamInfo<Case>& test) {
                             return std::string(test.param.kind.name) +
                                    (test.param.direction == MobilizedBody::Reverse ? "Reversed"
                                                                                    : "") +
                                    (test.param.useEulerAngles ? "InEulerAngles" : "");
                         });

//---------------------------------------------------------------------------------------------------------

TEST(MobilizerErrors, VelocitiesThatAreNotRatesOfPositionsAreRefusedByName) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::LineOrientation line(matter.Ground(), Transform(Rotation(0.3, XAxis)),
                                        makeBrick(1), Transform(Vec3(0, 0.3, 0)),
                                        MobilizedBody::Reverse);
    State state = system.realizeTopology();
    line.setOneQ(state, 1, 0.3);
    BdfIntegrator integrator(system);
    try {
        integrator.initialize(state);
        FAIL();
    } catch (const std::invalid_argument& error) {
        for (const char* word : {"mobilized body 1", "LineOrientation", "setUseEulerAngles"})
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
}

/** Counts realizations of the system to Stage::Position. **/
class Counter : public Subsystem::Guts {
public:
    explicit Counter(int& count) : Guts("Counter", "1"), m_count(count) {}
    Guts* cloneImpl() const override { return new Counter(*this); }
    int realizeSubsystemPositionImpl(const State&) const override {
        ++m_count;
        return 0;
    }

private:
    int& m_count;
};

class CounterSubsystem : public Subsystem {
public:
    CounterSubsystem(MultibodySystem& system, int& count) {
        adoptSubsystemGuts(new Counter(count));
        system.adoptSubsystem(*this);
    }
};

struct FlexiblePendulum {
    FlexiblePendulum()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter),
          boom(flexible, test::makePointMassPart().body, "boom"),
          bob(matter.Ground(), makeBrick(1)),
          hinge(flexible, matter.Ground(), boom.interface("A")),
          grip(flexible, boom.interface("B"), bob) {}
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody boom;
    MobilizedBody::Translation bob;
    Joint::Ball hinge;
    Joint::Ball grip;
};

TEST(Simbody, IsAskedForNothingInAModelWithoutForeignParts) {
    FlexiblePendulum model;
    int count = 0;
    CounterSubsystem counter(model.system, count);
    State state = model.system.realizeTopology();
    for (int k = 0; k < 1; ++k)  // locks are known without it
        model.boom.getModalMobilizer(k).lock(state);
    BdfIntegrator integrator(model.system);
    integrator.initialize(state);
    integrator.stepTo(1e-3);
    const long steps = integrator.getStatistics().stepsTaken;
    count = 0;
    integrator.stepTo(0.05);
    EXPECT_GT(integrator.getStatistics().stepsTaken - steps, 20);
    EXPECT_LE(count, 2);  // for the returned State
}

TEST(Simbody, IsNotAskedForTreesOfPlainMobilizers) {
    for (bool useEulerAngles : {false, true})
        for (const Kind& kind : makeKinds()) {
            const std::string name = kind.name;
            const bool isOther = name.find("Custom") == 0 || name == "FunctionBased" ||
                                 name == "Ellipsoid" || name == "SphericalCoords" || isLine(kind);
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            MobilizedBody::Free base(matter.Ground(), makeBrick(1));
            MobilizedBody body = kind.make(matter, base, Transform(), makeBrick(1),
                                           Transform(Vec3(0, 0.2, 0)), MobilizedBody::Forward);
            int count = 0;
            CounterSubsystem counter(system, count);
            State state = system.realizeTopology();
            matter.setUseEulerAngles(state, useEulerAngles);
            system.realizeModel(state);
            base.setUToFitAngularVelocity(state, Vec3(1, 2, 3));
            for (int k = 0; k < body.getNumQ(state); ++k)
                body.setOneQ(state, k, body.getOneQ(state, k) + 0.3 + 0.1 * k);
            BdfIntegrator integrator(system);
            integrator.initialize(state);
            count = 0;
            integrator.stepTo(0.05);
            EXPECT_GT(integrator.getStatistics().stepsTaken, 5) << name;
            if (isOther)
                EXPECT_GT(count, 10) << name;
            else
                EXPECT_LE(count, 2) << name;
        }
}

TEST(FlexibleFrames, EulerAnglesAndQuaternionsGiveTheSameMotion) {
    std::vector<Transform> poses;
    for (bool useEulerAngles : {false, true}) {
        FlexiblePendulum model;
        State state = model.system.realizeTopology();
        model.matter.setUseEulerAngles(state, useEulerAngles);
        model.system.realizeModel(state);
        model.boom.setPoseByInterface(state, "A", Transform(Rotation(0.3, ZAxis)));
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-7);
        integrator.initialize(state);
        integrator.stepTo(0.1);
        poses.push_back(model.boom.getFramePose(integrator.getState()));
    }
    EXPECT_LT((poses[0].p() - poses[1].p()).norm(), 1e-12);
    EXPECT_LT((poses[0].R().asMat33() - poses[1].R().asMat33()).norm(), 1e-12);
}

TEST(JointOnMobilizer, ThatHoldsTheSameIsReportedAsIdle) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Pin wheel(matter.updGround(), makeBrick(2));
    Joint::Pin(flexible, matter.Ground(), wheel, "bearing");
    State state = system.realizeTopology();
    wheel.setOneU(state, 0, 1);
    BdfIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.01);
    const std::vector<std::string> redundant = integrator.getRedundantConstraints();
    ASSERT_EQ(redundant.size(), 5u);
    for (const std::string& line : redundant)
        EXPECT_NE(line.find("of 'bearing' is redundant: the bodies on both sides"),
                  std::string::npos)
            << line;
}

}  // namespace
}  // namespace simflex
