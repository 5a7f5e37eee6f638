// Small motions about a steady rotation of assemblies. A rigid body cut into welded pieces, or
// carried by other joints, has the same modes; and the modes match Simbody's own motion.

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

/** Construction and support of a disc. **/
enum class Disc {
    Whole,            ///< one body on a Pin mobilizer of the hub
    Halves,           ///< two half-moons, the first on the mobilizer, welded
    HalvesOfSimbody,  ///< the same with Simbody's own Weld
    FreeHalves,       ///< half-moons on a Joint::Pin
    OnJoint,          ///< one body on a Joint::Pin
    OnTwoJoints,      ///< on two redundant Joint::Pin
    OnBallAndLine,    ///< on a Ball at one end of its shaft and a PointOnLine at the other
    CarriesHub,       ///< the disc is the base body and carries the hub
    OnCylinder,       ///< three thirds, welded in a ring, on a Cylinder and a PointInPlane
    Driven,           ///< one body whose Pin has a Motion
    DrivenHalves      ///< half-moons driven by a PrescribedRotation
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

/** A flexible part clamped at its interface A that carries a hub at B, on which a disc spins about
the hub's x axis. **/
struct Rotor {
    static constexpr Real DiscMass = 1.2, DiscI = 0.004, DiscI3 = 0.007;

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody part{flexible, test::makePointMassPart().body, "part"};
    std::vector<MobilizedBody> turning;  ///< bodies that rotate with the disc
    MobilizedBody hub;
    State state;

    /** Returns one of `pieces` bodies that together form the disc. Each has its centre of mass off
    the axis; halves are out of round, too. **/
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
        std::vector<MobilizedBody> placed;  // with their origin at the hub
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

/** Returns |λ| and damping ratio of the modes that oscillate or decay. **/
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

TEST(RotatingAssemblies, ModesFoundByBlocksAreTheSame) {
    for (const Real speed : {60.0, 700.0}) {
        std::vector<Vec2> expected = listModes(Rotor(Disc::Whole, speed).linearize());
        expected.resize(8);
        for (const auto& [disc, name] : listDiscs()) {
            SCOPED_TRACE(name + " at " + std::to_string(speed) + " rad/s");
            const Rotor rotor(disc, speed);
            std::vector<Vec2> found;
            for (const Eigenmode& mode :
                 calcSlowestEigenmodes(rotor.system, rotor.state, 10, EigenMethod::Blocks))
                if (mode.frequency > 0.02 && found.size() < expected.size())
                    found.emplace_back(mode.frequency, mode.dampingRatio);
            expectSameModes(found, expected);
        }
    }
}

TEST(RotatingAssemblies, WhatDrivesADiscOfPiecesChangesNothingMore) {
    const Real speed = 300;
    const std::vector<Vec2> expected = listModes(Rotor(Disc::Driven, speed).linearize());
    expectSameModes(listModes(Rotor(Disc::DrivenHalves, speed).linearize()), expected);
}

TEST(RotatingAssemblies, EquilibriaAndModesAboutThemDoNotDependOnPieces) {
    // The part and the axis of rotation bend under the weight.
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
    try {
        calcSlowestEigenmodes(rotor.system, state, 6, EigenMethod::Blocks);
        FAIL() << "no exception";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("equations of small motions change"));
    }
    // At rest and in slow rotation it is a steady motion.
    state.updU() = 0;
    EXPECT_EQ(calcLinearization(rotor.system, state).unsteady, "");
    rotor.turning[0].setOneU(state, 0, 0.1);
    EXPECT_EQ(calcLinearization(rotor.system, state).unsteady, "");
}

// -------------------------------------------------------------------------------------------------
// comparison with Simbody's own motion

/** A hub on an elastic, unsymmetric support, and n equal blades around it, welded to the spinning
part. All bodies and constraints are Simbody's. **/
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
    EXPECT_THROW(calcSlowestEigenmodes(windmill.system, windmill.state, 6, EigenMethod::Blocks),
                 std::invalid_argument);
}

/** Returns the frequency near `guess` at which the windowed Fourier transform of y is largest
[Hz]. **/
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
    // Simbody integrates the response to a small push.
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

//-------------------------------------------------------------------------------------------------
// several rotors, blades on hinges, tops

/** A body of `pieces` equal welded sectors, centred on its z axis. They rotate together on a pin of
another body, with inertia I, I, I3 about the centre. **/
struct Sectors {
    std::vector<MobilizedBody> bodies;

    Sectors(MultibodySystem& system, FlexibleBodySubsystem& flexible, MobilizedBody& on, int pieces,
            Real I, Real I3, const std::string& name) {
        auto& matter = system.updMatterSubsystem();
        const Real away = pieces > 1 ? 0.02 : 0;
        for (int k = 0; k < pieces; ++k) {
            const Real turn = 2 * Pi * k / pieces;
            const Vec3 center = away * Vec3(std::cos(turn), std::sin(turn), 0);
            bodies.push_back(MobilizedBody::Free(
                matter.Ground(), Transform(),
                Body::Rigid(MassProperties(2.0 / pieces, center,
                                           Inertia(I / pieces, I / pieces, I3 / pieces))),
                Transform()));
            if (k > 0)
                Joint::Weld(flexible, bodies[size_t(k) - 1], bodies[size_t(k)],
                            name + " weld " + std::to_string(k));
        }
        Joint::Pin(flexible, on, bodies[0], name);
    }
    void spin(State& state, Real speed) const {
        for (const MobilizedBody& body : bodies)
            body.setUToFitVelocity(state, SpatialVec(Vec3(0, 0, speed), Vec3(0)));
    }
};

TEST(RotatingAssemblies, ASatelliteWithARotorNutatesAsInClosedForm) {
    // h/I across the axis, for an observer rotating with the carrier.
    const Real It = 0.3, I3 = 0.2, rotorI = 0.03, rotorI3 = 0.05, speed = 50;
    for (const int pieces : {1, 2, 3})
        for (const Real carrier : {0.0, 7.0}) {
            SCOPED_TRACE(std::to_string(pieces) + " pieces, carrier at " + std::to_string(carrier));
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            FlexibleBodySubsystem flexible(system, matter);
            MobilizedBody::Free satellite(
                matter.Ground(), Transform(),
                Body::Rigid(MassProperties(10, Vec3(0), Inertia(It, It, I3))), Transform());
            const Sectors rotor(system, flexible, satellite, pieces, rotorI, rotorI3, "rotor");
            State state = system.realizeTopology();
            satellite.setUToFitVelocity(state, SpatialVec(Vec3(0, 0, carrier), Vec3(0)));
            rotor.spin(state, speed);
            system.realize(state, Stage::Velocity);
            const Real h = rotorI3 * speed + I3 * carrier;
            const Real nutation = std::abs(h / (It + rotorI) - carrier);
            int numRigid = 0;
            bool isFound = false;
            for (const Eigenmode& mode : calcEigenmodes(calcLinearization(system, state))) {
                const Real rate = std::abs(mode.eigenvalue);
                numRigid += mode.isRigidMotion();
                isFound = isFound || std::abs(rate - nutation) < 1e-7 * nutation;
                // A direction fixed in space rotates at the carrier's rate in its axes.
                EXPECT_TRUE(rate == 0 || std::abs(rate - nutation) < 1e-7 * nutation ||
                            std::abs(rate - carrier) < 1e-5 * carrier)
                    << rate;
            }
            EXPECT_TRUE(isFound);
            // Along and about the axis; if nothing rotates, also transverse positions and
            // directions.
            EXPECT_EQ(numRigid, carrier == 0 ? 7 : 3);
        }
}

TEST(RotatingAssemblies, RotorsOnOneBearingBlockAddTheirAngularMomenta) {
    // I θ̈ ± h θ̇ + kθ = 0 with h = Σ I₃Ω; the second rotor is mounted on the block or on the
    // first.
    const Real k = 200, I = 0.02, firstI3 = 0.03, secondI3 = 0.015;
    for (const bool isOnFirst : {false, true})
        for (const Vec2& speeds : {Vec2(300, -100), Vec2(300, 100), Vec2(100, -200)}) {
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            GeneralForceSubsystem forces(system);
            FlexibleBodySubsystem flexible(system, matter);
            MobilizedBody::Universal block(
                matter.Ground(), Transform(),
                Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.01, 0.01, 0.02))), Transform());
            for (const int axis : {0, 1})
                Force::MobilityLinearSpring(forces, block, MobilizerQIndex(axis), k, 0);
            Sectors first(system, flexible, block, 2, I, firstI3, "first");
            const Sectors second(system, flexible, isOnFirst ? first.bodies[1] : block, 3, I,
                                 secondI3, "second");
            State state = system.realizeTopology();
            first.spin(state, speeds[0]);
            second.spin(state, speeds[1]);
            system.realize(state, Stage::Velocity);
            const Real all = 0.01 + 2 * I, h = std::abs(firstI3 * speeds[0] + secondI3 * speeds[1]),
                       root = std::sqrt(h * h + 4 * all * k);
            std::vector<Real> rates;
            const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
            ASSERT_EQ(modes.size(), 4u);
            for (const int mode : {0, 1}) EXPECT_TRUE(modes[size_t(mode)].isRigidMotion());
            EXPECT_NEAR(std::abs(modes[2].eigenvalue), (root - h) / (2 * all), 1e-6 * root);
            EXPECT_NEAR(std::abs(modes[3].eigenvalue), (root + h) / (2 * all), 1e-6 * root);
        }
}

/** A nacelle on springs, a hub that spins about x on it, and hinged blades with hinge springs. **/
struct HingedBlades {
    static constexpr Real NacelleMass = 3, HubMass = 1, Mass = 0.5, Length = 1, Offset = 0.2,
                          HingeStiffness = 8;
    static constexpr Real I = Mass * Length * Length / 3, OwnI = 0.001, S = Mass * Length / 2;

    enum class Hinges { Across, Along };  ///< relative to the shaft: blades flap or lag
    enum class Pieces { One, Two };

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody nacelle;
    std::vector<MobilizedBody> blades, others;
    State state;

    /** @param stiffness  of the nacelle; for flapping blades along x only **/
    HingedBlades(Hinges hinges, Pieces pieces, int numBlades, Real nacelleMass, Real stiffness,
                 Real speed) {
        const Body body = Body::Rigid(MassProperties(nacelleMass, Vec3(0), Inertia(1)));
        const bool flaps = hinges == Hinges::Across;
        if (flaps)
            nacelle = MobilizedBody::Slider(matter.Ground(), Transform(), body, Transform());
        else
            nacelle = MobilizedBody::Cartesian(matter.Ground(), Transform(), body, Transform());
        for (int i = 0; i < (flaps ? 1 : 3); ++i)
            Force::MobilityLinearSpring(forces, nacelle, MobilizerQIndex(i), stiffness, 0);
        MobilizedBody::Pin hub(
            nacelle, Transform(zToX()),
            Body::Rigid(MassProperties(HubMass, Vec3(0), Inertia(0.05, 0.03, 0.03))),
            Transform(zToX()));
        const Real share = pieces == Pieces::One ? 1 : 0.5;
        const Body::Rigid piece(MassProperties(share * Mass, Vec3(0, Length / 2, 0),
                                               Inertia(share * I, share * OwnI, share * I)));
        const Rotation axes = flaps ? Rotation() : zToX();
        for (int k = 0; k < numBlades; ++k) {
            const Rotation turn(2 * Pi * k / numBlades, XAxis);
            blades.push_back(MobilizedBody::Pin(
                hub, Transform(turn * axes, turn * Vec3(0, Offset, 0)), piece, Transform(axes)));
            Force::MobilityLinearSpring(forces, blades.back(), MobilizerQIndex(0), HingeStiffness,
                                        0);
            if (pieces == Pieces::One) continue;
            others.push_back(MobilizedBody::Free(matter.Ground(), Transform(), piece, Transform()));
            Joint::Weld(flexible, blades.back(), others.back(), "glue " + std::to_string(k));
        }
        state = system.realizeTopology();
        hub.setOneU(state, 0, speed);
        for (size_t k = 0; k < others.size(); ++k) {
            system.realize(state, Stage::Velocity);
            others[k].setQToFitTransform(state, blades[k].getBodyTransform(state));
            system.realize(state, Stage::Velocity);
            others[k].setUToFitVelocity(state, blades[k].getBodyVelocity(state));
        }
        system.realize(state, Stage::Velocity);
    }
};

TEST(RotatingAssemblies, BladesThatFlapOnASwayingNacelleAreThoseOfTheClosedForm) {
    // M ẍ + n S β̈ + k x = 0, S ẍ + I β̈ + (k_h + Ω²(I + e S)) β = 0; the other modes flap without
    // the nacelle.
    const Real k = 200;
    for (const int n : {2, 3})
        for (const Real speed : {0.0, 5.0, 20.0})
            for (const auto pieces : {HingedBlades::Pieces::One, HingedBlades::Pieces::Two}) {
                SCOPED_TRACE(std::to_string(n) + " blades at " + std::to_string(speed));
                using B = HingedBlades;
                const B model(B::Hinges::Across, pieces, n, B::NacelleMass, k, speed);
                const Real hinge =
                    B::HingeStiffness + speed * speed * (B::I - B::OwnI + B::Offset * B::S);
                const Real mass = B::NacelleMass + B::HubMass + n * B::Mass;
                const Real a = mass * B::I - n * B::S * B::S, b = mass * hinge + k * B::I,
                           root = std::sqrt(b * b - 4 * a * k * hinge);
                std::vector<Real> expected(size_t(n - 1), std::sqrt(hinge / B::I));
                expected.push_back(std::sqrt((b - root) / (2 * a)));
                expected.push_back(std::sqrt((b + root) / (2 * a)));
                std::sort(expected.begin(), expected.end());
                const std::vector<Eigenmode> modes =
                    calcEigenmodes(calcLinearization(model.system, model.state));
                ASSERT_EQ(modes.size(), expected.size() + 1);
                EXPECT_TRUE(modes[0].isRigidMotion());
                for (size_t i = 0; i < expected.size(); ++i)
                    EXPECT_NEAR(std::abs(modes[i + 1].eigenvalue), expected[i], 1e-7 * expected[i]);
            }
}

TEST(RotatingAssemblies, BladesThatLagOnASwayingNacelleAreRefusedHoweverHeavyItIs) {
    using B = HingedBlades;
    for (const int n : {2, 3, 4})
        for (const Real heavier : {1, 100}) {
            const B model(B::Hinges::Along, B::Pieces::One, n, heavier * B::NacelleMass,
                          200 * heavier, 20);
            EXPECT_THAT(calcLinearization(model.system, model.state).unsteady,
                        HasSubstr("equations of small motions change"))
                << n << " blades, " << heavier;
        }
}

TEST(RotatingAssemblies, ATopInSteadyPrecessionNutatesAsInClosedForm) {
    // I φ̇² cos θ − I₃ω₃φ̇ + mgl = 0, and small motions of θ that conserve both momenta.
    const Real m = 1, l = 0.1, I = 0.02, I3 = 0.005, weight = m * 9.81 * l;
    const Body::Rigid body(MassProperties(m, Vec3(0, 0, l), Inertia(I, I, I3)));
    const Body::Massless ring;
    for (const Real theta : {0.5, 1.2})
        for (const Real w3 : {60.0, 600.0}) {
            SCOPED_TRACE(std::to_string(theta) + " rad, " + std::to_string(w3) + " rad/s");
            const Real s = std::sin(theta), c = std::cos(theta);
            const Real turn =
                (I3 * w3 - std::sqrt(square(I3 * w3) - 4 * I * c * weight)) / (2 * I * c);
            const Real change = (I3 * w3 - 2 * I * c * turn) / (I * s);
            const Real stiffness = I3 * w3 * (change * s + turn * c) - weight * c -
                                   I * (2 * turn * change * s * c + turn * turn * (c * c - s * s));
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            GeneralForceSubsystem forces(system);
            Force::Gravity(forces, matter, Vec3(0, 0, -9.81));
            MobilizedBody::Pin precession(matter.Ground(), Transform(), ring, Transform());
            MobilizedBody::Pin tilt(precession, Transform(zToX()), ring, Transform(zToX()));
            MobilizedBody::Pin spin(tilt, Transform(), body, Transform());
            State state = system.realizeTopology();
            tilt.setOneQ(state, 0, theta);
            precession.setOneU(state, 0, turn);
            spin.setOneU(state, 0, w3 - turn * c);
            system.realize(state, Stage::Velocity);
            const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
            ASSERT_EQ(modes.size(), 3u);
            EXPECT_TRUE(modes[0].isRigidMotion() && modes[1].isRigidMotion());
            EXPECT_NEAR(std::abs(modes[2].eigenvalue), std::sqrt(stiffness / I),
                        1e-7 * std::sqrt(stiffness / I));
            if (w3 > 100) continue;

            // On a ball its twist is not a steady motion: gravity rotates it about another axis.
            MultibodySystem other;
            SimbodyMatterSubsystem itsMatter(other);
            GeneralForceSubsystem itsForces(other);
            Force::Gravity(itsForces, itsMatter, Vec3(0, 0, -9.81));
            MobilizedBody::Ball ball(itsMatter.Ground(), Transform(), body, Transform());
            State its = other.realizeTopology();
            ball.setQToFitTransform(its, spin.getBodyTransform(state));
            other.realize(its, Stage::Position);
            ball.setUToFitAngularVelocity(its, spin.getBodyAngularVelocity(state));
            EXPECT_THAT(calcLinearization(other, its).unsteady,
                        HasSubstr("forces that do not turn with it lead"));
        }
}

//-------------------------------------------------------------------------------------------------
// flexible rotors

/** A part rotating on bearings at its interfaces, about an axis through its centre of mass. **/
struct Shaft {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody part{flexible, test::makePointMassPart().body, "shaft"};
    State state;

    enum class Spin { Free, Driven };

    Shaft(Spin spin, Real speed, Real weight) {
        Force::Gravity(forces, matter, Vec3(0, -weight, 0));
        const auto seatOf = [&](const std::string& name) {
            const auto& p = part.getPart().getInterface(name).position;
            return std::pair(Vec3(0, -p[1], -p[2]), p[0]);
        };
        const auto [atA, xA] = seatOf("A");
        const auto [atB, xB] = seatOf("B");
        const Attachment a = part.interface("A", Transform(zToX(), atA)),
                         b = part.interface("B", Transform(zToX(), atB)),
                         ground(matter.Ground(), Transform(zToX()));
        Joint::Ball(flexible, ground, a, "ball");
        Joint::PointOnLine(flexible, ground, b, "line");
        if (spin == Spin::Driven)
            Joint::PrescribedRotation(
                flexible, ground, a, [speed](Real t) { return Vec3(speed * t, speed, 0); },
                "drive");
        state = system.realizeTopology();
        part.setPoseByInterface(state, "A", Transform(-atA));
        setSteadyRotation(system, state, Vec3(speed, 0, 0));
        system.realize(state, Stage::Velocity);
    }

    State findSteadyMotion() const {
        StaticEquilibrium equilibrium(system);
        equilibrium.solveSteadyMotion(state);
        return equilibrium.getState();
    }
};

TEST(RotatingAssemblies, AFreeSpinIsARigidMotionOfAFlexibleShaft) {
    for (const Real speed : {0.05, 10.0, 100.0}) {
        const Shaft shaft(Shaft::Spin::Free, speed, 0);
        const std::vector<Eigenmode> modes =
            calcEigenmodes(calcLinearization(shaft.system, shaft.findSteadyMotion()));
        EXPECT_TRUE(modes[0].isRigidMotion()) << modes[0].frequency;
        EXPECT_GT(modes[1].frequency, 20);
    }
}

TEST(RotatingAssemblies, WeightThatBendsAShaftIsNoPartOfItsSteadyMotion) {
    // In body axes gravity rotates, so the pendulum-like stiffness on the spin holds for an instant
    // only.
    for (const Real speed : {10.0, 50.0, 100.0, 200.0}) {
        const Shaft shaft(Shaft::Spin::Free, speed, 9.81);
        EXPECT_NE(calcLinearization(shaft.system, shaft.findSteadyMotion()).unsteady, "") << speed;
    }
    const Shaft slow(Shaft::Spin::Driven, 10, 9.81), weightless(Shaft::Spin::Driven, 10, 0);
    const std::vector<Vec2> found =
                                listModes(calcLinearization(slow.system, slow.findSteadyMotion())),
                            expected = listModes(calcLinearization(weightless.system,
                                                                   weightless.findSteadyMotion()));
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < found.size(); ++k)
        EXPECT_NEAR(found[k][0], expected[k][0], 1e-3 * expected[k][0]);
}

}  // namespace
}  // namespace simflex
