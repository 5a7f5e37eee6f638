// Bricard's mechanism of the multibody benchmark library (IFToMM Technical Committee for Multibody
// Dynamics): five bars of 1 m and 1 kg and the ground, joined by six pins into a ring along six
// edges of a cube; each pin is perpendicular to both its bars. By counting equations it could not
// move: 30 coordinates, 30 equations. But one of them is redundant, and the ring is mobile.
//
// For a ring of equal bars with pins at right angles, the rotations at neighbouring pins satisfy
// cos θ + cos φ + cos θ cos φ = 0, and every second pin has the same angle (Y. Chen, Z. You, T.
// Tarnai, Int. J. Solids Struct. 42, 2005, for twist α = π/2).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real Gravity = 9.81, Length = 1, Mass = 1;

/** Directions of the bars, ground last, along the cube's edges. Pin i is at the start of bar i, and
its axis is the one of x, y, z that is parallel to neither bar. **/
const Vec3 Directions[6] = {Vec3(1, 0, 0),  Vec3(0, -1, 0), Vec3(0, 0, 1),
                            Vec3(-1, 0, 0), Vec3(0, 1, 0),  Vec3(0, 0, -1)};

Vec3 vertex(int i) {
    Vec3 p(0);
    for (int j = 0; j < i; ++j) p += Length * Directions[j];
    return p;
}

/** Returns the initial frame of pin i in Ground: at vertex i, z axis along the pin. **/
Transform pinFrame(int i) {
    const UnitVec3 axis(Directions[(i + 5) % 6] % Directions[i % 6]);
    return Transform(Rotation(axis, ZAxis), vertex(i));
}

/** Returns bar i, whose initial frame is Ground's, shifted to vertex i. **/
Body::Rigid makeBar(int i) {
    const Vec3 center = Length / 2 * Directions[i];
    // 0.02 m thick: an ideal line has no moment of inertia about itself, which leaves a free bar
    // singular.
    const Vec3 d = Directions[i];
    const Mat33 along = d * ~d;
    const Real across = Mass * Length * Length / 12, about = 1e-4;
    const Inertia central(SymMat33(across * (1 - along(0, 0)) + about * along(0, 0), 0,
                                   across * (1 - along(1, 1)) + about * along(1, 1), 0, 0,
                                   across * (1 - along(2, 2)) + about * along(2, 2)));
    return Body::Rigid(MassProperties(Mass, center, central.shiftFromMassCenter(-center, Mass)));
}

/** Frame of pin i on bar i, at its start, and on bar i − 1, at its end. **/
Transform pinOnNext(int i) {
    return Transform(Vec3(-vertex(i))) * pinFrame(i);
}
Transform pinOnPrevious(int i) {
    return Transform(Vec3(-vertex(i - 1))) * pinFrame(i);
}

enum class Assembly {
    FreeBodies,   ///< six of our pin joints: 30 equations on 30 coordinates
    ClosedChain,  ///< five pin mobilizers and one of our joints: 5 equations on 5 coordinates
    SimbodysOwn,  ///< the same closed by Simbody's Ball and two ConstantAngles
};

class Bricard {
public:
    explicit Bricard(Assembly assembly)
        : m_matter(m_system),
          m_forces(m_system),
          m_gravity(m_forces, m_matter, -YAxis, Gravity),
          m_flexible(m_system, m_matter) {
        const bool free = assembly == Assembly::FreeBodies;
        for (int i = 0; i < 5; ++i) {
            MobilizedBody previous = i == 0 ? MobilizedBody(m_matter.Ground()) : m_bars[i - 1];
            const Transform onPrevious = i == 0 ? pinFrame(0) : pinOnPrevious(i);
            if (free) {
                m_bars.push_back(MobilizedBody::Free(m_matter.Ground(), makeBar(i)));
                Joint::Pin(m_flexible, Attachment(previous, onPrevious),
                           Attachment(m_bars.back(), pinOnNext(i)), "pin " + String(i));
            } else {
                m_bars.push_back(
                    MobilizedBody::Pin(previous, onPrevious, makeBar(i), pinOnNext(i)));
            }
        }
        const Transform last = pinOnPrevious(5), closing = pinFrame(5);
        if (assembly == Assembly::SimbodysOwn) {
            Constraint::Ball(m_matter.Ground(), closing.p(), m_bars[4], last.p());
            Constraint::ConstantAngle(m_matter.Ground(), closing.R().x(), m_bars[4], last.R().z());
            Constraint::ConstantAngle(m_matter.Ground(), closing.R().y(), m_bars[4], last.R().z());
        } else {
            Joint::Pin(m_flexible, Attachment(m_matter.Ground(), closing),
                       Attachment(m_bars[4], last), "pin 5");
        }
        m_start = m_system.realizeTopology();
        if (free)
            for (int i = 0; i < 5; ++i) m_bars[i].setQToFitTransform(m_start, Transform(vertex(i)));
    }

    const MultibodySystem& getSystem() const { return m_system; }
    const State& getStart() const { return m_start; }

    Real calcEnergy(const State& state) const {
        m_system.realize(state, Stage::Dynamics);
        return m_flexible.calcEnergy(state);
    }

    Vec3 calcCenter(const State& state, int bar) const {
        return m_bars[bar].findStationLocationInGround(state, Length / 2 * Directions[bar]);
    }

    /** Returns the angle between bars i − 1 and i, 0 if collinear. **/
    Real calcAngle(const State& state, int i) const {
        const auto direction = [&](int bar) {
            return bar % 6 == 5
                       ? Directions[5]
                       : m_bars[bar % 6].expressVectorInGroundFrame(state, Directions[bar % 6]);
        };
        const Vec3 a = direction(i + 5), b = direction(i);
        return std::atan2((a % b).norm(), ~a * b);
    }

private:
    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter;
    GeneralForceSubsystem m_forces;
    Force::Gravity m_gravity;
    FlexibleBodySubsystem m_flexible;
    std::vector<MobilizedBody> m_bars;
    State m_start;
};

/** Returns the largest |cos θ + cos φ + cos θ cos φ| and difference of every second angle in the
ring. **/
Real calcRingError(const Bricard& mechanism, const State& state) {
    Real largest = 0;
    for (int i = 0; i < 6; ++i) {
        const Real a = std::cos(mechanism.calcAngle(state, i)),
                   b = std::cos(mechanism.calcAngle(state, (i + 1) % 6)),
                   c = std::cos(mechanism.calcAngle(state, (i + 2) % 6));
        largest = std::max({largest, std::abs(a + b + a * b), std::abs(a - c)});
    }
    return largest;
}

struct Errors {
    Real energy = 0;    ///< largest at any comparison time [J]
    Real distance = 0;  ///< of any bar's centre from Simbody's [m]
};

Errors measureErrors(Assembly assembly, Real accuracy) {
    const Bricard reference(Assembly::SimbodysOwn);
    RungeKuttaMersonIntegrator rungeKutta(reference.getSystem());
    rungeKutta.setAccuracy(1e-10);
    rungeKutta.setConstraintTolerance(1e-12);
    TimeStepper stepper(reference.getSystem(), rungeKutta);
    stepper.initialize(reference.getStart());

    const Bricard ours(assembly);
    BdfIntegrator integrator(ours.getSystem());
    integrator.setAccuracy(accuracy);
    integrator.setMaximumOrder(4);
    integrator.initialize(ours.getStart());
    const Real start = ours.calcEnergy(integrator.getState());
    Errors errors;
    for (Real time : {2.0, 4.0, 6.0, 8.0, 10.0}) {
        stepper.stepTo(time);
        State theirs = stepper.getState();
        reference.getSystem().realize(theirs, Stage::Velocity);
        integrator.stepTo(time);
        const State& state = integrator.getState();
        errors.energy = std::max(errors.energy, std::abs(ours.calcEnergy(state) - start));
        for (int i = 0; i < 5; ++i)
            errors.distance =
                std::max(errors.distance,
                         (ours.calcCenter(state, i) - reference.calcCenter(theirs, i)).norm());
        // The joints' own errors of at most 1e-10 add up around the ring.
        EXPECT_LT(calcRingError(ours, state), 1e-8) << time;
        EXPECT_EQ(integrator.getStatistics().redundantConstraints, 1) << time;
    }
    return errors;
}

void expectSimbodysMotion(Assembly assembly) {
    const Errors coarse = measureErrors(assembly, 1e-6), fine = measureErrors(assembly, 1e-8);
    // Tightening the accuracy by two decades gains 100^(p/(p+1)), p ≥ 2.
    const Real gain = std::pow(100, 2.0 / 3);
    EXPECT_LT(fine.energy, coarse.energy / gain);
    EXPECT_LT(fine.distance, coarse.distance / gain);
    EXPECT_LT(fine.energy, 1e-6 * 5 * Mass * Gravity * Length);
    EXPECT_LT(fine.distance, 1e-5 * Length);
}

TEST(Bricard, FreeBarsMoveAsInSimbodyAndKeepTheirEnergy) {
    expectSimbodysMotion(Assembly::FreeBodies);
}
TEST(Bricard, ClosedChainMovesAsInSimbodyAndKeepsItsEnergy) {
    expectSimbodysMotion(Assembly::ClosedChain);
}

}  // namespace
}  // namespace simflex
