#include "simflex/render/SideBySide.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "simflex/render/overlay/Font.h"

namespace simflex {

namespace {

void checkSameSize(const char* function, const Image& first, const Image& second) {
    if (first.getWidth() != second.getWidth() || first.getHeight() != second.getHeight())
        throw std::invalid_argument(
            std::string(function) + ": the pictures must have the same size, not " +
            std::to_string(first.getWidth()) + "x" + std::to_string(first.getHeight()) + " and " +
            std::to_string(second.getWidth()) + "x" + std::to_string(second.getHeight()));
}

struct Layout {
    int cellWidth, cellHeight;
    int letters, strip;  // sizes of captions
    int stepX, stepY;    // from the first picture to the second
};

Layout layOut(const std::array<int, 2>& first, const std::array<int, 2>& second,
              const std::array<std::string, 2>& captions, const SideBySideStyle& style) {
    Layout layout;
    layout.cellWidth = std::max(first[0], second[0]);
    layout.cellHeight = std::max(first[1], second[1]);
    layout.letters = std::max(9, int(std::lround(20.0 * layout.cellHeight / 720)));
    const bool hasCaptions = !captions[0].empty() || !captions[1].empty();
    layout.strip = hasCaptions ? int(std::lround(2.1 * layout.letters)) : 0;
    const bool isLeftRight = style.arrangement == SideBySideStyle::Arrangement::LeftRight;
    layout.stepX = isLeftRight ? layout.cellWidth + style.gap : 0;
    layout.stepY = isLeftRight ? 0 : layout.cellHeight + layout.strip + style.gap;
    return layout;
}

}  // namespace

std::array<int, 2> calcSideBySideSize(const std::array<int, 2>& first,
                                      const std::array<int, 2>& second,
                                      const std::array<std::string, 2>& captions,
                                      const SideBySideStyle& style) {
    const Layout layout = layOut(first, second, captions, style);
    return {layout.stepX + layout.cellWidth, layout.stepY + layout.strip + layout.cellHeight};
}

Image makeSideBySide(const Image& first, const Image& second,
                     const std::array<std::string, 2>& captions, const SideBySideStyle& style) {
    if (first.isEmpty() || second.isEmpty())
        throw std::invalid_argument("makeSideBySide: an empty picture");
    if (style.gap < 0)
        throw std::invalid_argument("makeSideBySide: the gap must not be negative, not " +
                                    std::to_string(style.gap));
    const Layout layout = layOut({first.getWidth(), first.getHeight()},
                                 {second.getWidth(), second.getHeight()}, captions, style);
    Image result(layout.stepX + layout.cellWidth, layout.stepY + layout.strip + layout.cellHeight,
                 style.background);
    for (int i = 0; i < 2; ++i) {
        const Image& image = i == 0 ? first : second;
        result.paste(image, i * layout.stepX + (layout.cellWidth - image.getWidth()) / 2,
                     i * layout.stepY + layout.strip + (layout.cellHeight - image.getHeight()) / 2);
        if (captions[size_t(i)].empty()) continue;
        Font font(Font::Weight::Bold);
        font.draw(result, i * layout.stepX + 0.5 * layout.cellWidth,
                  i * layout.stepY + 0.5 * layout.strip + 0.36 * layout.letters,
                  captions[size_t(i)], layout.letters, style.text, Font::Anchor::Center);
    }
    return result;
}

Image makeBlend(const Image& first, const Image& second, double weight) {
    checkSameSize("makeBlend", first, second);
    if (!(weight >= 0 && weight <= 1))
        throw std::invalid_argument("makeBlend: weight must be between 0 and 1, not " +
                                    std::to_string(weight));
    Image result = first;
    std::uint8_t* out = result.updData();
    for (size_t i = 0; i < result.getNumBytes(); ++i)
        out[i] = std::uint8_t(
            std::lround((1 - weight) * first.getData()[i] + weight * second.getData()[i]));
    return result;
}

Image makeDifference(const Image& first, const Image& second, int full) {
    checkSameSize("makeDifference", first, second);
    Image result = first;
    std::uint8_t* out = result.updData();
    const std::uint8_t *a = first.getData(), *b = second.getData();
    for (size_t i = 0; i < result.getNumBytes(); i += 4) {
        int difference = 0;
        for (size_t c = i; c < i + 4; ++c) difference = std::max(difference, std::abs(a[c] - b[c]));
        const double red = std::min(1.0, double(difference) / std::max(1, full));
        const double gray = 190 + 65 * (0.3 * a[i] + 0.59 * a[i + 1] + 0.11 * a[i + 2]) / 255;
        const double color[] = {215, 25, 30};
        for (size_t c = 0; c < 3; ++c)
            out[i + c] = std::uint8_t(std::lround((1 - red) * gray + red * color[c]));
        out[i + 3] = 255;
    }
    return result;
}

}  // namespace simflex
