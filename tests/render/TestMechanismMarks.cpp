#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "TestParts.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/LoadShape.h"
#include "simflex/render/scene/ForceSymbols.h"
#include "simflex/render/scene/MechanismMarks.h"
#include "simflex/render/scene/SceneBuilder.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

// Counts the pieces in a list of decorations.
class Inventory : public DecorativeGeometryImplementation {
public:
    explicit Inventory(const Array_<DecorativeGeometry>& geometry) {
        for (const DecorativeGeometry& piece : geometry) piece.implementGeometry(*this);
    }

    std::vector<Transform> frames;
    std::vector<std::string> texts, screenTexts;
    std::vector<Vec3> textPlaces, spheres;
    struct Arrow {
        Vec3 start, span;
    };
    std::vector<Arrow> arrows;
    int numShapes = 0, numCones = 0;
    double reach = 0;  // largest distance of a shape from the origin

    void implementPointGeometry(const DecorativePoint& g) override { count(g); }
    void implementLineGeometry(const DecorativeLine& g) override { count(g); }
    void implementBrickGeometry(const DecorativeBrick& g) override { count(g); }
    void implementCylinderGeometry(const DecorativeCylinder& g) override { count(g); }
    void implementCircleGeometry(const DecorativeCircle& g) override { count(g); }
    void implementSphereGeometry(const DecorativeSphere& g) override {
        count(g);
        spheres.push_back(g.getTransform().p());
    }
    void implementEllipsoidGeometry(const DecorativeEllipsoid& g) override { count(g); }
    void implementMeshGeometry(const DecorativeMesh& g) override { count(g); }
    void implementMeshFileGeometry(const DecorativeMeshFile& g) override { count(g); }
    void implementTorusGeometry(const DecorativeTorus& g) override { count(g); }
    void implementFrameGeometry(const DecorativeFrame& g) override {
        frames.push_back(g.getTransform());
    }
    void implementTextGeometry(const DecorativeText& g) override {
        (g.getIsScreenText() ? screenTexts : texts).push_back(g.getText());
        textPlaces.push_back(g.getTransform().p());
    }
    void implementArrowGeometry(const DecorativeArrow& g) override {
        arrows.push_back({g.getStartPoint(), g.getEndPoint() - g.getStartPoint()});
        ++numShapes;
    }
    void implementConeGeometry(const DecorativeCone& g) override {
        ++numCones;
        ++numShapes;
        reach = std::max(reach, g.getOrigin().norm());
    }

private:
    void count(const DecorativeGeometry& g) {
        ++numShapes;
        reach = std::max(reach, g.getTransform().p().norm());
    }
};

PartSnapshot capturePart(const FlexibleBody& body, const State& state) {
    PartSnapshot part;
    part.skin = extractSkinModes(body.getPartHandle(), 0.6);
    part.X_GB = part.X_GD = body.getFramePose(state);
    part.xi = body.getModalCoordinates(state);
    return part;
}

// A body hanging from Ground by a ball, with its other end free.
struct Pendulum {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, Vec3(0, -9.81, 0)};
    FlexibleBodySubsystem flexible{system, matter};
    std::shared_ptr<const ReducedBody> part = test::makePointMassPart().body;
    FlexibleBody body{flexible, part, "boom"};
    Joint::Ball ball{flexible, matter.Ground(), body.interface("A"), "hinge"};

    Transform X_GD;  // of the body as last drawn

    State place() {
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform(Rotation(-0.4, ZAxis)));
        flexible.initializeNative(state);
        return state;
    }
    Inventory takeStock(MechanismMarks& marks, const State& state, double factor = 1) {
        system.realize(state, marks.getStage());
        FrameSnapshot frame;
        frame.parts.push_back(capturePart(body, state));
        frame.partStyle.deformationFactor = factor;
        Array_<DecorativeGeometry> geometry;
        DrawnPoses drawn;
        drawn.setMeanAxes(true);
        drawn.update(system, state, factor);
        marks.append(system, state, drawn, frame, geometry);
        X_GD = body.getFramePose(drawn.getState());
        Inventory found(geometry);
        for (const Label& label : frame.labels) found.texts.push_back(label.text);
        return found;
    }
};

TEST(MechanismMarks, InterfaceFramesAreThoseOfTheBody) {
    Pendulum pendulum;
    State state = pendulum.place();
    Vector xi(pendulum.part->numModes);
    for (int i = 0; i < xi.size(); ++i) xi[i] = 0.004 * std::sin(1 + i);
    pendulum.body.setModalCoordinates(state, xi);
    pendulum.system.realize(state, Stage::Velocity);
    MechanismMarks marks;
    marks.settings.showInterfaces = true;
    const Inventory found = pendulum.takeStock(marks, state);
    ASSERT_EQ(found.frames.size(), pendulum.part->interfaces.size());
    EXPECT_EQ(found.texts, (std::vector<std::string>{"A", "B"}));
    for (std::size_t i = 0; i < found.frames.size(); ++i) {
        const Transform expected =
            pendulum.body.interface(pendulum.part->interfaces[i].name).calcMotion(state).X;
        EXPECT_LT((found.frames[i].p() - expected.p()).norm(), 1e-12);
        EXPECT_LT((found.frames[i].R().asMat33() - expected.R().asMat33()).norm(), 1e-12);
    }
    // With exaggeration they follow the surface: twice as far from the undeformed position.
    const Inventory twice = pendulum.takeStock(marks, state, 2),
                    none = pendulum.takeStock(marks, state, 0);
    EXPECT_LT((twice.frames[1].p() + none.frames[1].p() - 2 * found.frames[1].p()).norm(), 1e-12);
    EXPECT_GT((twice.frames[1].p() - none.frames[1].p()).norm(), 1e-4);
}

TEST(MechanismMarks, ArrowsAreInProportionToTheReactions) {
    Pendulum pendulum;
    // A second ball at the other end shares the weight.
    const auto &from = pendulum.part->interfaces[0].position,
               &to = pendulum.part->interfaces[1].position;
    const Vec3 span(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    Joint::Ball second(pendulum.flexible, Attachment(pendulum.matter.Ground(), Transform(span)),
                       pendulum.body.interface("B"));
    State state = pendulum.system.realizeTopology();
    pendulum.body.setPoseByInterface(state, "A", Transform());
    pendulum.flexible.initializeNative(state);
    MechanismMarks marks;
    marks.settings.showReactions = marks.settings.showReactionValues = true;
    EXPECT_EQ(marks.getStage(), Stage::Acceleration);
    const Inventory found = pendulum.takeStock(marks, state);
    const Joint joints[] = {pendulum.ball, second};
    ASSERT_EQ(found.arrows.size(), 2u);
    double longest = 0, largest = 0;
    for (int i = 0; i < 2; ++i) {
        const Vec3 force = joints[i].calcReaction(state, Joint::Side::M, Joint::Side::M)[1];
        EXPECT_LT((found.arrows[i].span.normalize() - force.normalize()).norm(), 1e-12);
        longest = std::max(longest, found.arrows[i].span.norm());
        largest = std::max(largest, force.norm());
    }
    for (int i = 0; i < 2; ++i) {
        const Vec3 force = joints[i].calcReaction(state, Joint::Side::M, Joint::Side::M)[1];
        EXPECT_NEAR(found.arrows[i].span.norm() / longest, force.norm() / largest, 1e-12);
    }
    EXPECT_EQ(found.numCones, 0);  // a ball carries no moment
    ASSERT_EQ(found.screenTexts.size(), 1u);
    EXPECT_THAT(found.screenTexts[0], HasSubstr(" N"));
    EXPECT_EQ(found.texts.size(), 2u);
}

TEST(MechanismMarks, ReactionsOfAnImplicitRunAreThoseOfItsMultipliers) {
    Pendulum pendulum;
    State state = pendulum.place();
    BdfIntegrator integrator(pendulum.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    integrator.stepTo(0.02);
    MechanismMarks marks;
    marks.settings.showReactions = marks.settings.showReactionValues = true;
    marks.settings.multipliers = [&](const State&, const Joint& joint) {
        return integrator.getMultipliers(joint);
    };
    EXPECT_EQ(marks.getStage(), Stage::Velocity);
    const Inventory found = pendulum.takeStock(marks, integrator.getState());
    ASSERT_EQ(found.arrows.size(), 1u);
    const Vec3 force = pendulum.ball.calcForceOnM(integrator.getState(),
                                                  integrator.getMultipliers(pendulum.ball))[1];
    EXPECT_LT((found.arrows[0].span.normalize() - force.normalize()).norm(), 1e-9);
    EXPECT_LT(found.arrows[0].start.norm(), 1e-6);  // at the hinge

    // The longest arrow is the run's largest: a later, larger force makes this one shorter.
    const double before = found.arrows[0].span.norm();
    marks.settings.multipliers = [&](const State&, const Joint& joint) {
        return Vector(2.0 * integrator.getMultipliers(joint));
    };
    EXPECT_NEAR(pendulum.takeStock(marks, integrator.getState()).arrows[0].span.norm(), before,
                1e-9);
    marks.settings.multipliers = [&](const State&, const Joint& joint) {
        return integrator.getMultipliers(joint);
    };
    EXPECT_NEAR(pendulum.takeStock(marks, integrator.getState()).arrows[0].span.norm(), before / 2,
                1e-9);
}

TEST(MechanismMarks, EveryKindOfJointHasASymbolOfItsSize) {
    const Transform X_GF(Rotation(0.3, UnitVec3(1, 2, 3)), Vec3(0));
    for (const char* kind : {"Ball", "Pin", "Slider", "Weld", "Cylinder", "Universal", "Planar",
                             "Screw", "PointOnLine", "PointInPlane", "Rod", "PrescribedRotation",
                             "PrescribedTranslation", "PrescribedPosition", "PrescribedPose"}) {
        Array_<DecorativeGeometry> geometry;
        appendJointSymbol(kind, X_GF, X_GF * Transform(Vec3(0.02, 0, 0)), {0.01, 0.01}, geometry);
        const Inventory found(geometry);
        EXPECT_GE(found.numShapes, 1) << kind;
        EXPECT_LT(found.reach, 0.05) << kind;
    }
    Array_<DecorativeGeometry> coupler;
    appendCouplerSymbol({X_GF, Transform(Vec3(1, 0, 0))}, {0.01, 0.01}, coupler);
    EXPECT_EQ(coupler.size(), 3u);
}

// Bounding box of a symbol from the ends of its sticks, balls and wires.
void findBounds(const Array_<DecorativeGeometry>& geometry, Vec3& lower, Vec3& upper) {
    ShapeCache shapes;
    Scene scene;
    SceneBuilder builder(
        scene, shapes, [](int) { return Transform(); }, [](const Vec3&, double) { return 50.0; });
    for (const DecorativeGeometry& piece : geometry) builder.add(piece);
    std::vector<Vec3> points;
    scene.appendBounds(points);
    ASSERT_FALSE(points.empty());
    lower = upper = points[0];
    for (const Vec3& p : points)
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k]);
            upper[k] = std::max(upper[k], p[k]);
        }
}

TEST(ForceSymbols, AStrutReachesFromOneEndToTheOtherHoweverLongItIs) {
    const StrutSize size = chooseStrutSize(0.4, 0.5);
    for (const double length : {0.1, 0.25, 0.4, 0.7})
        for (const bool hasSpring : {false, true})
            for (const bool hasDamper : {false, true}) {
                if (!hasSpring && !hasDamper) continue;
                Array_<DecorativeGeometry> geometry;
                appendStrut(Transform(Vec3(1, 2, 3)), Vec3(1 + length, 2, 3), size,
                            {hasSpring, hasDamper, false, false}, geometry);
                Vec3 lower, upper;
                findBounds(geometry, lower, upper);
                const double eye = 0.42 * size.radius;
                EXPECT_NEAR(lower[0], 1 - eye, 1e-9) << length;
                EXPECT_NEAR(upper[0], 1 + length + eye, 1e-9) << length;
                // Its thickness is independent of its length.
                if (hasSpring && !hasDamper) {
                    EXPECT_NEAR(upper[1] - 2, size.radius, 0.45 * size.radius) << length;
                }
            }
}

TEST(ForceSymbols, TheCoilKeepsItsTurnsAndEvenlySpacesThem) {
    // Crossings of the wire's centreline with the plane through the axis: one upwards per turn.
    EXPECT_EQ(chooseStrutSize(0.4, 0.5).numTurns, chooseStrutSize(0.8, 1).numTurns);
    EXPECT_GE(chooseStrutSize(0.01, 1).numTurns, 5);
    EXPECT_LE(chooseStrutSize(10, 0.1).numTurns, 14);
    EXPECT_LE(chooseStrutSize(0.01, 1).radius, 0.2 * 0.01);
    // A rope is straight except for a short piece.
    EXPECT_LT(chooseStrutSize(10, 1).coil, 1);
    EXPECT_GT(chooseStrutSize(3, 1).coil, 10);
}

TEST(ForceSymbols, ATorqueTurnsByTheRightHandInThePlaneAcrossIt) {
    for (const double sign : {-1.0, 1.0}) {
        const UnitVec3 axis(Vec3(0, 0, sign));
        Array_<DecorativeGeometry> geometry;
        appendTorqueArrow(Vec3(0), axis, 0.2, 0.05, Vec3(1, 0, 0), geometry);
        Vec3 lower, upper;
        findBounds(geometry, lower, upper);
        EXPECT_NEAR(upper[0], 0.2, 0.03);
        EXPECT_LT(upper[2] - lower[2], 0.05);
        // The tip points along the circle: r × forward is along the axis.
        struct Tip : Inventory {
            using Inventory::Inventory;
            Vec3 place, direction;
            void implementConeGeometry(const DecorativeCone& g) override {
                place = g.getOrigin();
                direction = Vec3(g.getDirection());
            }
        } tip(Array_<DecorativeGeometry>{});
        geometry.back().implementGeometry(tip);
        EXPECT_GT(dot(cross(tip.place, tip.direction), Vec3(axis)), 0.19);
    }
}

TEST(ForceMarks, SpringsAndLoadsGoWithTheDrawnBodyInEveryState) {
    Pendulum pendulum;
    State state = pendulum.place();
    Vector xi(pendulum.part->numModes, 0.003);
    pendulum.body.setModalCoordinates(state, xi);
    const Attachment tip = pendulum.body.interface("B"),
                     wall(pendulum.matter.Ground(), Transform(Vec3(0.3, 2, 0)));
    MechanismMarks marks;
    marks.forces.connectors.push_back({ConnectorKind::Spring, wall, tip, 1.0});
    marks.forces.loads.push_back(
        {tip, [](const State& at) { return SpatialVec(Vec3(0), Vec3(0, 0, -50 * at.getTime())); }});
    for (const double angle : {0.0, 0.7}) {
        pendulum.body.setPoseByInterface(state, "A", Transform(Rotation(angle, ZAxis)));
        state.setTime(1 + angle);
        pendulum.system.realize(state, Stage::Velocity);
        const Inventory found = pendulum.takeStock(marks, state);
        const Vec3 end = tip.calcMotion(state).X.p();
        ASSERT_EQ(found.arrows.size(), 1u);
        EXPECT_LT((found.arrows[0].start - end).norm(), 1e-12);
        EXPECT_LT((found.arrows[0].span.normalize() + Vec3(0, 0, 1)).norm(), 1e-12);
        ASSERT_GE(found.spheres.size(), 2u);
        EXPECT_LT((found.spheres[0] - Vec3(0.3, 2, 0)).norm(), 1e-12);
        EXPECT_LT((found.spheres[1] - end).norm(), 1e-12);
    }
    // The longest arrow is the run's largest load.
    state.setTime(0.85);
    pendulum.system.realize(state, Stage::Velocity);
    const double half = pendulum.takeStock(marks, state).arrows[0].span.norm();
    state.setTime(1.7);
    pendulum.system.realize(state, Stage::Velocity);
    const Inventory largest = pendulum.takeStock(marks, state);
    EXPECT_NEAR(half / largest.arrows[0].span.norm(), 0.5, 1e-12);
    ASSERT_EQ(largest.screenTexts.size(), 1u);
    EXPECT_EQ(largest.screenTexts[0], "loads up to 85 N");

    marks.forces.showConnectors = marks.forces.showLoads = false;
    EXPECT_EQ(pendulum.takeStock(marks, state).numShapes, 0);
}

TEST(ForceMarks, ASpreadLoadStandsOnTheDeformedBody) {
    // All nodal forces are along y: their centre moves by the modes' mean displacement there.
    Pendulum pendulum;
    State state = pendulum.place();
    const ReducedBody& part = *pendulum.part;
    const LoadShape shape =
        LoadShape::fromNodalForces(part, {0, 1}, {Vec3(0, 3, 0), Vec3(0, 3, 0)});
    Vector xi(part.numModes);
    for (int i = 0; i < xi.size(); ++i) xi[i] = 0.002 * std::cos(i);
    pendulum.body.setModalCoordinates(state, xi);
    pendulum.system.realize(state, Stage::Velocity);
    MechanismMarks marks;
    const auto position = [&](int node) {
        const auto p = part.mesh.position(node);
        return Vec3(p[0], p[1], p[2]);
    };
    const Vec3 center = 0.5 * (position(0) + position(1));
    marks.forces.spreadLoads.push_back(
        {pendulum.body, center, shape.force, shape.modal, [](Real) { return -2.0; }});
    double displacement = 0;
    for (int i = 0; i < xi.size(); ++i)
        for (const int node : {0, 1})
            displacement += 0.5 * xi[i] *
                            part.Phi[std::size_t(i) * 3 * std::size_t(part.mesh.numNodes()) +
                                     3 * std::size_t(node) + 1];
    for (const double factor : {1.0, 20.0}) {
        const Inventory found = pendulum.takeStock(marks, state, factor);
        ASSERT_EQ(found.arrows.size(), 1u);
        const Transform X_GB = pendulum.X_GD;
        EXPECT_LT(
            (found.arrows[0].start - X_GB * (center + Vec3(0, factor * displacement, 0))).norm(),
            1e-12);
        EXPECT_GT(dot(found.arrows[0].span, Vec3(-X_GB.R().y())),
                  0.999 * found.arrows[0].span.norm());
    }
}

TEST(ForceMarks, ALoadWithoutValueIsNamed) {
    Pendulum pendulum;
    const State state = pendulum.place();
    MechanismMarks marks;
    marks.forces.loads.push_back({pendulum.body.interface("B"),
                                  [](const State&) { return SpatialVec(Vec3(0), Vec3(NaN)); }});
    try {
        pendulum.takeStock(marks, state);
        FAIL() << "accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("boom.B"));
    }
}

TEST(MechanismMarks, AFollowedFrameStaysAtOnePixel) {
    Pendulum pendulum;
    pendulum.matter.setShowDefaultGeometry(false);
    State state = pendulum.place();
    const Attachment tip = pendulum.body.interface("B");
    std::vector<State> states;
    std::vector<Vec3> places;
    for (int i = 0; i < 7; ++i) {
        Vector xi(pendulum.part->numModes, 0.01 * std::sin(i));
        pendulum.body.setModalCoordinates(state, xi);
        pendulum.body.setPoseByInterface(state, "A", Transform(Rotation(-0.3 * i, ZAxis)));
        state.setTime(0.1 * i);
        pendulum.system.realize(state, Stage::Velocity);
        states.push_back(state);
        places.push_back(tip.calcMotion(state).X.p());
    }
    for (const double height : {0.0, 0.2})
        for (const double orbit : {0.0, 0.5}) {
            OffscreenVisualizer viz(pendulum.system, 160, 120);
            viz.addFlexibleBody(pendulum.body).setDeformationFactor(1);
            viz.setCamera(CameraView().setFollowedFrame(tip, height).setOrbit(orbit));
            viz.fitToMotion(states);
            Vec3 first(0);
            for (std::size_t i = 0; i < states.size(); ++i) {
                viz.drawFrame(states[i]);
                const Vec3 pixel = viz.calcPixel(places[i]);
                if (i == 0) first = pixel;
                EXPECT_LT((pixel - first).getSubVec<2>(0).norm(), 1) << i;
            }
            if (height > 0) {
                EXPECT_LT((first - Vec3(80, 60, first[2])).norm(), 1);
            }
        }
}

TEST(MechanismMarks, AreInThePicture) {
    Pendulum pendulum;
    pendulum.matter.setShowDefaultGeometry(false);
    const State state = pendulum.place();
    pendulum.system.realize(state, Stage::Acceleration);
    OffscreenVisualizer viz(pendulum.system, 640, 360);
    viz.addFlexibleBody(pendulum.body).setContour(Contour::None).setShowReactions(true);
    viz.setShowAxes(false);
    const Image with = viz.drawFrame(state);
    const auto countOrange = [](const Image& image) {
        int count = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x) {
                const Image::Pixel p = image.getPixel(x, y);
                count += p[0] > 120 && p[0] > 2 * p[1] && p[0] > 3 * p[2];
            }
        return count;
    };
    EXPECT_GT(countOrange(with), 100);
    EXPECT_EQ(countOrange(viz.setShowReactions(false).drawFrame(state)), 0);
}

TEST(MechanismMarks, OfJointsNeedFlexibleBodies) {
    test::EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 36);
    viz.setShowJoints(true);
    try {
        viz.drawFrame(scene.state);
        FAIL() << "accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("FlexibleBodySubsystem"));
    }
}

}  // namespace
}  // namespace simflex
