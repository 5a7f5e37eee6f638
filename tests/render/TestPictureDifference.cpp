#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "PictureDifference.h"
#include "TestParts.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;

// A scene with shades, edges and text, and the changes made by a test.
struct Change {
    Vec3 color{0.8, 0.25, 0.2};
    double shift = 0;  // [m]; a pixel is 7 mm at the brick's front
    std::string title = "A title";
    bool hasText = true;
};

Image draw(const Change& change) {
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 480, 270);
    viz.setCameraTransform(Transform(Vec3(0, 0.3, 4))).setWindowTitle(change.title);
    viz.setGroundHeight(-0.5);
    viz.addDecoration(SimTK::MobilizedBodyIndex(0),
                      Transform(SimTK::Rotation(0.3, SimTK::YAxis), Vec3(change.shift, 0, 0)),
                      SimTK::DecorativeBrick(Vec3(0.4, 0.3, 0.3)).setColor(change.color));
    viz.addDecoration(SimTK::MobilizedBodyIndex(0), Vec3(-0.9, 0, 0),
                      SimTK::DecorativeSphere(0.3).setColor(Vec3(0.2, 0.5, 0.7)));
    if (change.hasText)
        viz.addDecoration(SimTK::MobilizedBodyIndex(0), Vec3(0.7, 0.5, 0),
                          SimTK::DecorativeText("label").setScale(0.1).setColor(Vec3(0.1)));
    return viz.drawFrame(scene.state);
}

// Changes each channel by a random level up or down, like driver round-off.
Image addRoundOff(Image image, int levels) {
    std::mt19937 random(1);
    for (std::size_t i = 0; i < image.getNumBytes(); ++i) {
        if (i % 4 == 3) continue;
        const int step = int(random() % unsigned(2 * levels + 1)) - levels;
        image.updData()[i] = std::uint8_t(std::clamp(image.updData()[i] + step, 0, 255));
    }
    return image;
}

TEST(PictureDifference, OfEqualPicturesIsNothing) {
    const Image image = draw({});
    const PictureDifference difference = comparePictures(image, image);
    EXPECT_EQ(difference.largest, 0);
    EXPECT_EQ(difference.fraction, 0);
    EXPECT_TRUE(difference.isNegligible());
}

// ΔE of plain colours, from the definition of CIELAB: white and black are 100 apart; sRGB red,
// green and blue have the tabulated coordinates.
TEST(PictureDifference, OfPlainColorsIsTheirDistanceInCielab) {
    const auto calcDistance = [](const Image::Pixel& a, const Image::Pixel& b) {
        return comparePictures(Image(9, 9, a), Image(9, 9, b)).map[40];
    };
    const Image::Pixel white = {255, 255, 255, 255}, black = {0, 0, 0, 255};
    const Image::Pixel red = {255, 0, 0, 255}, green = {0, 255, 0, 255}, blue = {0, 0, 255, 255};
    EXPECT_NEAR(calcDistance(white, black), 100, 0.1);
    const Vec3 labRed(53.24, 80.09, 67.20), labGreen(87.73, -86.18, 83.18),
        labBlue(32.30, 79.19, -107.86);
    EXPECT_NEAR(calcDistance(red, green), (labRed - labGreen).norm(), 0.1);
    EXPECT_NEAR(calcDistance(red, blue), (labRed - labBlue).norm(), 0.1);
    EXPECT_NEAR(calcDistance(white, red), (Vec3(100, 0, 0) - labRed).norm(), 0.1);
    // Transparent counts as white.
    EXPECT_NEAR(calcDistance(white, {0, 0, 0, 0}), 0, 1e-3);
}

TEST(PictureDifference, RoundOffAndOtherSamplesOfEdgesAreNegligible) {
    const Image image = draw({});
    EXPECT_TRUE(comparePictures(image, addRoundOff(image, 2)).isNegligible());
    // A quarter of a pixel changes the sampling of edges.
    Change little;
    little.shift = 0.25 * 0.007;
    EXPECT_TRUE(comparePictures(image, draw(little)).isNegligible());
}

TEST(PictureDifference, WrongColorIsFound) {
    Change change;
    change.color = Vec3(0.8, 0.35, 0.2);
    EXPECT_FALSE(comparePictures(draw({}), draw(change)).isNegligible());
}

TEST(PictureDifference, MissingAndOtherWritingIsFound) {
    Change noTitle, otherTitle, noText;
    noTitle.title = "";
    otherTitle.title = "A titlf";
    noText.hasText = false;
    const Image image = draw({});
    for (const Change& change : {noTitle, otherTitle, noText})
        EXPECT_FALSE(comparePictures(image, draw(change)).isNegligible());
}

TEST(PictureDifference, EdgeShiftedByTwoPixelsIsFound) {
    Change change;
    change.shift = 2 * 0.007;
    EXPECT_FALSE(comparePictures(draw({}), draw(change)).isNegligible());
}

TEST(PictureDifference, SmallSpotIsFound) {
    Image image = draw({}), spotted = image;
    for (int y = 40; y < 44; ++y)
        for (int x = 300; x < 304; ++x) spotted.setPixel(x, y, {40, 40, 40, 255});
    EXPECT_FALSE(comparePictures(image, spotted).isNegligible());
}

TEST(PictureDifference, OtherSizesAreRefused) {
    EXPECT_THROW(comparePictures(Image(2, 3), Image(3, 2)), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
