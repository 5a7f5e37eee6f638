#include "simflex/render/SideBySide.h"

#include <gtest/gtest.h>

#include "simflex/render/ContactSheet.h"

namespace simflex {
namespace {

const Image::Pixel red{255, 0, 0, 255}, blue{0, 0, 255, 255}, black{0, 0, 0, 255},
    white{255, 255, 255, 255};

TEST(SideBySide, PicturesStandBesideEachOtherWithAGap) {
    SideBySideStyle style;
    style.gap = 6;
    style.background = black;
    const Image image = makeSideBySide(Image(40, 30, red), Image(40, 30, blue), {}, style);
    ASSERT_EQ(image.getWidth(), 86);
    ASSERT_EQ(image.getHeight(), 30);
    for (int x = 0; x < 86; ++x)
        EXPECT_EQ(image.getPixel(x, 15), x < 40 ? red : x < 46 ? black : blue) << x;
}

TEST(SideBySide, OrBelowEachOther) {
    SideBySideStyle style;
    style.arrangement = SideBySideStyle::Arrangement::TopBottom;
    style.gap = 2;
    const Image image = makeSideBySide(Image(40, 30, red), Image(20, 30, blue), {}, style);
    ASSERT_EQ(image.getWidth(), 40);
    ASSERT_EQ(image.getHeight(), 62);
    EXPECT_EQ(image.getPixel(20, 29), red);
    EXPECT_EQ(image.getPixel(20, 30), white);
    EXPECT_EQ(image.getPixel(9, 40), white);
    EXPECT_EQ(image.getPixel(10, 40), blue);
    EXPECT_EQ(image.getPixel(29, 40), blue);
    EXPECT_EQ(image.getPixel(30, 40), white);
}

TEST(SideBySide, CaptionsStandAboveTheMiddleOfTheirPictures) {
    const Image image =
        makeSideBySide(Image(400, 300, red), Image(400, 300, red), {"", "flexible"});
    const int strip = image.getHeight() - 300;
    EXPECT_GT(strip, 12);
    double ink = 0, column = 0;
    for (int y = 0; y < strip; ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const double darkness = 255 - image.getPixel(x, y)[1];
            ink += darkness;
            column += darkness * (x + 0.5);
        }
    EXPECT_GT(ink, 255 * 50);
    EXPECT_NEAR(column / ink, 404 + 200, 4);  // letters differ
    EXPECT_EQ(image.getPixel(10, strip), red);
}

TEST(SideBySide, WrongInputIsRefused) {
    const Image a(10, 10), b(10, 11);
    EXPECT_THROW(makeSideBySide(a, Image()), std::invalid_argument);
    SideBySideStyle style;
    style.gap = -1;
    EXPECT_THROW(makeSideBySide(a, b, {}, style), std::invalid_argument);
    EXPECT_THROW(makeBlend(a, b), std::invalid_argument);
    EXPECT_THROW(makeBlend(a, a, 1.5), std::invalid_argument);
    EXPECT_THROW(makeDifference(a, b), std::invalid_argument);
}

TEST(SideBySide, BlendIsTheWeightedMean) {
    const Image image =
        makeBlend(Image(3, 3, {0, 100, 200, 255}), Image(3, 3, {100, 0, 200, 255}), 0.25);
    EXPECT_EQ(image.getPixel(1, 1), (Image::Pixel{25, 75, 200, 255}));
}

TEST(SideBySide, DifferenceIsRedWherePicturesDiffer) {
    Image other(20, 20, white);
    other.setPixel(5, 6, black);
    const Image image = makeDifference(Image(20, 20, white), other);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 20; ++x) {
            const Image::Pixel p = image.getPixel(x, y);
            EXPECT_EQ(p[0] > p[1] + 100, x == 5 && y == 6) << x << " " << y;
        }
}

TEST(ContactSheet, TakesTheColoursOfItsStyle) {
    ContactSheetStyle style = ContactSheetStyle::dark();
    style.cellWidth = 200;
    const Image sheet = makeContactSheet({Image(200, 100, red)}, {"mode 1"}, 1, style);
    EXPECT_EQ(sheet.getPixel(0, 0), style.background);
    int light = 0;
    for (int y = 106; y < sheet.getHeight(); ++y)
        for (int x = 0; x < sheet.getWidth(); ++x) light += sheet.getPixel(x, y)[0] > 200;
    EXPECT_GT(light, 40);
}

}  // namespace
}  // namespace simflex
