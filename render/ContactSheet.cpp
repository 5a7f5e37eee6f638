#include "simflex/render/ContactSheet.h"

#include <algorithm>
#include <stdexcept>

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

Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth,
                       int gap) {
    std::vector<Image> images;
    for (const std::string& file : pngFiles) images.push_back(Image::readPng(file));
    return makeContactSheet(images, columns, cellWidth, gap);
}

}  // namespace simflex
