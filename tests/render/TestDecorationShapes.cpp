// Every kind of DecorativeGeometry against closed forms: covered area in an orthographic picture,
// colour, scale factors.
#include <gtest/gtest.h>

#include <functional>

#include "TestParts.h"
#include "TriangleMesh.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::DecorativeGeometry;
using SimTK::Pi;
using SimTK::Transform;
using SimTK::Vec3;

const SimTK::MobilizedBodyIndex ground(0);

struct Shape {
    const char* name;
    std::function<DecorativeGeometry()> make;
    double area;       // of the projection along z [m²]
    double perimeter;  // of its outline [m]
    bool isLayered;    // has a front and a back
};

std::ostream& operator<<(std::ostream& out, const Shape& shape) {
    return out << shape.name;
}

constexpr double arrowTip = 0.2, tipRadius = 0.32 * arrowTip, shaftRadius = 0.12 * arrowTip;

const Shape shapes[] = {
    {"Brick", [] { return SimTK::DecorativeBrick(Vec3(0.5, 0.25, 0.1)); }, 0.5, 3, true},
    {"Cylinder", [] { return SimTK::DecorativeCylinder(0.2, 0.5); }, 0.4, 2.8, true},
    {"Circle", [] { return SimTK::DecorativeCircle(0.4); }, Pi * 0.16, 0.8 * Pi, false},
    {"Sphere", [] { return SimTK::DecorativeSphere(0.4); }, Pi * 0.16, 0.8 * Pi, true},
    {"Ellipsoid", [] { return SimTK::DecorativeEllipsoid(Vec3(0.5, 0.2, 0.3)); }, Pi * 0.1, 2.3,
     true},
    {"Torus", [] { return SimTK::DecorativeTorus(0.4, 0.1); }, Pi*(0.25 - 0.09), 1.6 * Pi, true},
    {"Cone",
     [] { return SimTK::DecorativeCone(Vec3(0, -0.3, 0), SimTK::UnitVec3(0, 1, 0), 0.6, 0.3); },
     0.18, 2, true},
    {"Arrow", [] { return SimTK::DecorativeArrow(Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0), arrowTip); },
     2 * shaftRadius*(1 - arrowTip) + tipRadius* arrowTip, 2.2, true},
    {"Mesh", [] { return SimTK::DecorativeMesh(makeTriangleMesh()); }, 0.5, 3.3, false},
    {"ObjFile", [] { return SimTK::DecorativeMeshFile(writeTriangleFile("obj")); }, 0.5, 3.3,
     false},
    {"StlFile", [] { return SimTK::DecorativeMeshFile(writeTriangleFile("stl")); }, 0.5, 3.3,
     false},
    {"VtpFile", [] { return SimTK::DecorativeMeshFile(writeTriangleFile("vtp")); }, 0.5, 3.3,
     false},
};

class DecorationShape : public testing::TestWithParam<Shape> {
protected:
    EmptyScene scene;

    OffscreenVisualizer makeVisualizer() const {
        OffscreenVisualizer viz(scene.system, 480, 360);
        makePlain(viz, 20);
        viz.setCameraProjection(CameraView::Projection::Orthographic)
            .setCameraFieldOfView(0.14)
            .setShowScaleBar(false);
        return viz;
    }
};

double calcPixelsPerMeter(const OffscreenVisualizer& viz) {
    return viz.calcPixel(Vec3(1, 0, 0))[0] - viz.calcPixel(Vec3(0))[0];
}

TEST_P(DecorationShape, CoversTheAreaOfItsProjection) {
    const Shape& shape = GetParam();
    for (const Vec3& scale : {Vec3(1), Vec3(1.4), Vec3(1.6, 0.6, 2.5)}) {
        const bool isUniform = scale[0] == scale[1];
        if (std::string(shape.name) == "Arrow" && !isUniform) continue;  // its tip stays circular
        OffscreenVisualizer viz = makeVisualizer();
        viz.addDecoration(ground, Transform(Vec3(0.1, -0.05, 0)),
                          shape.make().setScaleFactors(scale).setColor(Vec3(0)));
        const Image image = viz.drawFrame(scene.state);
        const double pixels = calcPixelsPerMeter(viz);
        const double perimeter = shape.perimeter * std::max(scale[0], scale[1]) * pixels;
        // Facets lie up to a tenth of a pixel inside a circle; with four samples per pixel an edge
        // is accurate to an eighth of a pixel.
        EXPECT_NEAR(calcCoveredArea(image, 0, 0),
                    shape.area * scale[0] * scale[1] * pixels * pixels, 0.16 * perimeter)
            << scale;
    }
}

TEST_P(DecorationShape, HasItsColorAndOpacity) {
    const Shape& shape = GetParam();
    const Vec3 color(0.8, 0.2, 0.4);
    // A point on the shape's projection, outside the hole of a torus.
    const Vec3 p = std::string(shape.name) == "Torus" ? Vec3(0.4, 0, 0) : Vec3(0, -0.01, 0);
    for (const double opacity : {1.0, 0.5}) {
        OffscreenVisualizer viz = makeVisualizer();
        viz.addDecoration(ground, Transform(), shape.make().setColor(color).setOpacity(opacity));
        const Image image = viz.drawFrame(scene.state);
        const Vec3 pixel = viz.calcPixel(p);
        const Image::Pixel seen = image.getPixel(int(pixel[0]), int(pixel[1]));
        // Light passes through each wall.
        const double passing = std::pow(1 - opacity, shape.isLayered ? 2 : 1);
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(seen[std::size_t(k)], 255 * (color[k] * (1 - passing) + passing), 2)
                << opacity;
    }
}

TEST_P(DecorationShape, OfNoScaleOrNegativeScaleHasItsOwnSize) {
    const Shape& shape = GetParam();
    double areas[3];
    const Vec3 scales[3] = {Vec3(1), Vec3(0), Vec3(-2)};
    for (int i = 0; i < 3; ++i) {
        OffscreenVisualizer viz = makeVisualizer();
        viz.addDecoration(ground, Transform(),
                          shape.make().setScaleFactors(scales[i]).setColor(Vec3(0)));
        areas[i] = calcCoveredArea(viz.drawFrame(scene.state), 0, 0);
    }
    EXPECT_EQ(areas[0], areas[1]);
    EXPECT_EQ(areas[0], areas[2]);
}

INSTANTIATE_TEST_SUITE_P(EveryKind, DecorationShape, testing::ValuesIn(shapes),
                         [](const auto& parameters) { return parameters.param.name; });

TEST_F(DecorationShape, LineIsAsWideAsItsThicknessAndPointAsItsDiameter) {
    OffscreenVisualizer viz = makeVisualizer();
    const double unit = viz.getHeight() / 720.0;
    viz.addDecoration(ground, Transform(),
                      SimTK::DecorativeLine(Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0))
                          .setLineThickness(12)
                          .setColor(Vec3(0)));
    const double length = calcCoveredArea(viz.drawFrame(scene.state), 0, 0) / (12 * unit);
    EXPECT_NEAR(length, calcPixelsPerMeter(viz) + 12 * unit, 3);

    OffscreenVisualizer other = makeVisualizer();
    other.addDecoration(ground, Transform(),
                        SimTK::DecorativePoint(Vec3(0)).setLineThickness(40).setColor(Vec3(0)));
    const double area = calcCoveredArea(other.drawFrame(scene.state), 0, 0);
    EXPECT_NEAR(area, Pi / 4 * 40 * 40 * unit * unit, 0.16 * Pi * 40 * unit);
}

// Returns the numbers of covered columns and rows.
SimTK::Vec2 calcExtent(const Image& image) {
    int left = image.getWidth(), right = -1, top = image.getHeight(), bottom = -1;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x)
            if (image.getPixel(x, y)[0] < 128) {
                left = std::min(left, x);
                right = std::max(right, x);
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
    return SimTK::Vec2(right - left + 1, bottom - top + 1);
}

TEST_F(DecorationShape, TextIsAsHighAsItsScaleAndHasALineForEachNewline) {
    const auto draw = [&](const std::string& text, const Vec3& scale, double& pixels) {
        OffscreenVisualizer viz = makeVisualizer();
        viz.addDecoration(ground, Transform(),
                          SimTK::DecorativeText(text).setScaleFactors(scale).setColor(Vec3(0)));
        const Image image = viz.drawFrame(scene.state);
        pixels = calcPixelsPerMeter(viz);
        return image;
    };
    double pixels;
    const SimTK::Vec2 one = calcExtent(draw("H", Vec3(0.4), pixels));
    EXPECT_NEAR(one[1], 0.4 * pixels, 2);
    const SimTK::Vec2 wide = calcExtent(draw("H", Vec3(0.8, 0.4, 1), pixels));
    EXPECT_NEAR(wide[0], 2 * one[0], 2);
    EXPECT_EQ(wide[1], one[1]);
    const Image two = draw("H\nH", Vec3(0.4), pixels);
    EXPECT_NEAR(calcExtent(two)[0], one[0], 1);
    EXPECT_GT(calcExtent(two)[1], 2 * one[1]);
    EXPECT_NEAR(calcCoveredArea(two, 0, 0), 2 * calcCoveredArea(draw("H", Vec3(0.4), pixels), 0, 0),
                4 * one[1]);
    // A two-byte letter counts as one letter; invalid UTF-8 is drawn in some form.
    EXPECT_GT(calcCoveredArea(draw("Ω", Vec3(0.4), pixels), 0, 0), 100);
    EXPECT_NO_THROW(draw("\xff\xc3", Vec3(0.4), pixels));
}

TEST_F(DecorationShape, TextThatDoesNotFaceTheCameraLiesInItsFrame) {
    // Edge-on it is invisible; text that faces the camera is visible anyway.
    for (const bool facesCamera : {false, true}) {
        OffscreenVisualizer viz = makeVisualizer();
        viz.addDecoration(ground, Transform(SimTK::Rotation(Pi / 2, SimTK::YAxis)),
                          SimTK::DecorativeText("HHH")
                              .setFaceCamera(facesCamera)
                              .setScale(0.3)
                              .setColor(Vec3(0)));
        const double area = calcCoveredArea(viz.drawFrame(scene.state), 0, 0);
        if (facesCamera) {
            EXPECT_GT(area, 500);
        } else {
            EXPECT_LT(area, 5);
        }
    }
}

TEST_F(DecorationShape, FrameHasThreeAxesOfItsLengthInTheirColors) {
    OffscreenVisualizer viz = makeVisualizer();
    viz.addDecoration(ground, Transform(SimTK::Rotation(0.7, SimTK::UnitVec3(1, 1, 0))),
                      SimTK::DecorativeFrame(0.6));
    const Image image = viz.drawFrame(scene.state);
    const SimTK::Rotation R(0.7, SimTK::UnitVec3(1, 1, 0));
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 pixel =
            viz.calcPixel(R * (0.57 * Vec3(SimTK::UnitVec3(SimTK::CoordinateAxis(axis)))));
        const Image::Pixel p = image.getPixel(int(pixel[0]), int(pixel[1]));
        for (int k = 0; k < 3; ++k)
            if (k != axis) {
                EXPECT_GT(p[std::size_t(axis)], p[std::size_t(k)] + 40) << axis;
            }
    }
}

// A force element with geometry at each stage, like springs and contacts.
class StagedGeometry : public SimTK::Force::Custom::Implementation {
public:
    void calcForce(const SimTK::State&, SimTK::Vector_<SimTK::SpatialVec>&, SimTK::Vector_<Vec3>&,
                   SimTK::Vector&) const override {}
    double calcPotentialEnergy(const SimTK::State&) const override { return 0; }
    void calcDecorativeGeometryAndAppend(
        const SimTK::State&, SimTK::Stage stage,
        SimTK::Array_<DecorativeGeometry>& geometry) const override {
        const double x = stage == SimTK::Stage::Position       ? -0.5
                         : stage == SimTK::Stage::Velocity     ? 0
                         : stage == SimTK::Stage::Acceleration ? 0.5
                                                               : SimTK::NaN;
        if (std::isfinite(x))
            geometry.push_back(
                SimTK::DecorativeBrick(Vec3(0.1)).setColor(Vec3(0)).setTransform(Vec3(x, 0, 0)));
    }
};

TEST(DecorationSources, ForcesAreDrawnAsFarAsTheStateIsRealized) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    SimTK::GeneralForceSubsystem forces(system);
    SimTK::Force::Custom force(forces, new StagedGeometry);
    const SimTK::State state = system.realizeTopology();
    OffscreenVisualizer viz(system, 480, 360);
    makePlain(viz, 5);
    const auto isDrawn = [&](const Image& image, double x) {
        const Vec3 pixel = viz.calcPixel(Vec3(x, 0, 0));
        return image.getPixel(int(pixel[0]), int(pixel[1]))[0] < 10;
    };
    const Image first = viz.drawFrame(state);
    EXPECT_EQ(state.getSystemStage(), SimTK::Stage::Position);
    EXPECT_TRUE(isDrawn(first, -0.5));
    EXPECT_FALSE(isDrawn(first, 0));
    EXPECT_FALSE(isDrawn(first, 0.5));
    system.realize(state, SimTK::Stage::Velocity);
    EXPECT_TRUE(isDrawn(viz.drawFrame(state), 0));
    EXPECT_FALSE(isDrawn(viz.drawFrame(state), 0.5));
    system.realize(state, SimTK::Stage::Acceleration);
    EXPECT_TRUE(isDrawn(viz.drawFrame(state), 0.5));
}

TEST(DecorationSources, SubsystemsGeneratorsAndDefaultGeometryAreDrawn) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    SimTK::DecorationSubsystem decorations(system);
    SimTK::Body::Rigid body(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
    SimTK::MobilizedBody::Pin pin(matter.Ground(), Transform(), body, Transform(Vec3(0, 1, 0)));
    decorations.addBodyFixedDecoration(pin, Transform(Vec3(0.5, 0, 0)),
                                       SimTK::DecorativeSphere(0.1).setColor(Vec3(0)));
    decorations.addRubberBandLine(ground, Vec3(-1, -1, 0), pin, Vec3(0),
                                  SimTK::DecorativeLine().setLineThickness(6).setColor(Vec3(0)));
    matter.setShowDefaultGeometry(false);
    SimTK::State state = system.realizeTopology();
    pin.setAngle(state, 0.4);
    OffscreenVisualizer viz(system, 480, 360);
    makePlain(viz, 5);
    const Image image = viz.drawFrame(state);
    const Vec3 p = pin.getBodyOriginLocation(state);
    for (const Vec3& station : {pin.findStationLocationInGround(state, Vec3(0.5, 0, 0)),
                                Vec3(0.5 * (Vec3(-1, -1, 0) + p))}) {
        const Vec3 pixel = viz.calcPixel(station);
        EXPECT_LT(image.getPixel(int(pixel[0]), int(pixel[1]))[0], 10);
    }
    matter.setShowDefaultGeometry(true);
    state = system.realizeTopology();
    pin.setAngle(state, 0.4);
    EXPECT_GT(countPixels(viz.drawFrame(state), {255, 255, 255, 255}),
              countPixels(image, {255, 255, 255, 255}) + 500);
}

}  // namespace
}  // namespace simflex
