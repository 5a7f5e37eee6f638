#include "simflex/render/Image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "simflex/render/ColorMap.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/Video.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

Image makePattern(int width, int height, bool hasAlpha) {
    Image image(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.setPixel(x, y,
                           {std::uint8_t(7 * x), std::uint8_t(5 * y), std::uint8_t(x * y),
                            std::uint8_t(hasAlpha ? x + y : 255)});
    return image;
}

TEST(Image, PngRoundTripKeepsEveryByte) {
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("png");
    for (const bool hasAlpha : {false, true}) {
        const Image image = makePattern(37, 23, hasAlpha);
        image.writePng(folder + "/a.png");
        EXPECT_TRUE(Image::readPng(folder + "/a.png") == image);
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1)
        << "a partial file was left behind";
}

TEST(Image, UnwritableFolderGivesPathAndReason) {
    const Image image(4, 4);
    EXPECT_THAT([&] { image.writePng("/no/such/folder/a.png"); },
                ThrowsMessage<std::runtime_error>(::testing::AllOf(
                    HasSubstr("/no/such/folder/a.png"), HasSubstr("No such file"))));
}

TEST(Image, FailedWriteLeavesNoPartialFile) {
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("full");
    const Image image(4, 4);
    fs::create_directory(folder + "/a.png");
    EXPECT_THROW(image.writePng(folder + "/a.png"), std::runtime_error);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST(Image, ReadingWhatIsNoPngSaysSo) {
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("bad");
    std::ofstream(folder + "/a.png") << "this is no picture at all";
    EXPECT_THAT([&] { Image::readPng(folder + "/a.png"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("a.png")));
    EXPECT_THAT([&] { Image::readPng(folder + "/none.png"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("none.png")));
}

TEST(Image, PixelOutsideIsNamed) {
    const Image image(4, 3);
    EXPECT_THAT([&] { image.getPixel(4, 0); },
                ThrowsMessage<std::out_of_range>(HasSubstr("(4, 0)")));
    EXPECT_THROW(Image(0, 5), std::invalid_argument);
}

TEST(Image, ResizingKeepsTheMean) {
    Image image(60, 40, {0, 0, 0, 255});
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 30; ++x) image.setPixel(x, y, {200, 100, 40, 255});
    const Image half = image.resized(7, 5);
    double mean = 0;
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 7; ++x) mean += half.getPixel(x, y)[0] / 35.0;
    EXPECT_NEAR(mean, 100, 0.5);
}

TEST(ContactSheet, PlacesPicturesRowByRow) {
    const Image red(40, 20, {255, 0, 0, 255}), green(40, 20, {0, 255, 0, 255}),
        blue(40, 20, {0, 0, 255, 255});
    const Image sheet = makeContactSheet(std::vector<Image>{red, green, blue}, 2, 20, 4);
    EXPECT_EQ(sheet.getWidth(), 2 * 20 + 3 * 4);
    EXPECT_EQ(sheet.getHeight(), 2 * 10 + 3 * 4);
    EXPECT_EQ(sheet.getPixel(5, 5), (Image::Pixel{255, 0, 0, 255}));
    EXPECT_EQ(sheet.getPixel(29, 5), (Image::Pixel{0, 255, 0, 255}));
    EXPECT_EQ(sheet.getPixel(5, 19), (Image::Pixel{0, 0, 255, 255}));
    EXPECT_EQ(sheet.getPixel(29, 19), (Image::Pixel{255, 255, 255, 255}));
    EXPECT_THROW(makeContactSheet(std::vector<Image>(), 2), std::invalid_argument);
}

TEST(ContactSheet, CaptionsStandUnderTheMiddleOfTheirPictures) {
    const Image red(400, 200, {255, 0, 0, 255}), green(400, 200, {0, 255, 0, 255});
    const Image sheet = makeContactSheet({red, green}, {"", "mode 7"}, 2, 400, 10);
    EXPECT_EQ(sheet.getWidth(), 2 * 400 + 3 * 10);
    EXPECT_GT(sheet.getHeight(), 200 + 2 * 10 + 17);
    EXPECT_EQ(sheet.getPixel(11, 11), (Image::Pixel{255, 0, 0, 255}));
    EXPECT_EQ(sheet.getPixel(421, 11), (Image::Pixel{0, 255, 0, 255}));
    double ink = 0, column = 0;
    for (int y = 10 + 200; y < sheet.getHeight(); ++y)
        for (int x = 0; x < sheet.getWidth(); ++x) {
            const double darkness = 255 - sheet.getPixel(x, y)[0];
            EXPECT_TRUE(darkness == 0 || x >= 420) << x << " " << y;
            ink += darkness;
            column += darkness * (x + 0.5);
        }
    EXPECT_GT(ink, 255 * 50);
    EXPECT_NEAR(column / ink, 420 + 200, 4);  // letters differ
    EXPECT_THROW(makeContactSheet({red}, {"a", "b"}, 1), std::invalid_argument);
}

TEST(ColorMap, EndsAreThoseOfViridis) {
    EXPECT_EQ(calcColor(ColorMap::Viridis, 0), SimTK::Vec3(0x44, 0x01, 0x54) / 255.0);
    EXPECT_EQ(calcColor(ColorMap::Viridis, 1), SimTK::Vec3(0xFD, 0xE7, 0x25) / 255.0);
    EXPECT_EQ(calcColor(ColorMap::Viridis, 7), calcColor(ColorMap::Viridis, 1));
}

TEST(ColorMap, ViridisGrowsEvenlyLighter) {
    double last = 0;
    for (int i = 0; i <= 100; ++i) {
        const SimTK::Vec3 c = calcColor(ColorMap::Viridis, i / 100.0);
        const double luma = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        EXPECT_GT(luma, last) << "at " << i;
        last = luma;
    }
}

TEST(Video, FramesBecomeOneFile) {
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("video");
    EXPECT_THAT([&] { writeVideo(folder, folder + "/v.mp4"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("frame_00000.png")));
    for (int i = 0; i < 3; ++i)
        makePattern(63, 41, false).writePng(folder + "/frame_0000" + std::to_string(i) + ".png");
    const bool wasWritten = writeVideo(folder, folder + "/v.mp4", 10);
    EXPECT_EQ(wasWritten, isVideoAvailable());
    EXPECT_EQ(fs::exists(folder + "/v.mp4"), wasWritten);
    if (wasWritten) {
        EXPECT_THROW(writeVideo(folder, "/no/such/folder/v.mp4"), std::runtime_error);
    }
}

TEST(Video, ASuffixOfGifGivesAnAnimationThatRepeats) {
    if (!isVideoAvailable()) GTEST_SKIP() << "no ffmpeg";
    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("gif");
    for (int i = 0; i < 3; ++i)
        makePattern(63 + i % 2, 41, false)
            .resized(64, 42)
            .writePng(folder + "/frame_0000" + std::to_string(i) + ".png");
    ASSERT_TRUE(writeVideo(folder, folder + "/v.gif", 20));
    std::ostringstream text;
    text << std::ifstream(folder + "/v.gif", std::ios::binary).rdbuf();
    const std::string gif = text.str();
    ASSERT_GT(gif.size(), 10u);
    EXPECT_EQ(gif.substr(0, 6), "GIF89a");
    EXPECT_EQ((unsigned char)(gif[6]), 64);  // width
    EXPECT_EQ((unsigned char)(gif[8]), 42);
    // The application extension with a count of 0 (endless); 3 frames of 5 hundredths of a second.
    EXPECT_NE(gif.find(std::string("NETSCAPE2.0\x03\x01\0\0", 15)), std::string::npos);
    int frames = 0;
    for (size_t at = 0; (at = gif.find("\x21\xF9\x04", at)) != std::string::npos; ++at) {
        EXPECT_EQ(gif[at + 4], 5);
        ++frames;
    }
    EXPECT_EQ(frames, 3);
}

}  // namespace
}  // namespace simflex
