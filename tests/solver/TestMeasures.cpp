// Auxiliary variables z, auto-update variables and initialization: Simbody's Measures in a run.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

/** Initial amplitude 1, angular frequency 3 rad/s: x = cos 3t. **/
struct Oscillator {
    Oscillator()
        : matter(system),
          forces(system),
          mass(matter.Ground(), Body::Rigid(MassProperties(2, Vec3(0), Inertia(1)))),
          spring(forces, mass, MobilizerQIndex(0), 2 * omega * omega, 0),
          sine(forces, 1.5, 4, 0.3),
          integral(forces, sine, Measure::Constant(forces, 0.7)),
          largest(forces, sine, Measure::Extreme::Maximum),
          delayed(forces, sine, 0.05) {}
    State makeState() {
        State state = system.realizeTopology();
        mass.setOneQ(state, 0, 1);
        return state;
    }
    static constexpr Real omega = 3;
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    MobilizedBody::Slider mass;
    Force::MobilityLinearSpring spring;
    Measure::Sinusoid sine;  ///< 1.5 sin(4t + 0.3)
    Measure::Integrate integral;
    Measure::Extreme largest;
    Measure::Delay delayed;
};

TEST(Measures, IntegralsFollowTheirClosedForm) {
    Oscillator model;
    const State state = model.makeState();
    const auto exact = [](Real t) {
        return 0.7 - 1.5 / 4 * (std::cos(4 * t + 0.3) - std::cos(0.3));
    };
    std::vector<Real> errors;
    for (Real accuracy : {1e-5, 1e-7}) {
        BdfIntegrator bdf(model.system);
        GeneralizedAlphaIntegrator alpha(model.system);
        RadauIntegrator radau(model.system);
        for (ImplicitIntegrator* method : {(ImplicitIntegrator*)&bdf, (ImplicitIntegrator*)&alpha,
                                           (ImplicitIntegrator*)&radau}) {
            ImplicitIntegrator& integrator = *method;
            integrator.setAccuracy(accuracy);
            integrator.initialize(state);
            Real error = 0;
            for (int i = 1; i <= 10; ++i) {
                integrator.stepTo(0.2 * i);
                error = std::max(error, std::abs(model.integral.getValue(integrator.getState()) -
                                                 exact(0.2 * i)));
                EXPECT_LT(
                    std::abs(model.mass.getOneQ(integrator.getState(), 0) - std::cos(0.6 * i)),
                    100 * std::pow(accuracy, 2.0 / 3));
            }
            EXPECT_LT(error, 20 * std::pow(accuracy, 2.0 / 3)) << "accuracy " << accuracy;
        }
    }
}

TEST(Measures, ExtremesAndDelaysAreUpdatedStepByStep) {
    Oscillator model;
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(model.makeState());
    EXPECT_NEAR(model.largest.getValue(integrator.getState()), 1.5 * std::sin(0.3), 1e-12);
    integrator.stepTo(1);
    // The sine peaks at t = 0.318; the step length limits the resolution of the peak.
    EXPECT_NEAR(model.largest.getValue(integrator.getState()), 1.5, 1e-3);
    model.system.realize(integrator.getState(), Stage::Velocity);
    EXPECT_NEAR(model.delayed.getValue(integrator.getState()), 1.5 * std::sin(4 * 0.95 + 0.3),
                1e-3);
}

TEST(Measures, ARunFromAHistoryBeginsWithTheirInitialValues) {
    Oscillator model;
    const State state = model.makeState();
    constexpr Real h = 1e-3, begin = 0.2, end = 0.5;
    const auto integrate = [](Real from, Real to) {
        return -1.5 / 4 * (std::cos(4 * to + 0.3) - std::cos(4 * from + 0.3));
    };
    for (const bool agrees : {true, false}) {
        SCOPED_TRACE(agrees ? "integral as initialized" : "another integral");
        Array_<State> history;
        for (int i = -3; i <= 0; ++i) {
            const Real t = begin + i * h;
            State past = state;
            past.setTime(t);
            model.mass.setOneQ(past, 0, std::cos(3 * t));
            model.mass.setOneU(past, 0, -3 * std::sin(3 * t));
            past.updZ() = agrees ? 0.7 + integrate(begin, t) : 0;
            history.push_back(past);
        }
        BdfIntegrator integrator(model.system);
        integrator.setFixedStep(h);
        integrator.setFixedOrder(3);
        integrator.initialize(state);
        const State& advanced = integrator.updAdvancedState();
        integrator.initialize(history);
        EXPECT_EQ(advanced.getTime(), integrator.getTime());
        EXPECT_NEAR(integrator.getTime(), begin, 1e-15);
        EXPECT_EQ(model.integral.getValue(integrator.getState()), 0.7);
        EXPECT_NEAR(model.largest.getValue(integrator.getState()), 1.5 * std::sin(4 * begin + 0.3),
                    1e-12);
        // Where it leads to another State, the history is of no use.
        integrator.stepOnce();
        EXPECT_EQ(integrator.getLastOrder(), agrees ? 3 : 2);
        integrator.stepTo(end);
        EXPECT_NEAR(model.integral.getValue(integrator.getState()), 0.7 + integrate(begin, end),
                    1e-6);
        EXPECT_NEAR(model.mass.getOneQ(integrator.getState(), 0), std::cos(3 * end), 1e-6);
    }
}

/** ż = −k z, fed back as a force on the slider: a coupled linear system. **/
class Lag : public Force::Custom::Implementation {
public:
    Lag(const MobilizedBody& mass, const Subsystem& subsystem)
        : m_mass(mass), m_subsystem(subsystem) {}
    bool dependsOnlyOnPositions() const override { return false; }
    void realizeTopology(State& state) const override {
        m_z = m_subsystem.allocateZ(state, Vector(1, Real(1)));
    }
    void realizeAcceleration(const State& state) const override {
        m_subsystem.updZDot(state)[m_z] = -5 * m_subsystem.getZ(state)[m_z];
    }
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        m_mass.applyOneMobilityForce(state, 0, m_subsystem.getZ(state)[m_z], mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_mass;
    const Subsystem& m_subsystem;
    mutable ZIndex m_z;
};

TEST(Measures, ForcesSeeTheZOfTheirTime) {
    // 2 ẍ = e^(−5t) from rest: x = (e^(−5t) − 1 + 5t)/50.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(),
                               Body::Rigid(MassProperties(2, Vec3(0), Inertia(1))));
    Force::Custom(forces, new Lag(mass, forces));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-8);
    integrator.initialize(system.realizeTopology());
    integrator.stepTo(0.5);
    EXPECT_NEAR(integrator.getState().getZ()[0], std::exp(-2.5), 1e-5);
    EXPECT_NEAR(mass.getOneQ(integrator.getState(), 0), (std::exp(-2.5) - 1 + 2.5) / 50, 1e-6);
}

/** ż is an acceleration of a point on a flexible body. **/
class AccelerationMeter : public Force::Custom::Implementation {
public:
    AccelerationMeter(const MobilizedBody& body, const Subsystem& subsystem)
        : m_body(body), m_subsystem(subsystem) {}
    void realizeTopology(State& state) const override {
        m_z = m_subsystem.allocateZ(state, Vector(3, Real(0)));
    }
    void realizeAcceleration(const State& state) const override {
        const Vec3 a = m_body.getBodyOriginAcceleration(state);
        for (int i = 0; i < 3; ++i) m_subsystem.updZDot(state)[ZIndex(m_z + i)] = a[i];
    }
    void calcForce(const State&, Vector_<SpatialVec>&, Vector_<Vec3>&, Vector&) const override {}
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody m_body;
    const Subsystem& m_subsystem;
    mutable ZIndex m_z;
};

// A soft body swings on a hinge under gravity: the integral of its centre's acceleration is its
// change of velocity, including joint forces, gravity and deformation.
TEST(Measures, IntegratedAccelerationsOfAHingedFlexibleBodyAreItsVelocity) {
    for (const bool isAlpha : {false, true}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        const Force::Gravity gravity(forces, matter, -YAxis, 9.81);
        FlexibleBodySubsystem flexible(system, matter);
        test::PointMassPartOptions options;
        options.numModes = 5;
        options.lowestFrequency = 6;
        options.highestFrequency = 25;
        const FlexibleBody body(flexible, test::makePointMassPart(options).body);
        const Joint::Pin hinge(flexible, matter.Ground(), body.interface("A"));
        Force::Custom(forces, new AccelerationMeter(body.getFrame(), forces));
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
        BdfIntegrator bdf(system);
        GeneralizedAlphaIntegrator alpha(system);
        ImplicitIntegrator& integrator = isAlpha ? static_cast<ImplicitIntegrator&>(alpha) : bdf;
        integrator.setAccuracy(1e-8);
        integrator.initialize(state);
        integrator.stepTo(0.2);
        const State& now = integrator.getState();
        const Vec3 v = body.getFrame().getBodyOriginVelocity(now);
        EXPECT_GT(v.norm(), 0.5);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(now.getZ()[i], v[i], 1e-4 * v.norm());
    }
}

}  // namespace
}  // namespace simflex
