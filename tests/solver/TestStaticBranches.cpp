// A loop of joints can often be assembled in two ways that no motion connects. The equilibrium must
// be on the branch of the initial State. Four-bars whose shortest bar makes full turns have two
// circuits, distinguished by the sense in which coupler and rocker are folded (Grashof).

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real Gravity = 9.81;

struct Lengths {
    Real crank, coupler, rocker, ground;
};

/** Angles of the bars relative to x. **/
struct Angles {
    Real crank, coupler, rocker;
};

/** Returns nothing if the joints cannot be closed.
@param sense  +1 or −1: side of the line from the coupler's pin to the rocker's foot to which the
coupler points **/
std::optional<Angles> close(const Lengths& of, Real crank, int sense) {
    const Vec3 B(of.crank * std::cos(crank), of.crank * std::sin(crank), 0), D(of.ground, 0, 0);
    const Vec3 across = D - B;
    const Real r = across.norm(),
               cosine = (r * r + square(of.coupler) - square(of.rocker)) / (2 * r * of.coupler);
    if (std::abs(cosine) > 1) return std::nullopt;
    const Real coupler = std::atan2(across[1], across[0]) + sense * std::acos(cosine);
    const Vec3 C = B + of.coupler * Vec3(std::cos(coupler), std::sin(coupler), 0);
    return Angles{crank, coupler, std::atan2(C[1] - D[1], C[0] - D[0])};
}

enum class Assembly {
    FreeBodies,  ///< all bars free, all pins joints
    Trees        ///< pin mobilizers, with one joint between coupler and rocker
};

class FourBar {
public:
    static constexpr Real SpringStiffness = 3, FreeAngle = 1.7;
    static constexpr Real Masses[] = {0.5, 0.8, 0.6};

    FourBar(const Lengths& lengths, Assembly assembly) : m_lengths(lengths), m_assembly(assembly) {
        const Real sizes[] = {lengths.crank, lengths.coupler, lengths.rocker};
        const Vec3 D(lengths.ground, 0, 0);
        const auto makeBar = [&](int k) {
            const Vec3 center(sizes[k] / 2, 0, 0);
            const Real inertia = Masses[k] * square(sizes[k]) / 12;
            return Body::Rigid(MassProperties(
                Masses[k], center,
                Inertia(1e-4, inertia, inertia).shiftFromMassCenter(-center, Masses[k])));
        };
        if (assembly == Assembly::Trees) {
            m_bars.push_back(MobilizedBody::Pin(m_matter.Ground(), Vec3(0), makeBar(0), Vec3(0)));
            m_bars.push_back(
                MobilizedBody::Pin(m_bars[0], Vec3(lengths.crank, 0, 0), makeBar(1), Vec3(0)));
            m_bars.push_back(MobilizedBody::Pin(m_matter.Ground(), D, makeBar(2), Vec3(0)));
        } else {
            for (int k = 0; k < 3; ++k)
                m_bars.push_back(MobilizedBody::Free(m_matter.Ground(), makeBar(k)));
            Joint::Pin(m_flexible, m_matter.Ground(), m_bars[0], "A");
            Joint::Pin(m_flexible, Attachment(m_bars[0], Vec3(lengths.crank, 0, 0)), m_bars[1],
                       "B");
            Joint::Pin(m_flexible, Attachment(m_matter.Ground(), D), m_bars[2], "D");
        }
        Joint::Pin(m_flexible, Attachment(m_bars[1], Vec3(lengths.coupler, 0, 0)),
                   Attachment(m_bars[2], Vec3(lengths.rocker, 0, 0)), "C");
        TorsionSpring(m_flexible, m_matter.Ground(), m_bars[2], SpringStiffness, 0, FreeAngle);
        m_start = m_system.realizeTopology();
    }

    State place(const Angles& angles) const {
        State state = m_start;
        const Vec3 B(m_lengths.crank * std::cos(angles.crank),
                     m_lengths.crank * std::sin(angles.crank), 0);
        const Vec3 at[] = {Vec3(0), B, Vec3(m_lengths.ground, 0, 0)};
        const Real turned[] = {angles.crank, angles.coupler, angles.rocker};
        for (size_t k = 0; k < 3; ++k) {
            if (m_assembly == Assembly::Trees)
                m_bars[k].setOneQ(state, 0, k == 1 ? turned[1] - turned[0] : turned[k]);
            else
                m_bars[k].setQToFitTransform(state, Transform(Rotation(turned[k], ZAxis), at[k]));
        }
        return state;
    }

    Angles measure(const State& state) const {
        m_system.realize(state, Stage::Position);
        const auto angle = [&](size_t k) {
            const Vec3 x(m_bars[k].getBodyRotation(state).x());
            return std::atan2(x[1], x[0]);
        };
        return {angle(0), angle(1), angle(2)};
    }

    const MultibodySystem& getSystem() const { return m_system; }

    static Real calcEnergy(const Lengths& of, const Angles& at) {
        const Real heights[] = {
            of.crank / 2 * std::sin(at.crank),
            of.crank * std::sin(at.crank) + of.coupler / 2 * std::sin(at.coupler),
            of.rocker / 2 * std::sin(at.rocker)};
        // The rocker of a crank-rocker above ground never turns over.
        const Real turned = std::remainder(at.rocker - FreeAngle, 2 * Pi);
        Real energy = SpringStiffness / 2 * square(turned);
        for (int k = 0; k < 3; ++k) energy += Masses[k] * Gravity * heights[k];
        return energy;
    }

private:
    const Lengths m_lengths;
    const Assembly m_assembly;
    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter{m_system};
    GeneralForceSubsystem m_forces{m_system};
    Force::Gravity m_gravity{m_forces, m_matter, -YAxis, Gravity};
    FlexibleBodySubsystem m_flexible{m_system, m_matter};
    std::vector<MobilizedBody> m_bars;
    State m_start;
};

/** Returns the sense as defined by close(). **/
int findSense(const Angles& angles) {
    return std::sin(angles.rocker - angles.coupler) > 0 ? 1 : -1;
}

/** Descends from the given angle to the minimum of the energy. **/
Real findCrankAtRest(const Lengths& of, Real crank, int sense) {
    const auto calc = [&](Real angle) {
        return FourBar::calcEnergy(of, close(of, angle, sense).value());
    };
    Real step = calc(crank + 1e-3) < calc(crank - 1e-3) ? 1e-2 : -1e-2;
    while (std::abs(step) > 1e-9) {
        while (calc(crank + step) < calc(crank)) crank += step;
        step *= -0.3;
    }
    return crank;
}

TEST(StaticBranches, FourBarsRestOnTheCircuitThatTheyAreOn) {
    int numFollowed = 0;
    // In the last two, the circuits come close to each other.
    const Lengths all[] = {
        {0.12, 0.35, 0.25, 0.40}, {0.12, 0.35, 0.25, 0.478}, {0.15, 0.2, 0.2, 0.248}};
    for (const Lengths& lengths : all)
        for (const Assembly assembly : {Assembly::FreeBodies, Assembly::Trees}) {
            FourBar model(lengths, assembly);
            for (const int sense : {1, -1})
                for (Real crank = -3; crank < 3.1; crank += 0.9) {
                    SCOPED_TRACE("from " + std::to_string(crank) + " rad, sense " +
                                 std::to_string(sense) +
                                 (assembly == Assembly::Trees ? ", trees" : ", free"));
                    const Angles start = close(lengths, crank, sense).value();
                    ASSERT_EQ(findSense(start), sense);
                    StaticEquilibrium equilibrium(model.getSystem());
                    equilibrium.solve(model.place(start));
                    const Angles end = model.measure(equilibrium.getState());
                    EXPECT_NE(equilibrium.getBranch(), StaticEquilibrium::Branch::Unknown);
                    const bool isFollowed =
                        equilibrium.getBranch() == StaticEquilibrium::Branch::Followed;
                    EXPECT_EQ(equilibrium.describeBranch().empty(), !isFollowed);
                    numFollowed += isFollowed;
                    EXPECT_EQ(findSense(end), sense);
                    EXPECT_TRUE(equilibrium.getUnstableMotions().empty());
                    const Real expected = findCrankAtRest(lengths, crank, sense);
                    EXPECT_NEAR(std::remainder(end.crank - expected, 2 * Pi), 0, 1e-5);
                }
        }
    EXPECT_GT(numFollowed, 0);
}

TEST(StaticBranches, SpringsAreWoundOverTheirTurns) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Pin wheel(matter.Ground(), Vec3(0),
                             Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Vec3(0));
    TorsionSpring(flexible, matter.Ground(), wheel, 0.5);
    AttachmentForce(flexible, Attachment(wheel), SpatialVec(Vec3(0, 0, 6), Vec3(0)));
    const State state = system.realizeTopology();
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    EXPECT_NEAR(wheel.getOneQ(equilibrium.getState(), 0), 12, 1e-9);
}

}  // namespace
}  // namespace simflex
