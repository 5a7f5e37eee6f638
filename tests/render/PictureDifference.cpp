#include "PictureDifference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace simflex {
namespace test {

namespace {

namespace fs = std::filesystem;

using Plane = std::vector<float>;

double linearize(std::uint8_t level) {
    const double c = level / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

double calcLightness(double t) {
    constexpr double edge = 216.0 / 24389.0;
    return t > edge ? std::cbrt(t) : (24389.0 / 27.0 * t + 16) / 116;
}

std::array<Plane, 3> convertToLab(const Image& image) {
    const std::size_t count = std::size_t(image.getWidth()) * image.getHeight();
    std::array<Plane, 3> lab;
    for (Plane& plane : lab) plane.resize(count);
    std::array<double, 256> linear;
    for (int level = 0; level < 256; ++level)
        linear[std::size_t(level)] = linearize(std::uint8_t(level));
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint8_t* p = image.getData() + 4 * i;
        // Transparent pixels are blended with white.
        const double alpha = p[3] / 255.0;
        const double r = alpha * linear[p[0]] + 1 - alpha, g = alpha * linear[p[1]] + 1 - alpha,
                     b = alpha * linear[p[2]] + 1 - alpha;
        const double x = calcLightness((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047);
        const double y = calcLightness(0.2126729 * r + 0.7151522 * g + 0.0721750 * b);
        const double z = calcLightness((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883);
        lab[0][i] = float(116 * y - 16);
        lab[1][i] = float(500 * (x - y));
        lab[2][i] = float(200 * (y - z));
    }
    return lab;
}

// A Gaussian of one pixel; border values extend beyond the border.
void smooth(Plane& plane, int width, int height) {
    constexpr double weights[] = {0.4026, 0.2442, 0.0545};
    Plane other(plane.size());
    const auto pass = [&](const Plane& from, Plane& to, int dx, int dy) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                double sum = 0;
                for (int k = -2; k <= 2; ++k) {
                    const int column = std::clamp(x + k * dx, 0, width - 1);
                    const int row = std::clamp(y + k * dy, 0, height - 1);
                    sum += weights[std::abs(k)] * from[std::size_t(row) * width + column];
                }
                to[std::size_t(y) * width + x] = float(sum);
            }
    };
    pass(plane, other, 1, 0);
    pass(other, plane, 0, 1);
}

}  // namespace

Image PictureDifference::makePicture() const {
    Image image(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double shade = std::min(1.0, map[std::size_t(y) * width + x] / 30.0);
            const auto level = std::uint8_t(std::lround(255 * (1 - shade)));
            image.setPixel(x, y, {level, level, level, 255});
        }
    return image;
}

PictureDifference comparePictures(const Image& a, const Image& b) {
    if (a.getWidth() != b.getWidth() || a.getHeight() != b.getHeight())
        throw std::invalid_argument("comparePictures: sizes " + std::to_string(a.getWidth()) + "x" +
                                    std::to_string(a.getHeight()) + " and " +
                                    std::to_string(b.getWidth()) + "x" +
                                    std::to_string(b.getHeight()) + " differ");
    const int width = a.getWidth(), height = a.getHeight();
    std::array<Plane, 3> labA = convertToLab(a), labB = convertToLab(b);
    for (int k = 0; k < 3; ++k) {
        smooth(labA[std::size_t(k)], width, height);
        smooth(labB[std::size_t(k)], width, height);
    }

    PictureDifference result;
    result.width = width;
    result.height = height;
    result.map.resize(std::size_t(width) * height);
    const auto calcDistance = [&](int x, int y, double dx, double dy) {
        // Interpolates b between (x, y) and its neighbour.
        const int x2 = std::clamp(x + (dx > 0) - (dx < 0), 0, width - 1);
        const int y2 = std::clamp(y + (dy > 0) - (dy < 0), 0, height - 1);
        const std::size_t i = std::size_t(y) * width + x, j = std::size_t(y2) * width + x2;
        const double f = std::max(std::abs(dx), std::abs(dy));
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double d = labA[k][i] - ((1 - f) * labB[k][i] + f * labB[k][j]);
            sum += d * d;
        }
        return std::sqrt(sum);
    };
    int numVisible = 0;
    std::vector<int> visibleSum(std::size_t(width + 1) * (height + 1), 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double distance = calcDistance(x, y, 0, 0);
            if (distance > PictureDifference::visible)
                for (const auto& [dx, dy] : {std::pair(0.5, 0.0), std::pair(-0.5, 0.0),
                                             std::pair(0.0, 0.5), std::pair(0.0, -0.5)})
                    distance = std::min(distance, calcDistance(x, y, dx, dy));
            result.map[std::size_t(y) * width + x] = float(distance);
            result.largest = std::max(result.largest, distance);
            const bool isVisible = distance > PictureDifference::visible;
            numVisible += isVisible;
            const std::size_t row = std::size_t(width) + 1;
            visibleSum[(y + 1) * row + x + 1] = visibleSum[y * row + x + 1] +
                                                visibleSum[(y + 1) * row + x] -
                                                visibleSum[y * row + x] + isVisible;
        }
    result.fraction = double(numVisible) / (double(width) * height);

    constexpr int window = 9;
    const auto sumUpTo = [&](int x, int y) {
        return visibleSum[std::size_t(std::min(y, height)) * (width + 1) + std::min(x, width)];
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            result.numClustered = std::max(
                result.numClustered, sumUpTo(x + window, y + window) - sumUpTo(x, y + window) -
                                         sumUpTo(x + window, y) + sumUpTo(x, y));
    return result;
}

std::string compareWithReference(const Image& frame, const std::string& name) {
    const fs::path path = fs::path(SIMFLEX_SOURCE_DIR) / "tests/render/reference" / (name + ".png");
    const char* const update = std::getenv("SIMFLEX_UPDATE_REFERENCES");
    if (update && std::string(update) == "1") {
        fs::create_directories(path.parent_path());
        frame.writePng(path.string());
        return "";
    }
    const fs::path folder = fs::path(SIMFLEX_BINARY_DIR) / "reference_failures";
    const std::string actual = (folder / (name + "_actual.png")).string();
    const auto keepActual = [&] {
        fs::create_directories(folder);
        frame.writePng(actual);
    };
    if (!fs::exists(path)) {
        keepActual();
        return "there is no reference picture " + path.string() + "; the frame is " + actual +
               ", SIMFLEX_UPDATE_REFERENCES=1 makes it the reference";
    }
    const Image reference = Image::readPng(path.string());
    if (reference.getWidth() != frame.getWidth() || reference.getHeight() != frame.getHeight()) {
        keepActual();
        return "the reference picture " + path.string() + " has another size than " + actual;
    }
    const PictureDifference difference = comparePictures(frame, reference);
    if (difference.isNegligible()) return "";
    keepActual();
    reference.writePng((folder / (name + "_reference.png")).string());
    difference.makePicture().writePng((folder / (name + "_difference.png")).string());
    return name + " does not look like its reference picture: " +
           std::to_string(100 * difference.fraction) + " % of the pixels differ visibly, " +
           std::to_string(difference.numClustered) + " in one spot, at most by ΔE " +
           std::to_string(difference.largest) + "; see " + folder.string() + "/" + name +
           "_{actual,reference,difference}.png (where the new look is meant, "
           "SIMFLEX_UPDATE_REFERENCES=1 renews the reference)";
}

}  // namespace test
}  // namespace simflex
