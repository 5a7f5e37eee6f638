#include "Overlay.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"

namespace simflex {

using SimTK::Vec3;

namespace {

double roundUp(double value, std::initializer_list<double> steps) {
    if (!(value > 0) || !std::isfinite(value)) return 1;
    const double decade = std::pow(10, std::floor(std::log10(value)));
    for (const double step : steps)
        if (value <= step * decade * (1 + 1e-9)) return step * decade;
    return 10 * decade;
}

}  // namespace

double roundUpToStep(double value) {
    return roundUp(value, {1, 2, 5, 10});
}

double roundUpToRange(double value) {
    return roundUp(value, {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10});
}

std::string formatNumber(double value) {
    return writeGeneral(value, 4);
}

std::string formatFactor(double value) {
    if (!(value >= 1e4) || !std::isfinite(value)) return formatNumber(value);
    const int exponent = int(std::floor(std::log10(value) + 1e-9));
    const std::string mantissa = formatNumber(value / std::pow(10, exponent));
    return (mantissa == "1" ? "" : mantissa + "·") + formatPowerOfTen(exponent);
}

std::string formatLength(double meters) {
    const DisplayUnit unit = chooseScaledUnit("m", meters);
    return formatNumber(meters / unit.size) + " " + unit.name;
}

// Reduces the letter size so that a text fits into `room` [pixel], down to three fifths of
// `letters`, and truncates a longer text.
static int fitText(Font& font, std::string& text, int letters, double room) {
    const int least = std::max(7, 3 * letters / 5);
    while (letters > least && font.calcWidth(text, letters) > room) --letters;
    std::string rest = text;
    while (!rest.empty() && font.calcWidth(text, letters) > room) {
        const auto isInside = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; };
        while (rest.size() > 1 && isInside(rest.back())) rest.pop_back();
        rest.pop_back();
        text = rest + "…";
    }
    return letters;
}

// Reduces the letter size of a text that does not fit, down to three quarters, and then breaks it
// into lines.
static std::vector<std::string> breakText(Font& font, const std::string& text, int& letters,
                                          double room) {
    const int least = std::max(7, 3 * letters / 4);
    while (letters > least && font.calcWidth(text, letters) > room) --letters;
    if (font.calcWidth(text, letters) <= room) return {text};
    std::vector<std::string> lines;
    for (const std::string& word : splitAt(text, ' ')) {
        const std::string longer = lines.empty() ? word : lines.back() + " " + word;
        if (!lines.empty() && font.calcWidth(longer, letters) <= room)
            lines.back() = longer;
        else
            lines.push_back(word);
    }
    return lines;
}

void Overlay::draw(Image& image, const OverlayContent& content, const Palette& palette) {
    const bool hasText = !content.title.empty() || !content.captions.empty() ||
                         !content.screenTexts.empty() || !content.footnote.empty() ||
                         content.hasScaleBar || content.hasColorBar || content.hasTriad ||
                         !content.labels.empty();
    if (!hasText) return;
    if (!regular) {
        regular = std::make_unique<Font>(Font::Weight::Regular);
        bold = std::make_unique<Font>(Font::Weight::Bold);
    }

    const double unit = content.unit;
    const auto size = [unit](double points) {
        return std::max(7, int(std::lround(points * unit)));
    };
    for (const OverlayContent::PlacedLabel& label : content.labels)
        drawLabel(image, label, palette, unit);

    const double left = 34 * unit;
    double y = 54 * unit;
    const auto write = [&](Font& font, std::string text, int letters, const Image::Pixel& color) {
        letters = fitText(font, text, letters, image.getWidth() - left - 20 * unit);
        font.drawWithHalo(image, left, y, text, letters, color, palette.halo);
    };
    if (!content.title.empty()) {
        int letters = size(25);
        const double room = image.getWidth() - left - 20 * unit;
        for (const std::string& line : breakText(*bold, content.title, letters, room)) {
            write(*bold, line, letters, palette.text);
            y += 32 * unit;
        }
    }
    for (const std::string& caption : content.captions) {
        write(*regular, caption, size(18), palette.faintText);
        y += 26 * unit;
    }
    for (const std::string& text : content.screenTexts) {
        write(*regular, text, size(17), palette.text);
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
    if (content.hasColorBar) drawColorBar(image, content.colorBar, palette, unit, *regular, *bold);
    if (content.hasBorder) {
        const int width = image.getWidth(), height = image.getHeight();
        const int thickness = std::max(1, int(std::lround(1.5 * unit)));
        for (int row = 0; row < height; ++row)
            for (int column = 0; column < width; ++column)
                if (std::min({column, row, width - 1 - column, height - 1 - row}) < thickness)
                    image.blendPixel(column, row, palette.faintText, 0.9);
    }
}

// Draws a bar of a round length between a twelfth and a fifth of the picture's width.
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

// Placed beside its point, on a side with room. The strong halo makes it legible over any colour.
void Overlay::drawLabel(Image& image, const OverlayContent::PlacedLabel& label,
                        const Palette& palette, double unit) {
    const int size = std::max(7, int(std::lround(15 * unit)));
    const double width = regular->calcWidth(label.text, size), gap = 9 * unit;
    const bool fits = label.x + gap + width < image.getWidth() - 4 * unit;
    Image::Pixel color{0, 0, 0, 255}, halo = palette.halo;
    for (std::size_t k = 0; k < 3; ++k)
        color[k] =
            std::uint8_t(std::lround(255 * std::min(1.0, std::max(0.0, label.color[int(k)]))));
    halo[3] = 150;
    regular->drawWithHalo(image, fits ? label.x + gap : label.x - gap, label.y - 6 * unit,
                          label.text, size, color, halo,
                          fits ? Font::Anchor::Left : Font::Anchor::Right);
}

}  // namespace simflex
