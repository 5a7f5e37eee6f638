#include "ColorBar.h"

#include <algorithm>
#include <cmath>

#include "Ticks.h"
#include "simflex/base/NumberText.h"

namespace simflex {

using SimTK::Vec3;

namespace {

Image::Pixel toPixel(const Vec3& color) {
    Image::Pixel pixel{0, 0, 0, 255};
    for (int k = 0; k < 3; ++k)
        pixel[k] = std::uint8_t(std::lround(255 * std::min(1.0, std::max(0.0, color[k]))));
    return pixel;
}

// A colour bar inside a frame of one pixel.
struct BarPlace {
    int left, width, top, bottom;
};

void drawColors(Image& image, const BarPlace& place, const ColorBar& bar, const Palette& palette) {
    for (int y = place.top - 1; y <= place.bottom + 1; ++y)
        for (int x = place.left - 1; x <= place.left + place.width; ++x) {
            const bool isFrame = y < place.top || y > place.bottom || x < place.left ||
                                 x >= place.left + place.width;
            const double fraction = double(place.bottom - y) / (place.bottom - place.top);
            if (isFrame)
                image.blendPixel(x, y, palette.text, 0.55);
            else
                image.setPixel(x, y, toPixel(calcColor(bar.colorMap, fraction)));
        }
}

// Draws a triangle at an end of the bar, in the colour of that end.
void drawTip(Image& image, const BarPlace& place, int end, int direction, const Vec3& color,
             const Palette& palette) {
    const double half = 0.5 * place.width, middle = place.left + half;
    const int length = std::max(3, int(std::lround(0.75 * place.width)));
    for (int i = 0; i <= length; ++i) {
        const double reach = half * (1 - double(i) / length);
        const int y = end + direction * (i + 2);
        for (int x = place.left - 1; x <= place.left + place.width; ++x) {
            const double inside = reach - std::abs(x + 0.5 - middle) + 0.5;
            if (inside <= 0) continue;
            image.blendPixel(x, y, toPixel(color), std::min(1.0, inside));
            const bool isEdge = inside < 1.5 || i == length;
            if (isEdge) image.blendPixel(x, y, palette.text, 0.4 * std::min(1.0, inside));
        }
    }
}

}  // namespace

void drawColorBar(Image& image, const ColorBar& bar, const Palette& palette, double unit,
                  Font& regular, Font& bold) {
    const auto size = [unit](double points) {
        return std::max(7, int(std::lround(points * unit)));
    };
    const auto scaled = [unit](double length) { return int(std::lround(length * unit)); };
    const BarPlace place{image.getWidth() - scaled(118), std::max(4, scaled(16)),
                         int(std::lround(bar.top * image.getHeight())),
                         int(std::lround(bar.bottom * image.getHeight()))};
    if (place.bottom <= place.top) return;
    drawColors(image, place, bar, palette);
    if (bar.hasAbove) drawTip(image, place, place.top, -1, calcColor(bar.colorMap, 1), palette);
    if (bar.hasBelow) drawTip(image, place, place.bottom, 1, calcColor(bar.colorMap, 0), palette);

    const DisplayUnit written =
        chooseScaledUnit(bar.unit, std::max(std::abs(bar.low), std::abs(bar.high)));
    const double right = image.getWidth() - 30 * unit;
    const double heading = bar.reference.empty() ? 45 : 64;
    bold.drawWithHalo(image, right, place.top - heading * unit, bar.quantity, size(16),
                      palette.text, palette.halo, Font::Anchor::Right);
    if (!bar.reference.empty())
        regular.drawWithHalo(image, right, place.top - 44 * unit, bar.reference, size(13),
                             palette.faintText, palette.halo, Font::Anchor::Right);
    regular.drawWithHalo(image, right, place.top - 24 * unit, "[" + written.name + "]", size(15),
                         palette.faintText, palette.halo, Font::Anchor::Right);
    const double labels = place.left + place.width + 10 * unit;
    if (bar.hasGaps) {
        const int side = place.width, top = place.bottom + scaled(30);
        for (int y = top - 1; y <= top + side; ++y)
            for (int x = place.left - 1; x <= place.left + side; ++x)
                if (y < top || y == top + side || x < place.left || x == place.left + side)
                    image.blendPixel(x, y, palette.text, 0.55);
                else
                    image.setPixel(x, y, toPixel(gapColor));
        regular.drawWithHalo(image, labels, top + side - 3 * unit, "no data", size(15),
                             palette.text, palette.halo);
    }

    const double low = bar.low / written.size, high = bar.high / written.size, span = high - low;
    if (!(span > 0) || !std::isfinite(span)) return;
    const double step = chooseTickStep(low, high);
    const int decimals = countDecimals(step);
    for (double k = std::ceil(low / step - 1e-6); k * step <= high + 1e-6 * span; ++k) {
        const double value = k * step;
        const int y =
            place.bottom - int(std::lround((value - low) / span * (place.bottom - place.top)));
        for (int x = place.left + place.width + 1; x <= place.left + place.width + scaled(5); ++x)
            image.blendPixel(x, y, palette.text, 0.7);
        // Typographic minus sign, not before zero.
        const std::string label =
            (value < -0.5 * step ? "−" : "") + writeFixed(std::abs(value), decimals);
        regular.drawWithHalo(image, labels, y + 5 * unit, label, size(15), palette.text,
                             palette.halo);
    }
}

}  // namespace simflex
