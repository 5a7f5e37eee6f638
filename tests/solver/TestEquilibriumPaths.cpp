// Paths of equilibria through limit points and bifurcations, against closed forms.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;
using Kind = StaticEquilibrium::PathPoint::Kind;

/** Von Mises truss: a mass between two springs to supports at ±b, initially at height h, pushed
down by a force P. Straight down, F(w) = 2k (l₀/l − 1)(h − w) with l² = b² + (h − w)². **/
struct Truss {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<MobilizedBody> bodies;
    State state;
    static constexpr Real k = 2e4, b = 1;
    const Real h, P;

    enum class Mover {
        Slider,  ///< a mobilizer without joints
        Pins     ///< rigid bars on pins between springs on sliders: a closed loop of joints
    };

    Truss(Real height, Real force, Mover mover) : h(height), P(force) {
        const Body::Rigid mass(MassProperties(1, Vec3(0), Inertia(0.01)));
        const Rotation xToY(Pi / 2, ZAxis);
        if (mover == Mover::Slider) {
            bodies.push_back(
                MobilizedBody::Slider(matter.Ground(), Transform(xToY), mass, Transform(xToY)));
            for (const Real side : {-1.0, 1.0})
                TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(side * b, 0, 0)),
                                     Attachment(bodies[0]), k, 0, std::hypot(b, h));
            AttachmentForce(flexible, Attachment(bodies[0]), SpatialVec(Vec3(0), Vec3(0, -P, 0)));
        } else {
            // Two bars of length b' whose feet slide against springs of stiffness 2k.
            const Real l = std::hypot(b, h);
            for (const Real side : {-1.0, 1.0}) {
                const Rotation turned(side < 0 ? std::atan2(h, b) : Pi - std::atan2(h, b), ZAxis);
                bodies.push_back(
                    MobilizedBody::Slider(matter.Ground(), Vec3(side * b, 0, 0), mass, Vec3(0)));
                TwoPointSpringDamper(flexible,
                                     Attachment(matter.Ground(), Vec3(3 * side * b, 0, 0)),
                                     Attachment(bodies.back()), k, 0, 2 * b);
                bodies.push_back(MobilizedBody::Pin(bodies.back(), Transform(turned),
                                                    Body::Rigid(mass), Transform()));
            }
            Joint::Pin(flexible, Attachment(bodies[1], Vec3(l, 0, 0)),
                       Attachment(bodies[3], Vec3(l, 0, 0)), "top");
            AttachmentForce(flexible, Attachment(bodies[1], Vec3(l, 0, 0)),
                            SpatialVec(Vec3(0), Vec3(0, -P, 0)));
        }
        state = system.realizeTopology();
        if (mover == Mover::Slider) bodies[0].setOneQ(state, 0, h);
    }

    /** Returns the downward displacement. **/
    Real measure(const State& at) const {
        system.realize(at, Stage::Position);
        if (bodies.size() == 1) return h - bodies[0].getBodyOriginLocation(at)[1];
        const Real l = std::hypot(b, h);
        return h - bodies[1].findStationLocationInGround(at, Vec3(l, 0, 0))[1];
    }

    Real calcForce(Real w) const {
        const Real y = h - w, l0 = std::hypot(b, h);
        if (bodies.size() == 1) return 2 * k * (l0 / std::hypot(b, y) - 1) * y;
        // Feet move by x' = √(l₀² − y²) − b each: F = 2k x' y/√(l₀² − y²)
        const Real x = std::sqrt(l0 * l0 - y * y);
        return 2 * k * (x - b) * y / x;
    }
};

void checkTruss(const Truss& truss, const std::vector<StaticEquilibrium::PathPoint>& path) {
    // Finds the maximum of F by ternary search.
    Real low = 0, high = truss.h;
    for (int i = 0; i < 200; ++i) {
        const Real a = low + (high - low) / 3, b = high - (high - low) / 3;
        (truss.calcForce(a) < truss.calcForce(b) ? low : high) =
            truss.calcForce(a) < truss.calcForce(b) ? a : b;
    }
    const Real largest = truss.calcForce(low);
    ASSERT_LT(largest, 0.9 * truss.P);
    std::vector<const StaticEquilibrium::PathPoint*> limits;
    Real before = -1;
    for (const auto& point : path) {
        const Real w = truss.measure(point.state);
        EXPECT_GT(w, before);
        before = w;
        EXPECT_NEAR(point.fraction * truss.P, truss.calcForce(w), 1e-9 * truss.P);
        if (point.kind == Kind::Limit) limits.push_back(&point);
        if (point.kind == Kind::Regular) {
            const bool falls = w > low && w < 2 * truss.h - low;
            EXPECT_EQ(point.numUnstable, falls ? 1 : 0) << w;
        }
    }
    ASSERT_EQ(limits.size(), 2u);
    EXPECT_NEAR(limits[0]->fraction * truss.P, largest, 1e-9 * largest);
    EXPECT_NEAR(truss.measure(limits[0]->state), low, 1e-4 * truss.h);
    EXPECT_NEAR(limits[1]->fraction * truss.P, -largest, 1e-9 * largest);
    EXPECT_EQ(limits[0]->numUnstable, 0);
    EXPECT_EQ(path.front().fraction, 0);
    EXPECT_EQ(path.back().fraction, 1);
    EXPECT_GT(before, 2 * truss.h);
}

TEST(EquilibriumPaths, TrussesSnapThroughAsInClosedForm) {
    // Holds for shallow trusses, whose motion is far below a step of a bar's length, too.
    for (const Truss::Mover mover : {Truss::Mover::Slider, Truss::Mover::Pins})
        for (const Real height : {0.3, 0.05, 0.01}) {
            SCOPED_TRACE(std::to_string(height) + (mover == Truss::Mover::Pins ? " pins" : ""));
            const Real force =
                Truss::k * std::pow(height, 3) * (mover == Truss::Mover::Pins ? 1 : 2);
            const Truss truss(height, force, mover);
            StaticEquilibrium equilibrium(truss.system);
            const auto path = equilibrium.followPath(truss.state, {});
            checkTruss(truss, path);
            EXPECT_LT(path.size(), 200u);
            EXPECT_TRUE(equilibrium.getUnstableMotions().empty());
            EXPECT_EQ((equilibrium.getState().getQ() - path.back().state.getQ()).norm(), 0);
        }
}

/** A stop puts a kink in the path; if met where the load decreases, the load reverses. **/
TEST(EquilibriumPaths, PathsGoOnBeyondStops) {
    const Real height = 0.3, stiffness = 2e5;
    for (const Real depth : {0.05, 0.2, 0.3, 0.4, 0.55}) {
        SCOPED_TRACE(depth);
        Truss truss(height, Truss::k * std::pow(height, 3), Truss::Mover::Slider);
        const Transform up(Rotation(-Pi / 2, XAxis), Vec3(0, height - depth, 0));
        ContactStop(truss.flexible, Attachment(truss.matter.Ground(), up),
                    Attachment(truss.bodies[0]), stiffness);
        State state = truss.system.realizeTopology();
        truss.bodies[0].setOneQ(state, 0, height);
        const auto calcLoad = [&](Real w) {
            return truss.calcForce(w) + stiffness * std::max(0.0, w - depth);
        };
        const auto rises = [&](Real w) { return calcLoad(w + 1e-7) > calcLoad(w - 1e-7); };
        StaticEquilibrium equilibrium(truss.system);
        const auto path = equilibrium.followPath(state, {});
        Real before = -1;
        std::vector<Real> limits;
        for (const auto& point : path) {
            const Real w = truss.measure(point.state);
            EXPECT_GT(w, before);
            EXPECT_NEAR(point.fraction * truss.P, calcLoad(w), 1e-9 * truss.P) << w;
            if (point.kind == Kind::Limit)
                limits.push_back(w);
            else
                EXPECT_EQ(point.numUnstable, rises(w) ? 0 : 1) << w;
            EXPECT_NE(point.kind, Kind::Bifurcation) << w;
            before = w;
        }
        std::vector<Real> expected;
        for (Real w = 0; w < before; w += 1e-4)
            if (rises(w) != rises(w + 1e-4)) expected.push_back(w);
        ASSERT_EQ(limits.size(), expected.size());
        for (size_t i = 0; i < limits.size(); ++i) EXPECT_NEAR(limits[i], expected[i], 2e-4);
        EXPECT_EQ(path.back().fraction, 1);
        EXPECT_LT(path.size(), 200u);
    }
}

/** An arm on a pin with a torsion spring, pulled along and slightly across: k q = f (e cos q − P
sin q), whose f has a pole just beyond the end. **/
TEST(EquilibriumPaths, PullsThatHardlyMoveAnythingAreFollowedToTheirEnd) {
    for (const auto& [k, P, e] : {std::array<Real, 3>{1, 1000, 0.01},
                                  {1e-5, 20, 0.3},
                                  {1e-6, 300, 0.3},
                                  {1e-7, 300, 3},
                                  {1e-3, 20, 0.3},
                                  {1, 981, 0.1},
                                  {1, 1, 0.5}})
        for (const Real step : {0.01, 0.05, 0.1, 2.0}) {
            SCOPED_TRACE(std::to_string(k) + " " + std::to_string(P) + " " + std::to_string(e) +
                         ", step " + std::to_string(step));
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            FlexibleBodySubsystem flexible(system, matter);
            MobilizedBody::Pin arm(matter.Ground(), Transform(),
                                   Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.1))),
                                   Transform(Vec3(-0.5, 0, 0)));
            TorsionSpring(flexible, Attachment(matter.Ground()), Attachment(arm, Vec3(-0.5, 0, 0)),
                          k);
            AttachmentForce(flexible, Attachment(arm, Vec3(0.5, 0, 0)),
                            SpatialVec(Vec3(0), Vec3(P, e, 0)));
            StaticEquilibrium equilibrium(system);
            StaticEquilibrium::PathSettings settings;
            settings.step = step;
            const auto path = equilibrium.followPath(system.realizeTopology(), settings);
            Real before = 0;
            for (const auto& point : path) {
                const Real q = point.state.getQ()[0], f = point.fraction;
                EXPECT_NEAR(k * q, f * (e * std::cos(q) - P * std::sin(q)), 1e-7 * (k * q + f * e));
                EXPECT_EQ(point.kind, Kind::Regular);
                EXPECT_EQ(point.numUnstable, 0);
                EXPECT_GE(f, before);
                before = f;
            }
            EXPECT_EQ(path.back().fraction, 1);
            EXPECT_LT(path.back().state.getQ()[0], std::atan(e / P));
        }
}

TEST(EquilibriumPaths, PathsThatEndEarlySayWhere) {
    const Truss truss(0.3, 1000, Truss::Mover::Slider);
    StaticEquilibrium equilibrium(truss.system);
    StaticEquilibrium::PathSettings settings;
    settings.mostPoints = 3;
    const auto path = equilibrium.followPath(truss.state, settings);
    ASSERT_EQ(path.size(), 3u);
    EXPECT_LT(path.back().fraction, 1);
    EXPECT_EQ(equilibrium.getState().getQ()[0], path.back().state.getQ()[0]);
}

/** A column of n rigid links on pins with torsion springs, including its foot, under a load of
fixed direction on top, beyond the smallest critical load of the discrete column. **/
TEST(EquilibriumPaths, ImperfectColumnsBendAwayWithoutABifurcation) {
    constexpr Real k = 3, L = 0.4;
    for (const int count : {1, 2}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const Body::Rigid link(
            MassProperties(1, Vec3(L / 2, 0, 0),
                           Inertia(1e-4, 0.02, 0.02).shiftFromMassCenter(Vec3(-L / 2, 0, 0), 1)));
        const Transform up(Rotation(Pi / 2, ZAxis));
        std::vector<MobilizedBody> links;
        for (int i = 0; i < count; ++i) {
            const Transform frame = i == 0 ? up : Transform(Vec3(L, 0, 0));
            MobilizedBody& before =
                i == 0 ? static_cast<MobilizedBody&>(matter.updGround()) : links.back();
            MobilizedBody::Pin next(before, frame, link, Transform());
            TorsionSpring(flexible, Attachment(before, frame), Attachment(next), k);
            links.push_back(next);
        }
        // For two links: F = k/L (3 − √5)/2.
        const Real critical = count == 1 ? k / L : k / L * (3 - std::sqrt(5)) / 2;
        AttachmentForce(flexible, Attachment(links.back(), Vec3(L, 0, 0)),
                        SpatialVec(Vec3(0), Vec3(1e-3 * critical, -1.3 * critical, 0)));
        // A small lateral force bends it.
        State state = system.realizeTopology();
        StaticEquilibrium equilibrium(system);
        const auto path = equilibrium.followPath(state, {});
        EXPECT_EQ(path.back().numUnstable, 0);
        for (const auto& point : path) EXPECT_EQ(point.kind, Kind::Regular);
    }
}

/** Checks that the number of unstable motions changes between regular points as the limit points
and bifurcations between them say. If one motion is lost and another gained at the same load, the
number does not change. **/
void checkCounts(const std::vector<StaticEquilibrium::PathPoint>& path) {
    int count = path.front().numUnstable;
    bool mayChange = false;
    std::vector<int> changes{0};  // all possible sums of the changes between two regular points
    for (const auto& point : path) {
        if (point.kind == Kind::Regular) {
            EXPECT_TRUE(std::count(changes.begin(), changes.end(), point.numUnstable - count))
                << "at " << point.fraction << ": " << count << " to " << point.numUnstable;
            count = point.numUnstable;
            changes = {0};
            continue;
        }
        const int own = point.kind == Kind::Limit ? 1 : point.numChanging;
        EXPECT_GE(own, 1);
        std::vector<int> sums;
        for (const int sum : changes)
            for (int change = -own; change <= own; change += 2) sums.push_back(sum + change);
        changes = sums;
        mayChange = true;
    }
    EXPECT_TRUE(mayChange);
}

/** A column of n rigid links of length L on pins with torsion springs, including its foot, in one
plane or two. Under a weight P that moves down with the top, K = k T and −P L Σ(1 − cos θ): the
critical loads are k/L times the eigenvalues of the springs' stiffness. **/
struct Column {
    static constexpr Real k = 3, L = 0.4, Foot = 100;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<Real> critical;
    Real load;

    /** Base of the column. **/
    enum class Base {
        Slider,  ///< with a soft spring that the load compresses
        Joint,   ///< the same with a joint: rotations are round-off only
        Ground   ///< the load moves nothing
    };

    Column(int count, int numPlanes, Real overload, Base base = Base::Slider) {
        const Body::Rigid mass(MassProperties(1, Vec3(0), Inertia(0.01)));
        const Transform up(Rotation(Pi / 2, ZAxis));
        MobilizedBody top = matter.Ground();
        if (base != Base::Ground) {
            if (base == Base::Slider)
                top = MobilizedBody::Slider(matter.Ground(), up, mass, Transform());
            else
                top = MobilizedBody::Free(matter.Ground(), up, mass, Transform());
            TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(0, -9, 0)),
                                 Attachment(top), Foot, 0, 9);
            if (base == Base::Joint)
                Joint::Slider(flexible, Attachment(matter.Ground(), up), Attachment(top), "guide");
        }
        for (int i = 0; i < count; ++i) {
            Transform frame = i > 0                  ? Transform(Vec3(L, 0, 0))
                              : base == Base::Ground ? up
                                                     : Transform();
            for (int plane = 0; plane < numPlanes; ++plane) {
                // The pin is about z or y; x stays along the column.
                const Rotation axis = plane == 0 ? Rotation() : Rotation(Pi / 2, XAxis);
                const Transform own = frame * Transform(axis);
                MobilizedBody::Pin next(top, own, mass, Transform(axis));
                TorsionSpring(flexible, Attachment(top, own), Attachment(next, Transform(axis)), k);
                top = next;
                frame = Transform();
            }
            critical.push_back(k / L * 2 * (1 - std::cos((2 * i + 1) * Pi / (2 * count + 1))));
        }
        load = overload * critical.back();
        AttachmentForce(flexible, Attachment(top, Vec3(L, 0, 0)),
                        SpatialVec(Vec3(0), Vec3(0, -load, 0)));
    }
};

TEST(EquilibriumPaths, ColumnsBifurcateAtTheirCriticalLoadsWhateverTheStep) {
    const auto follow = [](int numPlanes, int count, Real step, Column::Base base) {
        SCOPED_TRACE(std::to_string(count) + " links, " + std::to_string(numPlanes) +
                     " planes, step " + std::to_string(step) + ", base " +
                     std::to_string(int(base)));
        Column column(count, numPlanes, 1.3, base);
        StaticEquilibrium equilibrium(column.system);
        StaticEquilibrium::PathSettings settings;
        settings.step = step;
        const auto path = equilibrium.followPath(column.system.realizeTopology(), settings);
        checkCounts(path);
        std::vector<Real> found;
        for (const auto& point : path) {
            const Real load = column.load * point.fraction;
            if (point.kind == Kind::Bifurcation) {
                EXPECT_EQ(point.numChanging, numPlanes);
                EXPECT_EQ(point.numUnstable, numPlanes * int(found.size()));
                found.push_back(load);
                continue;
            }
            EXPECT_EQ(point.kind, Kind::Regular);
            EXPECT_EQ(point.numUnstable,
                      numPlanes * std::count_if(column.critical.begin(), column.critical.end(),
                                                [&](Real own) { return own < load; }))
                << point.fraction;
        }
        EXPECT_EQ(equilibrium.getUnstableMotions().size(), size_t(path.back().numUnstable));
        ASSERT_EQ(found.size(), column.critical.size());
        for (size_t i = 0; i < found.size(); ++i)
            EXPECT_NEAR(found[i], column.critical[i], 1e-6 * column.critical[i]);
    };
    for (const int numPlanes : {1, 2})
        for (const int count : {1, 2, 3}) {
            for (const Real step : {0.01, 0.05, 0.1, 0.3})
                follow(numPlanes, count, step, Column::Base::Slider);
            for (const Column::Base base : {Column::Base::Joint, Column::Base::Ground})
                follow(numPlanes, count, 0.05, base);
        }
}

TEST(EquilibriumPaths, SingleEquilibriaFallInAsManyMotionsAsPathsSay) {
    for (const int numPlanes : {1, 2})
        for (const int count : {1, 3})
            for (const Real overload : {0.9, 1.1, 30.0}) {
                Column column(count, numPlanes, overload, Column::Base::Ground);
                StaticEquilibrium path(column.system), single(column.system);
                const auto points = path.followPath(column.system.realizeTopology(), {});
                single.solve(points.back().state);
                EXPECT_EQ(single.getUnstableMotions(), path.getUnstableMotions());
                EXPECT_EQ(int(single.getUnstableMotions().size()), points.back().numUnstable)
                    << count << " links, " << numPlanes << " planes, overload " << overload;
            }
}

TEST(EquilibriumPaths, PathsMayEndNextToABifurcation) {
    for (const Real overload : {1 - 1e-4, 1 - 1e-7, 1.0, 1 + 1e-7, 1 + 1e-4}) {
        SCOPED_TRACE(overload - 1);
        Column column(2, 1, overload);
        StaticEquilibrium equilibrium(column.system);
        const auto path = equilibrium.followPath(column.system.realizeTopology(), {});
        checkCounts(path);
        EXPECT_EQ(path.back().fraction, 1);
        if (std::abs(overload - 1) > 1e-6) {
            EXPECT_EQ(path.back().numUnstable, overload < 1 ? 1 : 2);
        }
    }
}

/** A steep von Mises truss whose mass may also move sideways: at height y above its feet K_yy = 2k
(1 − l₀b²/l³) and K_xx = 2k (1 − l₀y²/l³). It buckles sideways before it snaps through. **/
TEST(EquilibriumPaths, BifurcationsAndLimitPointsAreToldApart) {
    constexpr Real k = 1e3, b = 1, h = 3, P = 4e3;
    const Real l0 = std::hypot(b, h);
    const auto calcForce = [&](Real y) { return 2 * k * (l0 / std::hypot(b, y) - 1) * y; };
    const auto calcAside = [&](Real y) { return 1 - l0 * y * y / std::pow(b * b + y * y, 1.5); };
    const auto halve = [](const auto& f, Real low, Real high) {
        for (int i = 0; i < 200; ++i) {
            const Real middle = 0.5 * (low + high);
            ((f(middle) > 0) == (f(low) > 0) ? low : high) = middle;
        }
        return low;
    };
    const Real first = halve(calcAside, 2, 3), second = halve(calcAside, 0.5, 1.2),
               limit = std::sqrt(std::pow(l0 * b * b, 2.0 / 3) - b * b);
    const std::vector<std::pair<Kind, Real>> expected{
        {Kind::Bifurcation, first},   {Kind::Limit, limit},  {Kind::Bifurcation, second},
        {Kind::Bifurcation, -second}, {Kind::Limit, -limit}, {Kind::Bifurcation, -first}};
    for (const Real step : {0.01, 0.05, 0.1, 0.3}) {
        SCOPED_TRACE(step);
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const Body::Rigid body(MassProperties(1, Vec3(0), Inertia(0.01)));
        const Rotation xToY(Pi / 2, ZAxis);
        MobilizedBody::Slider aside(matter.Ground(), Transform(), body, Transform());
        MobilizedBody::Slider mass(aside, Transform(xToY), body, Transform(xToY));
        for (const Real side : {-1.0, 1.0})
            TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(side * b, 0, 0)),
                                 Attachment(mass), k, 0, l0);
        AttachmentForce(flexible, Attachment(mass), SpatialVec(Vec3(0), Vec3(0, -P, 0)));
        State state = system.realizeTopology();
        mass.setOneQ(state, 0, h);
        StaticEquilibrium equilibrium(system);
        StaticEquilibrium::PathSettings settings;
        settings.step = step;
        const auto path = equilibrium.followPath(state, settings);
        checkCounts(path);
        std::vector<std::pair<Kind, Real>> found;
        for (const auto& point : path) {
            const Real y = mass.getOneQ(point.state, 0);
            EXPECT_NEAR(point.fraction * P, calcForce(y), 1e-6 * P);
            EXPECT_NEAR(mass.getBodyOriginLocation(point.state)[0], 0, 1e-9);
            if (point.kind != Kind::Regular) {
                found.emplace_back(point.kind, point.fraction * P);
                continue;
            }
            EXPECT_EQ(point.numUnstable, (std::abs(y) < limit) + (calcAside(y) < 0)) << y;
        }
        ASSERT_EQ(found.size(), expected.size());
        for (size_t i = 0; i < found.size(); ++i) {
            EXPECT_EQ(found[i].first, expected[i].first) << i;
            const Real force = calcForce(expected[i].second);
            EXPECT_NEAR(found[i].second, force, 1e-6 * std::abs(force)) << i;
        }
    }
}

TEST(EquilibriumPaths, WhatDoesNotGrowWithTheLoadsIsRefused) {
    const Truss truss(0.3, 0, Truss::Mover::Slider);
    StaticEquilibrium unloaded(truss.system);
    EXPECT_THROW(unloaded.followPath(truss.state, {}), std::runtime_error);
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(), Vec3(0),
                               Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Vec3(0));
    Force::MobilityLinearSpring(forces, mass, MobilizerQIndex(0), 10, 0);
    const State state = system.realizeTopology();
    StaticEquilibrium equilibrium(system);
    try {
        equilibrium.followPath(state, {});
        FAIL() << "no exception";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("springs among them would grow with the loads"));
    }
}

TEST(EquilibriumPaths, PlainStaticsNamesTheLoadAtWhichThePathTurns) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Pin lever(matter.Ground(), Vec3(0),
                             Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))), Vec3(0));
    // A long spring from far away pulls its tip along x: the moment Fl sin θ is at most Fl.
    constexpr Real Far = 1e4, Stiffness = 1, l = 0.5, Pull = Stiffness * Far;
    TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(2 * Far, 0, 0)),
                         Attachment(lever, Vec3(l, 0, 0)), Stiffness, 0, Far);
    AttachmentForce(flexible, Attachment(lever), SpatialVec(Vec3(0, 0, 1.6 * Pull * l), Vec3(0)));
    const State state = system.realizeTopology();
    StaticEquilibrium equilibrium(system);
    try {
        equilibrium.solve(state);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("turns at 62.5 % of the loads"));
        EXPECT_THAT(error.what(), HasSubstr("`path:`"));
    }
}

}  // namespace
}  // namespace simflex
