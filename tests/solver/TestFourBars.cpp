// The N-four-bar mechanism of the multibody benchmark library (IFToMM Technical Committee for
// Multibody Dynamics; M. González et al., Multibody System Dynamics 16, 2006): N + 1 uprights on
// ground pins 1 m apart, N couplers between their tops; bars of 1 m and 1 kg. The uprights start
// vertical, with their tops at 1 m/s along x, under gravity; 10 s.
//
// The parallelograms remain parallelograms, so that the mechanism is a single pendulum,
//     ((N + 1)/3 + N) θ̈ = −((N + 1)/2 + N) g cos θ,     θ: uprights against x,
// which makes full turns. Twice a turn all bars are collinear: there every loop could also fold
// into an antiparallelogram, and the constraints lose rank. Every planar loop of pins has 3
// redundant equations in space.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real Gravity = 9.81, Length = 1, Mass = 1;

/** A slender bar along its own x axis, from x = 0 to 1; 0.02 m thick. **/
Body::Rigid makeBar() {
    const Vec3 center(Length / 2, 0, 0);
    return Body::Rigid(
        MassProperties(Mass, center,
                       Inertia(1e-4, Mass * Length * Length / 12, Mass * Length * Length / 12)
                           .shiftFromMassCenter(-center, Mass)));
}

enum class Assembly {
    FreeBodies,   ///< all bars free, all pins joints
    Trees,        ///< pin mobilizers; a joint where each coupler meets the next upright
    SimbodysOwn,  ///< as Trees, with Simbody's own constraints instead of joints
};

class FourBars {
public:
    FourBars(int loops, Assembly assembly)
        : m_loops(loops),
          m_matter(m_system),
          m_forces(m_system),
          m_gravity(m_forces, m_matter, -YAxis, Gravity),
          m_flexible(m_system, m_matter) {
        const Transform tip(Vec3(Length, 0, 0));
        for (int i = 0; i <= loops; ++i) {
            const Transform foot(Vec3(i * Length, 0, 0));
            if (assembly != Assembly::FreeBodies) {
                m_uprights.push_back(
                    MobilizedBody::Pin(m_matter.Ground(), foot, makeBar(), Transform()));
            } else {
                m_uprights.push_back(MobilizedBody::Free(m_matter.Ground(), makeBar()));
                Joint::Pin(m_flexible, Attachment(m_matter.Ground(), foot), m_uprights.back(),
                           "foot " + String(i));
            }
        }
        for (int i = 0; i < loops; ++i) {
            if (assembly != Assembly::FreeBodies) {
                m_couplers.push_back(
                    MobilizedBody::Pin(m_uprights[i], tip, makeBar(), Transform()));
            } else {
                m_couplers.push_back(MobilizedBody::Free(m_matter.Ground(), makeBar()));
                Joint::Pin(m_flexible, Attachment(m_uprights[i], tip), m_couplers.back(),
                           "left of coupler " + String(i));
            }
            if (assembly == Assembly::SimbodysOwn)
                Constraint::Ball(m_couplers.back(), tip.p(), m_uprights[i + 1], tip.p());
            else
                Joint::Pin(m_flexible, Attachment(m_couplers.back(), tip),
                           Attachment(m_uprights[i + 1], tip), "right of coupler " + String(i));
        }

        m_start = m_system.realizeTopology();
        const Rotation up(Pi / 2, ZAxis);
        const SpatialVec turning(Vec3(0, 0, -1 / Length), Vec3(0)), gliding(Vec3(0), Vec3(1, 0, 0));
        for (int i = 0; i <= loops; ++i)
            if (assembly != Assembly::FreeBodies) {
                m_uprights[i].setQToFitRotation(m_start, up);
            } else {
                m_uprights[i].setQToFitTransform(m_start, Transform(up, Vec3(i * Length, 0, 0)));
            }
        for (int i = 0; i < loops; ++i)
            if (assembly != Assembly::FreeBodies) {
                m_couplers[i].setQToFitRotation(m_start, ~up);
            } else {
                m_couplers[i].setQToFitTransform(m_start, Transform(Vec3(i * Length, Length, 0)));
            }
        for (const MobilizedBody& upright : m_uprights) upright.setUToFitVelocity(m_start, turning);
        m_system.realize(m_start, Stage::Velocity);
        for (const MobilizedBody& coupler : m_couplers)
            if (assembly != Assembly::FreeBodies)
                coupler.setUToFitAngularVelocity(m_start, Vec3(0, 0, 1 / Length));
            else
                coupler.setUToFitVelocity(m_start, gliding);
    }

    const MultibodySystem& getSystem() const { return m_system; }
    const State& getStart() const { return m_start; }
    int getNumLoops() const { return m_loops; }

    /** Returns the energy exchanged between kinetic and potential [J]. **/
    Real calcExchangedEnergy() const {
        return ((m_loops + 1) / 2.0 + m_loops) * 2 * Mass * Gravity * Length;
    }

    Real calcEnergy(const State& state) const {
        m_system.realize(state, Stage::Dynamics);
        return m_flexible.calcEnergy(state);
    }

    /** Returns the right ends of the couplers. **/
    std::vector<Vec3> getCouplerEnds(const State& state) const {
        std::vector<Vec3> ends;
        for (const MobilizedBody& coupler : m_couplers)
            ends.push_back(coupler.findStationLocationInGround(state, Vec3(Length, 0, 0)));
        return ends;
    }

    /** Returns the largest distance of any coupler end from `expected`. **/
    Real calcLargestDistance(const State& state, const std::vector<Vec3>& expected) const {
        const std::vector<Vec3> ends = getCouplerEnds(state);
        Real largest = 0;
        for (size_t i = 0; i < ends.size(); ++i)
            largest = std::max(largest, (ends[i] - expected[i]).norm());
        return largest;
    }

    /** The same relative to the pendulum at angle θ. **/
    Real calcLargestDistance(const State& state, Real theta) const {
        std::vector<Vec3> expected;
        for (int i = 1; i <= m_loops; ++i)
            expected.push_back(Length * Vec3(i + std::cos(theta), std::sin(theta), 0));
        return calcLargestDistance(state, expected);
    }

    /** Returns (θ, θ̇) after `time`: the pendulum's equation by the classical Runge–Kutta method
    with steps of 1e-4 s (error 1e-11). **/
    Vec2 solvePendulum(Real time) const {
        const Real stiffness =
            ((m_loops + 1) / 2.0 + m_loops) * Gravity / (((m_loops + 1) / 3.0 + m_loops) * Length);
        const auto derivative = [&](const Vec2& y) {
            return Vec2(y[1], -stiffness * std::cos(y[0]));
        };
        Vec2 y(Pi / 2, -1 / Length);
        const int steps = int(std::ceil(time / 1e-4));
        const Real h = time / steps;
        for (int i = 0; i < steps; ++i) {
            const Vec2 k1 = derivative(y), k2 = derivative(y + h / 2 * k1);
            const Vec2 k3 = derivative(y + h / 2 * k2), k4 = derivative(y + h * k3);
            y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
        return y;
    }

private:
    int m_loops;
    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter;
    GeneralForceSubsystem m_forces;
    Force::Gravity m_gravity;
    FlexibleBodySubsystem m_flexible;
    std::vector<MobilizedBody> m_uprights, m_couplers;
    State m_start;
};

struct Errors {
    Real energy;    ///< relative to the energy exchanged between kinetic and potential
    Real distance;  ///< relative to the path of the tops
};

/** Returns the errors after `time`; also checks the number of redundant equations. **/
Errors measureErrors(const FourBars& mechanism, ImplicitIntegrator& integrator, Real time) {
    const int loops = mechanism.getNumLoops();
    integrator.initialize(mechanism.getStart());
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 3 * loops);
    const Real start = mechanism.calcEnergy(integrator.getState());
    integrator.stepTo(time);
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 3 * loops);
    EXPECT_LT(integrator.getLargestConstraintError(), 1e-10);
    const State& state = integrator.getState();
    const Vec2 pendulum = mechanism.solvePendulum(time);
    return {std::abs(mechanism.calcEnergy(state) - start) / mechanism.calcExchangedEnergy(),
            mechanism.calcLargestDistance(state, pendulum[0]) /
                (Length * std::abs(pendulum[0] - Pi / 2))};
}

/** The same with BDF of orders up to 4. **/
Errors measureErrors(int loops, Assembly assembly, Real accuracy, Real time) {
    const FourBars mechanism(loops, assembly);
    BdfIntegrator integrator(mechanism.getSystem());
    integrator.setAccuracy(accuracy);
    integrator.setMaximumOrder(4);
    return measureErrors(mechanism, integrator, time);
}

/** Tightening the accuracy by two decades must gain 100^(p/(p+1)), p ≥ 2. **/
void expectOnePendulum(int loops, Assembly assembly, Real time) {
    const Errors coarse = measureErrors(loops, assembly, 1e-6, time);
    const Errors fine = measureErrors(loops, assembly, 1e-8, time);
    const Real gain = std::pow(100, 2.0 / 3);
    EXPECT_LT(fine.energy, coarse.energy / gain);
    EXPECT_LT(fine.distance, coarse.distance / gain);
    EXPECT_LT(fine.energy, 1e-5);
    EXPECT_LT(fine.distance, 1e-5);
}

TEST(FourBars, TwoLoopsOfFreeBarsTurnOverAsOnePendulum) {
    expectOnePendulum(2, Assembly::FreeBodies, 10);
}
TEST(FourBars, FiveLoopsOfFreeBarsTurnOverAsOnePendulum) {
    expectOnePendulum(5, Assembly::FreeBodies, 10);
}

// In one second the bars become collinear once.
TEST(FourBars, FortyLoopsOfTreesPassTheSingularPosition) {
    const Errors errors = measureErrors(40, Assembly::Trees, 1e-8, 1);
    EXPECT_LT(errors.energy, 1e-5);
    EXPECT_LT(errors.distance, 1e-5);
}

/** Returns the largest energy error at every half second of 10 s, in which the bars become
collinear 22 times [J]. **/
Real measureDrift(const FourBars& mechanism, ImplicitIntegrator& integrator, Real accuracy) {
    integrator.setAccuracy(accuracy);
    integrator.setNumThreads(1);
    integrator.initialize(mechanism.getStart());
    const Real start = mechanism.calcEnergy(integrator.getState());
    Real drift = 0;
    for (int i = 1; i <= 20; ++i) {
        integrator.stepTo(0.5 * i);
        drift = std::max(drift, std::abs(mechanism.calcEnergy(integrator.getState()) - start));
    }
    return drift;
}

Real measureBdfDrift(const FourBars& mechanism, int order, Real accuracy) {
    BdfIntegrator integrator(mechanism.getSystem());
    integrator.setMaximumOrder(order);
    return measureDrift(mechanism, integrator, accuracy);
}

Real measureAlphaDrift(const FourBars& mechanism, Real accuracy) {
    GeneralizedAlphaIntegrator integrator(mechanism.getSystem());
    return measureDrift(mechanism, integrator, accuracy);
}

Real measureRadauDrift(const FourBars& mechanism, Real accuracy) {
    RadauIntegrator integrator(mechanism.getSystem());
    return measureDrift(mechanism, integrator, accuracy);
}

TEST(FourBars, EnergyDriftFallsWithTheAccuracy) {
    for (Assembly assembly : {Assembly::Trees, Assembly::FreeBodies}) {
        const FourBars mechanism(2, assembly);
        // In theory two decades gain 100^(2/3) = 21; step placement changes each value by some tens
        // of per cent.
        const auto expectFall = [&](const char* name, auto&& measure) {
            std::vector<Real> drifts{mechanism.calcExchangedEnergy()};
            for (Real accuracy : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
                drifts.push_back(measure(accuracy));
                const size_t last = drifts.size() - 1;
                EXPECT_LT(drifts[last], drifts[last - 1]) << name << ", " << accuracy;
                if (last < 2) continue;
                EXPECT_LT(drifts[last], drifts[last - 2] / 10) << name << ", " << accuracy;
            }
        };
        expectFall("BDF2", [&](Real accuracy) { return measureBdfDrift(mechanism, 2, accuracy); });
        expectFall("BDF4", [&](Real accuracy) { return measureBdfDrift(mechanism, 4, accuracy); });
        expectFall("generalized-alpha",
                   [&](Real accuracy) { return measureAlphaDrift(mechanism, accuracy); });
        // Near the collinear position Radau falls back on a varying number of BDF2 steps.
        EXPECT_LT(measureRadauDrift(mechanism, 1e-9), measureRadauDrift(mechanism, 1e-5) / 100);
    }
}

// The benchmark allows 0.1 J.
TEST(FourBars, LoopsOfAnyNumberKeepTheBenchmarksEnergy) {
    for (Assembly assembly : {Assembly::Trees, Assembly::FreeBodies}) {
        for (int loops : {5, 10})
            EXPECT_LT(measureBdfDrift(FourBars(loops, assembly), 4, 1e-9), 0.1) << loops;
        const FourBars twenty(20, assembly), forty(40, assembly);
        EXPECT_LT(measureBdfDrift(twenty, 2, 1e-7), 0.1);
        EXPECT_LT(measureAlphaDrift(twenty, 1e-7), 0.1);
        EXPECT_LT(measureBdfDrift(forty, 4, 1e-8), 0.1);
    }
}

// Fixed steps, chosen so that the 400th ends in the collinear position or up to a step before or
// after it.
TEST(FourBars, StepsMayEndAtTheSingularPosition) {
    for (Assembly assembly : {Assembly::Trees, Assembly::FreeBodies}) {
        const FourBars mechanism(2, assembly);
        Real before = 0.5, after = 1;
        for (int i = 0; i < 20; ++i) {
            const Real middle = (before + after) / 2;
            (mechanism.solvePendulum(middle)[0] > 0 ? before : after) = middle;
        }
        for (int k = -10; k <= 10; ++k) {
            BdfIntegrator bdf(mechanism.getSystem());
            GeneralizedAlphaIntegrator alpha(mechanism.getSystem());
            bdf.setFixedStep(before / (400 + 0.1 * k));
            alpha.setFixedStep(before / (400 + 0.1 * k));
            for (const Errors& errors :
                 {measureErrors(mechanism, bdf, 0.8), measureErrors(mechanism, alpha, 0.8)}) {
                EXPECT_LT(errors.energy, 1e-4) << k;
                EXPECT_LT(errors.distance, 1e-4) << k;
            }
        }
    }
}

TEST(FourBars, TwoLoopsMoveAsInSimbody) {
    const FourBars stock(2, Assembly::SimbodysOwn);
    RungeKuttaMersonIntegrator reference(stock.getSystem());
    reference.setAccuracy(1e-9);
    reference.setConstraintTolerance(1e-11);
    TimeStepper stepper(stock.getSystem(), reference);
    stepper.initialize(stock.getStart());

    const FourBars ours(2, Assembly::Trees);
    BdfIntegrator integrator(ours.getSystem());
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(4);
    integrator.initialize(ours.getStart());
    for (Real time : {0.3, 0.6, 0.9, 1.2}) {
        stepper.stepTo(time);
        State theirs = stepper.getState();
        stock.getSystem().realize(theirs, Stage::Velocity);
        integrator.stepTo(time);
        EXPECT_LT(ours.calcLargestDistance(integrator.getState(), stock.getCouplerEnds(theirs)),
                  1e-5)
            << time;
    }
}

}  // namespace
}  // namespace simflex
