// A heavy top whose stem bends: a disc on a beam that stands on a ball joint. Energy and angular
// momentum about the vertical are kept; on a stem nearly rigid it precesses as Lagrange's top.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Hub.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "validation/Beam.h"

namespace simflex::test {
namespace {

using namespace SimTK;

constexpr Real kGravity = 9.81, kLength = 0.2, kDiscMass = 0.5, kDiscRadius = 0.08, kSpin = 300,
               kTilt = 0.6;  // of the stem from the vertical

std::shared_ptr<const ReducedBody> makeStem() {
    BeamOptions options;
    options.length = kLength;
    options.height = options.width = 0.004;
    options.E = 200e9;
    options.density = 7800;
    options.numElements = 10;
    options.numModes = 20;
    return makeBeam(options);
}

/** Stem along x of its body; the vertical is y. **/
class HeavyTop {
public:
    /** @param stiffening  factor on the stem's stiffness **/
    explicit HeavyTop(Real stiffening)
        : m_stem(flexible,
                 std::make_shared<const ReducedBody>(part().withScaledStiffness(stiffening)),
                 "stem"),
          m_foot(flexible, matter.Ground(), m_stem.interface("root"), "foot"),
          m_disc(flexible, matter, m_stem.interface("tip"),
                 Body::Rigid(MassProperties(
                     kDiscMass, Vec3(0), kDiscMass * UnitInertia::cylinderAlongX(kDiscRadius, 0))),
                 "disc") {}

    static const ReducedBody& part() {
        static const auto stem = makeStem();
        return *stem;
    }

    /** About the foot: along the stem, across it [kg m²]; mass × distance of its centre [kg m]. **/
    static Vec3 calcRigidProperties() {
        const ReducedBody& stem = part();
        const Real half = -stem.interfaces[0].position[0];
        const Real along = kDiscMass * square(kDiscRadius) / 2 + stem.inertia[0];
        const Real across = kDiscMass * (square(kDiscRadius) / 4 + square(kLength)) +
                            stem.inertia[1] + stem.mass * square(half);
        return {along, across, kDiscMass * kLength + stem.mass * half};
    }

    /** The slower rate of steady precession: J₁Ω²cos θ − J₃ω₃Ω + mgd = 0. **/
    static Real calcPrecession() {
        const Vec3 rigid = calcRigidProperties();
        const Real a = rigid[1] * std::cos(kTilt), b = rigid[0] * kSpin, c = rigid[2] * kGravity;
        return 2 * c / (b + std::sqrt(b * b - 4 * a * c));
    }

    /** In steady precession as if rigid. **/
    State makeState() {
        State state = system.realizeTopology();
        const UnitVec3 axis(std::sin(kTilt), std::cos(kTilt), 0);
        m_stem.setPoseByInterface(state, "root", Transform(Rotation(axis, XAxis)));
        const Real precession = calcPrecession();
        const Vec3 omega = Vec3(0, precession, 0) + (kSpin - precession * axis[1]) * Vec3(axis);
        system.realize(state, Stage::Position);
        const Vec3 center = m_stem.getFramePose(state).p();
        m_stem.setFrameVelocity(state, SpatialVec(omega, omega % center));
        m_disc.setStateToFit(state);
        return state;
    }

    /** Of the disc about the vertical [rad]. **/
    Real calcAzimuth(const State& state) const {
        system.realize(state, Stage::Position);
        const Vec3 p = m_disc.getBody().getBodyOriginLocation(state);
        return std::atan2(-p[2], p[0]);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, kGravity};
    FlexibleBodySubsystem flexible{system, matter};

private:
    FlexibleBody m_stem;
    Joint::Ball m_foot;
    Hub m_disc;
};

struct Drift {
    Real energy = 0, momentum = 0;  ///< largest, relative to mgd and to the first value
};

/** Steps a top and looks at it every 5 ms. **/
template <class Step>
Drift calcDrift(HeavyTop& top, const State& start, Real duration, const Step& stepTo) {
    const auto measure = [&](const State& state) {
        top.system.realize(state, Stage::Dynamics);
        return Vec2(top.flexible.calcEnergy(state), top.flexible.calcMomentum(state)[0][1]);
    };
    const Vec2 first = measure(start);
    Drift drift;
    for (int k = 1; 0.005 * k <= duration; ++k) {
        const Vec2 change = (measure(stepTo(0.005 * k)) - first).abs();
        drift.energy =
            std::max(drift.energy, change[0] / (top.calcRigidProperties()[2] * kGravity));
        drift.momentum = std::max(drift.momentum, change[1] / std::abs(first[1]));
    }
    return drift;
}

Drift runBdf(Real accuracy) {
    HeavyTop top(1);
    BdfIntegrator integrator(top.system);
    integrator.setAccuracy(accuracy);
    integrator.initialize(top.makeState());
    return calcDrift(top, integrator.getState(), 1, [&](Real t) -> const State& {
        integrator.stepTo(t);
        return integrator.getState();
    });
}

TEST(HeavyTop, KeepsEnergyAndMomentumAboutTheVertical) {
    const Drift coarse = runBdf(1e-6), fine = runBdf(1e-8);
    EXPECT_LT(coarse.energy, 1e-4);
    EXPECT_LT(coarse.momentum, 1e-4);
    const Real order = std::pow(100, 2.0 / 3);  // BDF2
    EXPECT_GT(coarse.energy / fine.energy, order);
    EXPECT_GT(coarse.momentum / fine.momentum, order);
}

// On a stem of few modes, soft along its axis too: explicit steps are small enough as it is.
TEST(HeavyTop, KeepsThemUnderSimbodysIntegrators) {
    HeavyTop top(0.05);
    State state = top.makeState();
    top.flexible.initializeNative(state);
    RungeKuttaMersonIntegrator integrator(top.system);
    integrator.setAccuracy(1e-6);
    TimeStepper stepper(top.system, integrator);
    stepper.initialize(state);
    const Drift drift = calcDrift(top, stepper.getState(), 0.05, [&](Real t) -> const State& {
        stepper.stepTo(t);
        return stepper.getState();
    });
    EXPECT_LT(drift.energy, 1e-6);
    EXPECT_LT(drift.momentum, 1e-8);
}

// What bending changes falls with the stiffness.
TEST(HeavyTop, OnAStiffStemItPrecessesAsLagrangesTop) {
    const auto calcDifference = [](Real stiffening) {
        HeavyTop top(stiffening);
        BdfIntegrator integrator(top.system);
        integrator.setAccuracy(1e-8);
        integrator.initialize(top.makeState());
        Real largest = 0;
        for (int k = 1; k <= 50; ++k) {
            const Real t = 0.01 * k;
            integrator.stepTo(t);
            largest = std::max(largest, std::abs(top.calcAzimuth(integrator.getState()) -
                                                 t * HeavyTop::calcPrecession()));
        }
        return largest;
    };
    const Real soft = calcDifference(10), stiff = calcDifference(100),
               stiffer = calcDifference(1000);
    EXPECT_NEAR(soft / stiff, 10, 0.5);
    EXPECT_GT(stiff / stiffer, 10);
    EXPECT_LT(stiffer, 1e-4 * 0.5 * HeavyTop::calcPrecession());
}

}  // namespace
}  // namespace simflex::test
