// A beam welded to Ground at its end: Euler-Bernoulli frequencies, and CalculiX's sag under its
// weight.

#include <gtest/gtest.h>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/FrequencyResponse.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/Beam.h"
#include "validation/BrickParts.h"
#include "validation/Cantilever.h"

namespace simflex {
namespace {

using namespace SimTK;
using simflex::testing::Brick;
using test::Cantilever;

TEST(Cantilever, FrequenciesMatchEulerBernoulli) {
    Brick brick;
    brick.size = {1, 0.01, 0.013};
    brick.elements = {50, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    Cantilever model(test::reduceBrick(brick, 30), Vec3(0));
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, model.makeState()));
    std::vector<std::pair<double, double>>
        expected;  // with the reduction by shear and rotatory inertia
    for (const double root : {1.8751, 4.6941, 7.8548})
        for (const double depth : {brick.size[1], brick.size[2]})
            expected.emplace_back(
                root * root * depth * std::sqrt(brick.E / (12 * brick.rho)) / (2 * Pi),
                0.5 * root * root * depth * depth / 12 * (1 + 2 * 1.2));
    std::sort(expected.begin(), expected.end());
    for (size_t k = 0; k < expected.size(); ++k) {
        const double error = modes[k].frequency / expected[k].first - 1;
        EXPECT_LT(error, 1e-4) << k;  // of the reduction
        EXPECT_GT(error, -1.5 * expected[k].second - 1e-4) << k;
    }
}

TEST(Cantilever, SagsUnderItsWeightAsInCalculix) {
    SIMFLEX_NEEDS_CALCULIX();
    const Brick brick;
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(folder / "brick.inp", brick.text());
    const std::array<double, 6> expected =
        simflex::testing::calcCalculixSag(folder, folder / "brick.inp", {"LEFT", {0, 0, 0}},
                                          {"RIGHT", {brick.size[0], 0, 0}}, 9.81, {0, -0.8, 0.6});
    Cantilever model(test::reduceBrick(brick, 50), 9.81 * Vec3(0, -0.8, 0.6));
    StaticEquilibrium equilibrium(model.system);
    equilibrium.setTolerance(1e-14);
    equilibrium.solve(model.makeState());
    const Transform X = model.beam.interface("right").calcMotion(equilibrium.getState()).X;
    const Vec3 shift = X.p() - Vec3(brick.size[0], 0, 0);
    const Vec4 turn = X.R().convertRotationToAngleAxis();
    for (int a = 1; a < 3; ++a) {
        EXPECT_NEAR(shift[a], expected[size_t(a)], 1e-3 * std::abs(expected[size_t(a)])) << a;
        const double rotation = turn[0] * turn[1 + a], own = expected[size_t(3 + a)];
        EXPECT_NEAR(rotation, own, 1e-3 * std::abs(own)) << a;
    }
    // The clamp carries the weight and its moment.
    const SpatialVec force =
        model.clamp.calcForceOnM(equilibrium.getState(), equilibrium.getMultipliers(model.clamp));
    const double weight = brick.mass() * 9.81;
    EXPECT_NEAR(force[1][1], 0.8 * weight, 1e-8 * weight);
    EXPECT_NEAR(force[0][2], 0.8 * weight * brick.size[0] / 2, 1e-5 * weight * brick.size[0]);
}

/** Straight beam pieces welded to each other, the first one to Ground, each rotated relative to the
previous one. **/
struct Pieces {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> bodies;
    std::vector<Transform> roots;

    Pieces(const std::shared_ptr<const ReducedBody>& part, double length, Transform root,
           const Rotation& turn, int count) {
        for (int k = 0; k < count; ++k) {
            const FlexibleBody body(flexible, part);
            const Attachment before = k == 0 ? Attachment(matter.Ground(), root)
                                             : bodies.back().interface("tip", Transform(turn));
            Joint::Weld(flexible, before, body.interface("root"));
            bodies.push_back(body);
            roots.push_back(root);
            root = Transform(root.R() * turn, root * Vec3(length, 0, 0));
        }
    }
    State makeState() {
        State state = system.realizeTopology();
        for (size_t k = 0; k < bodies.size(); ++k)
            bodies[k].setPoseByInterface(state, "root", roots[k]);
        return state;
    }
};

// K. J. Bathe, S. Bolourchi, Large displacement analysis of three-dimensional beam structures, Int.
// J. Numer. Meth. Eng. 14 (1979): an eighth of a circle of 100 in, 1 in square, 10⁷ psi, 600 lb at
// its end, out of its plane. The published result is (−23.82, −13.73, 53.61) in, with the torsion
// constant of a square, 0.1406, which nine bricks over the section approach. A section that cannot
// warp has 1/6, for which a geometrically exact (Reissner) rod, integrated by Runge-Kutta and
// shooting, gives (−23.56024, −13.60452, 53.47486) in.
TEST(Cantilever, CurvedBeamOfAnyNumberOfPiecesBendsOutOfItsPlaneInFewIterations) {
    const double Radius = 100, Angle = Pi / 4;
    for (const int across : {1, 3})
        for (const int count : {8, 16, 32}) {
            const double part = Angle / count;
            test::BeamOptions options;
            options.length = 2 * Radius * std::sin(part / 2);
            options.height = options.width = 1;
            options.E = 1e7;
            options.density = 1;
            options.numElements = 4;
            options.numAcross = across;
            options.numModes = 18;
            Pieces beam(test::makeBeam(options), options.length,
                        Transform(Rotation(part / 2, ZAxis)), Rotation(part, ZAxis), count);
            const Attachment tip = beam.bodies.back().interface("tip");
            AttachmentForce(beam.flexible, tip, SpatialVec(Vec3(0), Vec3(0, 0, 600)));
            StaticEquilibrium equilibrium(beam.system);
            equilibrium.solve(beam.makeState());
            const Vec3 end(Radius * std::sin(Angle), Radius * (1 - std::cos(Angle)), 0);
            const Vec3 shift = tip.calcMotion(equilibrium.getState()).X.p() - end;
            const Vec3 rod(-23.56024, -13.60452, 53.47486), published(-23.82, -13.73, 53.61);
            const double largest = across > 1 || count < 32 ? 2e-3 : 2e-4;
            const Vec3 expected = across > 1 ? published : rod;
            EXPECT_LT((shift - expected).norm(), largest * expected.norm())
                << count << ", " << across << " across: " << shift;
            EXPECT_LE(equilibrium.getNumIterations(), 30) << count;
            EXPECT_EQ(equilibrium.getNumLoadSteps(), 1) << count;
            EXPECT_TRUE(equilibrium.getUnstableMotions().empty()) << count;
        }
}

// K. E. Bisshopp, D. C. Drucker, Large deflection of cantilever beams, Quart. Appl. Math. 3 (1945):
// with k² = (1 + sin θ₀)/2 and sin φ = 1/(k√2), θ₀ the tip's slope,
//     α = PL²/EI = (K(k) − F(φ, k))²,  y/L = 1 − 2 (E(k) − E(φ, k))/√α,  x/L = √(2 sin θ₀/α)
TEST(Cantilever, TipGoesTheWayOfTheElastica) {
    constexpr int Count = 16;
    constexpr double Length = 1, Depth = 0.01;
    test::BeamOptions options;
    options.length = Length / Count;
    options.height = options.width = Depth;
    options.numElements = 8;
    options.numModes = 14;
    const auto part = test::makeBeam(options);
    const double EI = options.E * std::pow(Depth, 4) / 12;
    for (const double load : {0.5, 2.0, 10.0}) {
        const auto calcModulus = [](double slope) { return std::sqrt((1 + std::sin(slope)) / 2); };
        const auto calcLoad = [&](double slope) {
            const double k = calcModulus(slope), phi = std::asin(1 / (k * std::sqrt(2)));
            return square(std::comp_ellint_1(k) - std::ellint_1(k, phi));
        };
        double low = 1e-6, high = Pi / 2 - 1e-9;
        for (int pass = 0; pass < 100; ++pass) {
            const double middle = 0.5 * (low + high);
            (calcLoad(middle) < load ? low : high) = middle;
        }
        const double k = calcModulus(low), phi = std::asin(1 / (k * std::sqrt(2)));
        const double y = 1 - 2 * (std::comp_ellint_2(k) - std::ellint_2(k, phi)) / std::sqrt(load);
        const double x = std::sqrt(2 * std::sin(low) / load);

        Pieces beam(part, options.length, Transform(), Rotation(), Count);
        const Attachment tip = beam.bodies.back().interface("tip");
        AttachmentForce(beam.flexible, tip,
                        SpatialVec(Vec3(0), Vec3(0, load * EI / square(Length), 0)));
        StaticEquilibrium equilibrium(beam.system);
        equilibrium.solve(beam.makeState());
        const Transform end = tip.calcMotion(equilibrium.getState()).X;
        EXPECT_NEAR(end.p()[0] / Length, x, 1e-3) << load;
        EXPECT_NEAR(end.p()[1] / Length, y, 1e-3) << load;
        EXPECT_NEAR(std::atan2(end.R().x()[1], end.R().x()[0]), low, 1e-3) << load;
        EXPECT_LE(equilibrium.getNumIterations(), 30) << load;
        EXPECT_EQ(equilibrium.getBranch(), StaticEquilibrium::Branch::Own);

        // The same end by following the path, on which the load never reverses.
        const auto path = equilibrium.followPath(beam.makeState(), {});
        for (const auto& point : path)
            EXPECT_EQ(point.kind, StaticEquilibrium::PathPoint::Kind::Regular);
        EXPECT_LT((tip.calcMotion(equilibrium.getState()).X.p() - end.p()).norm(), 1e-8);
    }
}

/** Half of a toggle frame: clamped at its foot, with zero slope at its apex, which moves straight
down; lengths in m, forces in N. **/
struct Toggle {
    double length, rise, EA, EI;

    double getAngle() const { return std::asin(rise / length); }
    /** Returns the end (x, y, slope) of a rod that can bend and stretch, for the force (H, V) at
    its end and the moment at its foot. **/
    Vec3 calcEnd(const Vec3& forces) const {
        constexpr int Steps = 400;
        const double H = forces[0], V = forces[1];
        Vec4 z(0, 0, getAngle(), forces[2]);  // x, y, slope, moment
        const auto slope = [&](const Vec4& at) {
            const double c = std::cos(at[2]), s = std::sin(at[2]),
                         stretch = 1 + (H * c + V * s) / EA;
            return Vec4(stretch * c, stretch * s, at[3] / EI, stretch * (H * s - V * c));
        };
        const double h = length / Steps;
        for (int i = 0; i < Steps; ++i) {
            const Vec4 a = slope(z), b = slope(z + h / 2 * a), c = slope(z + h / 2 * b),
                       d = slope(z + h * c);
            z += h / 6 * (a + 2 * b + 2 * c + d);
        }
        return Vec3(z[0], z[1], z[2]);
    }
    /** Returns the downward force on the apex for a displacement `w`; `forces` holds the previous
    solution as initial guess. **/
    double calcForce(double w, Vec3& forces) const {
        const Vec3 wanted(length * std::cos(getAngle()), rise - w, getAngle());
        const Vec3 units(EI / square(length), EI / square(length), EI / length);
        for (int pass = 0; pass < 30; ++pass) {
            const Vec3 error = calcEnd(forces) - wanted;
            Mat33 slopes;
            for (int j = 0; j < 3; ++j) {
                Vec3 moved = forces;
                moved[j] += 1e-5 * units[j];
                slopes(j) = (calcEnd(moved) - wanted - error) / (1e-5 * units[j]);
            }
            forces -= slopes.invert() * error;
        }
        return -forces[1];
    }
};

// F. W. Williams, An approach to the non-linear behaviour of the members of a rigid jointed plane
// framework with finite deflections, Quart. J. Mech. Appl. Math. 17 (1964): members of 12.94 in, a
// rise of 0.386 in, 0.753 × 0.243 in, 1.03·10⁷ psi. Compared with rods solved by shooting.
TEST(ToggleFrame, SnapsThroughAsWilliamsHasIt) {
    constexpr int Count = 6;
    constexpr double Inch = 0.0254, Pound = 4.4482216;
    test::BeamOptions options;
    options.length = 12.943 * Inch / Count;
    options.height = 0.243 * Inch;
    options.width = 0.753 * Inch;
    options.E = 1.03e7 * Pound / square(Inch);
    options.numElements = 6;
    options.numModes = 14;
    const double area = options.height * options.width;
    const Toggle toggle{12.943 * Inch, 0.386 * Inch, options.E * area,
                        options.E * area * square(options.height) / 12};
    const Rotation along(toggle.getAngle(), ZAxis);
    const double load = 35 * Pound;  // on this half
    Pieces beam(test::makeBeam(options), options.length, Transform(along), Rotation(), Count);
    const Vec3 apex = along * Vec3(toggle.length, 0, 0);
    const Rotation up(Pi / 2, ZAxis);
    const Attachment tip = beam.bodies.back().interface("tip", Transform(~along * up));
    Joint::Slider(beam.flexible, Attachment(beam.matter.Ground(), Transform(up, apex)), tip);
    AttachmentForce(beam.flexible, tip, SpatialVec(Vec3(0), Vec3(0, -load, 0)));
    StaticEquilibrium equilibrium(beam.system);
    StaticEquilibrium::PathSettings settings;
    settings.step = 0.02;
    const auto path = equilibrium.followPath(beam.makeState(), settings);
    Vec3 forces(0);
    int limits = 0;
    for (const auto& point : path) {
        const double w = apex[1] - tip.calcMotion(point.state).X.p()[1];
        EXPECT_NEAR(point.fraction * load, toggle.calcForce(w, forces), 0.005 * 17 * Pound) << w;
        if (point.kind == StaticEquilibrium::PathPoint::Kind::Limit) ++limits;
        if (point.kind == StaticEquilibrium::PathPoint::Kind::Regular) {
            EXPECT_EQ(point.numUnstable, limits == 1 ? 1 : 0);
        }
    }
    EXPECT_EQ(limits, 2);
    EXPECT_GT(path.size(), 10u);
}

/** Returns tip over static deflection of a cantilever with a harmonic force at its tip, x = βL. **/
double calcTipResponse(double x) {
    return 3 / (x * x * x) * (std::sin(x) * std::cosh(x) - std::cos(x) * std::sinh(x)) /
           (1 + std::cos(x) * std::cosh(x));
}

TEST(Cantilever, TipAnswersToAHarmonicForceAsInClosedForm) {
    constexpr int Count = 4;
    constexpr double Length = 1, Depth = 0.004;
    test::BeamOptions options;
    options.length = Length / Count;
    options.height = options.width = Depth;
    options.numElements = 24;
    options.numModes = 24;
    Pieces beam(test::makeBeam(options), options.length, Transform(), Rotation(), Count);
    const State state = beam.makeState();
    const FrequencyResponse response(beam.system, state);
    EXPECT_EQ(response.describeImbalance(), "");
    const int n = state.getNU(), m = response.getPoint().multipliers.size();

    // The generalized force of a unit force on the tip.
    LinearInputs inputs{Matrix(n, 1, 0.0), Matrix(m, 1, 0.0), Matrix(1, 1, 0.0)};
    const Attachment tip = beam.bodies.back().interface("tip");
    Pieces pushed(test::makeBeam(options), options.length, Transform(), Rotation(), Count);
    AttachmentForce(pushed.flexible, pushed.bodies.back().interface("tip"),
                    SpatialVec(Vec3(0), Vec3(0, 1, 0)));
    const Vector force =
        -calcEquationErrors(pushed.system, pushed.makeState(), Vector(n, 0.0), Vector(m, 0.0))
             .residual;
    for (int i = 0; i < n; ++i) inputs.forces(i, 0) = force[i];
    const LinearOutputs outputs = differentiateOutputs(
        beam.system, response.getPoint(), [&](const State& moved, const Vector&, const Vector&) {
            return std::vector<double>{tip.calcMotion(moved).X.p()[1]};
        });

    const double EI = options.E * std::pow(Depth, 4) / 12, rhoA = options.density * Depth * Depth;
    std::vector<Real> omegas;
    std::vector<double> expected;
    for (double x = 0.1; x < 9; x += 0.1) {
        const double V = calcTipResponse(x);
        if (std::abs(V) >= 2) continue;
        omegas.push_back(x * x * std::sqrt(EI / rhoA) / (Length * Length));
        expected.push_back(std::pow(Length, 3) / (3 * EI) * V);
    }
    EXPECT_GT(omegas.size(), 70u);
    const auto transfers = response.calcTransfers(omegas, inputs, outputs);
    for (size_t k = 0; k < omegas.size(); ++k) {
        // Between modes the response crosses zero, where no relative error exists.
        const double allowed = 0.01 * std::max(std::abs(expected[k]), 1e-3 * std::abs(expected[0]));
        EXPECT_NEAR(transfers[k](0, 0).real(), expected[k], allowed) << omegas[k];
        EXPECT_LT(std::abs(transfers[k](0, 0).imag()), 1e-6 * std::abs(expected[k]));
    }
}

// Links of equal weight w between two points: at the middle of link i the force is (H, w(i − ½N)),
// and the link is aligned with it.
TEST(Chain, OfManyPinnedLinksHangsInAFunicularPolygon) {
    constexpr int Count = 1000;
    constexpr double Share = 0.8;  // distance of the points over its length
    test::BeamOptions options;
    options.length = 0.1;
    options.E = 7e12;  // limits its stretch to 1e-6
    options.numElements = 4;
    options.numModes = 14;
    const auto part = test::makeBeam(options);
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    Force::Gravity(forces, matter, -YAxis, 9.81);
    std::vector<FlexibleBody> links;
    for (int k = 0; k < Count; ++k) {
        links.emplace_back(flexible, part);
        const Attachment before =
            k == 0 ? Attachment(matter.Ground()) : links[size_t(k) - 1].interface("tip");
        Joint::Pin(flexible, before, links.back().interface("root"));
    }
    const double width = Share * Count * options.length;
    Joint::PointOnLine(flexible, Attachment(matter.Ground(), Vec3(width, 0, 0)),
                       links.back().interface("tip"));
    State state = system.realizeTopology();
    Vec3 at(0);
    for (int k = 0; k < Count; ++k) {
        const Rotation R((k < Count / 2 ? -1 : 1) * std::acos(Share), ZAxis);
        links[size_t(k)].setPoseByInterface(state, "root", Transform(R, at));
        at += R * Vec3(options.length, 0, 0);
    }
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);
    EXPECT_LE(equilibrium.getNumIterations(), 30);
    EXPECT_TRUE(equilibrium.getFreeMotions().empty());
    EXPECT_TRUE(equilibrium.getUnstableMotions().empty());

    double low = 1e-3, high = 1e6;  // H/w
    const auto angle = [&](int k, double H) { return std::atan((k + 0.5 - 0.5 * Count) / H); };
    for (int pass = 0; pass < 200; ++pass) {
        const double H = std::sqrt(low * high);
        double span = 0;
        for (int k = 0; k < Count; ++k) span += options.length * std::cos(angle(k, H));
        (span < width ? low : high) = H;
    }
    double depth = 0;
    for (int k = 0; k < Count / 2; ++k) depth += options.length * std::sin(angle(k, low));
    const Vec3 middle =
        links[Count / 2 - 1].interface("tip").calcMotion(equilibrium.getState()).X.p();
    EXPECT_NEAR(middle[1], depth, 1e-5 * std::abs(depth));
    EXPECT_NEAR(middle[0], width / 2, 1e-6 * width);
    // With so many links it is nearly a catenary: y = a (cosh(x/a) − 1), s = a sinh(x/a).
    const double half = Count * options.length / 2, a = low * options.length;
    EXPECT_NEAR(std::asinh(half / a) * a, width / 2, 1e-5 * width);
    EXPECT_NEAR(middle[1], -(std::hypot(a, half) - a), 1e-4 * std::abs(depth));
}

}  // namespace
}  // namespace simflex
