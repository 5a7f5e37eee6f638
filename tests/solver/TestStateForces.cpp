// User-defined forces and state equations: laws, controllers, counted turns.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <sstream>
#include <string>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/StateForces.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using Vector3 = std::array<Signal, 3>;

/** Masses of 1 kg on slides along x. **/
struct Slides {
    explicit Slides(int count) {
        for (int i = 0; i < count; ++i)
            masses.push_back(MobilizedBody::Slider(
                matter.Ground(), Transform(Vec3(0, 0.1 * i, 0)),
                Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Vec3(0)));
    }

    Signal position(int i) {
        return Signal::displacement(matter.Ground(), masses[size_t(i)], XAxis);
    }
    Signal speed(int i) {
        return Signal::displacementRate(matter.Ground(), masses[size_t(i)], XAxis);
    }
    void push(int i, const Signal& force) {
        StateForce(flexible, masses[size_t(i)], Vector3{force, Signal(), Signal()});
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<MobilizedBody> masses;
};

/** Returns Σ c_i x_i. **/
Signal sum(const std::vector<Signal>& terms, const std::vector<Real>& factors) {
    return Signal::function(terms, [factors](Real, const Real* x, Real* slopes) {
        Real value = 0;
        for (size_t i = 0; i < factors.size(); ++i) {
            value += factors[i] * x[i];
            if (slopes) slopes[i] = factors[i];
        }
        return value;
    });
}

/** Solves ẋ = A x from x₀. **/
Eigen::VectorXd propagate(const Eigen::MatrixXd& A, const Eigen::VectorXd& x0, double time) {
    const Eigen::EigenSolver<Eigen::MatrixXd> eigen(A);
    const Eigen::VectorXcd weights = eigen.eigenvectors().partialPivLu().solve(
        Eigen::VectorXcd(x0.cast<std::complex<double>>()));
    const Eigen::VectorXcd grown =
        (eigen.eigenvalues().array() * time).exp().matrix().cwiseProduct(weights);
    return (eigen.eigenvectors() * grown).real();
}

const Real Proportional = 300, Derivative = 20, Integral = 900, Target = 0.2;

/** A mass driven to a target by proportional, integral and derivative action: (x, v, z). **/
struct ControlledSlide : Slides {
    ControlledSlide() : Slides(1) {
        const Signal error = Signal::function({position(0)}, [](Real, const Real* x, Real* slopes) {
            if (slopes) slopes[0] = -1;
            return Target - x[0];
        });
        const int integral =
            flexible.adoptState(std::make_unique<SignalState>("integral", error, 0.01));
        push(0, sum({error, speed(0), Signal::state(integral)},
                    {Proportional, -Derivative, Integral}));
        system.realizeTopology();
    }

    static Eigen::Vector3d calcExact(double time) {
        Eigen::Matrix3d A;
        A << 0, 1, 0, -Proportional, -Derivative, Integral, -1, 0, 0;
        // Relative to the equilibrium x = Target, z = 0.
        const Eigen::Vector3d x0(-Target, 0, 0.01);
        return propagate(A, x0, time) + Eigen::Vector3d(Target, 0, 0);
    }

    Eigen::Vector3d take(const State& state) const {
        return {masses[0].getOneQ(state, 0), masses[0].getOneU(state, 0),
                flexible.getStateValue(state, 0)};
    }
};

template <class Integrator>
class StateForces : public ::testing::Test {};
using Integrators = ::testing::Types<BdfIntegrator, GeneralizedAlphaIntegrator, RadauIntegrator>;
TYPED_TEST_SUITE(StateForces, Integrators);

/** Two masses of 1 kg: ẍ + 0.2 ẋ + K x = 0. **/
struct CoupledSlides : Slides {
    explicit CoupledSlides(const Mat22& K) : Slides(2) {
        for (int i = 0; i < 2; ++i)
            push(i, sum({position(0), position(1), speed(i)}, {-K(i, 0), -K(i, 1), -0.2}));
        state = system.realizeTopology();
    }
    std::vector<std::string> listUnstableMotions() {
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(state);
        return equilibrium.getUnstableMotions();
    }
    State state;
};

TEST(StateForce, ForcesWithoutPotentialAreJudgedByTheMotionsThatGrow) {
    // ẍ + c ẋ + (ω² ± ik) x = 0 grows if k > cω.
    EXPECT_TRUE(CoupledSlides({100, 1.9, -1.9, 100}).listUnstableMotions().empty());
    const auto flutter = CoupledSlides({100, 2.1, -2.1, 100}).listUnstableMotions();
    ASSERT_EQ(flutter.size(), 1u);
    EXPECT_NE(flutter[0].find("oscillates"), std::string::npos);
    // Eigenvalues 10 and 12, though the symmetric part has 11 ± 20.
    EXPECT_TRUE(CoupledSlides({10, 40, 0, 12}).listUnstableMotions().empty());
    const auto falling = CoupledSlides({10, 40, 0, -12}).listUnstableMotions();
    ASSERT_EQ(falling.size(), 1u);
    EXPECT_NE(falling[0].find("falls away"), std::string::npos);
}

TYPED_TEST(StateForces, ControllerFollowsTheLinearSolution) {
    const ControlledSlide model;
    for (const Real accuracy : {1e-5, 1e-7}) {
        TypeParam integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.system.getDefaultState());
        for (const Real time : {0.05, 0.2, 0.6, 1.}) {
            integrator.stepTo(time);
            const Eigen::Vector3d found = model.take(integrator.getState()),
                                  exact = ControlledSlide::calcExact(time);
            // Within a step, speeds are weighted by their effect on positions.
            EXPECT_NEAR(found[0], exact[0], 300 * accuracy) << time;
            EXPECT_NEAR(found[2], exact[2], 300 * accuracy) << time;
        }
    }
}

TYPED_TEST(StateForces, FiltersMayBeMuchFasterThanSteps) {
    // Damping by a filtered rate, d (x − f)/T with f' = (x − f)/T: approaches d ẋ for short T.
    const Real damping = 4, stiffness = 100;
    struct Effort {
        Real steps, iterations;
    };
    const auto run = [&](Real T) {
        Slides model(1);
        if (T > 0) {
            auto state = std::make_unique<SignalState>("filter", 0.1);
            SignalState& filter = *state;
            const Signal filtered = Signal::state(model.flexible.adoptState(std::move(state)));
            filter.setRate(sum({model.position(0), filtered}, {1 / T, -1 / T}));
            model.push(0,
                       sum({model.position(0), filtered}, {-stiffness - damping / T, damping / T}));
        } else {
            model.push(0, sum({model.position(0), model.speed(0)}, {-stiffness, -damping}));
        }
        State start = model.system.realizeTopology();
        model.masses[0].setOneQ(start, 0, 0.1);
        TypeParam integrator(model.system);
        integrator.setAccuracy(1e-6);
        integrator.initialize(start);
        integrator.stepTo(1);
        const Real omega = std::sqrt(stiffness - 4);
        const Real exact = 0.1 * std::exp(-2.) * (std::cos(omega) + 2 / omega * std::sin(omega));
        EXPECT_NEAR(model.masses[0].getOneQ(integrator.getState(), 0), exact, 2e-4);
        const auto& statistics = integrator.getStatistics();
        EXPECT_EQ(statistics.convergenceFailures, 0);
        return Effort{Real(statistics.stepsTaken), Real(statistics.newtonIterations)};
    };
    const Effort filtered = run(1e-6), direct = run(0);
    // Generalized-α's trapezoidal rule for z does not damp modes that decay within a step.
    if (std::is_same<TypeParam, GeneralizedAlphaIntegrator>::value) return;
    // Steps span some ten thousand time constants; an explicit rule would take a million.
    EXPECT_LT(filtered.steps, 3 * direct.steps);
    EXPECT_LT(filtered.iterations, 4 * direct.iterations);
}

TYPED_TEST(StateForces, GoesOnFromACheckpointToTheBit) {
    const ControlledSlide model;
    const auto make = [&] {
        auto integrator = std::make_unique<TypeParam>(model.system);
        integrator->setAccuracy(1e-5);
        return integrator;
    };
    const State start = model.system.getDefaultState();
    const auto whole = make(), resumed = make();
    whole->initialize(start);
    whole->stepTo(0.1);
    std::stringstream stream;
    whole->writeCheckpoint(stream);
    whole->stepTo(0.3);
    resumed->readCheckpoint(stream, start);
    resumed->stepTo(0.3);
    EXPECT_EQ(model.take(whole->getState()), model.take(resumed->getState()));
}

TYPED_TEST(StateForces, TurnsAreCounted) {
    // A flywheel winds up a spring: θ = ω₀/Ω sin Ωt, four turns each way.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free wheel(matter.Ground(),
                                    Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.5))));
    const Joint::Pin bearing(flexible, matter.Ground(), wheel, "bearing");
    const Real Omega = 2, Amplitude = 8 * Pi, theta0 = 2.5;
    const Signal angle = Signal::turnedAngle(flexible, bearing);
    CoordinateForce(flexible, bearing, 0, sum({angle}, {-0.5 * Omega * Omega}));
    State state = system.realizeTopology();
    wheel.setQToFitRotation(state, Rotation(theta0, ZAxis));
    wheel.setUToFitAngularVelocity(state, Vec3(0, 0, Amplitude * Omega));
    TypeParam integrator(system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    for (int i = 1; i <= 40; ++i) {
        const Real t = 0.1 * i;
        integrator.stepTo(t);
        const Real exact = Amplitude * std::sin(Omega * t) + theta0 * std::cos(Omega * t);
        EXPECT_NEAR(angle.calcValue(flexible, integrator.getState()), exact, 2e-2) << t;
    }
}

/** A body on a spring, built in or as a law, initially at rest off its axis. **/
struct SprungBody {
    explicit SprungBody(bool isLaw)
        : body(matter.Ground(), Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.1)))) {
        Force::Gravity(forces, matter, Vec3(0, -9.81, 0));
        const Attachment from(matter.Ground(), Vec3(0.1, 1, 0)), to(body, Vec3(0.1, 0.2, 0.3));
        const Real stiffness = 4e4, damping = 30, length = 0.5;
        if (isLaw)
            LineForce(flexible, from, to,
                      Signal::function({Signal::distance(from, to), Signal::distanceRate(from, to)},
                                       [=](Real, const Real* x, Real* slopes) {
                                           if (slopes) slopes[0] = stiffness, slopes[1] = damping;
                                           return stiffness * (x[0] - length) + damping * x[1];
                                       }));
        else
            TwoPointSpringDamper(flexible, from, to, stiffness, damping, length);
        system.realizeTopology();
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Free body;
};

TYPED_TEST(StateForces, SpringByLawIsASpring) {
    const SprungBody byLaw(true), builtIn(false);
    TypeParam law(byLaw.system), spring(builtIn.system);
    for (TypeParam* integrator : {&law, &spring}) {
        integrator->setAccuracy(1e-6);
        integrator->initialize((integrator == &law ? byLaw : builtIn).system.getDefaultState());
    }
    for (int i = 0; i < 6; ++i)
        EXPECT_NEAR(law.getUDot()[i], spring.getUDot()[i], 1e-12 * spring.getUDot().norm());
    law.stepTo(1);
    spring.stepTo(1);
    // Their Newton matrices differ by the effect of the line's rotation on the rate.
    for (int i = 0; i < 7; ++i)
        EXPECT_NEAR(law.getState().getQ()[i], spring.getState().getQ()[i], 1e-6);
    EXPECT_NEAR(law.getStatistics().stepsTaken, spring.getStatistics().stepsTaken,
                0.01 * spring.getStatistics().stepsTaken + 1);
    EXPECT_NEAR(law.getStatistics().newtonIterations, spring.getStatistics().newtonIterations,
                0.03 * spring.getStatistics().newtonIterations);
}

TYPED_TEST(StateForces, OneSidedTermsAreInTheNewtonMatrix) {
    // A stiff force on one mass that depends on another one does not disturb Newton's method.
    const Real stiffness = 1e6, damping = 2e3;
    const auto run = [&](bool isCoupled) {
        Slides model(2);
        model.push(1, sum({model.position(1), model.speed(1)}, {-100., -0.1}));
        model.push(
            0, sum({model.position(isCoupled ? 1 : 0), model.speed(0)}, {-stiffness, -damping}));
        State state = model.system.realizeTopology();
        model.masses[1].setOneQ(state, 0, 0.01);
        TypeParam integrator(model.system);
        integrator.setAccuracy(1e-6);
        integrator.initialize(state);
        integrator.stepTo(1);
        if (isCoupled) {
            Eigen::Matrix4d A;
            A << 0, 0, 1, 0, 0, 0, 0, 1, 0, -stiffness, -damping, 0, 0, -100, 0, -0.1;
            const Eigen::Vector4d exact = propagate(A, Eigen::Vector4d(0, 0.01, 0, 0), 1);
            EXPECT_NEAR(model.masses[0].getOneQ(integrator.getState(), 0), exact[0],
                        2e-3 * std::abs(exact[0]));
        }
        const auto& statistics = integrator.getStatistics();
        return Real(statistics.newtonIterations) / statistics.stepsTaken;
    };
    EXPECT_LT(run(true), 1.3 * run(false) + 0.5);
}

TEST(StateForce, NativeIntegratorsSeeTheSame) {
    const ControlledSlide model;
    State state = model.system.getDefaultState();
    model.flexible.initializeNative(state);
    RungeKuttaMersonIntegrator integrator(model.system);
    integrator.setAccuracy(1e-10);
    TimeStepper stepper(model.system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.5);
    const Eigen::Vector3d exact = ControlledSlide::calcExact(0.5);
    EXPECT_LT((model.take(integrator.getState()) - exact).norm(), 1e-8);
}

TEST(StateForce, EigenvaluesAreThoseOfTheClosedLoop) {
    // m ẍ + d ẋ + k x = 0 of a law.
    Slides model(1);
    model.push(0, sum({model.position(0), model.speed(0)}, {-400., -4.}));
    const State state = model.system.realizeTopology();
    const auto modes = calcEigenmodes(calcLinearization(model.system, state));
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].eigenvalue.real(), -2, 1e-7);
    EXPECT_NEAR(std::abs(modes[0].eigenvalue.imag()), std::sqrt(396), 1e-6);
}

TEST(StateForce, EigenvaluesAreThoseOfTheControlledLoop) {
    const ControlledSlide model;
    const auto modes =
        calcEigenmodes(calcLinearization(model.system, model.system.getDefaultState()));
    Eigen::Matrix3d A;
    A << 0, 1, 0, -Proportional, -Derivative, Integral, -1, 0, 0;
    const Eigen::Vector3cd exact = A.eigenvalues();
    ASSERT_EQ(modes.size(), 2u);
    for (const Eigenmode& mode : modes) {
        double nearest = 1e9;
        for (int i = 0; i < 3; ++i)
            nearest = std::min(nearest, std::abs(exact[i] - std::complex<double>(mode.eigenvalue)));
        EXPECT_LT(nearest, 1e-6);
    }
}

TEST(StateForce, EigenvaluesAreThoseOfALoopThatHoldsByItsStateAlone) {
    // m ẍ = z, T ż = −P x − z: the only restoring force acts through the filter, so it is unstable.
    // An unused state or one far from rest makes no difference.
    const Real P = 100, T = 1e-3;
    for (const Real initial : {0.0, 3e3}) {
        Slides model(1);
        SignalState* states[2];
        const char* const names[] = {"filter", "observer"};
        for (int k = 0; k < 2; ++k) {
            auto state = std::make_unique<SignalState>(names[k], k == 0 ? initial : 7);
            states[k] = state.get();
            model.flexible.adoptState(std::move(state));
        }
        states[0]->setRate(sum({model.position(0), Signal::state(0)}, {-P / T, -1 / T}));
        states[1]->setRate(sum({model.position(0), Signal::state(1)}, {10, -10}));
        model.push(0, Signal::state(0));
        const State state = model.system.realizeTopology();
        const auto modes = calcEigenmodes(calcLinearization(model.system, state));
        Eigen::Matrix4d A;
        A << 0, 1, 0, 0, 0, 0, 1, 0, -P / T, 0, -1 / T, 0, 10, 0, 0, -10;
        const Eigen::Vector4cd exact = A.eigenvalues();
        ASSERT_EQ(modes.size(), 3u);
        for (const Eigenmode& mode : modes) {
            double nearest = 1e9;
            for (int i = 0; i < 4; ++i)
                nearest =
                    std::min(nearest, std::abs(exact[i] - std::complex<double>(mode.eigenvalue)));
            EXPECT_LT(nearest, 1e-7 * std::abs(std::complex<double>(mode.eigenvalue)));
            EXPECT_FALSE(mode.isUncertain());
        }
    }
}

TEST(StateForce, SmallMotionsKnowNoSaturationNearBy) {
    Slides model(1);
    model.push(0, Signal::function({model.position(0)}, [](Real, const Real* x, Real* slopes) {
                   const Real force = -400 * x[0], most = 1e-6;
                   const bool isFree = std::abs(force) < most;
                   if (slopes) slopes[0] = isFree ? -400 : 0;
                   return isFree ? force : std::copysign(most, force);
               }));
    const State state = model.system.realizeTopology();
    const auto modes = calcEigenmodes(calcLinearization(model.system, state));
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].frequency, 20 / (2 * Pi), 1e-8);
}

TEST(StateForce, EquilibriumKeepsStatesFromChanging) {
    // The integral carries the weight: kᵢ z = m g at the target.
    Slides model(1);
    const Signal error = Signal::function({model.position(0)}, [](Real, const Real* x, Real* s) {
        if (s) s[0] = -1;
        return Target - x[0];
    });
    const int integral =
        model.flexible.adoptState(std::make_unique<SignalState>("integral", error, 0.01));
    model.push(0, sum({error, Signal::state(integral)}, {Proportional, Integral}));
    Force::Gravity(model.forces, model.matter, Vec3(-9.81, 0, 0));
    model.system.realizeTopology();
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.system.getDefaultState());
    const State& state = equilibrium.getState();
    EXPECT_NEAR(model.masses[0].getOneQ(state, 0), Target, 1e-9);
    EXPECT_NEAR(model.flexible.getStateValue(state, integral), 9.81 / Integral, 1e-9);
}

/** Finite differences for small twists. **/
TEST(Signal, GradientsAreThoseOfDifferences) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const MobilizedBody::Free a(matter.Ground(),
                                Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))),
        b(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    const Attachment A(a, Vec3(0.1, 0, 0.2)), B(b, Vec3(0, 0.3, 0));
    const Signal distance = Signal::distance(A, B), rate = Signal::distanceRate(A, B),
                 offset = Signal::displacement(A, B, YAxis),
                 angle = Signal::coordinate(JointCoordinate::makeAngleAboutZ(), A, B);
    const Signal product =
        Signal::function({distance, offset, angle}, [](Real t, const Real* x, Real* slopes) {
            if (slopes) {
                slopes[0] = x[1] * x[2];
                slopes[1] = x[0] * x[2];
                slopes[2] = x[0] * x[1];
            }
            return t + x[0] * x[1] * x[2];
        });
    Array_<FrameMotion> frames(2);
    frames[0].X = Transform(Rotation(0.3, UnitVec3(1, 2, 3)), Vec3(0.1, 0.2, -0.4));
    frames[1].X = Transform(Rotation(-0.5, UnitVec3(1, -1, 0.5)), Vec3(-0.6, 0.3, 0.8));
    const Real gamma = 0.7, h = 1e-6;
    for (const Signal& signal : {distance, rate, offset, angle, product}) {
        Array_<Attachment> attachments;
        const std::vector<int> places = signal.addFramesTo(attachments);
        ASSERT_EQ(attachments.size(), 2u);
        Array_<SpatialVec> gradient(2, SpatialVec(Vec3(0), Vec3(0)));
        signal.addInGradient(0.1, frames, places, gamma, 2, {gradient.data()});
        for (unsigned k = 0; k < 2; ++k)
            for (int row = 0; row < 2; ++row)
                for (int axis = 0; axis < 3; ++axis) {
                    const auto calc = [&](Real step) {
                        Array_<FrameMotion> moved = frames;
                        SpatialVec twist(Vec3(0), Vec3(0));
                        twist[row][axis] = step;
                        moved[k].V += twist;
                        const Vec3 turn = gamma * twist[0];
                        if (turn.norm() > 0)
                            moved[k].X.updR() =
                                Rotation(turn.norm(), UnitVec3(turn)) * frames[k].X.R();
                        moved[k].X.updP() += gamma * twist[1];
                        return signal.calc(0.1, moved, places);
                    };
                    EXPECT_NEAR(gradient[k][row][axis], (calc(h) - calc(-h)) / h, 1e-8);
                }
    }
}

TEST(Signal, RefusesWhatIsNotThere) {
    Slides model(2);
    const Joint::Ball ball(model.flexible, model.masses[0], model.masses[1], "ball");
    EXPECT_THROW(Signal::coordinate(ball), std::out_of_range);
    EXPECT_THROW(Signal::function({}, nullptr), std::invalid_argument);
    EXPECT_THROW(SignalState("z", Signal(), NaN), std::invalid_argument);
    EXPECT_THROW(SignalState("z", Signal(), 0, -1), std::invalid_argument);
}

/** A free body of point masses with a load on some of its nodes. **/
struct LoadedBody {
    explicit LoadedBody(const std::function<void(LoadedBody&)>& load)
        : body(flexible, part, "body") {
        load(*this);
        state = system.realizeTopology();
        body.setFramePose(state, Transform(Rotation(0.7, UnitVec3(1, 2, 3)), Vec3(1, 2, 3)));
        Vector xi(body.getNumModes());
        for (int i = 0; i < xi.size(); ++i) xi[i] = 2e-2 * std::cos(1.0 + i);
        body.setModalCoordinates(state, xi);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = std::sin(2.0 + i);
    }

    LoadShape makeShape() const {
        return LoadShape::fromNodalForces(*part, {0, 3, 5},
                                          {Vec3(30, -10, 5), Vec3(0, 20, -8), Vec3(7, 1, 12)});
    }

    const std::shared_ptr<const ReducedBody> part = test::makePointMassPart().body;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    State state;
};

TEST(StateLoad, AcceleratesAsTheSameLoadOfTime) {
    LoadedBody given([](LoadedBody& model) {
        DistributedLoad(model.flexible, model.body, model.makeShape(), 3);
    });
    LoadedBody law([](LoadedBody& model) {
        StateLoad(model.flexible, model.body, model.makeShape(), Signal::constant(3));
    });
    given.system.realize(given.state, Stage::Acceleration);
    law.system.realize(law.state, Stage::Acceleration);
    const Vector expected = given.state.getUDot(), found = law.state.getUDot();
    EXPECT_LT((found - expected).normInf(), 1e-11 * expected.normInf());

    BdfIntegrator first(given.system), second(law.system);
    for (BdfIntegrator* integrator : {&first, &second}) integrator->setAccuracy(1e-9);
    first.initialize(given.state);
    second.initialize(law.state);
    EXPECT_LT((second.getUDot() - first.getUDot()).normInf(), 1e-10 * expected.normInf());
    first.stepTo(0.05);
    second.stepTo(0.05);
    EXPECT_LT((second.getState().getQ() - first.getState().getQ()).normInf(), 1e-7);
}

TEST(StateLoad, OfWhatItBendsIsAStiffness) {
    // f_ξ = −k b s with s the distance between two ends, from rest: K = Ω² + k b gᵀ.
    const Real k = 4e3;
    const auto end = [](const LoadedBody& made, size_t i) {
        const auto& s = made.part->interfaces[i].position;
        return Vec3(s[0], s[1], s[2]);
    };
    Vector b;
    LoadedBody model([&](LoadedBody& made) {
        b.resize(made.body.getNumModes());
        for (int i = 0; i < b.size(); ++i) b[i] = std::cos(3.0 * i);
        const Signal distance = Signal::distance(Attachment::onInterface(made.body, "A"),
                                                 Attachment::onInterface(made.body, "B"));
        const Real rest = (end(made, 1) - end(made, 0)).norm();
        const auto law = [=](Real, const Real* x, Real* slopes) {
            if (slopes) *slopes = -k;
            return -k * (*x - rest);
        };
        StateLoad(made.flexible, made.body, LoadShape::fromModalForces(b),
                  Signal::function({distance}, law));
    });
    const State rest = model.system.getDefaultState();
    const int n = model.body.getNumModes();
    const Vec3 along(UnitVec3(end(model, 1) - end(model, 0)));
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, n);
    for (int j = 0; j < n; ++j) {
        const size_t at = 3 * size_t(j);
        const auto &PhiA = model.part->interfaces[0].Phi, &PhiB = model.part->interfaces[1].Phi;
        Real g = 0;
        for (size_t a = 0; a < 3; ++a) g += along[int(a)] * (PhiB[at + a] - PhiA[at + a]);
        for (int i = 0; i < n; ++i) K(i, j) = k * b[i] * g;
        K(j, j) += model.part->omegaSquared[size_t(j)];
    }
    std::vector<Real> expected, found;
    for (const std::complex<double> value : K.eigenvalues()) {
        ASSERT_NEAR(value.imag(), 0, 1e-6);
        expected.push_back(std::sqrt(value.real()) / (2 * Pi));
    }
    for (const Eigenmode& mode : calcEigenmodes(calcLinearization(model.system, rest)))
        if (!mode.isRigidMotion()) found.push_back(mode.frequency);
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i] / expected[i], 1, 1e-7) << i;
    // The load changes the frequency noticeably.
    EXPECT_GT(std::abs(found[0] - std::sqrt(model.part->omegaSquared[0]) / (2 * Pi)), 0.01);
}

}  // namespace
}  // namespace simflex
