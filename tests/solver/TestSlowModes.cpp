// The slowest modes by block elimination match those of dense matrices, for hanging systems with
// and without damping, and for rotating ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

constexpr Real Gravity = 9.81;

/** Compares modes of blocks and of dense matrices. **/
void expectSame(const std::vector<Eigenmode>& found, const std::vector<Eigenmode>& expected,
                Real accuracy = 1e-7) {
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < found.size(); ++k) {
        SCOPED_TRACE(k);
        const Real size = std::abs(expected[k].eigenvalue);
        EXPECT_EQ(found[k].isRigidMotion(), expected[k].isRigidMotion());
        EXPECT_LT(std::abs(found[k].eigenvalue - expected[k].eigenvalue), accuracy * size + 1e-9);
        EXPECT_NEAR(found[k].dampingRatio, expected[k].dampingRatio, accuracy);
        if (expected[k].isRigidMotion()) continue;
        Real difference = 0, norm = 0;
        for (int i = 0; i < found[k].shape.size(); ++i) {
            difference += std::norm(found[k].shape[i] - expected[k].shape[i]);
            norm += std::norm(expected[k].shape[i]);
        }
        EXPECT_LT(std::sqrt(difference), 100 * accuracy * std::sqrt(norm));
    }
}

/** Links hanging one below the other at rest; the last may be held by a damped bushing. **/
struct Hanging {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    State state;

    /** @param follower  follower force across the last link's end [N] **/
    Hanging(int count, Real damping, Real ofBushing, Real follower = 0) {
        Force::Gravity(forces, matter, -YAxis, Gravity);
        test::PointMassPartOptions options;
        options.numModes = 34;
        options.cells = {5, 1, 1};
        const auto part = test::makePointMassPart(options).body;
        std::vector<FlexibleBody> links;
        for (int k = 0; k < count; ++k) {
            links.emplace_back(flexible, part);
            if (k == 0 && follower > 0)  // the force would spin it about a ball
                Joint::Pin(flexible, matter.Ground(), links[0].interface("A"));
            else if (k == 0)
                Joint::Ball(flexible, matter.Ground(), links[0].interface("A"));
            else
                Joint::Pin(flexible, links[size_t(k) - 1].interface("B"),
                           links.back().interface("A"));
            if (damping > 0) ModalDamping(flexible, links.back(), damping);
        }
        if (ofBushing > 0) {
            Mat66 stiffness(0);
            stiffness.updSubMat<3, 3>(3, 3) = Mat33(1);
            Bushing(flexible, links[0].interface("B"), links.back().interface("B"), stiffness,
                    ofBushing * stiffness);
        }
        if (follower > 0)
            AttachmentForce(flexible, links.back().interface("B"),
                            SpatialVec(Vec3(0), Vec3(0, follower, 0)),
                            AttachmentForce::Axes::Attachment);
        state = system.realizeTopology();
        const auto &from = part->getInterface("A").position, &to = part->getInterface("B").position;
        const Rotation down(-0.5 * Pi + 0.1, ZAxis);
        Vec3 at(0);
        for (const FlexibleBody& link : links) {
            link.setPoseByInterface(state, "A", Transform(down, at));
            at += down * Vec3(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        }
        StaticEquilibrium equilibrium(system);
        equilibrium.solve(state);
        state = equilibrium.getState();
    }
};

TEST(SlowestEigenmodes, FoundByBlockEliminationAreThoseOfDenseMatrices) {
    constexpr int Count = 25;
    for (const auto& [damping, ofBushing] :
         {std::pair(0.0, 0.0), std::pair(0.02, 0.0), std::pair(0.3, 0.05)}) {
        SCOPED_TRACE(damping);
        const Hanging model(6, damping, ofBushing);
        const std::vector<Eigenmode> found = calcSlowestEigenmodes(model.system, model.state, Count,
                                                                   EigenMethod::Blocks),
                                     expected = calcSlowestEigenmodes(model.system, model.state,
                                                                      Count, EigenMethod::Dense);
        expectSame(found, expected);
    }
}

TEST(SlowestEigenmodes, OfWhatIsPushedByAForceThatTurnsAlongAreThoseOfDenseMatrices) {
    constexpr int Count = 15;
    for (const Real damping : {0.0, 0.05}) {
        SCOPED_TRACE(damping);
        const Hanging model(4, damping, 0, 3);
        const Linearization linear = calcLinearization(model.system, model.state);
        Real skew = 0;
        for (int i = 0; i < linear.K.nrow(); ++i)
            for (int j = 0; j < i; ++j)
                skew = std::max(skew, std::abs(linear.K(i, j) - linear.K(j, i)));
        EXPECT_GT(skew, 0.1);
        expectSame(calcSlowestEigenmodes(model.system, model.state, Count, EigenMethod::Blocks),
                   calcSlowestEigenmodes(model.system, model.state, Count, EigenMethod::Dense),
                   1e-6);
    }
}

TEST(SlowestEigenmodes, AStateThatIsNoEquilibriumIsRefusedByName) {
    for (const EigenMethod method : {EigenMethod::Blocks, EigenMethod::Dense}) {
        Hanging model(3, 0.02, 0);
        EXPECT_FALSE(calcSlowestEigenmodes(model.system, model.state, 3, method).empty());
        model.state.updQ()[0] += 0.1;  // rotated as a whole about its ball joint
        BdfIntegrator integrator(model.system);
        integrator.initialize(model.state);
        model.state = integrator.getState();
        try {
            calcSlowestEigenmodes(model.system, model.state, 3, method);
            FAIL() << "no exception";
        } catch (const std::runtime_error& error) {
            const std::string text = error.what();
            EXPECT_NE(text.find("no equilibrium: forces of up to"), std::string::npos) << text;
            EXPECT_NE(text.find("static equilibrium"), std::string::npos) << text;
        }
    }
}

/** Welded pieces between a driven bearing and one with axial freedom, both on Ground, with a heavy
disc in the middle. No part is axisymmetric: it only has to rotate as one. **/
struct Shaft {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    State state;

    Shaft(Real speed, Real damping, Real bearingDamping, int count = 4) {
        test::PointMassPartOptions options;
        options.numModes = 12;
        options.lowestFrequency = 90;
        options.highestFrequency = 900;
        options.jitter = 0.05;
        const auto part = test::makePointMassPart(options).body;
        const auto &from = part->getInterface("A").position, &to = part->getInterface("B").position;
        const Vec3 along(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        // The bearing axis passes through both ends.
        const Rotation axis(UnitVec3(along), ZAxis);
        const Attachment first(matter.Ground(), Transform(axis)),
            last(matter.Ground(), Transform(axis, Real(count) * along));
        std::vector<FlexibleBody> pieces;
        for (int k = 0; k < count; ++k) {
            pieces.emplace_back(flexible, part, "piece" + std::to_string(k));
            if (k > 0)
                Joint::Weld(flexible, pieces[size_t(k) - 1].interface("B"),
                            pieces.back().interface("A"));
            if (damping > 0) ModalDamping(flexible, pieces.back(), damping);
        }
        const Attachment seat = pieces[0].interface("A", Transform(axis));
        Joint::Pin(flexible, first, seat, "bearing");
        Joint::PrescribedRotation(
            flexible, first, seat, [speed](Real t) { return Vec3(speed * t, speed, 0); }, "drive");
        const auto disc = MobilizedBody::Free(
            matter.Ground(), Transform(),
            Body::Rigid(MassProperties(4, Vec3(0), Inertia(0.2, 0.1, 0.12))), Transform());
        Joint::Weld(flexible, pieces[size_t(count / 2)].interface("A"), disc, "disc");
        Joint::Cylinder(flexible, last, pieces.back().interface("B", Transform(axis)), "far");
        if (bearingDamping > 0) {
            Mat66 dampers(0);
            dampers.updSubMat<3, 3>(3, 3) = Mat33(bearingDamping);
            Bushing(flexible, Attachment(matter.Ground(), Transform(Real(count / 2) * along)),
                    pieces[size_t(count / 2)].interface("A"), Mat66(0), dampers);
        }
        state = system.realizeTopology();
        for (int k = 0; k < count; ++k)
            pieces[size_t(k)].setPoseByInterface(state, "A", Transform(Real(k) * along));
        system.realize(state, Stage::Position);
        disc.setQToFitTransform(state, Transform(Real(count / 2) * along));
        system.realize(state, Stage::Position);
        setSteadyRotation(system, state, speed * axis.z());
        StaticEquilibrium equilibrium(system);
        equilibrium.solveSteadyMotion(state);
        state = equilibrium.getState();
    }
};

TEST(SlowestEigenmodes, OfAShaftThatTurnsAreThoseOfDenseMatrices) {
    constexpr int Count = 20;
    for (const auto& [speed, damping, ofBearing] :
         {std::tuple(0.0, 0.0, 0.0), std::tuple(20.0, 0.0, 0.0), std::tuple(60.0, 0.02, 0.0),
          std::tuple(60.0, 0.02, 40.0), std::tuple(200.0, 0.02, 40.0)}) {
        SCOPED_TRACE(speed);
        SCOPED_TRACE(ofBearing);
        const Shaft shaft(speed, damping, ofBearing);
        const std::vector<Eigenmode> expected =
            calcSlowestEigenmodes(shaft.system, shaft.state, Count, EigenMethod::Dense);
        ASSERT_GE(expected.size(), size_t(Count));
        expectSame(calcSlowestEigenmodes(shaft.system, shaft.state, Count, EigenMethod::Blocks),
                   expected, 1e-6);
    }
}

TEST(SlowestEigenmodes, OfWhatSticksByFrictionAreNotFoundByBlocks) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    FlexibleBody body(flexible, test::makePointMassPart().body);
    Joint::Pin pin(flexible, matter.Ground(), body.interface("A"));
    FrictionCoefficients coefficients;
    coefficients.coulomb = 0.2;
    coefficients.radius = 0.01;
    JointFriction friction(flexible, pin, coefficients);
    try {
        calcSlowestEigenmodes(system, system.realizeTopology(), 3, EigenMethod::Blocks);
        FAIL() << "no exception";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("joints have friction"));
    }
}

}  // namespace
}  // namespace simflex
