/** @file
Parts with exaggerated deformation stay attached at their joints. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "TestParts.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/render/scene/DrawnPoses.h"
#include "simflex/render/skin/DeformedSurface.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

std::shared_ptr<const ReducedBody> makePart(unsigned seed) {
    test::PointMassPartOptions options;
    options.seed = seed;
    return test::makePointMassPart(options).body;
}

Vector makeModes(const FlexibleBody& body, double size, double phase) {
    Vector xi(body.getNumModes());
    for (int i = 0; i < xi.size(); ++i) xi[i] = size * std::sin(phase + 1.7 * i);
    return xi;
}

/** Ground – arm – forearm, joined by pins that the State closes. **/
struct TwoArms {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody arm{flexible, makePart(1), "arm"}, forearm{flexible, makePart(2), "forearm"};
    Joint::Pin shoulder{flexible, matter.Ground(), arm.interface("A"), "shoulder"};
    Joint::Pin elbow{flexible, arm.interface("B"), forearm.interface("A"), "elbow"};

    State place(double angle = 0.3, double bend = 0.7, double size = 2e-4) {
        State state = system.realizeTopology();
        placeAt(state, arm, "A", Transform(Rotation(angle, ZAxis)), makeModes(arm, size, angle));
        system.realize(state, Stage::Velocity);
        const Transform X_GE = arm.interface("B").calcMotion(state).X;
        placeAt(state, forearm, "A", X_GE * Transform(Rotation(bend, ZAxis)),
                makeModes(forearm, size, 1 + bend));
        system.realize(state, Stage::Velocity);
        return state;
    }
    static void placeAt(State& state, const FlexibleBody& body, const std::string& name,
                        const Transform& X_GI, const Vector& xi) {
        body.setModalCoordinates(state, xi);
        const FlexibleFramePose pose =
            calcFramePose(body.interface(name).getFlexibleFrame(), &xi[0]);
        body.setFramePose(state, X_GI * ~Transform(pose.R_BA, pose.r));
    }
};

/** Returns the location of an interface's node on the surface. **/
Vec3 findOnSurface(const DrawnPoses& drawn, const FlexibleBody& body, const std::string& name) {
    const DeformedSurface surface(extractSkinModes(body.getPartHandle(), 0.6));
    const Vec3 s = body.interface(name).getFlexibleFrame().shapes->s;
    const Mesh& mesh = body.getPart().mesh;
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const auto p = mesh.position(node);
        if ((Vec3(p[0], p[1], p[2]) - s).norm() < 1e-12)
            return body.getFramePose(drawn.getState()) *
                   surface.calcNodePosition(node, body.getModalCoordinates(drawn.getState()),
                                            drawn.getFactor(),
                                            drawn.calcReference(body.getIndex()));
    }
    ADD_FAILURE() << "no node at interface " << name;
    return Vec3(NaN);
}

TEST(DrawnPoses, SurfacesMeetAtPinsHoweverMuchIsExaggerated) {
    TwoArms arms;
    const State state = arms.place();
    for (const bool areMeanAxes : {false, true})
        for (const double factor : {0.0, 1.0, 10.0, 100.0, 1000.0}) {
            SCOPED_TRACE(factor);
            DrawnPoses drawn;
            drawn.setMeanAxes(areMeanAxes);
            drawn.update(arms.system, state, factor);
            EXPECT_LT(findOnSurface(drawn, arms.arm, "A").norm(), 1e-9);
            EXPECT_LT(
                (findOnSurface(drawn, arms.arm, "B") - findOnSurface(drawn, arms.forearm, "A"))
                    .norm(),
                1e-9);
            EXPECT_LT(drawn.getLargestGap().distance, 1e-9);
            // The pins' axes agree, too.
            const Transform shoulder = drawn.calcPose(arms.shoulder.getFrameM()),
                            arm = drawn.calcPose(arms.elbow.getFrameF()),
                            forearm = drawn.calcPose(arms.elbow.getFrameM());
            EXPECT_LT((Vec3(shoulder.z()) - Vec3(0, 0, 1)).norm(), 1e-9);
            EXPECT_LT((Vec3(arm.z()) - Vec3(forearm.z())).norm(), 1e-9);
        }
}

TEST(DrawnPoses, NothingMovesWithoutExaggeration) {
    TwoArms arms;
    const State state = arms.place();
    DrawnPoses drawn;
    drawn.update(arms.system, state, 1);
    EXPECT_EQ(&drawn.getState(), &state);
    for (const FlexibleBody& body : {arms.arm, arms.forearm})
        for (const char* const name : {"A", "B"}) {
            const Attachment frame = body.interface(name);
            EXPECT_LT((drawn.calcPose(frame).p() - frame.calcMotion(state).X.p()).norm(), 1e-12);
        }
}

TEST(DrawnPoses, MoveAsSmoothlyAsTheBodies) {
    // Halving the time between two pictures halves the motion of every body between them.
    TwoArms arms;
    const auto calcLargestMove = [&](double step) {
        double largest = 0;
        DrawnPoses drawn;
        Vec3 before(NaN);
        for (double t = 0; t < 1; t += step) {
            const State state = arms.place(0.3 + 0.8 * t, 0.7 - t, 2e-4);
            drawn.update(arms.system, state, 300);
            const Vec3 tip = findOnSurface(drawn, arms.forearm, "B");
            if (before.isFinite()) largest = std::max(largest, (tip - before).norm());
            before = tip;
        }
        return largest;
    };
    const double coarse = calcLargestMove(0.02), fine = calcLargestMove(0.01);
    EXPECT_LT(coarse, 0.2);
    EXPECT_NEAR(coarse / fine, 2, 0.1);
}

TEST(DrawnPoses, ClampedEndStaysOnTheGround) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    FlexibleBody tower(flexible, makePart(3), "tower");
    Joint::Weld foot(flexible, matter.Ground(), tower.interface("A"), "foot");
    State state = system.realizeTopology();
    TwoArms::placeAt(state, tower, "A", Transform(), makeModes(tower, 3e-4, 0.2));
    system.realize(state, Stage::Velocity);
    DrawnPoses drawn;
    drawn.update(system, state, 500);
    EXPECT_EQ(drawn.getReferenceName(tower.getIndex()), "tower.A");
    const Transform X_GA = drawn.calcPose(foot.getFrameM());
    EXPECT_LT(X_GA.p().norm(), 1e-12);
    EXPECT_LT((X_GA.R().asMat33() - Mat33(1)).norm(), 1e-12);
    // Relative to that end, its displacement is zero and the body's frame stays in place.
    const ReferenceMotion reference = drawn.calcReference(tower.getIndex());
    const Vector xi = tower.getModalCoordinates(state);
    const FrameShapes& shapes = *tower.interface("A").getFlexibleFrame().shapes;
    const FrameSums atXi = multiplyShapes(shapes, &xi[0]);
    EXPECT_LT((atXi.translation - reference.calcDisplacement(shapes.s)).norm(), 1e-15);
    EXPECT_LT((atXi.rotation - reference.turn).norm(), 1e-15);
    EXPECT_LT((tower.getFramePose(drawn.getState()).p() - tower.getFramePose(state).p()).norm(),
              1e-9);
}

TEST(DrawnPoses, ReferencesAreJointsAsFarAsTheyHold) {
    TwoArms arms;
    const State state = arms.place();
    DrawnPoses drawn;
    drawn.update(arms.system, state, 10);
    EXPECT_EQ(drawn.getReferenceName(arms.arm.getIndex()), "arm.A");
    EXPECT_EQ(drawn.getReferenceName(arms.forearm.getIndex()), "forearm.A");
    // A pin does not constrain rotation about its axis.
    EXPECT_LT(std::abs(drawn.calcReference(arms.arm.getIndex()).turn[2]), 1e-15);
    EXPECT_GT(drawn.calcReference(arms.arm.getIndex()).turn.norm(), 1e-6);
    drawn.setReference(arms.arm.interface("B"));
    drawn.update(arms.system, state, 10);
    EXPECT_EQ(drawn.getReferenceName(arms.arm.getIndex()), "arm.B");
    EXPECT_GT(std::abs(drawn.calcReference(arms.arm.getIndex()).turn[2]), 1e-6);
    drawn.setMeanAxes(true);
    drawn.update(arms.system, state, 10);
    EXPECT_EQ(drawn.getReferenceName(arms.forearm.getIndex()), "");
    EXPECT_EQ(drawn.calcReference(arms.forearm.getIndex()).shift.norm(), 0);
}

// A bar between two points of Ground that becomes longer than their distance.
TEST(DrawnPoses, WhatCannotCloseIsSharedOutAndNamed) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = makePart(4);
    FlexibleBody bar(flexible, part, "bar");
    const Vector xi = makeModes(bar, 2e-4, 0.5);
    const auto calcEnd = [&](const char* name, double factor) {
        const Vector more = factor * xi;
        return calcFramePose(bar.interface(name).getFlexibleFrame(), &more[0]).r;
    };
    const Transform X_GB(Vec3(0.1, 0.2, 0.3));
    Joint::Ball left(flexible, Attachment(matter.Ground(), X_GB * calcEnd("A", 1)),
                     bar.interface("A"), "left");
    Joint::Ball right(flexible, Attachment(matter.Ground(), X_GB * calcEnd("B", 1)),
                      bar.interface("B"), "right");
    State state = system.realizeTopology();
    bar.setModalCoordinates(state, xi);
    bar.setFramePose(state, X_GB);
    system.realize(state, Stage::Velocity);
    DrawnPoses drawn;
    drawn.setMeanAxes(true);
    const double factor = 200;
    drawn.update(system, state, factor);
    const double extra = std::abs((calcEnd("A", factor) - calcEnd("B", factor)).norm() -
                                  (calcEnd("A", 1) - calcEnd("B", 1)).norm());
    ASSERT_GT(extra, 0.01);
    EXPECT_NEAR(drawn.getLargestGap().distance, extra / 2, 1e-4 * extra);
    EXPECT_THAT(drawn.getLargestGap().joint, ::testing::AnyOf("left", "right"));

    // The picture reports it.
    OffscreenVisualizer viz(system, 64, 48);
    viz.addFlexibleBody(bar).setDeformationFactor(factor).setReference(
        OffscreenVisualizer::Reference::MeanAxes);
    viz.drawFrame(state);
    EXPECT_NEAR(viz.getLargestGap().second, extra / 2, 1e-4 * extra);
    viz.setDeformationFactor(1).drawFrame(state);
    EXPECT_EQ(viz.getLargestGap().second, 0);
}

/** Twenty links in a row, each stretched by 1 part in 10⁴. **/
TEST(DrawnPoses, AChainOfStretchedLinksGetsLongerAndDoesNotFold) {
    constexpr int numLinks = 20;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = makePart(3);
    std::vector<FlexibleBody> links;
    for (int i = 0; i < numLinks; ++i)
        links.emplace_back(flexible, part, "link " + std::to_string(i));
    for (int i = 0; i < numLinks; ++i)
        Joint::Ball(flexible, i == 0 ? Attachment(matter.Ground()) : links[i - 1].interface("B"),
                    links[i].interface("A"));
    State state = system.realizeTopology();
    // ξ that moves B away from A along the chord only.
    const int n = links[0].getNumModes();
    const auto calcChord = [&](const Vector& xi) {
        Vec3 ends[2];
        for (const int end : {0, 1}) {
            const FlexibleFrame& seat = links[0].interface(end == 0 ? "A" : "B").getFlexibleFrame();
            ends[end] = seat.shapes->s + multiplyShapes(*seat.shapes, &xi[0]).translation;
        }
        return Vec3(ends[1] - ends[0]);
    };
    const Vec3 chord = calcChord(Vector(n, 0.0));
    Matrix stretch(3, n);
    for (int i = 0; i < n; ++i) {
        Vector one(n, 0.0);
        one[i] = 1;
        const Vec3 change = calcChord(one) - chord;
        for (int k = 0; k < 3; ++k) stretch(k, i) = change[k];
    }
    Vector wanted(3), xi(n);
    for (int k = 0; k < 3; ++k) wanted[k] = 1e-4 * chord[k];
    FactorQTZ(stretch).solve(wanted, xi);
    for (int i = 0; i < numLinks; ++i) {
        links[i].setModalCoordinates(state, xi);
        const Vec3 a = calcChord(xi) * i;
        const FrameSums atA =
            multiplyShapes(*links[i].interface("A").getFlexibleFrame().shapes, &xi[0]);
        links[i].setFramePose(
            state, Transform(Rotation(), a - links[i].interface("A").getFlexibleFrame().shapes->s -
                                             atA.translation));
    }
    system.realize(state, Stage::Velocity);
    DrawnPoses drawn;
    drawn.update(system, state, 1000);
    EXPECT_LT(drawn.getLargestGap().distance, 1e-6);
    for (const FlexibleBody& link : links) {
        const Rotation turned = link.getFramePose(drawn.getState()).R();
        EXPECT_LT(turned.convertRotationToAngleAxis()[0], 0.02) << link.getName();
    }
    const double length = drawn.calcPose(links.back().interface("B")).p().norm();
    EXPECT_NEAR(length, 1.1 * numLinks * chord.norm(), 0.005 * numLinks * chord.norm());
}

TEST(DrawnPoses, JointsThatHaveComeApartAreLeftApart) {
    TwoArms arms;
    State state = arms.place();
    arms.forearm.setFramePose(state, Transform(Vec3(1, 2, 3)));
    arms.system.realize(state, Stage::Velocity);
    DrawnPoses drawn;
    drawn.update(arms.system, state, 100);
    EXPECT_LT((arms.forearm.getFramePose(drawn.getState()).p() - Vec3(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT(drawn.calcPose(arms.shoulder.getFrameM()).p().norm(), 1e-9);
}

TEST(DrawnPoses, FramesOnRigidBodiesAreNoReference) {
    TwoArms arms;
    const State state = arms.place();
    OffscreenVisualizer viz(arms.system, 64, 48);
    try {
        viz.setReference(Attachment(arms.matter.Ground()));
        ADD_FAILURE() << "taken";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("'ground' is on a rigid one"));
    }
}

}  // namespace
}  // namespace simflex
