#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "simflex/render/Video.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

const std::vector<Image::Pixel> colors = {{220, 40, 30, 255},
                                          {30, 200, 60, 255},
                                          {40, 60, 230, 255},
                                          {240, 240, 240, 255},
                                          {20, 20, 20, 255}};

class VideoFile : public ::testing::Test {
protected:
    void SetUp() override {
        if (!isVideoAvailable()) GTEST_SKIP() << "no ffmpeg";
    }

    int countFiles() const {
        return int(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    std::string write(const std::string& name, const VideoOptions& options = {}) const {
        VideoWriter video(folder + name, options);
        for (const Image::Pixel& color : colors) video.write(Image(64, 48, color));
        EXPECT_EQ(video.getNumFrames(), int(colors.size()));
        EXPECT_FALSE(fs::exists(folder + name)) << "before it is complete";
        video.finish();
        video.finish();
        EXPECT_EQ(countFiles(), 1);
        std::ostringstream text;
        text << std::ifstream(folder + name, std::ios::binary).rdbuf();
        return text.str();
    }

    const testing::TestFolder scratch;
    const std::string folder = scratch.makeFolder("videos");
};

std::string runAndRead(const std::string& command) {
    std::string result;
    std::FILE* pipe = popen(command.c_str(), "r");
    char buffer[65536];
    while (const size_t count = std::fread(buffer, 1, sizeof buffer, pipe))
        result.append(buffer, count);
    EXPECT_EQ(pclose(pipe), 0) << command;
    return result;
}

int countOf(const std::string& text, const std::string& word) {
    int count = 0;
    for (size_t at = 0; (at = text.find(word, at)) != std::string::npos; ++at) ++count;
    return count;
}

TEST_F(VideoFile, Mp4ShowsThePicturesItWasGiven) {
    write("/v.mp4", {10});
    const std::string pixels =
        runAndRead("ffmpeg -v error -i " + folder + "/v.mp4 -f rawvideo -pix_fmt rgb24 -");
    ASSERT_EQ(pixels.size(), colors.size() * 64 * 48 * 3);
    for (size_t i = 0; i < colors.size(); ++i)
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR((unsigned char)(pixels[i * 64 * 48 * 3 + 3 * 64 * 20 + 3 * 30 + c]),
                        colors[i][c], 8)  // H.264 limited range 16…235
                << "frame " << i;
    EXPECT_EQ(runAndRead("ffprobe -v error -show_entries stream=codec_name,r_frame_rate,pix_fmt "
                         "-of csv=p=0 " +
                         folder + "/v.mp4"),
              "h264,yuv420p,10/1\n");
}

TEST_F(VideoFile, AnyNameIsANameAndNothingElse) {
    const fs::path before = fs::current_path();
    fs::current_path(folder);
    for (const std::string ending : {".mp4", ".gif", ".webp"}) {
        const std::string name = "-y:a;touch b $(touch c) 'q' \"w\"\n%03d" + ending;
        VideoWriter video(name);
        for (const Image::Pixel& color : colors) video.write(Image(64, 48, color));
        video.finish();
        EXPECT_GT(fs::file_size(name), 100u) << ending;
    }
    EXPECT_EQ(countFiles(), 3);
    fs::current_path(before);
}

TEST_F(VideoFile, Mp4OfOddSizeIsPaddedToEven) {
    VideoWriter video(folder + "/v.mp4");
    video.write(Image(63, 41, colors[0]));
    video.finish();
    EXPECT_EQ(runAndRead("ffprobe -v error -show_entries stream=width,height -of csv=p=0 " +
                         folder + "/v.mp4"),
              "64,42\n");
}

TEST_F(VideoFile, TransparentPixelsBecomeWhiteInMp4) {
    VideoWriter video(folder + "/v.mp4");
    for (int i = 0; i < 3; ++i) video.write(Image(64, 48, {255, 0, 0, 0}));
    video.finish();
    const std::string pixels =
        runAndRead("ffmpeg -v error -i " + folder + "/v.mp4 -f rawvideo -pix_fmt rgb24 -");
    ASSERT_EQ(pixels.size(), 3u * 64 * 48 * 3);
    EXPECT_GE((unsigned char)(pixels[3000]), 250);
    EXPECT_GE((unsigned char)(pixels[3001]), 250);
}

TEST_F(VideoFile, GifRepeatsAsOftenAsItIsTold) {
    const std::string endless = write("/endless.gif", {20});
    EXPECT_EQ(endless.substr(0, 6), "GIF89a");
    EXPECT_EQ(countOf(endless, "\x21\xF9\x04"), int(colors.size()));
    EXPECT_NE(endless.find(std::string("NETSCAPE2.0\x03\x01\0\0", 15)), std::string::npos);
    fs::remove(folder + "/endless.gif");
    EXPECT_EQ(countOf(write("/once.gif", {20, 1}), "NETSCAPE"), 0);
    fs::remove(folder + "/once.gif");
    EXPECT_NE(write("/thrice.gif", {20, 3}).find(std::string("NETSCAPE2.0\x03\x01\x02\0", 15)),
              std::string::npos);
}

TEST_F(VideoFile, WebPIsAnAnimationOfAllFrames) {
    const std::string webp = write("/v.webp", {20, 2});
    EXPECT_EQ(webp.substr(0, 4), "RIFF");
    EXPECT_EQ(webp.substr(8, 4), "WEBP");
    EXPECT_EQ(countOf(webp, "ANMF"), int(colors.size()));
    const size_t animation = webp.find("ANIM");
    ASSERT_NE(animation, std::string::npos);
    EXPECT_EQ(webp[animation + 12], 2);  // after size and background
    const size_t frame = webp.find("ANMF");
    EXPECT_EQ(webp[frame + 8 + 12], 50);  // duration [ms], after position and size
}

TEST_F(VideoFile, SuffixInCapitalsCountsAndAnUnknownOneIsRefused) {
    EXPECT_NO_THROW(write("/V.GIF"));
    for (const char* name : {"/v.avi", "/v", "/v.mp4/x", "/mp4"})
        EXPECT_THAT([&] { VideoWriter(folder + name); },
                    ThrowsMessage<std::invalid_argument>(
                        AllOf(HasSubstr(name), HasSubstr(".mp4, .gif or .webp"))));
    EXPECT_EQ(countFiles(), 1);
}

TEST_F(VideoFile, PictureOfAnotherSizeIsRefusedWithBothSizes) {
    VideoWriter video(folder + "/v.mp4");
    video.write(Image(64, 48));
    EXPECT_THAT([&] { video.write(Image(66, 48)); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("picture 1"), HasSubstr("66x48"), HasSubstr("64x48"))));
    EXPECT_THROW(video.write(Image()), std::invalid_argument);
    video.write(Image(64, 48));
    video.finish();
    EXPECT_THROW(video.write(Image(64, 48)), std::runtime_error);
}

TEST_F(VideoFile, WithoutFinishNothingIsLeft) {
    for (const char* name : {"/v.mp4", "/v.gif", "/v.webp"}) {
        VideoWriter video(folder + name);
        for (int i = 0; i < 3; ++i) video.write(Image(64, 48));
    }
    EXPECT_EQ(countFiles(), 0);
}

TEST_F(VideoFile, AnOlderVideoStaysUntilTheNewOneIsComplete) {
    std::ofstream(folder + "/v.mp4") << "older";
    { VideoWriter(folder + "/v.mp4").write(Image(64, 48)); }
    EXPECT_EQ(fs::file_size(folder + "/v.mp4"), 5u);
}

TEST_F(VideoFile, NoFramesAndWrongRatesAreRefused) {
    VideoWriter video(folder + "/v.mp4");
    EXPECT_THAT([&] { video.finish(); }, ThrowsMessage<std::runtime_error>(HasSubstr("no frames")));
    EXPECT_THROW(VideoWriter(folder + "/w.mp4", {0}), std::invalid_argument);
    EXPECT_THROW(VideoWriter(folder + "/w.mp4", {30, -1}), std::invalid_argument);
    EXPECT_THAT([&] { VideoWriter(folder + "/w.gif", {60}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("50 frames per second")));
}

TEST_F(VideoFile, FolderThatCannotBeWrittenToIsNamedBeforeAnythingIsDrawn) {
    EXPECT_THAT([&] { VideoWriter(folder + "/no/v.mp4"); },
                ThrowsMessage<std::runtime_error>(
                    AllOf(HasSubstr("/no/v.mp4"), HasSubstr("No such file"))));
}

TEST_F(VideoFile, MissingFfmpegNamesThePackage) {
    const std::string path = std::getenv("PATH");
    setenv("PATH", folder.c_str(), 1);
    EXPECT_FALSE(isVideoAvailable());
    EXPECT_THAT([&] { VideoWriter(folder + "/v.mp4"); },
                ThrowsMessage<std::runtime_error>(HasSubstr("Debian package ffmpeg")));
    setenv("PATH", path.c_str(), 1);
}

// Simulates a full disk: no file may grow beyond a few kilobytes.
TEST_F(VideoFile, DiskThatIsFullIsAnErrorAndLeavesNothing) {
    Image noise(320, 240);
    for (size_t i = 0; i < noise.getNumBytes(); ++i)
        noise.updData()[i] = std::uint8_t(i % 4 == 3 ? 255 : (i * i * 7919) >> 5);
    rlimit before;
    getrlimit(RLIMIT_FSIZE, &before);
    for (const char* name : {"/v.mp4", "/v.gif", "/v.webp"}) {
        const auto oldHandler = signal(SIGXFSZ, SIG_IGN);
        rlimit small = before;
        small.rlim_cur = 4096;
        setrlimit(RLIMIT_FSIZE, &small);
        std::string message = "no error";
        try {
            VideoWriter video(folder + name);
            for (int i = 0; i < 4; ++i) video.write(noise);
            video.finish();
        } catch (const std::runtime_error& error) {
            message = error.what();
        }
        setrlimit(RLIMIT_FSIZE, &before);
        signal(SIGXFSZ, oldHandler);
        EXPECT_THAT(message, AllOf(HasSubstr("ffmpeg could not write"), HasSubstr(name),
                                   HasSubstr("File too large")));
    }
    EXPECT_EQ(countFiles(), 0);
}

TEST_F(VideoFile, TakesAwayWhatKilledProcessesHaveLeftOfIt) {
    const std::string dead = "run.mp4.part-999999999", alive = "run.mp4.part-1";
    for (const std::string& name : {dead, alive, std::string("other.mp4.part-999999999")})
        std::ofstream(fs::path(folder) / name) << "part of a video";
    const VideoWriter video((fs::path(folder) / "run.mp4").string());
    EXPECT_FALSE(fs::exists(fs::path(folder) / dead));
    EXPECT_TRUE(fs::exists(fs::path(folder) / alive));
    EXPECT_TRUE(fs::exists(fs::path(folder) / "other.mp4.part-999999999"));
}

}  // namespace
}  // namespace simflex
