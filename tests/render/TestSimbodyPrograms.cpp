// Simbody's own example programs from Debian's sources, made headless. Each one runs until it has
// written a few frames.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "simflex/render/Image.h"
#include "support/Await.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;

struct Hue {
    const char* name;
    int red, green, blue;  // of the colour in full light
    int numPixels;         // minimum, of 1280 × 720
};

struct Program {
    const char* name;
    int numFrames;
    std::vector<Hue> colors;
    bool isOnWhite;  // shows whether parts leave the picture
};

std::ostream& operator<<(std::ostream& out, const Program& program) {
    return out << program.name;
}

const Hue red = {"red", 255, 0, 0, 200}, blue = {"blue", 0, 0, 255, 50};
const Hue orange = {"orange", 255, 128, 0, 200};

const Program programs[] = {
    {"ExamplePendulum", 6, {red, orange}, false},
    {"ExampleClosedTopologyMechanism", 4, {red, blue}, true},
    {"ExampleGears", 4, {{"grey", 158, 171, 186, 5000}}, true},
    {"ExampleLongPendulum", 6, {{"orange", 255, 128, 0, 100}}, true},
    {"ExampleContactPlayground", 4, {}, false},
    {"ExampleBricardMechanism", 3, {{"green", 0, 255, 0, 5000}, red}, false},
};

std::string readText(const fs::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

// Counts pixels whose colour vector is at a small angle to the given one: same hue and saturation
// in any light.
int countHue(const Image& image, const Hue& hue) {
    const double length =
        std::sqrt(double(hue.red * hue.red + hue.green * hue.green + hue.blue * hue.blue));
    int count = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const Image::Pixel p = image.getPixel(x, y);
            const double size = std::sqrt(double(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
            const double cosine =
                size > 60 ? (p[0] * hue.red + p[1] * hue.green + p[2] * hue.blue) / (size * length)
                          : 0;
            count += cosine > 0.97 && size < 1.05 * length + 60;
        }
    return count;
}

int countBorderPixels(const Image& image) {
    int count = 0;
    const int w = image.getWidth(), h = image.getHeight();
    const Image::Pixel white = {255, 255, 255, 255};
    for (int x = 0; x < w; ++x)
        count += (image.getPixel(x, 0) != white) + (image.getPixel(x, h - 1) != white);
    for (int y = 0; y < h; ++y)
        count += (image.getPixel(0, y) != white) + (image.getPixel(w - 1, y) != white);
    return count;
}

class SimbodyProgram : public ::testing::TestWithParam<Program> {};

TEST_P(SimbodyProgram, DrawsWithoutADisplay) {
    const Program& program = GetParam();
    const fs::path binary = fs::path(SIMFLEX_SIMBODY_PROGRAMS) / program.name;
    if (!fs::exists(binary))
        GTEST_SKIP() << "the sources of Simbody's examples are not installed "
                        "(/usr/share/doc/simbody/examples/src of libsimbody-dev)";
    const testing::TestFolder scratch;
    const fs::path folder = scratch.path();

    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        unsetenv("DISPLAY");
        const int input = open("/dev/null", O_RDONLY);
        const int output = open((folder / "output.txt").c_str(), O_WRONLY | O_CREAT, 0644);
        dup2(input, STDIN_FILENO);
        dup2(output, STDOUT_FILENO);
        dup2(output, STDERR_FILENO);
        if (chdir(folder.c_str()) == 0) execl(binary.c_str(), binary.c_str(), nullptr);
        _exit(127);
    }
    char name[40];
    std::snprintf(name, sizeof name, "frames/frame_%05d.png", program.numFrames - 1);
    testing::await(name, [&] { return fs::exists(folder / name) || testing::hasEnded(child); });
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    ASSERT_TRUE(fs::exists(folder / name)) << readText(folder / "output.txt");

    const Image first = Image::readPng((folder / "frames/frame_00000.png").string());
    const Image last = Image::readPng((folder / name).string());
    EXPECT_FALSE(first == last) << "nothing moves in " << folder;
    for (const Hue& hue : program.colors)
        EXPECT_GT(countHue(last, hue), hue.numPixels) << hue.name << " in " << folder;
    if (program.isOnWhite) {
        EXPECT_EQ(countBorderPixels(last), 0) << folder;
    }
}

INSTANTIATE_TEST_SUITE_P(Examples, SimbodyProgram, ::testing::ValuesIn(programs),
                         [](const auto& parameters) { return parameters.param.name; });

}  // namespace
}  // namespace simflex
