#include "simflex/render/ContactSheet.h"

#include <algorithm>
#include <stdexcept>

#include "Font.h"

namespace simflex {

Image makeContactSheet(const std::vector<Image>& images, int columns, int cellWidth, int gap) {
    if (images.empty()) throw std::invalid_argument("makeContactSheet: no pictures");
    if (columns <= 0 || cellWidth <= 0 || gap < 0)
        throw std::invalid_argument(
            "makeContactSheet: columns and cell width must be positive, the gap not negative");

    std::vector<Image> cells;
    int cellHeight = 1;
    for (const Image& image : images) {
        if (image.isEmpty()) throw std::invalid_argument("makeContactSheet: an empty picture");
        const int height =
            std::max(1, int(double(image.getHeight()) * cellWidth / image.getWidth() + 0.5));
        cells.push_back(image.resized(cellWidth, height));
        cellHeight = std::max(cellHeight, height);
    }

    columns = std::min(columns, int(cells.size()));
    const int rows = (int(cells.size()) + columns - 1) / columns;
    Image sheet(columns * (cellWidth + gap) + gap, rows * (cellHeight + gap) + gap);
    for (int i = 0; i < int(cells.size()); ++i)
        sheet.paste(
            cells[i], gap + (i % columns) * (cellWidth + gap),
            gap + (i / columns) * (cellHeight + gap) + (cellHeight - cells[i].getHeight()) / 2);
    return sheet;
}

Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, int cellWidth, int gap) {
    if (images.size() != captions.size())
        throw std::invalid_argument("makeContactSheet: " + std::to_string(images.size()) +
                                    " pictures, but " + std::to_string(captions.size()) +
                                    " captions");
    const Image::Pixel ink{28, 34, 44, 255};
    Font font(Font::Weight::Regular);
    std::vector<Image> cells;
    for (size_t i = 0; i < images.size(); ++i) {
        // Letters have the same height on the sheet whatever the size of the picture.
        const int width = images[i].getWidth();
        const int letters = std::max(8, 17 * width / std::max(1, cellWidth));
        Image cell(width, images[i].getHeight() + 2 * letters);
        cell.paste(images[i], 0, 0);
        font.draw(cell, 0.5 * width, images[i].getHeight() + 1.35 * letters, captions[i], letters,
                  ink, Font::Anchor::Center);
        cells.push_back(std::move(cell));
    }
    return makeContactSheet(cells, columns, cellWidth, gap);
}

Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth,
                       int gap) {
    std::vector<Image> images;
    for (const std::string& file : pngFiles) images.push_back(Image::readPng(file));
    return makeContactSheet(images, columns, cellWidth, gap);
}

}  // namespace simflex
