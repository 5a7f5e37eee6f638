#include "Overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace simflex {

using SimTK::Vec3;

namespace {

struct LengthUnit {
    const char* name;
    double meters;
};

// Tenths of a unit are still written in it: 0.4 mm rather than 400 µm.
LengthUnit chooseUnit(double length) {
    const LengthUnit units[] = {{"km", 1e3}, {"m", 1}, {"mm", 1e-3}, {"µm", 1e-6}, {"nm", 1e-9}};
    if (length >= 1e3) return units[0];
    if (length >= 0.9995) return units[1];
    for (const LengthUnit& unit : {units[2], units[3], units[4]})
        if (length >= 0.0995 * unit.meters) return unit;
    return length > 0 ? units[4] : units[2];
}

double roundUp(double value, std::initializer_list<double> steps) {
    if (!(value > 0) || !std::isfinite(value)) return 1;
    const double decade = std::pow(10, std::floor(std::log10(value)));
    for (const double step : steps)
        if (value <= step * decade * (1 + 1e-9)) return step * decade;
    return 10 * decade;
}

Image::Pixel toPixel(const Vec3& color) {
    Image::Pixel pixel{0, 0, 0, 255};
    for (int k = 0; k < 3; ++k)
        pixel[k] = std::uint8_t(std::lround(255 * std::min(1.0, std::max(0.0, color[k]))));
    return pixel;
}

}  // namespace

double roundUpToStep(double value) {
    return roundUp(value, {1, 2, 5, 10});
}

double roundUpToRange(double value) {
    return roundUp(value, {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10});
}

std::string formatNumber(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
}

std::string formatLength(double meters) {
    const LengthUnit unit = chooseUnit(std::abs(meters));
    return formatNumber(meters / unit.meters) + " " + unit.name;
}

void Overlay::draw(Image& image, const OverlayContent& content, const Palette& palette) {
    const bool hasText = !content.title.empty() || !content.captions.empty() ||
                         !content.screenTexts.empty() || !content.footnote.empty() ||
                         content.hasScaleBar || content.hasColorBar || content.hasTriad;
    if (!hasText) return;
    if (!regular) {
        regular = std::make_unique<Font>(Font::Weight::Regular);
        bold = std::make_unique<Font>(Font::Weight::Bold);
    }

    const double unit = content.unit;
    const auto size = [unit](double points) {
        return std::max(7, int(std::lround(points * unit)));
    };
    const double left = 34 * unit;
    double y = 54 * unit;
    if (!content.title.empty()) {
        bold->drawWithHalo(image, left, y, content.title, size(25), palette.text, palette.halo);
        y += 32 * unit;
    }
    for (const std::string& caption : content.captions) {
        regular->drawWithHalo(image, left, y, caption, size(18), palette.faintText, palette.halo);
        y += 26 * unit;
    }
    for (const std::string& text : content.screenTexts) {
        regular->drawWithHalo(image, left, y, text, size(17), palette.text, palette.halo);
        y += 24 * unit;
    }
    if (!content.footnote.empty())
        regular->drawWithHalo(image, image.getWidth() - 30 * unit, image.getHeight() - 26 * unit,
                              content.footnote, size(14), palette.faintText, palette.halo,
                              Font::Anchor::Right);
    if (content.hasScaleBar) {
        const double taken = content.footnote.empty()
                                 ? 0
                                 : regular->calcWidth(content.footnote, size(14)) + 26 * unit;
        drawScaleBar(image, image.getWidth() - 30 * unit - taken, image.getHeight() - 26 * unit,
                     content, palette);
    }

    if (content.hasTriad) {
        const TriadPlace place = calcTriadPlace(image.getHeight(), unit);
        const char* const names[] = {"x", "y", "z"};
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 direction(0);
            direction[axis] = 1;
            const Vec3 seen = ~content.R_GC * direction;
            bold->drawWithHalo(image, place.x + 1.3 * place.length * seen[0],
                               place.y - 1.3 * place.length * seen[1] + 5 * unit, names[axis],
                               size(14), palette.text, palette.halo, Font::Anchor::Center);
        }
    }
    if (content.hasColorBar) drawColorBar(image, content.colorBar, palette, unit);
}

// A bar of a round length between a twelfth and a fifth of the picture's width.
void Overlay::drawScaleBar(Image& image, double right, double baseline,
                           const OverlayContent& content, const Palette& palette) {
    const double length = roundUpToStep(image.getWidth() / 12.0 * content.pixelSize);
    const int x1 = int(std::lround(right)), x0 = x1 - int(std::lround(length / content.pixelSize));
    const int y1 = int(std::lround(baseline)),
              height = std::max(2, int(std::lround(content.unit * 4)));
    const int end = std::max(1, int(std::lround(content.unit * 3)));
    for (int x = x0; x <= x1; ++x) {
        const bool isEnd = x < x0 + height / 2 || x > x1 - height / 2;
        for (int y = y1 - height + 1 - (isEnd ? end : 0); y <= y1 + (isEnd ? end : 0); ++y)
            image.blendPixel(x, y, palette.text, 0.85);
    }
    regular->drawWithHalo(image, 0.5 * (x0 + x1), y1 - 10 * content.unit, formatLength(length),
                          std::max(7, int(std::lround(14 * content.unit))), palette.text,
                          palette.halo, Font::Anchor::Center);
}

void Overlay::drawColorBar(Image& image, const ColorBar& bar, const Palette& palette, double unit) {
    const int width = std::max(4, int(std::lround(16 * unit)));
    const int left = image.getWidth() - int(std::lround(118 * unit));
    const int top = int(std::lround(0.27 * image.getHeight()));
    const int bottom = int(std::lround(0.73 * image.getHeight()));

    // One pixel of frame around the colours.
    for (int y = top - 1; y <= bottom + 1; ++y)
        for (int x = left - 1; x <= left + width; ++x) {
            const bool isFrame = y < top || y > bottom || x < left || x >= left + width;
            if (isFrame)
                image.blendPixel(x, y, palette.text, 0.55);
            else
                image.setPixel(
                    x, y, toPixel(calcColor(bar.colorMap, double(bottom - y) / (bottom - top))));
        }

    const double range = bar.high - bar.low;
    const LengthUnit length = chooseUnit(std::max(std::abs(bar.low), std::abs(bar.high)));
    const auto size = [unit](double points) {
        return std::max(7, int(std::lround(points * unit)));
    };
    const double right = image.getWidth() - 30 * unit;
    bold->drawWithHalo(image, right, top - 38 * unit, bar.quantity, size(16), palette.text,
                       palette.halo, Font::Anchor::Right);
    regular->drawWithHalo(image, right, top - 17 * unit, std::string("[") + length.name + "]",
                          size(15), palette.faintText, palette.halo, Font::Anchor::Right);
    if (!(range > 0)) return;

    // Four to eight intervals; a range that ends on a round number ends on a tick.
    const double low = bar.low / length.meters, high = bar.high / length.meters;
    const double span = high - low;
    double step = roundUpToStep(span / 7);
    if (span / step < 3.5) step = roundUpToStep(span / 11);
    const int decimals = std::max(0, -int(std::floor(std::log10(step) + 1e-9)));
    for (double k = std::ceil(low / step - 1e-6); k * step <= high + 1e-6 * span; ++k) {
        const double value = k * step;
        const int y = bottom - int(std::lround((value - low) / span * (bottom - top)));
        for (int x = left + width + 1; x <= left + width + int(5 * unit); ++x)
            image.blendPixel(x, y, palette.text, 0.7);
        char text[32];
        std::snprintf(text, sizeof text, "%.*f", decimals, value == 0 ? 0.0 : value);
        regular->drawWithHalo(image, left + width + 10 * unit, y + 5 * unit, text, size(15),
                              palette.text, palette.halo);
    }
}

}  // namespace simflex
