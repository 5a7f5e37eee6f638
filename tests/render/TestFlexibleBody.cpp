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

    // The silhouette touches the outermost nodes: leftmost and rightmost column in use.
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

}  // namespace
}  // namespace simflex
