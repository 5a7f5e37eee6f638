#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "TestParts.h"
#include "simflex/render/FrameReporter.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Pi;
using SimTK::Transform;
using SimTK::Vec3;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

const Vec3 black(0);
const SimTK::MobilizedBodyIndex ground(0);

double calcFocalLength(const OffscreenVisualizer& viz, double fieldOfView) {
    return 0.5 * viz.getHeight() / std::tan(fieldOfView / 2);  // [pixel]
}

struct Pendulum {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity{forces, matter, -SimTK::YAxis, 9.81};
    SimTK::MobilizedBody::Pin pin;

    Pendulum() {
        matter.setShowDefaultGeometry(false);
        SimTK::Body::Rigid bob(SimTK::MassProperties(1, Vec3(0), SimTK::UnitInertia(1)));
        bob.addDecoration(Transform(), SimTK::DecorativeSphere(0.1).setColor(Vec3(0.8, 0.2, 0.1)));
        bob.addDecoration(Transform(Vec3(0, 0.5, 0)), SimTK::DecorativeCylinder(0.02, 0.5));
        pin =
            SimTK::MobilizedBody::Pin(matter.Ground(), Transform(), bob, Transform(Vec3(0, 1, 0)));
    }
};

TEST(Frame, SphereCoversTheAreaOfItsProjection) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 5);
    const double fov = 30 * Pi / 180, r = 0.6;
    viz.setCameraFieldOfView(fov);
    viz.addDecoration(ground, Transform(), SimTK::DecorativeSphere(r).setColor(black));
    const double area = calcCoveredArea(viz.drawFrame(scene.state), 0, 0);
    const double R = calcFocalLength(viz, fov) * r / std::sqrt(25 - r * r);
    // Facets lie up to a tenth of a pixel inside the circle; sampling errors are random.
    const double circumference = 2 * Pi * R;
    EXPECT_NEAR(area, Pi * R * R, 0.1 * circumference + std::sqrt(circumference));
}

TEST(Frame, BrickCoversTheAreaOfItsFrontFace) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 4);
    const double fov = 40 * Pi / 180;
    viz.setCameraFieldOfView(fov);
    viz.addDecoration(ground, Transform(),
                      SimTK::DecorativeBrick(Vec3(0.7, 0.4, 0.5)).setColor(black));
    const double area = calcCoveredArea(viz.drawFrame(scene.state), 0, 0);
    const double scale = calcFocalLength(viz, fov) / (4 - 0.5);
    const double width = 1.4 * scale, height = 0.8 * scale;
    // With four samples per pixel, a straight edge is accurate to an eighth of a pixel.
    EXPECT_NEAR(area, width * height, 0.125 * 2 * (width + height));
}

TEST(Frame, EdgesAreAntiAliased) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 4);
    viz.addDecoration(ground, Transform(SimTK::Rotation(0.1, SimTK::ZAxis)),
                      SimTK::DecorativeBrick(Vec3(0.5)).setColor(black));
    const Image image = viz.drawFrame(scene.state);
    int numBetween = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const int value = image.getPixel(x, y)[0];
            numBetween += value > 20 && value < 235;
        }
    EXPECT_GT(numBetween, 500);
}

TEST(Frame, NearerBodyHidesFartherOne) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 5);
    viz.addDecoration(ground, Transform(Vec3(0, 0, 1)),
                      SimTK::DecorativeBrick(Vec3(0.2)).setColor(Vec3(1, 0, 0)));
    viz.addDecoration(ground, Transform(Vec3(0, 0, -1)),
                      SimTK::DecorativeBrick(Vec3(0.6)).setColor(Vec3(0, 0, 1)));
    const Image image = viz.drawFrame(scene.state);
    EXPECT_EQ(image.getPixel(640, 360), (Image::Pixel{255, 0, 0, 255}));
    const Vec3 beside = viz.calcPixel(Vec3(0.5, 0, -0.4));
    EXPECT_EQ(image.getPixel(int(beside[0]), int(beside[1])), (Image::Pixel{0, 0, 255, 255}));
}

TEST(Frame, TransparentBodyShowsWhatIsBehindIt) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 5);
    viz.addDecoration(ground, Transform(Vec3(0, 0, 1)),
                      SimTK::DecorativeCircle(0.4).setColor(Vec3(1, 0, 0)).setOpacity(0.5));
    viz.addDecoration(ground, Transform(Vec3(0, 0, -1)),
                      SimTK::DecorativeBrick(Vec3(0.2)).setColor(Vec3(0, 0, 1)));
    const Image image = viz.drawFrame(scene.state);
    const Image::Pixel middle = image.getPixel(640, 360);
    EXPECT_NEAR(middle[0], 128, 2);
    EXPECT_NEAR(middle[1], 0, 2);
    EXPECT_NEAR(middle[2], 128, 2);
    const Vec3 beside = viz.calcPixel(Vec3(0.35, 0, 1));
    EXPECT_NEAR(image.getPixel(int(beside[0]), int(beside[1]))[1], 128, 2);
}

TEST(Frame, SameStatesGiveTheSameBytes) {
    Pendulum pendulum;
    SimTK::State state = pendulum.system.realizeTopology();
    std::vector<Image> images;
    for (int run = 0; run < 2; ++run) {
        OffscreenVisualizer viz(pendulum.system);
        viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1, 0.1, 0.1), 20, 3, 3),
                                        SimTK::Vector(Vec3(0, 0.01, 0.02))));
        for (const double angle : {0.2, 0.4, 0.2}) {
            pendulum.pin.setAngle(state, angle);
            images.push_back(viz.drawFrame(state));
        }
    }
    EXPECT_TRUE(images[0] == images[2]);
    EXPECT_TRUE(images[0] == images[3]);
    EXPECT_TRUE(images[1] == images[4]);
    EXPECT_FALSE(images[0] == images[1]);
}

TEST(Frame, DefaultPictureIsNotBlankAndHoldsTheWholeScene) {
    Pendulum pendulum;
    const SimTK::State state = pendulum.system.realizeTopology();
    OffscreenVisualizer viz(pendulum.system);
    const Image image = viz.drawFrame(state);
    EXPECT_GT(countPixels(image, image.getPixel(0, 0)), 10000);
    for (const Vec3& p : {Vec3(0.02, 0, 0), Vec3(0, -1.1, 0), Vec3(0.1, -1, 0)}) {
        const Vec3 pixel = viz.calcPixel(p);
        EXPECT_GT(pixel[0], 0);
        EXPECT_LT(pixel[0], 1280);
        EXPECT_GT(pixel[1], 0);
        EXPECT_LT(pixel[1], 720);
    }
}

// 51 by 51 small boxes that move with time.
class Swarm : public SimTK::DecorationGenerator {
public:
    static Vec3 getPlace(const SimTK::State& state, int i, int j) {
        return state.getTime() * Vec3(5, 4, 3) + Vec3(0.08 * i - 2, 0.06 * j - 1.5, 0);
    }
    void generateDecorations(const SimTK::State& state,
                             SimTK::Array_<SimTK::DecorativeGeometry>& geometry) override {
        for (int i = 0; i <= 50; ++i)
            for (int j = 0; j <= 50; ++j)
                geometry.push_back(
                    SimTK::DecorativeBrick(Vec3(0.01)).setTransform(getPlace(state, i, j)));
    }
};

// For very many points that leave the first picture, the corners of their bounding box are kept.
TEST(Frame, AllOfASwarmThatLeavesThePictureIsSeenAgain) {
    for (int azimuth = 0; azimuth < 4; ++azimuth) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 320, 180);
        viz.setCamera(CameraView().setDirection(azimuth * Pi / 2 + 0.4, 0.6));
        viz.addDecorationGenerator(new Swarm);
        viz.drawFrame(scene.state);
        scene.state.setTime(1);
        viz.drawFrame(scene.state);
        for (const int i : {0, 50})
            for (const int j : {0, 50}) {
                const Vec3 pixel = viz.calcPixel(Swarm::getPlace(scene.state, i, j));
                EXPECT_TRUE(pixel[0] > 0 && pixel[0] < 320 && pixel[1] > 0 && pixel[1] < 180)
                    << azimuth << " " << i << " " << j << " " << pixel;
            }
    }
}

// Perceived brightness depends on the colour: 30 % red, 59 % green, 11 % blue.
TEST(Frame, WritingIsLightOnDarkColoursAndDarkOnLightOnes) {
    const std::pair<Vec3, bool> colors[] = {{Vec3(0), true},          {Vec3(1, 0, 0), true},
                                            {Vec3(0, 0.7, 0), true},  {Vec3(0, 0.8, 0), false},
                                            {Vec3(0, 0, 1), true},    {Vec3(0.9, 0, 1), true},
                                            {Vec3(1, 0.4, 0), false}, {Vec3(0, 0.6, 1), false}};
    for (const auto& [color, isDark] : colors) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system);
        viz.setBackgroundType(SimTK::Visualizer::SolidColor)
            .setBackgroundColor(color)
            .setShowAxes(false)
            .setShowSimTime(true);
        const Image image = viz.drawFrame(scene.state);
        int numLight = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x) {
                const Image::Pixel pixel = image.getPixel(x, y);
                numLight += std::min({pixel[0], pixel[1], pixel[2]}) > 150;
            }
        EXPECT_EQ(numLight > 100, isDark) << color;
    }
}

TEST(Frame, NothingLeavesThePictureOfAFittedMotion) {
    Pendulum pendulum;
    const SimTK::State state = pendulum.system.realizeTopology();
    std::vector<SimTK::State> states;
    for (int i = 0; i <= 12; ++i) {
        states.push_back(state);
        pendulum.pin.setAngle(states.back(), 2 * Pi * i / 12);
    }
    for (const double orbit : {0.0, 1.0}) {
        OffscreenVisualizer viz(pendulum.system, 320, 180);
        viz.setCameraOrbit(orbit).fitToMotion(states);
        for (SimTK::State& s : states) {
            s.setTime(0.5 * s.getQ()[0]);
            viz.drawFrame(s);
            pendulum.system.realize(s, SimTK::Stage::Position);
            for (const Vec3& p : {Vec3(0), Vec3(0.1, 0, 0), Vec3(0, -0.1, 0), Vec3(0, 1, 0)}) {
                const Vec3 pixel = viz.calcPixel(pendulum.pin.getBodyTransform(s) * p);
                EXPECT_TRUE(pixel[0] > 0 && pixel[0] < 320 && pixel[1] > 0 && pixel[1] < 180)
                    << pixel;
            }
        }
    }
}

TEST(Frame, EmptySceneGivesAPicture) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 321, 123);
    const Image image = viz.drawFrame(scene.state);
    EXPECT_EQ(image.getWidth(), 321);
    EXPECT_EQ(image.getHeight(), 123);
}

TEST(Frame, HugeAndTinyScenesLookAlike) {
    std::vector<double> areas;
    for (const double scale : {1e-6, 1.0, 1e6}) {
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 320, 180);
        viz.setLighting(OffscreenVisualizer::Lighting::Flat)
            .setShowAxes(false)
            .setShowSimTime(false);
        viz.setBackgroundType(SimTK::Visualizer::SolidColor);
        viz.addDecoration(ground, Transform(),
                          SimTK::DecorativeBrick(scale * Vec3(1, 0.5, 0.7)).setColor(black));
        areas.push_back(calcCoveredArea(viz.drawFrame(scene.state), 0, 0));
    }
    EXPECT_GT(areas[1], 2000);
    EXPECT_NEAR(areas[0] / areas[1], 1, 2e-3);
    EXPECT_NEAR(areas[2] / areas[1], 1, 2e-3);
}

TEST(Frame, WritingOnThePictureAppears) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz);
    const Image without = viz.drawFrame(scene.state);
    EXPECT_EQ(countPixels(without, {255, 255, 255, 255}), 0);
    viz.setShowSimTime(true);
    const Image withTime = viz.drawFrame(scene.state);
    EXPECT_GT(countPixels(withTime, {255, 255, 255, 255}), 200);
    viz.setWindowTitle("A title");
    EXPECT_GT(countPixels(viz.drawFrame(scene.state), {255, 255, 255, 255}),
              countPixels(withTime, {255, 255, 255, 255}) + 200);
}

TEST(Frame, ShadowFallsOnTheGround) {
    EmptyScene scene;
    int numDifferent[2];
    for (const bool hasShadow : {false, true}) {
        OffscreenVisualizer viz(scene.system);
        viz.setShowShadows(hasShadow).setGroundHeight(-1);
        viz.addDecoration(ground, Transform(), SimTK::DecorativeSphere(0.5));
        const Image image = viz.drawFrame(scene.state);
        int dark = 0;
        for (int y = 360; y < 720; ++y)
            for (int x = 0; x < 1280; ++x) {
                const Image::Pixel p = image.getPixel(x, y);
                dark += p[0] > 100 && p[0] < 160 && std::abs(p[0] - p[2]) < 25;
            }
        numDifferent[hasShadow] = dark;
    }
    EXPECT_GT(numDifferent[1], numDifferent[0] + 1000);
}

TEST(Reporter, RealizesAccelerationsAsThatOfSimbodyDoes) {
    struct StageKeeper : SimTK::DecorationGenerator {
        explicit StageKeeper(SimTK::Stage& keptStage) : stage(keptStage) {}
        void generateDecorations(const SimTK::State& state,
                                 SimTK::Array_<SimTK::DecorativeGeometry>&) override {
            stage = state.getSystemStage();
        }
        SimTK::Stage& stage;
    };
    Pendulum pendulum;
    OffscreenVisualizer viz(pendulum.system, 160, 90);
    SimTK::Stage stage = SimTK::Stage::Empty;
    viz.setOutputFolder("").setNumThreads(0).addDecorationGenerator(new StageKeeper(stage));
    FrameReporter reporter(viz, 0.1);
    const SimTK::State state = pendulum.system.realizeTopology();
    reporter.handleEvent(state);
    EXPECT_EQ(stage, SimTK::Stage(SimTK::Stage::Acceleration));
    SimTK::State other = state;
    other.invalidateAll(SimTK::Stage::Time);
    reporter.setStage(SimTK::Stage::Velocity).handleEvent(other);
    EXPECT_EQ(stage, SimTK::Stage(SimTK::Stage::Velocity));
}

TEST(Reporter, WritesNumberedFramesAndRemovesOldOnes) {
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("frames");
    std::ofstream(folder + "/frame_00099.png") << "of an earlier run";
    std::ofstream(folder + "/notes.txt") << "kept";

    Pendulum pendulum;
    OffscreenVisualizer viz(pendulum.system, 160, 90);
    viz.setOutputFolder(folder);
    pendulum.system.addEventReporter(new FrameReporter(viz, 0.1));
    SimTK::State state = pendulum.system.realizeTopology();
    pendulum.pin.setAngle(state, 1);
    SimTK::RungeKuttaMersonIntegrator integrator(pendulum.system);
    SimTK::TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.35);

    EXPECT_EQ(viz.getNumFrames(), 4);
    for (int i = 0; i < 4; ++i) {
        const Image image = Image::readPng(folder + "/frame_0000" + std::to_string(i) + ".png");
        EXPECT_EQ(image.getWidth(), 160);
    }
    EXPECT_FALSE(fs::exists(folder + "/frame_00099.png"));
    EXPECT_TRUE(fs::exists(folder + "/notes.txt"));
}

TEST(BadInput, UnwritableFolderIsNamed) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 64);
    viz.setOutputFolder("/proc/no/such/folder");
    EXPECT_THAT([&] { viz.report(scene.state); },
                ThrowsMessage<std::runtime_error>(HasSubstr("/proc/no/such/folder")));
}

TEST(BadInput, PoseThatIsNotFiniteNamesTheBodyAndTheTime) {
    Pendulum pendulum;
    SimTK::State state = pendulum.system.realizeTopology();
    state.setTime(0.25);
    state.updQ()[0] = SimTK::NaN;
    OffscreenVisualizer viz(pendulum.system, 64, 64);
    EXPECT_THAT([&] { viz.drawFrame(state); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("mobilized body 1"), HasSubstr("0.25 s"))));
}

TEST(BadInput, ModalCoordinateThatIsNotFiniteNamesThePart) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 64);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(1), 2, 2, 2), SimTK::Vector(Vec3(0, SimTK::NaN, 0))));
    EXPECT_THAT([&] { viz.drawFrame(scene.state); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("'brick'"), HasSubstr("modal coordinate 1"))));
}

TEST(BadInput, UnknownMeshFileIsNamed) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 64);
    viz.addDecoration(ground, Transform(), SimTK::DecorativeMeshFile("no/such/mesh.obj"));
    EXPECT_THAT([&] { viz.drawFrame(scene.state); },
                ThrowsMessage<std::runtime_error>(HasSubstr("no/such/mesh.obj")));
}

TEST(BadInput, WrongSizesAndMissingFunctionsAreRefused) {
    EmptyScene scene;
    EXPECT_THROW(OffscreenVisualizer(scene.system, 0, 10), std::invalid_argument);
    OffscreenVisualizer viz(scene.system, 64, 64);
    EXPECT_THROW(viz.addDeformableMesh({}), std::invalid_argument);
    EXPECT_THROW(viz.setDeformationFactor(-1), std::invalid_argument);
    EXPECT_THROW(viz.setContourRange(2, 1), std::invalid_argument);
    viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1), 2, 2, 2), SimTK::Vector(5, 0.0)));
    EXPECT_THAT(
        [&] { viz.drawFrame(scene.state); },
        ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("3 modes"), HasSubstr("size 5"))));
}

TEST(BadInput, MissingContextSaysWhatIsMissing) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 64);
    setenv("SIMFLEX_GL", "none", 1);
    EXPECT_THAT(
        [&] { viz.drawFrame(scene.state); },
        ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("OpenGL context"), HasSubstr("osmesa"))));
    unsetenv("SIMFLEX_GL");
    EXPECT_NO_THROW(viz.drawFrame(scene.state));
}

TEST(Frames, LongTitlesEndInThePicture) {
    test::EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 640, 720);
    test::makePlain(viz);
    const Image empty = viz.drawFrame(scene.state);
    const auto findEnd = [&](const std::string& title) {
        const Image image = viz.setWindowTitle(title).drawFrame(scene.state);
        int end = 0;
        for (int y = 0; y < image.getHeight(); ++y)
            for (int x = 0; x < image.getWidth(); ++x)
                if (image.getPixel(x, y) != empty.getPixel(x, y)) end = std::max(end, x);
        return end;
    };
    const int shortEnd = findEnd("Crank");
    EXPECT_GT(shortEnd, 60);
    EXPECT_LT(shortEnd, 200);
    const std::string fits = "A slider-crank with a flexible connecting rod";
    EXPECT_GT(findEnd(fits), 500);
    EXPECT_LT(findEnd(fits), 622);
    // Also for a title that does not fit even in small letters.
    EXPECT_GT(findEnd(fits + ", run up in 0.05 s, über alles"), 500);
    EXPECT_LT(findEnd(fits + ", run up in 0.05 s, über alles"), 622);
}

}  // namespace
}  // namespace simflex
