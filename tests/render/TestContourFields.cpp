#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "StressedParts.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/StressRecovery.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Array_;
using SimTK::SymMat33;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;
using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Work>
std::string errorOf(const Work& work) {
    try {
        work();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "accepted";
}

double calcEnergyDensity(const SymMat33& stress, const SymMat33& strain) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            sum += 0.5 * SimTK::Mat33(stress)(i, j) * SimTK::Mat33(strain)(i, j);
    return sum;
}

// A link reduced from finite elements, in motion.
TEST(ContourFields, AreWhatTheBodyAndItsStressRecoverySay) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = std::make_shared<const ReducedBody>(
        readReducedBody(SIMFLEX_BINARY_DIR "/parts/link_stress.h5"));
    ASSERT_TRUE(part->modalStress);
    FlexibleBody body(flexible, part, "link");
    SimTK::State state = system.realizeTopology();
    body.setFramePose(
        state, Transform(SimTK::Rotation(0.7, SimTK::UnitVec3(1, 2, -1)), Vec3(0.1, 0.2, 0.3)));
    Vector xi(part->numModes), xiDot(part->numModes);
    for (int i = 0; i < xi.size(); ++i) {
        xi[i] = 1e-4 * std::sin(1 + i) / (1 + i);
        xiDot[i] = 0.1 * std::cos(2 + i) / (1 + i);
    }
    body.setModalCoordinates(state, xi);
    body.setModalSpeeds(state, xiDot);
    body.setFrameVelocity(state, SimTK::SpatialVec(Vec3(3, -2, 5), Vec3(0.1, 0.2, -0.3)));
    system.realize(state, SimTK::Stage::Velocity);

    StressRecovery withStress(body), all = StressRecovery::atAllNodes(body);
    Array_<SymMat33> stress, strain;
    withStress.calcStress(state, stress);
    withStress.calcStrain(state, strain);
    Array_<Vec3> principal, u, v;
    withStress.calcPrincipalStress(state, principal);
    all.calcDisplacement(state, u);
    all.calcVelocity(state, v);

    struct Case {
        Contour contour;
        bool isOfStress;
        std::function<double(unsigned)> value;
    };
    const auto component = [](const Array_<Vec3>& vectors, int axis) {
        return [&vectors, axis](unsigned k) { return vectors[k][axis]; };
    };
    const Case cases[] = {
        {Contour::Displacement, false, [&](unsigned k) { return u[k].norm(); }},
        {Contour::DisplacementX, false, component(u, 0)},
        {Contour::DisplacementY, false, component(u, 1)},
        {Contour::DisplacementZ, false, component(u, 2)},
        {Contour::Speed, false, [&](unsigned k) { return v[k].norm(); }},
        {Contour::VelocityX, false, component(v, 0)},
        {Contour::VelocityY, false, component(v, 1)},
        {Contour::VelocityZ, false, component(v, 2)},
        {Contour::StrainEnergyDensity, true,
         [&](unsigned k) { return calcEnergyDensity(stress[k], strain[k]); }},
        {Contour::VonMises, true, [&](unsigned k) { return calcVonMises(stress[k]); }},
        {Contour::SignedVonMises, true, [&](unsigned k) { return calcSignedVonMises(stress[k]); }},
        {Contour::LargestPrincipalStress, true, [&](unsigned k) { return principal[k][0]; }},
        {Contour::SmallestPrincipalStress, true, [&](unsigned k) { return principal[k][2]; }}};

    OffscreenVisualizer viz(system, 64, 36);
    viz.addFlexibleBody(body).setShowColorBar(false);
    for (const Case& c : cases) {
        viz.setContour(c.contour).drawFrame(state);
        StressRecovery& nodes = c.isOfStress ? withStress : all;
        double largest = 0;
        for (int k = 0; k < nodes.getNumNodes(); ++k)
            largest = std::max(largest, std::abs(c.value(unsigned(k))));
        int numCompared = 0;
        for (int k = 0; k < nodes.getNumNodes(); k += 11) {
            const double found = viz.findNode("link", nodes.getNodeNumber(k)).value;
            if (std::isnan(found)) continue;  // inside
            EXPECT_NEAR(found, c.value(unsigned(k)), 3e-6 * largest)
                << "contour " << int(c.contour);
            ++numCompared;
        }
        EXPECT_GT(numCompared, 100);
    }
}

TEST(ContourFields, OfStressNeedAPartThatHasIt) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 64, 36);
    DeformableMesh mesh = makeStill(makeBrickPart(Vec3(1, 1, 0.1), 2, 2, 1), Vector(Vec3(1e-3)));
    mesh.name = "boom";
    viz.addDeformableMesh(mesh);
    EXPECT_THAT(errorOf([&] { viz.setContour(Contour::VonMises); }),
                AllOf(HasSubstr("'boom'"), HasSubstr("'brick'"), HasSubstr("von Mises"),
                      HasSubstr("--stress")));
    viz.drawFrame(scene.state);  // displacement, as before
    EXPECT_NO_THROW(viz.findNode("boom", 1));
    EXPECT_THAT(errorOf([&] { viz.setContour(Contour::Speed); }),
                AllOf(HasSubstr("'boom'"), HasSubstr("getModalSpeeds")));

    OffscreenVisualizer other(scene.system, 64, 36);
    other.setContour(Contour::StrainEnergyDensity);
    EXPECT_THAT(errorOf([&] { other.addDeformableMesh(mesh); }), HasSubstr("--stress"));
}

// The colour of a node's pixel matches the value there, pixel by pixel; picking finds the drawn
// surface.
TEST(ContourFields, ColourOfAPixelIsThatOfTheValuePickedThere) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 5);
    viz.setShowUndeformed(false).setShowFeatureEdges(false).setDeformationFactor(20);
    const auto part = makeStressedBrick(Vec3(2, 1, 0.1), 8, 4, 1);
    viz.addDeformableMesh(
        makeStill(part, Vector(Vec3(2e-3, 1e-3, 4e-3)),
                  Transform(SimTK::Rotation(0.3, SimTK::YAxis), Vec3(0.1, 0, 0))));
    for (const Contour contour : {Contour::Displacement, Contour::DisplacementY, Contour::VonMises,
                                  Contour::SignedVonMises, Contour::LargestPrincipalStress,
                                  Contour::SmallestPrincipalStress, Contour::StrainEnergyDensity}) {
        viz.setContour(contour);
        const Image image = viz.drawFrame(scene.state);
        const SimTK::Vec2 range = viz.getContourRange();
        const bool isSigned = range[0] < 0;
        const ColorMap map = isSigned ? ColorMap::CoolWarm : ColorMap::Viridis;
        int numVisible = 0;
        for (int node = 0; node < part->mesh.numNodes(); ++node) {
            const NodeView view = viz.findNode("brick", part->mesh.nodeNumbers[std::size_t(node)]);
            EXPECT_EQ(view.color, calcColor(map, (view.value - range[0]) / (range[1] - range[0])));
            if (!view.isVisible) continue;
            const int x = int(view.pixel[0]), y = int(view.pixel[1]);
            // At an edge of the part the pixel is a mixture.
            bool isInside = true;
            for (const int dx : {-2, 2})
                for (const int dy : {-2, 2}) isInside &= bool(viz.pickNode(x + dx, y + dy));
            if (!isInside) continue;
            ++numVisible;
            const auto picked = viz.pickNode(x + 0.5, y + 0.5);
            ASSERT_TRUE(picked);
            EXPECT_EQ(picked->nodeNumber, part->mesh.nodeNumbers[std::size_t(node)]);
            EXPECT_EQ(picked->nodeValue, view.value);
            const Vec3 expected =
                255 * calcColor(map, (picked->value - range[0]) / (range[1] - range[0]));
            const Image::Pixel found = image.getPixel(x, y);
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(found[k], expected[int(k)], 1.5) << "contour " << int(contour);
        }
        EXPECT_GT(numVisible, 15) << int(contour);
    }
}

TEST(ContourFields, WhereThereIsNoStressTheSurfaceIsGreyAndTheBarSaysSo) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 5);
    viz.setShowUndeformed(false).setShowFeatureEdges(false).setDeformationFactor(0);
    viz.setContour(Contour::VonMises);
    viz.addDeformableMesh(
        makeStill(makeStressedBrick(Vec3(2, 1, 0.1), 8, 4, 1, 0.01), Vector(Vec3(1e-3, 0, 0))));
    const Image image = viz.drawFrame(scene.state);
    const auto pixelAt = [&](double x) {
        const Vec3 pixel = viz.calcPixel(Vec3(x, 0.1, 0.05));
        return image.getPixel(int(pixel[0]), int(pixel[1]));
    };
    const Image::Pixel grey{158, 158, 158, 255};
    EXPECT_EQ(pixelAt(0.3), grey);
    EXPECT_EQ(pixelAt(0.9), grey);
    EXPECT_EQ(pixelAt(0.1), grey);  // up to the last node that has stress
    EXPECT_NE(pixelAt(-0.1), grey);
    EXPECT_NE(pixelAt(-0.9), grey);
    const auto isGapInBar = [&](const Image& picture) {
        int count = 0;
        for (int y = 530; y < 600; ++y)
            for (int x = 1140; x < 1200; ++x) count += picture.getPixel(x, y) == grey;
        return count > 100;
    };
    EXPECT_TRUE(isGapInBar(image));
    viz.setContour(Contour::Displacement);
    EXPECT_FALSE(isGapInBar(viz.drawFrame(scene.state)));

    const Vec3 p(0.3, 0.1, 0.05);
    viz.setContour(Contour::VonMises).drawFrame(scene.state);
    const auto picked = viz.pickNode(viz.calcPixel(p)[0], viz.calcPixel(p)[1]);
    ASSERT_TRUE(picked);
    EXPECT_TRUE(std::isnan(picked->value));
}

TEST(ContourRanges, AreEvenAboutZeroWhereValuesHaveASign) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 160, 90);
    viz.addDeformableMesh(
        {makeBrickPart(Vec3(2, 1, 0.1), 4, 2, 1), "brick",
         [](const SimTK::State&) { return Transform(); },
         [](const SimTK::State& s) { return Vector(Vec3(-s.getTime() * 1e-3, 0, 0)); }});
    std::vector<SimTK::State> states(4, scene.state);
    for (int i = 0; i < 4; ++i) states[std::size_t(i)].setTime(0.9 * i);
    viz.setContour(Contour::DisplacementY);  // -0.9, -1.8, -2.7 mm
    viz.setContourRange(ContourRange::PerFrame);
    viz.drawFrame(states[1]);
    EXPECT_NEAR(viz.getContourRange()[0], -0.9e-3, 1e-9);
    EXPECT_NEAR(viz.getContourRange()[1], 0.9e-3, 1e-9);
    viz.setContourRange(ContourRange::PerRun).fitToMotion(states);
    viz.drawFrame(states[0]);
    EXPECT_NEAR(viz.getContourRange()[0], -3e-3, 1e-12);
    EXPECT_NEAR(viz.getContourRange()[1], 3e-3, 1e-12);
    // Without a prior motion, the range grows with each frame.
    viz.setContour(Contour::Displacement);
    viz.drawFrame(states[1]);
    EXPECT_NEAR(viz.getContourRange()[1], 1e-3, 1e-12);
    viz.drawFrame(states[3]);
    EXPECT_NEAR(viz.getContourRange()[1], 3e-3, 1e-12);
    viz.drawFrame(states[1]);
    EXPECT_NEAR(viz.getContourRange()[1], 3e-3, 1e-12);
    EXPECT_EQ(viz.getContourRange()[0], 0);
}

TEST(ContourRanges, ValuesBeyondThemGiveTheBarATip) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system);
    makePlain(viz, 12);
    viz.setShowUndeformed(false).setShowDeformationFactor(false);
    viz.addDeformableMesh(
        makeStill(makeBrickPart(Vec3(2, 1, 0.1), 4, 2, 1), Vector(Vec3(0, 1e-3, 0))));
    viz.setContour(Contour::DisplacementX);  // -1 to 1 mm
    const int x = 1280 - 118 + 8, above = int(0.27 * 720) - 5, below = int(0.73 * 720) + 7;
    const Image::Pixel white{255, 255, 255, 255};
    const auto hasTips = [&](double low, double high) {
        const Image image = viz.setContourRange(low, high).drawFrame(scene.state);
        return std::make_pair(image.getPixel(x, below) != white, image.getPixel(x, above) != white);
    };
    EXPECT_EQ(hasTips(-2e-3, 2e-3), std::make_pair(false, false));
    EXPECT_EQ(hasTips(-0.5e-3, 2e-3), std::make_pair(true, false));
    EXPECT_EQ(hasTips(-2e-3, 0.9e-3), std::make_pair(false, true));
    EXPECT_EQ(hasTips(-1e-4, 1e-4), std::make_pair(true, true));
}

}  // namespace
}  // namespace simflex
