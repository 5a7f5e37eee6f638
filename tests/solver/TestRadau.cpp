// Radau IIA: its constants, achieved accuracy, Newton matrix and events.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/integration/RadauTableau.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

::Eigen::Matrix3d toMatrix(const double (&rows)[3][3]) {
    ::Eigen::Matrix3d matrix;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) matrix(i, j) = rows[i][j];
    return matrix;
}

TEST(RadauTableau, IntegratesPolynomialsExactlyAndFallsIntoARealAndAComplexPart) {
    const ::Eigen::Matrix3d A = toMatrix(radau::A), W = toMatrix(radau::W), T = toMatrix(radau::T);
    // Stages are exact to degree 2, the step's end to degree 4.
    for (int k = 1; k <= 5; ++k)
        for (int i = 0; i < 3; ++i) {
            if (k > 3 && i < 2) continue;
            double sum = 0;
            for (int j = 0; j < 3; ++j) sum += A(i, j) * std::pow(radau::C[j], k - 1);
            EXPECT_NEAR(sum, std::pow(radau::C[i], k) / k, 1e-15) << k << " " << i;
        }
    EXPECT_LT((A * W - ::Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_LT((T * toMatrix(radau::InverseT) - ::Eigen::Matrix3d::Identity()).norm(), 1e-14);
    ::Eigen::Matrix3d parts;
    parts << radau::RealEigenvalue, 0, 0, 0, radau::Alpha, -radau::Beta, 0, radau::Beta,
        radau::Alpha;
    EXPECT_LT((toMatrix(radau::InverseT) * W * T - parts).norm(), 1e-13);
    // ŷ has order 3: its difference from the collocation solution of ẏ = t^k vanishes up to k = 2.
    for (int k = 0; k <= 3; ++k) {
        double difference = k == 0 ? 1 : 0;
        for (int i = 0; i < 3; ++i) {
            double stage = 0;
            for (int j = 0; j < 3; ++j) stage += A(i, j) * std::pow(radau::C[j], k);
            difference += radau::E[i] * stage;
        }
        if (k < 3)
            EXPECT_NEAR(difference, 0, 1e-14) << k;
        else
            EXPECT_GT(std::abs(difference), 1e-3);
    }
}

/** Masses on springs at 1 and 2.7 Hz, and their closed form. **/
struct Springs {
    Springs() {
        for (const Real frequency : {1.0, 2.7}) {
            masses.emplace_back(matter.Ground(),
                                Body::Rigid(MassProperties(2, Vec3(0), Inertia(1))));
            const Real omega = 2 * Pi * frequency;
            Force::MobilityLinearSpring(forces, masses.back(), MobilizerQIndex(0),
                                        2 * omega * omega, 0);
        }
        state = system.realizeTopology();
        for (MobilizedBody::Slider& mass : masses) mass.setOneQ(state, 0, 0.1);
    }
    Real calcError(const State& at) const {
        const Real t = at.getTime();
        return std::max(std::abs(masses[0].getOneQ(at, 0) - 0.1 * std::cos(2 * Pi * t)),
                        std::abs(masses[1].getOneQ(at, 0) - 0.1 * std::cos(2 * Pi * 2.7 * t)));
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    std::vector<MobilizedBody::Slider> masses;
    State state;
};

TEST(Radau, GlobalErrorIsTenTimesTheAccuracyAtMostInTenPeriods) {
    const Springs model;
    long steps = 0;
    for (const Real accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
        RadauIntegrator integrator(model.system);
        integrator.setAccuracyNorm(ImplicitIntegrator::AccuracyNorm::Displacement);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.state);
        Real error = 0;
        for (int k = 1; k <= 1000; ++k) {
            integrator.stepTo(0.01 * k);
            error = std::max(error, model.calcError(integrator.getState()));
        }
        EXPECT_LT(error, 10 * accuracy) << accuracy;
        // The accuracy is not far exceeded either.
        EXPECT_GT(error, 1e-3 * accuracy) << accuracy;
        steps = integrator.getStatistics().stepsTaken;
    }
    EXPECT_LT(steps, 6000);
}

/** Two links on pins and a thin one on a ball that spins fast about its own axis: with Simbody's
mobilizers, or with joints between free bodies. **/
struct ThinLink {
    enum class Angles { Quaternion, Euler };
    explicit ThinLink(bool byJoints, Angles angles = Angles::Quaternion) {
        const auto makeBar = [](Real mass, Real length) {
            return Body::Rigid(
                MassProperties(mass, Vec3(0), UnitInertia::brick(length / 2, 0.01, 0.01) * mass));
        };
        const Body::Rigid bodies[] = {makeBar(1, 0.3), makeBar(0.5, 0.3), makeBar(0.3, 0.2)};
        const Real halves[] = {0.15, 0.15, 0.1};
        const Vec3 spin(30, 1, 0);
        Real along = 0;
        std::vector<MobilizedBody::Free> free;
        for (int k = 0; k < 3; ++k) {
            const Transform inside(Vec3(-halves[k], 0, 0));
            if (byJoints) {
                free.emplace_back(matter.Ground(), bodies[k]);
                const Attachment left =
                    k ? Attachment(links.back(), Vec3(halves[k - 1], 0, 0)) : matter.Ground();
                const Attachment right(free.back(), inside.p());
                if (k < 2)
                    Joint::Pin(flexible, left, right);
                else
                    Joint::Ball(flexible, left, right);
                links.push_back(free.back());
                continue;
            }
            MobilizedBody& parent = k ? links.back() : matter.updGround();
            const Transform outside = k ? Transform(Vec3(halves[k - 1], 0, 0)) : Transform();
            if (k < 2)
                links.emplace_back(MobilizedBody::Pin(parent, outside, bodies[k], inside));
            else
                links.push_back(MobilizedBody::Ball(parent, outside, bodies[k], inside));
        }
        Force::TwoPointLinearSpring(forces, matter.Ground(), Vec3(0.5, 0.4, 0.1), links.back(),
                                    Vec3(0), 200, std::sqrt(0.21));
        state = system.realizeTopology();
        matter.setUseEulerAngles(state, angles == Angles::Euler);
        system.realizeModel(state);
        for (int k = 0; byJoints && k < 3; ++k) {
            free[size_t(k)].setQToFitTranslation(state, Vec3(along + halves[k], 0, 0));
            along += 2 * halves[k];
        }
        if (byJoints) {
            free[2].setUToFitAngularVelocity(state, spin);
            free[2].setUToFitLinearVelocity(state, spin % Vec3(halves[2], 0, 0));
        } else {
            links[2].setUToFitAngularVelocity(state, spin);
        }
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<MobilizedBody> links;
    State state;
};

/** Returns the end positions of the thin link at 0.1 s, 0.2 s and so on. **/
template <class Advance>
std::vector<Vec3> findEnds(const ThinLink& model, const Advance& advance) {
    std::vector<Vec3> ends;
    for (int k = 1; k <= 15; ++k) {
        const State& state = advance(0.1 * k);
        model.system.realize(state, Stage::Position);
        ends.push_back(model.links[2].findStationLocationInGround(state, Vec3(0.1, 0, 0)));
    }
    return ends;
}

std::vector<Vec3> findEndsBySimbody() {
    const ThinLink model(false);
    RungeKuttaMersonIntegrator integrator(model.system);
    integrator.setAccuracy(1e-11);
    TimeStepper stepper(model.system, integrator);
    stepper.initialize(model.state);
    return findEnds(model, [&](Real time) -> const State& {
        stepper.stepTo(time);
        return stepper.getState();
    });
}

/** @returns largest distance from the `exact` ends **/
Real run(RadauIntegrator& integrator, const ThinLink& model, const std::vector<Vec3>& exact) {
    integrator.setMaximumStepSize(1e-2);
    integrator.initialize(model.state);
    const std::vector<Vec3> ends = findEnds(model, [&](Real time) -> const State& {
        integrator.stepTo(time);
        return integrator.getState();
    });
    Real error = 0;
    for (size_t k = 0; k < ends.size(); ++k) error = std::max(error, (ends[k] - exact[k]).norm());
    return error;
}

TEST(Radau, FollowsAThinBodyThatTurnsFastAboutItsAxis) {
    const std::vector<Vec3> exact = findEndsBySimbody();
    for (const auto angles : {ThinLink::Angles::Quaternion, ThinLink::Angles::Euler}) {
        const ThinLink model(true, angles);
        for (const Real accuracy : {1e-4, 1e-6, 1e-8}) {
            RadauIntegrator integrator(model.system);
            integrator.setAccuracy(accuracy);
            EXPECT_LT(run(integrator, model, exact), 10 * accuracy) << accuracy;
            const IntegratorStatistics& statistics = integrator.getStatistics();
            EXPECT_LE(statistics.convergenceFailures, 2) << accuracy;
            if (angles == ThinLink::Angles::Quaternion) {  // Euler angles pass singularities
                EXPECT_LT(statistics.calcRejectedFraction(), 0.05) << accuracy;
            }
        }
    }
}

TEST(Radau, ShortensStepsThatDoNotConvergeAndKeepsItsOrder) {
    const std::vector<Vec3> exact = findEndsBySimbody();
    const ThinLink model(true);
    for (const Real accuracy : {1e-4, 1e-6, 1e-8}) {
        RadauIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        ImplicitIntegrator::NewtonTolerances tolerances;
        tolerances.displacement = 1e-4;
        tolerances.maxIterations = 4;
        integrator.setNewtonTolerances(tolerances);
        EXPECT_LT(run(integrator, model, exact), 10 * accuracy) << accuracy;
        const IntegratorStatistics& statistics = integrator.getStatistics();
        EXPECT_GT(statistics.convergenceFailures, 10) << accuracy;
        EXPECT_LT(statistics.stepsTaken - statistics.stepsAtOrder[5], 3) << accuracy;
        EXPECT_LE(statistics.errorTestFailures, 5) << accuracy;
    }
}

/** Two soft links and a stiff one on balls, moving out of the plane. **/
struct Chain {
    Chain() {
        for (int k = 0; k < 3; ++k) {
            test::PointMassPartOptions options;
            options.seed = unsigned(k + 3);
            options.numModes = 4 + k;
            options.lowestFrequency = k == 2 ? 2000 : 5;
            options.highestFrequency = k == 2 ? 9000 : 30;
            links.emplace_back(flexible, test::makePointMassPart(options).body);
            Joint::Ball(flexible, k ? links[size_t(k - 1)].interface("B") : matter.Ground(),
                        links.back().interface("A"));
        }
        state = system.realizeTopology();
        Transform end;
        for (FlexibleBody& link : links) {
            link.setPoseByInterface(state, "A", end);
            system.realize(state, Stage::Velocity);
            end = link.interface("B").calcMotion(state).X;
        }
        // The spin is about its ball: speeds that violate a joint would cause an impact.
        system.realize(state, Stage::Velocity);
        const FlexibleBody& last = links.back();
        const Vec3 spin(1, 4, -2), origin = last.getFramePose(state).p(),
                                   ball = last.interface("A").calcMotion(state).X.p();
        last.setFrameVelocity(state, SpatialVec(spin, spin % (origin - ball)));
    }
    Vec3 findTip(const State& at) const {
        system.realize(at, Stage::Velocity);
        return links.back().interface("B").calcMotion(at).X.p();
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> links;
    State state;
};

TEST(Radau, FollowsFlexibleBodiesWithStiffModesInFewSteps) {
    const Chain model;
    const Real end = 0.4;
    RadauIntegrator exact(model.system);
    exact.setAccuracy(1e-11);
    exact.initialize(model.state);
    exact.stepTo(end);
    // The reference is independent: BDF agrees with it within its own accuracy.
    BdfIntegrator bdf(model.system);
    bdf.setAccuracy(1e-9);
    bdf.initialize(model.state);
    bdf.stepTo(end);
    EXPECT_LT((model.findTip(exact.getState()) - model.findTip(bdf.getState())).norm(), 3e-5);
    for (const Real accuracy : {1e-4, 1e-6, 1e-8}) {
        RadauIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.state);
        integrator.stepTo(end);
        EXPECT_LT((model.findTip(exact.getState()) - model.findTip(integrator.getState())).norm(),
                  10 * accuracy);
        const IntegratorStatistics& statistics = integrator.getStatistics();
        EXPECT_LT(statistics.stepsTaken, bdf.getStatistics().stepsTaken / 10);
        EXPECT_LE(statistics.newtonIterations, 3 * statistics.stepsTaken) << accuracy;
    }
}

TEST(Radau, StartsAtSmallAccuraciesFromJointsThatAreAlmostClosed) {
    const Chain model;
    State state = model.state;
    model.system.realize(state, Stage::Velocity);
    const Transform X = model.links[1].interface("A").calcMotion(state).X;
    model.links[1].setPoseByInterface(state, "A", Transform(X.R(), X.p() + Vec3(3e-11, 0, 0)));
    RadauIntegrator integrator(model.system);
    integrator.setAccuracy(1e-12);
    integrator.initialize(state);
    EXPECT_NO_THROW(integrator.stepTo(1e-3));
    EXPECT_LT(integrator.getStatistics().errorTestFailures, 5);
}

Transform findInterface(const std::shared_ptr<const ReducedBody>& part, const char* name) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, part);
    const State state = system.realizeTopology();
    system.realize(state, Stage::Velocity);
    return body.interface(name).calcMotion(state).X;
}

/** Rows of stiff force elements appear twice in the complex system. An error in one of them, or in
the combination of J, would slow the convergence. **/
TEST(Radau, NewtonsMatrixOfALinearSystemIsExact) {
    const auto part = test::makePointMassPart().body;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, part);
    for (const char* name : {"A", "B"})
        Bushing(flexible, Attachment(matter.Ground(), findInterface(part, name)),
                body.interface(name), Bushing::diagonal(Vec6(30, 200, 10, 3e5, 1e6, 2e5)),
                Bushing::diagonal(Vec6(1, 3, 2, 3e3, 900, 100)));
    State state = system.realizeTopology();
    Vector xi(body.getNumModes(), 0.0);
    xi[0] = 1e-6;
    body.setModalCoordinates(state, xi);
    RadauIntegrator integrator(system);
    integrator.setAccuracy(1e-11);
    integrator.setFixedStep(1e-3);
    integrator.initialize(state);
    integrator.stepTo(0.05);
    const IntegratorStatistics& statistics = integrator.getStatistics();
    EXPECT_LE(statistics.newtonIterations, 3 * statistics.stepsTaken);
    EXPECT_EQ(statistics.convergenceFailures, 0);
}

/** Reverses the speed where the mass passes 0.03 m upwards. **/
class Mirror : public TriggeredEventHandler {
public:
    explicit Mirror(const MobilizedBody& mass)
        : TriggeredEventHandler(Stage::Position), m_mass(mass) {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
    }
    Real getValue(const State& state) const override { return m_mass.getOneQ(state, 0) - 0.03; }
    void handleEvent(State& state, Real, bool&) const override {
        times.push_back(state.getTime());
        m_mass.setOneU(state, 0, -m_mass.getOneU(state, 0));
    }
    mutable std::vector<Real> times;

private:
    const MobilizedBody& m_mass;
};

TEST(Radau, EventsAreLocatedInsideOfLongStepsToTheAccuracy) {
    Springs model;
    auto* mirror = new Mirror(model.masses[0]);
    mirror->getTriggerInfo().setRequiredLocalizationTimeWindow(1e-9);
    model.system.addEventHandler(mirror);
    State state = model.system.realizeTopology();
    model.masses[0].setOneQ(state, 0, -0.1);
    for (const Real accuracy : {1e-5, 1e-7}) {
        mirror->times.clear();
        RadauIntegrator integrator(model.system);
        integrator.setAccuracyNorm(ImplicitIntegrator::AccuracyNorm::Displacement);
        integrator.setAccuracy(accuracy);
        integrator.initialize(state);
        integrator.stepTo(3);
        // −0.1 cos(2πt) reaches 0.03, reverses and returns after twice that time.
        const Real first = std::acos(-0.3) / (2 * Pi);
        ASSERT_EQ(mirror->times.size(), 5u);
        for (size_t k = 0; k < mirror->times.size(); ++k)
            EXPECT_NEAR(mirror->times[k], Real(2 * k + 1) * first, 100 * accuracy);
        EXPECT_LT(integrator.getStatistics().stepsTaken, 2000);
    }
}

/** A driven slider-crank of rigid bodies on spatial pins, with its rod in a plane beside the
crank's. Three equations are redundant, and the corresponding multiplier components must not grow
from step to step. **/
template <class Integrator>
void expectReactionsOfLeastNorm() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    const Body::Rigid bar(MassProperties(1, Vec3(0), Inertia(0.001, 0.02, 0.02)));
    MobilizedBody::Free crank(matter.Ground(), bar), rod(matter.Ground(), bar);
    MobilizedBody::Slider slider(matter.Ground(),
                                 Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.01))));
    Joint::Pin(flexible, matter.Ground(), Attachment(crank, Vec3(-0.1, 0, 0)));
    Joint::Pin(flexible, Attachment(crank, Vec3(0.1, 0, 0.007)), Attachment(rod, Vec3(-0.3, 0, 0)));
    Joint::Pin(flexible, Attachment(rod, Vec3(0.3, 0, 0)), Attachment(slider, Vec3(0, 0, 0.007)));
    Vector line(2);
    line[0] = 100;
    line[1] = 1;
    Joint::PrescribedRotation(flexible, matter.Ground(), Attachment(crank, Vec3(-0.1, 0, 0)),
                              std::make_shared<Function::Linear>(line));
    State state = system.realizeTopology();
    const Real angle = 1, lean = std::asin(0.2 * std::sin(angle) / 0.6);
    const Vec3 pin(0.2 * std::cos(angle), 0.2 * std::sin(angle), 0);
    crank.setQToFitTransform(state, Transform(Rotation(angle, ZAxis), 0.5 * pin));
    rod.setQToFitTransform(
        state, Transform(Rotation(-lean, ZAxis),
                         pin + Vec3(0.3 * std::cos(lean), -0.3 * std::sin(lean), 0.007)));
    slider.setOneQ(state, 0, pin[0] + 0.6 * std::cos(lean));
    Integrator integrator(system);
    integrator.setAccuracy(1e-6);
    integrator.setMaximumStepSize(5e-4);
    integrator.initialize(state);
    // Inertia forces are a few kN.
    for (int k = 1; k <= 20; ++k) {
        integrator.stepTo(0.05 * k);
        EXPECT_LT(integrator.getMultipliers().normInf(), 2e4) << integrator.getTime();
    }
    EXPECT_GE(integrator.getStatistics().redundantConstraints, 3);
}

TEST(RedundantConstraints, KeepTheirReactionsSmallFromStepToStep) {
    expectReactionsOfLeastNorm<BdfIntegrator>();
    expectReactionsOfLeastNorm<RadauIntegrator>();
}

/** A ball bounces on a stop. The energy error is compared with the work of the largest force over a
position error as large as the accuracy. **/
TEST(Radau, EnergyAtAStopFollowsTheAccuracy) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    constexpr Real g = 9.81, mass = 1, height = 0.1, stiffness = 1e5;
    Force::Gravity gravity(forces, matter, -ZAxis, g);
    FlexibleBodySubsystem flexible(system, matter);
    const Transform upwards(Rotation(-Pi / 2, YAxis));
    MobilizedBody::Slider ball(matter.Ground(), upwards,
                               Body::Rigid(MassProperties(mass, Vec3(0), Inertia(0.01))), upwards);
    ContactStop(flexible, Attachment(matter.Ground()), Attachment(ball), stiffness);
    State state = system.realizeTopology();
    ball.setLength(state, height);
    const Real largestForce = std::sqrt(2 * g * height * mass * stiffness);
    for (const Real accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
        RadauIntegrator integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(state);
        Real error = 0;
        for (int k = 1; k <= 2000; ++k) {
            integrator.stepTo(1e-3 * k);
            const State& now = integrator.getState();
            const Real z = ball.getLength(now), v = ball.getRate(now), depth = std::max(-z, 0.0);
            error = std::max(error, std::abs(mass * g * (z - height) + 0.5 * mass * v * v +
                                             0.5 * stiffness * depth * depth));
        }
        EXPECT_LT(error, 10 * accuracy * largestForce) << accuracy;
        EXPECT_LT(integrator.getStatistics().stepsTaken, 500) << accuracy;
    }
}

TEST(Radau, RefusesIndex3) {
    const Springs model;
    RadauIntegrator integrator(model.system);
    integrator.setFormulation(ImplicitIntegrator::Formulation::Index3);
    EXPECT_THROW(integrator.initialize(model.state), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
