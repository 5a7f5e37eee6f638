#include "simflex/render/ContactSheet.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "simflex/render/frame/FrameOutput.h"
#include "simflex/render/overlay/Font.h"

namespace simflex {

ContactSheetStyle ContactSheetStyle::dark() {
    ContactSheetStyle style;
    style.background = {27, 31, 38, 255};
    style.text = {236, 240, 245, 255};
    return style;
}

Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, const ContactSheetStyle& style) {
    const int cellWidth = style.cellWidth, gap = style.gap;
    if (images.empty()) throw std::invalid_argument("makeContactSheet: no pictures");
    if (columns <= 0 || cellWidth <= 0 || gap < 0)
        throw std::invalid_argument(
            "makeContactSheet: columns and cell width must be positive, the gap not negative");
    if (!captions.empty() && images.size() != captions.size())
        throw std::invalid_argument("makeContactSheet: " + std::to_string(images.size()) +
                                    " pictures, but " + std::to_string(captions.size()) +
                                    " captions");

    std::vector<Image> cells;
    int pictureHeight = 1;
    for (const Image& image : images) {
        if (image.isEmpty()) throw std::invalid_argument("makeContactSheet: an empty picture");
        const int height =
            std::max(1, int(double(image.getHeight()) * cellWidth / image.getWidth() + 0.5));
        cells.push_back(image.resized(cellWidth, height));
        pictureHeight = std::max(pictureHeight, height);
    }
    constexpr int letters = 17;
    const int cellHeight = pictureHeight + (captions.empty() ? 0 : 2 * letters);

    columns = std::min(columns, int(cells.size()));
    const int rows = (int(cells.size()) + columns - 1) / columns;
    Image sheet(columns * (cellWidth + gap) + gap, rows * (cellHeight + gap) + gap,
                style.background);
    std::unique_ptr<Font> font;
    if (!captions.empty()) font = std::make_unique<Font>(Font::Weight::Regular);
    for (int i = 0; i < int(cells.size()); ++i) {
        const int left = gap + (i % columns) * (cellWidth + gap);
        const int top = gap + (i / columns) * (cellHeight + gap);
        sheet.paste(cells[size_t(i)], left,
                    top + (pictureHeight - cells[size_t(i)].getHeight()) / 2);
        if (font)
            font->draw(sheet, left + 0.5 * cellWidth, top + pictureHeight + 1.35 * letters,
                       captions[size_t(i)], letters, style.text, Font::Anchor::Center);
    }
    return sheet;
}

Image makeContactSheet(const std::vector<Image>& images, int columns, int cellWidth, int gap) {
    return makeContactSheet(images, {}, columns, cellWidth, gap);
}

Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, int cellWidth, int gap) {
    ContactSheetStyle style;
    style.cellWidth = cellWidth;
    style.gap = gap;
    return makeContactSheet(images, captions, columns, style);
}

Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth,
                       int gap) {
    std::vector<Image> images;
    for (const std::string& file : pngFiles) {
        const size_t slash = file.rfind('/');
        FrameOutput::waitForFolder(slash == std::string::npos ? "." : file.substr(0, slash));
        images.push_back(Image::readPng(file));
    }
    return makeContactSheet(images, columns, cellWidth, gap);
}

}  // namespace simflex
