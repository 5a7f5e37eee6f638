// Whole pictures against those in tests/render/reference, compared by appearance. After an intended
// change: SIMFLEX_UPDATE_REFERENCES=1 build/release/bin/test_render --gtest_filter='Reference*',
// and look at every picture before you commit it.
#include <gtest/gtest.h>

#include <cmath>

#include "PictureDifference.h"
#include "StressedParts.h"
#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/ProbePlot.h"
#include "simflex/render/SideBySide.h"
#include "support/GermanLocale.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Pi;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::Vec3;

const SimTK::MobilizedBodyIndex ground(0);
constexpr int width = 480, height = 270;

SimTK::PolygonalMesh makeStar() {
    SimTK::PolygonalMesh mesh;
    mesh.addVertex(Vec3(0, 0, 0.12));
    mesh.addVertex(Vec3(0, 0, -0.12));
    for (int i = 0; i < 10; ++i) {
        const double r = i % 2 ? 0.17 : 0.4, angle = Pi / 2 + i * Pi / 5;
        mesh.addVertex(Vec3(r * std::cos(angle), r * std::sin(angle), 0));
    }
    for (int i = 0; i < 10; ++i)
        for (const int tip : {0, 1}) {
            SimTK::Array_<int> face;
            face.push_back(tip);
            face.push_back(2 + (tip == 0 ? i : (i + 1) % 10));
            face.push_back(2 + (tip == 0 ? (i + 1) % 10 : i));
            mesh.addFace(face);
        }
    return mesh;
}

// All kinds in two rows.
void addEveryKind(OffscreenVisualizer& viz,
                  SimTK::DecorativeGeometry::Representation representation, double opacity) {
    const Vec3 colors[] = {Vec3(0.80, 0.33, 0.27), Vec3(0.90, 0.62, 0.25), Vec3(0.45, 0.65, 0.35),
                           Vec3(0.30, 0.55, 0.75), Vec3(0.55, 0.42, 0.68)};
    int number = 0;
    const auto add = [&](SimTK::DecorativeGeometry geometry) {
        const Vec3 place(1.05 * (number % 7), number < 7 ? 1.15 : 0, 0);
        geometry.setColor(colors[number % 5]).setRepresentation(representation);
        viz.addDecoration(ground, place, geometry.setOpacity(opacity));
        ++number;
    };
    add(SimTK::DecorativeBrick(Vec3(0.35, 0.3, 0.2)));
    add(SimTK::DecorativeCylinder(0.25, 0.4));
    add(SimTK::DecorativeSphere(0.4));
    add(SimTK::DecorativeEllipsoid(Vec3(0.4, 0.2, 0.3)));
    add(SimTK::DecorativeTorus(0.3, 0.1));
    add(SimTK::DecorativeCone(Vec3(0, -0.4, 0), SimTK::UnitVec3(0, 1, 0), 0.8, 0.3));
    add(SimTK::DecorativeArrow(Vec3(-0.4, -0.3, 0), Vec3(0.4, 0.3, 0), 0.25));
    add(SimTK::DecorativeMesh(makeStar()));
    add(SimTK::DecorativeCircle(0.35));
    add(SimTK::DecorativeLine(Vec3(-0.4, -0.3, 0), Vec3(0.4, 0.3, 0)).setLineThickness(4));
    add(SimTK::DecorativePoint(Vec3(0)).setLineThickness(16));
    add(SimTK::DecorativeText("text\nΔx ≥ 0").setScale(0.16).setTransform(Vec3(-0.35, 0.1, 0)));
    add(SimTK::DecorativeBrick(Vec3(0.3)).setScaleFactors(Vec3(1.2, 0.6, 1)));
    viz.addDecoration(ground, Vec3(1.05 * 6 - 0.2, -0.2, 0), SimTK::DecorativeFrame(0.6));
}

TEST(Reference, EveryKind) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, width, height);
    viz.setWindowTitle("Every kind of DecorativeGeometry").setCameraView(0.3, 0.15);
    addEveryKind(viz, SimTK::DecorativeGeometry::DrawSurface, 1);
    EXPECT_EQ(compareWithReference(viz.drawFrame(scene.state), "every_kind"), "");
}

TEST(Reference, EveryKindTransparentAndDark) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, width, height);
    viz.setTheme(OffscreenVisualizer::Theme::Dark).setCameraView(-0.3, 0.25);
    addEveryKind(viz, SimTK::DecorativeGeometry::DrawSurface, 0.45);
    EXPECT_EQ(compareWithReference(viz.drawFrame(scene.state), "every_kind_dark"), "");
}

TEST(Reference, EveryKindAsWireframe) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, width, height);
    viz.setBackgroundType(SimTK::Visualizer::SolidColor).setCameraView(0.3, 0.15);
    addEveryKind(viz, SimTK::DecorativeGeometry::DrawWireframe, 1);
    EXPECT_EQ(compareWithReference(viz.drawFrame(scene.state), "every_kind_wireframe"), "");
}

TEST(Reference, DeflectedPartWithGhostAndContour) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, width, height);
    viz.setWindowTitle("Bent beam").setShowElementEdges(true).setDeformationFactor(4);
    viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1, 0.12, 0.08), 20, 3, 2),
                                    SimTK::Vector(Vec3(0.005, 0, 0.15)),
                                    Transform(Rotation(0.2, SimTK::YAxis))));
    EXPECT_EQ(compareWithReference(viz.drawFrame(scene.state), "bent_beam"), "");
}

TEST(Reference, SeveralViewsOfAMechanism) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    SimTK::Body::Rigid link(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
    link.addDecoration(
        Transform(Vec3(0, 0.25, 0)),
        SimTK::DecorativeBrick(Vec3(0.04, 0.25, 0.04)).setColor(Vec3(0.35, 0.5, 0.7)));
    link.addDecoration(Transform(), SimTK::DecorativeSphere(0.09).setColor(Vec3(0.8, 0.4, 0.2)));
    SimTK::MobilizedBody::Pin first(matter.Ground(), Transform(), link, Vec3(0, 0.5, 0));
    SimTK::MobilizedBody::Ball second(first, Transform(), link, Vec3(0, 0.5, 0));
    SimTK::State state = system.realizeTopology();
    first.setAngle(state, 0.7);
    second.setQToFitRotation(state, Rotation(0.9, SimTK::XAxis));
    OffscreenVisualizer viz(system, width, height);
    viz.setWindowTitle("Pendulum with default geometry");
    viz.addView(CameraView("from above").setDirection(0, Pi / 2).setOrthographic());
    viz.addView(CameraView("bob").setFollowedBody(second, 0.5));
    EXPECT_EQ(compareWithReference(viz.drawFrame(state), "several_views"), "");
}

/** With a time stamp, a colour bar, and the scales of a plot. **/
Image drawStressWithPlotBelow() {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, width, 2 * height);
    viz.setWindowTitle("Stress and a probe").setContour(Contour::SignedVonMises);
    viz.addDeformableMesh(makeStill(makeStressedBrick(Vec3(1, 0.2, 0.2), 16, 4, 4, 0.4),
                                    SimTK::Vector(Vec3(0, 0.2, -0.3)),
                                    Transform(Rotation(-0.4, SimTK::YAxis))));
    std::vector<double> times, values;
    for (int i = 0; i <= 60; ++i) {
        times.push_back(0.01 * i);
        values.push_back(0.02 * std::exp(-0.05 * i) * std::cos(0.4 * i));
    }
    ProbePlot plot("Tip");
    plot.addPanel("deflection", "mm", 1e-3);
    plot.addCurve("z", times, values);
    viz.addPlot(plot, PlotSide::Below);
    scene.state.setTime(0.25);
    return viz.drawFrame(scene.state);
}

TEST(Reference, StressOfASignWithPlotBelow) {
    EXPECT_EQ(compareWithReference(drawStressWithPlotBelow(), "stress_and_plot"), "");
}

TEST(Reference, NumbersInPicturesAreTheSameInEveryLocale) {
    const Image expected = drawStressWithPlotBelow();
    const testing::TestFolder folder;
    const test::GermanLocale german(folder.path());
    EXPECT_TRUE(drawStressWithPlotBelow() == expected);
    if (!german.hasC()) GTEST_SKIP() << "there is no German locale";
}

TEST(Reference, SideBySideOfDeflectedAndRigid) {
    EmptyScene scene;
    std::vector<Image> images;
    for (const double deflection : {0.0, 0.2}) {
        OffscreenVisualizer viz(scene.system, width / 2, height);
        viz.setContour(Contour::None).setShowAxes(false).setTheme(OffscreenVisualizer::Theme::Dark);
        viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1, 0.12, 0.08), 20, 3, 2),
                                        SimTK::Vector(Vec3(0, 0, deflection))));
        images.push_back(viz.drawFrame(scene.state));
    }
    EXPECT_EQ(compareWithReference(makeSideBySide(images[0], images[1], {"rigid", "flexible"}),
                                   "side_by_side"),
              "");
}

}  // namespace
}  // namespace simflex
