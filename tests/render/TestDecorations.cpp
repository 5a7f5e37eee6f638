#include <gtest/gtest.h>

#include <functional>

#include "TestParts.h"
#include "TriangleMesh.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::DecorativeGeometry;
using SimTK::Transform;
using SimTK::Vec3;

const SimTK::MobilizedBodyIndex ground(0);
const Image::Pixel white = {255, 255, 255, 255};

// A decoration, points that it covers and points that it does not.
struct Kind {
    const char* name;
    std::function<DecorativeGeometry()> make;
    std::vector<Vec3> inside, outside;
};

std::ostream& operator<<(std::ostream& out, const Kind& kind) {
    return out << kind.name;
}

const Kind kinds[] = {
    {"Point",
     [] { return SimTK::DecorativePoint(Vec3(0.2, 0.1, 0)).setLineThickness(12); },
     {Vec3(0.2, 0.1, 0)},
     {Vec3(0), Vec3(0.25, 0.1, 0)}},
    {"Line",
     [] {
         return SimTK::DecorativeLine(Vec3(-0.5, -0.2, 0), Vec3(0.5, 0.2, 0)).setLineThickness(4);
     },
     {Vec3(-0.48, -0.192, 0), Vec3(0), Vec3(0.48, 0.192, 0)},
     {Vec3(0.4, 0, 0), Vec3(0.6, 0.24, 0)}},
    {"Brick",
     [] { return SimTK::DecorativeBrick(Vec3(0.5, 0.25, 0.1)); },
     {Vec3(0), Vec3(0.48, 0.24, 0.1)},
     {Vec3(0, 0.3, 0), Vec3(0.55, 0, 0)}},
    {"Cylinder",
     [] { return SimTK::DecorativeCylinder(0.2, 0.5); },
     {Vec3(0), Vec3(0, 0.48, 0), Vec3(0.18, 0, 0)},
     {Vec3(0.25, 0, 0), Vec3(0, 0.6, 0)}},
    {"Circle",
     [] { return SimTK::DecorativeCircle(0.4); },
     {Vec3(0), Vec3(0.38, 0, 0), Vec3(0, -0.38, 0)},
     {Vec3(0.3, 0.3, 0), Vec3(0.43, 0, 0)}},
    {"Sphere",
     [] { return SimTK::DecorativeSphere(0.4); },
     {Vec3(0), Vec3(0.38, 0, 0)},
     {Vec3(0.3, 0.3, 0), Vec3(0, 0.43, 0)}},
    {"Ellipsoid",
     [] { return SimTK::DecorativeEllipsoid(Vec3(0.5, 0.2, 0.3)); },
     {Vec3(0.48, 0, 0), Vec3(0, 0.19, 0)},
     {Vec3(0, 0.25, 0), Vec3(0.4, 0.18, 0)}},
    {"Frame",
     [] { return SimTK::DecorativeFrame(0.5); },
     {Vec3(0.25, 0, 0), Vec3(0, 0.45, 0)},
     {Vec3(0.2, 0.2, 0), Vec3(-0.2, 0, 0)}},
    {"Text",
     [] { return SimTK::DecorativeText("HHH").setScale(0.4); },
     {Vec3(0.095, 0.2, 0)},
     {Vec3(-0.1, 0.2, 0), Vec3(0.2, 0.5, 0), Vec3(0.2, -0.1, 0)}},
    {"Mesh",
     [] { return SimTK::DecorativeMesh(makeTriangleMesh()); },
     {Vec3(0), Vec3(0.45, -0.48, 0), Vec3(0, 0.46, 0)},
     {Vec3(0.4, 0.3, 0), Vec3(0, -0.55, 0)}},
    {"MeshFile",
     [] { return SimTK::DecorativeMeshFile(writeTriangleFile("obj")); },
     {Vec3(0), Vec3(0.45, -0.48, 0), Vec3(0, 0.46, 0)},
     {Vec3(0.4, 0.3, 0), Vec3(0, -0.55, 0)}},
    {"Torus",
     [] { return SimTK::DecorativeTorus(0.4, 0.08); },
     {Vec3(0.4, 0, 0), Vec3(0, -0.4, 0)},
     {Vec3(0), Vec3(0.28, 0, 0), Vec3(0.52, 0, 0)}},
    {"Arrow",
     [] { return SimTK::DecorativeArrow(Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0), 0.3); },
     {Vec3(-0.48, 0, 0), Vec3(0.48, 0, 0), Vec3(0.22, 0.07, 0)},
     {Vec3(0, 0.1, 0), Vec3(0.45, 0.08, 0)}},
    {"Cone",
     [] { return SimTK::DecorativeCone(Vec3(0, -0.4, 0), SimTK::UnitVec3(0, 1, 0), 0.8, 0.3); },
     {Vec3(0, 0.37, 0), Vec3(0.27, -0.39, 0)},
     {Vec3(0.2, 0.3, 0), Vec3(0, 0.45, 0), Vec3(0, -0.5, 0)}},
};

class Decoration : public testing::TestWithParam<Kind> {};

bool isDrawnAt(const OffscreenVisualizer& viz, const Image& image, const Vec3& p) {
    const Vec3 pixel = viz.calcPixel(p);
    return image.getPixel(int(pixel[0]), int(pixel[1])) != white;
}

TEST_P(Decoration, IsDrawnWhereItIs) {
    EmptyScene scene;
    const Kind& kind = GetParam();
    const Transform X(SimTK::Rotation(), Vec3(0.15, -0.1, 0));
    for (const auto theme :
         {OffscreenVisualizer::Lighting::Flat, OffscreenVisualizer::Lighting::Shaded}) {
        OffscreenVisualizer viz(scene.system);
        makePlain(viz, 20);
        viz.setCameraFieldOfView(0.08).setLighting(theme);
        viz.addDecoration(ground, X, kind.make().setColor(Vec3(0.8, 0.1, 0.1)));
        const Image image = viz.drawFrame(scene.state);
        for (const Vec3& p : kind.inside) EXPECT_TRUE(isDrawnAt(viz, image, X * p)) << p;
        for (const Vec3& p : kind.outside) EXPECT_FALSE(isDrawnAt(viz, image, X * p)) << p;
    }
}

TEST_P(Decoration, ScaleAndRepresentationAreFollowed) {
    EmptyScene scene;
    const Kind& kind = GetParam();
    std::vector<int> counts;
    for (const auto representation :
         {DecorativeGeometry::DrawSurface, DecorativeGeometry::DrawWireframe,
          DecorativeGeometry::DrawPoints, DecorativeGeometry::Hide}) {
        OffscreenVisualizer viz(scene.system);
        makePlain(viz, 20);
        viz.setCameraFieldOfView(0.08);
        viz.addDecoration(ground, Transform(),
                          kind.make().setRepresentation(representation).setColor(Vec3(0.1)));
        counts.push_back(countPixels(viz.drawFrame(scene.state), white));
    }
    for (int i = 0; i < 3; ++i) EXPECT_GT(counts[i], 0);
    EXPECT_EQ(counts[3], 0);

    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 20);
    viz.setCameraFieldOfView(0.08);
    DecorativeGeometry smaller = kind.make();
    const Vec3 scale = smaller.getScaleFactors();
    viz.addDecoration(ground, Transform(),
                      smaller.setScale(0.5 * (scale[0] > 0 ? scale[0] : 1)).setColor(Vec3(0.1)));
    if (std::string(kind.name) != "Point") {
        EXPECT_LT(countPixels(viz.drawFrame(scene.state), white), 0.7 * counts[0]);
    }
}

INSTANTIATE_TEST_SUITE_P(AllKinds, Decoration, testing::ValuesIn(kinds),
                         [](const auto& parameters) { return parameters.param.name; });

TEST(Decorations, FollowTheirBodies) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    SimTK::Body::Rigid body(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
    body.addDecoration(Transform(Vec3(0, 0.2, 0)), SimTK::DecorativeSphere(0.05).setColor(Vec3(0)));
    SimTK::MobilizedBody::Free free(matter.Ground(), body);
    SimTK::State state = system.realizeTopology();
    OffscreenVisualizer viz(system);
    makePlain(viz);
    const Transform X(SimTK::Rotation(1.0, SimTK::ZAxis), Vec3(0.3, 0.1, 0));
    free.setQToFitTransform(state, X);
    EXPECT_TRUE(isDrawnAt(viz, viz.drawFrame(state), X * Vec3(0, 0.2, 0)));
    free.setQToFitTransform(state, Transform());
    const Image image = viz.drawFrame(state);
    EXPECT_FALSE(isDrawnAt(viz, image, X * Vec3(0, 0.2, 0)));
    EXPECT_TRUE(isDrawnAt(viz, image, Vec3(0, 0.2, 0)));
}

class MovingDot : public SimTK::DecorationGenerator {
public:
    void generateDecorations(const SimTK::State& state,
                             SimTK::Array_<DecorativeGeometry>& geometry) override {
        geometry.push_back(SimTK::DecorativeSphere(0.05).setColor(Vec3(0)).setTransform(
            Vec3(state.getTime(), 0, 0)));
    }
};

TEST(Decorations, OfAGeneratorAndRubberBandsFollowTheState) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz);
    viz.addDecorationGenerator(new MovingDot);
    viz.addRubberBandLine(ground, Vec3(-0.5, -0.5, 0), ground, Vec3(0.5, -0.5, 0),
                          SimTK::DecorativeLine().setLineThickness(4).setColor(Vec3(0)));
    for (const double time : {0.0, 0.4}) {
        scene.state.setTime(time);
        const Image image = viz.drawFrame(scene.state);
        EXPECT_TRUE(isDrawnAt(viz, image, Vec3(time, 0, 0)));
        EXPECT_FALSE(isDrawnAt(viz, image, Vec3(0.4 - time, 0, 0)));
        EXPECT_TRUE(isDrawnAt(viz, image, Vec3(0.2, -0.5, 0)));
    }
}

}  // namespace
}  // namespace simflex
