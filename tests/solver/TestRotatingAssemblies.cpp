// Small motions about a steady rotation of assemblies: a rigid body that is cut into welded pieces,
// or carried by other joints, has the same modes; and they are those of Simbody's own motion.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/CampbellDiagram.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

const Rotation& zToX() {
    static const Rotation R(Pi / 2, YAxis);
    return R;
}

/** How a disc is made and what carries it. **/
enum class Disc {
    Whole,            ///< one body on a Pin mobilizer of the hub
    Halves,           ///< two half-moons, the first on the mobilizer, welded
    HalvesOfSimbody,  ///< the same by Simbody's own Weld
    FreeHalves,       ///< half-moons on a Joint::Pin
    OnJoint,          ///< one body on a Joint::Pin
    OnTwoJoints,      ///< on two of them, which are redundant
    OnBallAndLine,    ///< on a Ball at one end of its shaft and a PointOnLine at the other
    CarriesHub,       ///< the disc is the base body, the hub stands on it
    OnCylinder,       ///< of three thirds, welded in a ring, on a Cylinder and a plane's point
    Driven,           ///< one body whose Pin has a Motion
    DrivenHalves      ///< half-moons that a PrescribedRotation drives
};

const std::vector<std::pair<Disc, std::string>>& listDiscs() {
    static const std::vector<std::pair<Disc, std::string>> discs{
        {Disc::Halves, "halves"},
        {Disc::HalvesOfSimbody, "halves with Simbody's weld"},
        {Disc::FreeHalves, "free halves"},
        {Disc::OnJoint, "on a joint"},
        {Disc::OnTwoJoints, "on two joints"},
        {Disc::OnBallAndLine, "on a ball and a line"},
        {Disc::CarriesHub, "carries the hub"},
        {Disc::OnCylinder, "thirds on a cylinder"}};
    return discs;
}

/** A flexible part that is clamped at its interface A and carries a hub at B, on which a disc spins
about the hub's x axis. **/
struct Rotor {
    static constexpr Real DiscMass = 1.2, DiscI = 0.004, DiscI3 = 0.007;

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody part{flexible, test::makePointMassPart().body, "part"};
    std::vector<MobilizedBody> turning;  ///< bodies that turn with the disc
    MobilizedBody hub;
    State state;

    /** One of `pieces` bodies that are the disc together, each with its centre of mass off the axis
    and, of two, out of round. **/
    static Body makePiece(int pieces, int index) {
        const Real turn = 2 * Pi * index / pieces, away = pieces > 1 ? 0.03 : 0;
        const Vec3 center = away * Vec3(0, std::cos(turn), std::sin(turn));
        const Real odd = pieces == 2 ? 4e-4 * (1 - 2 * index) : 0;
        return Body::Rigid(
            MassProperties(DiscMass / pieces, center,
                           Inertia(DiscI3 / pieces, DiscI / pieces + odd, DiscI / pieces - odd,
                                   0.4 * odd, 0.2 * odd, 0.3 * odd)));
    }

    explicit Rotor(Disc disc, Real speed) {
        const Rotation& R = zToX();
        const Body hubBody = Body::Rigid(MassProperties(0.2, Vec3(0), Inertia(2e-4, 2e-4, 2e-4)));
        const Attachment seat = part.interface("B");
        Joint::Weld(flexible, matter.Ground(), part.interface("A"), "clamp");
        const auto pinned = [&](MobilizedBody& on, const Body& body) {
            return MobilizedBody::Pin(on, Transform(R), body, Transform(R));
        };
        const auto loose = [&](const Body& body) {
            return MobilizedBody::Free(matter.Ground(), Transform(), body, Transform());
        };
        std::vector<MobilizedBody> placed;  // at the hub's place
        if (disc == Disc::CarriesHub) {
            turning.push_back(loose(makePiece(1, 0)));
            hub = pinned(turning[0], hubBody);
        } else {
            hub = loose(hubBody);
            placed.push_back(hub);
        }
        Joint::Weld(flexible, seat, hub, "seat");
        const auto attach = [](const MobilizedBody& body, Real x = 0) {
            return Attachment(body, Transform(zToX(), Vec3(x, 0, 0)));
        };
        switch (disc) {
            case Disc::Whole:
            case Disc::Driven:
                turning.push_back(pinned(hub, makePiece(1, 0)));
                if (disc == Disc::Driven) Motion::Steady(turning[0], speed);
                break;
            case Disc::Halves:
                turning = {pinned(hub, makePiece(2, 0)), loose(makePiece(2, 1))};
                Joint::Weld(flexible, turning[0], turning[1], "glue");
                break;
            case Disc::HalvesOfSimbody:
                turning = {pinned(hub, makePiece(2, 0)), loose(makePiece(2, 1))};
                Constraint::Weld(turning[0], turning[1]);
                break;
            case Disc::FreeHalves:
            case Disc::DrivenHalves:
                turning = {loose(makePiece(2, 0)), loose(makePiece(2, 1))};
                Joint::Weld(flexible, turning[0], turning[1], "glue");
                Joint::Pin(flexible, attach(hub), attach(turning[1]), "bearing");
                if (disc == Disc::DrivenHalves)
                    Joint::PrescribedRotation(
                        flexible, attach(hub), attach(turning[0]),
                        [speed](Real t) { return Vec3(speed * t, speed, 0); }, "drive");
                break;
            case Disc::OnJoint:
                turning.push_back(loose(makePiece(1, 0)));
                Joint::Pin(flexible, attach(turning[0]), attach(hub), "bearing");
                break;
            case Disc::OnTwoJoints:
                turning.push_back(loose(makePiece(1, 0)));
                Joint::Pin(flexible, attach(hub, 0.1), attach(turning[0], 0.1), "first bearing");
                Joint::Pin(flexible, attach(hub, -0.1), attach(turning[0], -0.1), "second bearing");
                break;
            case Disc::OnBallAndLine:
                turning.push_back(loose(makePiece(1, 0)));
                Joint::Ball(flexible, attach(hub, 0.1), attach(turning[0], 0.1), "first bearing");
                Joint::PointOnLine(flexible, attach(hub, -0.2), attach(turning[0], -0.2),
                                   "second bearing");
                break;
            case Disc::OnCylinder:
                for (int k = 0; k < 3; ++k) turning.push_back(loose(makePiece(3, k)));
                Joint::Weld(flexible, turning[0], turning[1], "first glue");
                Joint::Weld(flexible, turning[1], turning[2], "second glue");
                Joint::Weld(flexible, turning[2], turning[0], "third glue");
                Joint::Cylinder(flexible, attach(hub), attach(turning[1]), "bearing");
                Joint::PointInPlane(flexible, attach(hub), attach(turning[2]), "thrust bearing");
                break;
            case Disc::CarriesHub:
                break;
        }
        ModalDamping(flexible, part, 0.01);
        state = system.realizeTopology();
        part.setPoseByInterface(state, "A", Transform());
        system.realize(state, Stage::Velocity);
        const Transform X = part.interface("B").calcMotion(state).X;
        for (const MobilizedBody& body : {hub, turning[0]})
            if (MobilizedBody::Free::isInstanceOf(body)) body.setQToFitTransform(state, X);
        for (const MobilizedBody& body : turning)
            if (MobilizedBody::Free::isInstanceOf(body)) body.setQToFitTransform(state, X);
        system.realize(state, Stage::Position);
        const Vec3 omega = X.R() * Vec3(speed, 0, 0);
        for (const MobilizedBody& body : turning) {
            if (MobilizedBody::Free::isInstanceOf(body))
                body.setUToFitVelocity(state, SpatialVec(omega, Vec3(0)));
            else if (disc != Disc::Driven)
                body.setOneU(state, 0, speed);
        }
        if (disc == Disc::CarriesHub) hub.setOneU(state, 0, -speed);
        system.prescribe(state);
        system.realize(state, Stage::Velocity);
    }

    Linearization linearize() const { return calcLinearization(system, state); }
};

/** What oscillates, or dies away, by |λ|; its damping ratios too. **/
std::vector<Vec2> listModes(const Linearization& linear) {
    std::vector<Vec2> modes;
    for (const Eigenmode& mode : calcEigenmodes(linear))
        if (mode.frequency > 0.02) modes.emplace_back(mode.frequency, mode.dampingRatio);
    return modes;
}

void expectSameModes(const std::vector<Vec2>& found, const std::vector<Vec2>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < expected.size(); ++k) {
        EXPECT_NEAR(found[k][0], expected[k][0], 1e-6 * expected[k][0]) << "mode " << k;
        EXPECT_NEAR(found[k][1], expected[k][1], 1e-6) << "mode " << k;
    }
}

TEST(RotatingAssemblies, ModesDoNotDependOnWhatADiscIsMadeOf) {
    for (const Real speed : {0.0, 60.0, 700.0}) {
        const std::vector<Vec2> expected = listModes(Rotor(Disc::Whole, speed).linearize());
        ASSERT_GE(expected.size(), 10u);
        for (const auto& [disc, name] : listDiscs()) {
            SCOPED_TRACE(name + " at " + std::to_string(speed) + " rad/s");
            const Linearization linear = Rotor(disc, speed).linearize();
            EXPECT_EQ(linear.unsteady, "");
            expectSameModes(listModes(linear), expected);
        }
    }
}

TEST(RotatingAssemblies, WhatDrivesADiscOfPiecesChangesNothingMore) {
    const Real speed = 300;
    const std::vector<Vec2> expected = listModes(Rotor(Disc::Driven, speed).linearize());
    expectSameModes(listModes(Rotor(Disc::DrivenHalves, speed).linearize()), expected);
}

TEST(RotatingAssemblies, EquilibriaAndModesAboutThemDoNotDependOnPieces) {
    // Under its weight the part bends, and the axis of rotation with it.
    std::vector<std::vector<Vec2>> found;
    std::vector<Vec3> places;
    for (const Disc disc : {Disc::Whole, Disc::Halves, Disc::FreeHalves}) {
        Rotor rotor(disc, 200);
        Force::Gravity(rotor.forces, rotor.matter, Vec3(0, -40, -20));
        State state = rotor.system.realizeTopology();
        state.updQ() = rotor.state.getQ();
        state.updU() = rotor.state.getU();
        StaticEquilibrium equilibrium(rotor.system);
        equilibrium.solveSteadyMotion(state);
        places.push_back(rotor.hub.getBodyOriginLocation(equilibrium.getState()));
        found.push_back(listModes(calcLinearization(rotor.system, equilibrium.getState())));
    }
    for (size_t k = 1; k < found.size(); ++k) {
        SCOPED_TRACE(k);
        EXPECT_LT((places[k] - places[0]).norm(), 1e-9);
        expectSameModes(found[k], found[0]);
    }
}

TEST(RotatingAssemblies, UnsymmetricDiscOnAnUnsymmetricPartIsRefused) {
    Rotor rotor(Disc::Whole, 300);
    rotor.turning[0].setDefaultMassProperties(MassProperties(
        Rotor::DiscMass, Vec3(0), Inertia(Rotor::DiscI3, 0.8 * Rotor::DiscI, 1.2 * Rotor::DiscI)));
    State state = rotor.system.realizeTopology();
    state.updQ() = rotor.state.getQ();
    state.updU() = rotor.state.getU();
    const Linearization linear = calcLinearization(rotor.system, state);
    EXPECT_THAT(linear.unsteady, HasSubstr("equations of small motions change"));
    try {
        calcEigenmodes(linear);
        FAIL() << "no exception";
    } catch (const std::invalid_argument& error) {
        EXPECT_EQ(std::string(error.what()),
                  "there are no natural modes about this motion: " + linear.unsteady);
    }
    // At rest there are, and where it turns slowly.
    state.updU() = 0;
    EXPECT_EQ(calcLinearization(rotor.system, state).unsteady, "");
    rotor.turning[0].setOneU(state, 0, 0.1);
    EXPECT_EQ(calcLinearization(rotor.system, state).unsteady, "");
}

//-------------------------------------------------------------------------------------------------
// against Simbody's own motion

/** A hub on an elastic, unsymmetric support, and n equal blades around it that are welded to what
spins on it. All bodies and constraints are Simbody's. **/
struct Windmill {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody::Free nacelle;
    MobilizedBody::Pin hub;
    std::vector<MobilizedBody::Free> blades;
    State state;
    static constexpr Real Speed = 30, BladeMass = 0.5, Radius = 0.3;

    static MassProperties makeBlade(Real angle) {
        const Rotation R(angle, XAxis);
        const Inertia own = Inertia(0.012, 0.001, 0.012).reexpress(~R);
        const Vec3 center = R * Vec3(0.05, Radius, 0);
        return {BladeMass, center, own.shiftFromMassCenter(center, BladeMass)};
    }

    explicit Windmill(int numBlades, bool isOneBody)
        : nacelle(matter.Ground(), Transform(),
                  Body::Rigid(MassProperties(3, Vec3(0), Inertia(0.02, 0.02, 0.03))), Transform()) {
        Force::LinearBushing(forces, matter.Ground(), nacelle, Vec6(40, 60, 45, 3000, 5000, 7000),
                             Vec6(0));
        Real mass = 1;
        Vec3 moment(0);
        Inertia inertia(0.01, 0.008, 0.008);
        if (isOneBody)
            for (int k = 0; k < numBlades; ++k) {
                const MassProperties blade = makeBlade(2 * Pi * k / numBlades);
                mass += blade.getMass();
                moment += blade.getMass() * blade.getMassCenter();
                inertia += blade.getInertia();
            }
        hub = MobilizedBody::Pin(nacelle, Transform(zToX()),
                                 Body::Rigid(MassProperties(mass, moment / mass, inertia)),
                                 Transform(zToX()));
        for (int k = 0; k < numBlades && !isOneBody; ++k) {
            blades.emplace_back(matter.Ground(), Transform(),
                                Body::Rigid(makeBlade(2 * Pi * k / numBlades)), Transform());
            Constraint::Weld(hub, blades.back());
        }
        state = system.realizeTopology();
        hub.setOneU(state, 0, Speed);
        for (const MobilizedBody& blade : blades)
            blade.setUToFitVelocity(state, SpatialVec(Vec3(Speed, 0, 0), Vec3(0)));
        system.realize(state, Stage::Velocity);
    }
};

TEST(RotatingAssemblies, BladesOnAHubAreOneBodyWithIt) {
    const Windmill oneBody(3, true);
    const std::vector<Vec2> expected = listModes(calcLinearization(oneBody.system, oneBody.state));
    const Windmill windmill(3, false);
    expectSameModes(listModes(calcLinearization(windmill.system, windmill.state)), expected);
}

TEST(RotatingAssemblies, TwoBladesAreRefused) {
    const Windmill windmill(2, false);
    EXPECT_THAT(calcLinearization(windmill.system, windmill.state).unsteady,
                HasSubstr("equations of small motions change"));
}

/** Frequency near `guess` at which the windowed transform of y is largest [Hz]. **/
Real findPeak(const std::vector<Real>& y, Real interval, Real guess) {
    const auto calcSize = [&](Real f) {
        Complex sum = 0;
        const Real n = Real(y.size());
        for (size_t k = 0; k < y.size(); ++k)
            sum += (1 - std::cos(2 * Pi * (Real(k) + 0.5) / n)) * y[k] *
                   std::polar(Real(1), -2 * Pi * f * interval * Real(k));
        return std::abs(sum);
    };
    Real best = guess, width = 2 / (interval * Real(y.size()));
    for (; width > 1e-7 * guess; width /= 4) {
        const Real center = best;
        for (int k = -8; k <= 8; ++k)
            if (calcSize(center + k * width / 8) > calcSize(best)) best = center + k * width / 8;
    }
    return best;
}

TEST(RotatingAssemblies, BladesOnAHubMoveAsInSimbodysOwnMotion) {
    const Windmill windmill(3, false);
    State state = windmill.state;
    const std::vector<Vec2> modes = listModes(calcLinearization(windmill.system, state));
    // Simbody integrates what follows on a small push.
    const Vec3 push(2e-4, 1e-4, -1.5e-4), twist(1e-3, -2e-3, 1.5e-3);
    windmill.nacelle.setUToFitVelocity(state, SpatialVec(twist, push));
    windmill.system.realize(state, Stage::Velocity);
    windmill.system.project(state, 1e-12);
    RungeKuttaMersonIntegrator integrator(windmill.system);
    integrator.setAccuracy(1e-7);
    integrator.setConstraintTolerance(1e-8);
    TimeStepper stepper(windmill.system, integrator);
    stepper.initialize(state);
    const Real interval = 0.02;
    const int count = 300;
    std::vector<std::vector<Real>> signals(6);
    for (int k = 0; k < count; ++k) {
        stepper.stepTo(k * interval);
        const State& now = integrator.getState();
        const Vec3 p = windmill.nacelle.getBodyOriginLocation(now),
                   angles = windmill.nacelle.getBodyRotation(now).convertRotationToBodyFixedXYZ();
        for (int a = 0; a < 3; ++a) {
            signals[size_t(a)].push_back(p[a]);
            signals[size_t(3 + a)].push_back(angles[a]);
        }
    }
    ASSERT_EQ(modes.size(), 6u);
    for (const Vec2& mode : modes) {
        Real nearest = Infinity;
        for (std::vector<Real>& signal : signals) {
            const Real mean = std::accumulate(signal.begin(), signal.end(), 0.0) / count;
            std::vector<Real> swing;
            for (const Real value : signal) swing.push_back(value - mean);
            const Real peak = findPeak(swing, interval, mode[0]);
            if (std::abs(peak - mode[0]) < std::abs(nearest - mode[0])) nearest = peak;
        }
        EXPECT_NEAR(nearest, mode[0], 2e-3 * mode[0]);
        EXPECT_NEAR(mode[1], 0, 1e-7);
    }
}

}  // namespace
}  // namespace simflex
