// Forces with kinks, near and far, in statics and linearization.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/StateForces.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/FrequencyResponse.h"
#include "simflex/solver/StateSpace.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

constexpr Real Stiff = 1e6;
const Real Gaps[] = {1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 6e-4, 1e-3, 1e-2, 1e-1};

/** A mass on a slider along x with its supports. **/
struct Slide {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    MobilizedBody::Slider mass{matter.Ground(), Transform(),
                               Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.01))), Transform()};

    /** Adds a stop at x that pushes back. **/
    void addStop(Real x) {
        const UnitVec3 back(x < 0 ? 1 : -1, 0, 0);
        ContactStop(flexible,
                    Attachment(matter.Ground(), Transform(Rotation(back, ZAxis), Vec3(x, 0, 0))),
                    Attachment(mass), Stiff, 0);
    }
    Signal getPlace() {
        return Signal::displacement(Attachment(matter.Ground()), Attachment(mass), XAxis);
    }
    Signal getSpeed() {
        return Signal::displacementRate(Attachment(matter.Ground()), Attachment(mass), XAxis);
    }
    /** Adds a force along x. **/
    void addLaw(const Signal& of, const std::function<Real(Real x)>& law) {
        const Signal force = Signal::function({of}, [law](Real, const Real* x, Real* slopes) {
            if (slopes) slopes[0] = (law(x[0] + 1e-9) - law(x[0] - 1e-9)) / 2e-9;
            return law(x[0]);
        });
        StateForce(flexible, Attachment(mass), {force, Signal(), Signal()},
                   StateForce::Axes::Ground, "law");
    }
    State start(Real x = 0) {
        State state = system.realizeTopology();
        mass.setOneQ(state, 0, x);
        return state;
    }
    Real calcStiffness(Real x = 0) { return calcLinearization(system, start(x)).K(0, 0); }
};

std::string refusal(const std::function<void()>& work) {
    try {
        work();
    } catch (const NoLinearForces& error) {
        return error.what();
    }
    return "none";
}

TEST(Kinks, FreePlayHasNoStiffnessHoweverLittleOfItThereIs) {
    for (const Real gap : Gaps) {
        SCOPED_TRACE(gap);
        Slide both, one, law;
        both.addStop(gap);
        both.addStop(-gap);
        one.addStop(-gap);
        law.addLaw(law.getPlace(), [gap](Real x) {
            return -Stiff * (std::max(0.0, x - gap) + std::min(0.0, x + gap)) - 40 * x;
        });
        EXPECT_EQ(both.calcStiffness(), 0);
        EXPECT_EQ(one.calcStiffness(), 0);
        EXPECT_NEAR(law.calcStiffness(), 40, 1e-6);
        EXPECT_TRUE(
            calcEigenmodes(calcLinearization(both.system, both.start())).at(0).isRigidMotion());
        // In contact by the same distance, the full stiffness counts.
        EXPECT_NEAR(both.calcStiffness(2 * gap), Stiff, 1e-6 * Stiff);
        EXPECT_NEAR(one.calcStiffness(-2 * gap), Stiff, 1e-6 * Stiff);
        EXPECT_NEAR(law.calcStiffness(-2 * gap), Stiff + 40, 1e-6 * Stiff);
    }
}

TEST(Kinks, WhatJustTouchesHasNoLinearForcesAndIsNamed) {
    for (const Real x : {0.0, 0.1, -0.25}) {
        SCOPED_TRACE(x);
        Slide stop;
        stop.addStop(x);
        EXPECT_THAT(refusal([&] { stop.calcStiffness(x); }),
                    ::testing::AllOf(HasSubstr("the spring, damper or stop between"),
                                     HasSubstr("(0 N/m one way, 1e+06 N/m the other)"),
                                     HasSubstr("has a kink exactly here")));
        EXPECT_THAT(refusal([&] {
                        calcSlowestEigenmodes(stop.system, stop.start(x), 1, EigenMethod::Blocks);
                    }),
                    HasSubstr("has a kink exactly here"));
        EXPECT_THAT(refusal([&] { FrequencyResponse(stop.system, stop.start(x)); }),
                    HasSubstr("has a kink exactly here"));
        Slide cable, stiffer, jumps;
        cable.addLaw(cable.getPlace(), [x](Real s) { return -3e3 * std::max(0.0, s - x); });
        EXPECT_THAT(refusal([&] { cable.calcStiffness(x); }),
                    HasSubstr("force 'law' (0 N/m one way, 3000 N/m"));
        stiffer.addLaw(stiffer.getPlace(),
                       [x](Real s) { return s < x ? -10 * (s - x) : -15 * (s - x); });
        EXPECT_THAT(refusal([&] { stiffer.calcStiffness(x); }),
                    HasSubstr("(10 N/m one way, 15 N/m the other)"));
        jumps.addLaw(jumps.getPlace(), [x](Real s) { return s < x ? 1.0 : s > x ? -1.0 : 0.0; });
        EXPECT_THAT(refusal([&] { jumps.calcStiffness(x); }), HasSubstr("force 'law'"));
    }
}

TEST(Kinks, SmoothLawsHaveTheirSlopesHoweverSharpTheyAre) {
    for (const Real width : {1.0, 1e-2, 1e-4, 1e-6}) {
        Slide slide;
        slide.addLaw(slide.getPlace(),
                     [width](Real x) { return -5 * width * std::tanh(x / width); });
        EXPECT_NEAR(slide.calcStiffness(), 5, 1e-5) << width;
        EXPECT_NEAR(slide.calcStiffness(width), 5 / square(std::cosh(1)), 1e-4) << width;
    }
    Slide cubic;
    cubic.addLaw(cubic.getPlace(), [](Real x) { return -x * x * x; });
    EXPECT_NEAR(cubic.calcStiffness(), 0, 1e-12);
}

TEST(Kinks, DampingIsThatOfSmallSpeeds) {
    Slide uneven, rubbing, idle;
    uneven.addLaw(uneven.getSpeed(), [](Real v) { return v > 0 ? -200 * v : -100 * v; });
    EXPECT_NEAR(calcLinearization(uneven.system, uneven.start()).D(0, 0), 150, 1e-6);
    EXPECT_THAT(listUnevenDamping(uneven.system, uneven.start()),
                ::testing::ElementsAre("force 'law' (100 N s/m one way, 200 N s/m the other)"));
    rubbing.addLaw(rubbing.getSpeed(), [](Real v) { return v > 0 ? -4.0 : v < 0 ? 4.0 : 0.0; });
    EXPECT_THAT(refusal([&] { calcLinearization(rubbing.system, rubbing.start()); }),
                HasSubstr("force 'law' jumps here"));
    for (const Real play : {1e-8, 1e-4, 4e-4, 0.1}) {
        Slide slide;
        slide.addLaw(slide.getSpeed(), [play](Real v) {
            return -7 * v - 1e4 * (std::max(0.0, v - play) + std::min(0.0, v + play));
        });
        EXPECT_NEAR(calcLinearization(slide.system, slide.start()).D(0, 0), 7, 1e-6) << play;
        EXPECT_TRUE(listUnevenDamping(slide.system, slide.start()).empty());
    }
}

TEST(Kinks, StopsOfFlexibleBodiesCountOnTheirSideOnly) {
    for (const Real gap : {1e-7, 2e-4, 4e-4, 1e-2, 0.0, -1e-5}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody body(flexible, test::makePointMassPart().body, "part");
        const Attachment frame = body.interface("A");
        for (const Real side : {-1.0, 1.0})
            ContactStop(
                flexible,
                Attachment(matter.Ground(), Transform(Rotation(UnitVec3(-side, 0, 0), ZAxis),
                                                      Vec3(side * gap, 0, 0))),
                frame, Stiff, 0);
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
        const auto work = [&] {
            const auto modes = calcSlowestEigenmodes(system, state, 3, EigenMethod::Blocks);
            int numRigid = 0;
            for (const Eigenmode& mode : modes) numRigid += mode.isRigidMotion();
            EXPECT_EQ(numRigid, gap > 0 ? 6 : 5) << gap;
        };
        if (gap == 0)
            EXPECT_THAT(refusal(work), HasSubstr("has a kink exactly here"));
        else
            work();
    }
}

TEST(Kinks, PlacesFarFromTheOriginHaveNone) {
    // A flexible pendulum pulled sideways by a spring; round-off of positions is not a kink.
    const auto calcModes = [](const Vec3& origin) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity(forces, matter, -YAxis, 9.81);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody body(flexible, test::makePointMassPart().body, "part");
        Joint::Pin(flexible, Attachment(matter.Ground(), origin), body.interface("A"), "pin");
        TwoPointSpringDamper(flexible, Attachment(matter.Ground(), origin + Vec3(1, 0.5, 0)),
                             body.interface("B"), 10, 0, 0);
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform(origin));
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(state);
        const State& rest = equilibrium.getState();
        std::vector<Real> frequencies;
        for (const EigenMethod method : {EigenMethod::Dense, EigenMethod::Blocks})
            for (const Eigenmode& mode : calcSlowestEigenmodes(system, rest, 3, method))
                frequencies.push_back(mode.frequency);
        return frequencies;
    };
    const std::vector<Real> here = calcModes(Vec3(0));
    for (const Real distance : {1e4, 1e6}) {
        const std::vector<Real> there = calcModes(distance * Vec3(1, 1, -1));
        ASSERT_EQ(there.size(), here.size());
        for (size_t k = 0; k < here.size(); ++k)
            EXPECT_NEAR(there[k], here[k], 1e-5 * here[k]) << k << " at " << distance << " m";
    }
}

TEST(Kinks, ObservedForcesAreDifferencedToBothSides) {
    Slide slide;
    const State state = slide.start();
    const Linearization linear = calcLinearization(slide.system, state);
    const auto observe = [&](const std::function<Real(Real x)>& force) {
        return differentiateOutputs(
                   slide.system, linear,
                   [&](const State& at, const Vector&, const Vector&) {
                       return std::vector<double>{force(slide.mass.getOneQ(at, 0))};
                   })
            .byQ(0, 0);
    };
    for (const Real sign : {1.0, -1.0}) {
        EXPECT_THROW(observe([sign](Real x) { return std::max(0.0, sign * x); }), NoDerivative);
        for (const Real gap : Gaps)
            EXPECT_EQ(observe([sign, gap](Real x) { return std::max(0.0, sign * x - gap); }), 0)
                << gap;
    }
    EXPECT_NEAR(observe([](Real x) { return std::sin(2 * x); }), 2, 1e-9);
}

TEST(Kinks, StaticsCrossesFreePlay) {
    for (const Real gap : Gaps) {
        Slide slide;
        slide.addStop(gap);
        slide.addStop(-gap);
        AttachmentForce(slide.flexible, Attachment(slide.mass),
                        SpatialVec(Vec3(0), Vec3(10, 0, 0)));
        StaticEquilibrium equilibrium(slide.system);
        equilibrium.solve(slide.start());
        EXPECT_NEAR(slide.mass.getOneQ(equilibrium.getState(), 0), gap + 10 / Stiff, 1e-9) << gap;
        EXPECT_TRUE(equilibrium.getFreeMotions().empty());
        Slide idle;
        idle.addStop(gap);
        idle.addStop(-gap);
        StaticEquilibrium free(idle.system);
        free.solve(idle.start());
        EXPECT_EQ(idle.mass.getOneQ(free.getState(), 0), 0) << gap;
        EXPECT_EQ(free.getFreeMotions().size(), 1u) << gap;
    }
}

/** Regardless of the size of the forces in a neighbouring assembly. **/
TEST(Kinks, ASmallLoadOnWhatIsFreeIsSeenBesideLargeForces) {
    for (const Real force : {1e-6, 1e-3, 1.0, 1e2}) {
        Slide slide;
        MobilizedBody::Slider other(slide.matter.Ground(), Transform(),
                                    Body::Rigid(MassProperties(1, Vec3(0), Inertia(0.01))),
                                    Transform());
        Bushing(slide.flexible, Attachment(slide.matter.Ground(), Transform(Vec3(0.3, 0, 0))),
                Attachment(other), Bushing::diagonal(Vec6(0, 0, 0, 1e9, 1e9, 1e9)));
        AttachmentForce(slide.flexible, Attachment(slide.mass),
                        SpatialVec(Vec3(0), Vec3(force, 0, 0)));
        StaticEquilibrium equilibrium(slide.system);
        try {
            equilibrium.solve(slide.start());
            ADD_FAILURE() << force << " N: " << equilibrium.getState().getQ() << ' '
                          << equilibrium.getNumIterations() << ' ' << equilibrium.isByDampedMotion()
                          << ' ' << equilibrium.getFreeMotions().size();
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr("is free to move and loads act along that motion"));
        }
    }
}

}  // namespace
}  // namespace simflex
