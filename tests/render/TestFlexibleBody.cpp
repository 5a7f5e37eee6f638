#include <gtest/gtest.h>

#include "TestParts.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using SimTK::Transform;
using SimTK::Vec3;

TEST(FlexibleBodyPicture, ShowsEveryNodeWhereTheBodySaysItIs) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = test::makePointMassPart().body;
    FlexibleBody body(flexible, part, "link");
    SimTK::State state = system.realizeTopology();
    body.setFramePose(state, Transform(SimTK::Rotation(0.4, SimTK::ZAxis), Vec3(0.1, 0.2, 0)));
    SimTK::Vector xi(part->numModes, 0.0);
    xi[0] = 0.05;
    body.setModalCoordinates(state, xi);

    OffscreenVisualizer viz(system);
    viz.addFlexibleBody(body);
    viz.setBackgroundType(SimTK::Visualizer::SolidColor)
        .setShowUndeformed(false)
        .setShowSimTime(false)
        .setShowAxes(false)
        .setContour(OffscreenVisualizer::Contour::None);
    const Image image = viz.drawFrame(state);
    system.realize(state, SimTK::Stage::Position);

    // The silhouette touches the outermost nodes: leftmost and rightmost covered column.
    double left = SimTK::Infinity, right = 0;
    for (const int number : part->mesh.nodeNumbers) {
        const double x = viz.calcPixel(body.calcNodeLocation(state, number))[0];
        left = std::min(left, x);
        right = std::max(right, x);
    }
    int first = image.getWidth(), last = 0;
    for (int y = 160; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x)
            if (image.getPixel(x, y) != Image::Pixel{255, 255, 255, 255}) {
                first = std::min(first, x);
                last = std::max(last, x);
            }
    EXPECT_NEAR(first, left, 1.5);
    EXPECT_NEAR(last + 1, right, 1.5);
}

TEST(FlexibleBodyPicture, HiddenAndColouredOnesCountForNoRange) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = test::makePointMassPart().body;
    FlexibleBody bent(flexible, part, "bent"), less(flexible, part, "less");
    SimTK::State state = system.realizeTopology();
    SimTK::Vector xi(part->numModes, 0.0);
    xi[0] = 0.05;
    bent.setModalCoordinates(state, xi);
    less.setModalCoordinates(state, 0.2 * xi);

    OffscreenVisualizer viz(system, 64, 36);
    EXPECT_THROW(viz.setBodyLook(bent, BodyLook()), std::invalid_argument);
    viz.addFlexibleBody(bent).addFlexibleBody(less).setShowColorBar(false);
    const auto calcLargest = [&] {
        viz.fitToMotion(std::vector<SimTK::State>{state});
        viz.drawFrame(state);
        return double(viz.getContourRange()[1]);
    };
    const double both = calcLargest();
    BodyLook look;
    look.isVisible = false;
    viz.setBodyLook(bent, look);
    const double without = calcLargest();
    EXPECT_NEAR(without, 0.2 * both, 1e-6 * both);
    look.isVisible = true;
    look.hasContour = false;
    viz.setBodyLook(bent, look);
    EXPECT_EQ(calcLargest(), without);
    viz.setBodyLook(bent, BodyLook());
    EXPECT_EQ(calcLargest(), both);
    look.opacity = 0;
    EXPECT_THROW(viz.setBodyLook(less, look), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
