#pragma once
/** @file
Several pictures on one sheet, for a README or a report. **/

#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {

struct ContactSheetStyle {
    int cellWidth = 480;
    int gap = 6;
    Image::Pixel background{255, 255, 255, 255};
    Image::Pixel text{28, 34, 44, 255};

    /** Light letters on the background of dark pictures. **/
    static ContactSheetStyle dark();
};

/** Lays pictures out in rows, left to right, each scaled to the style's cell width with its own
aspect ratio and with a line of text under it, if there are captions; cells are as high as the
highest picture.
@throws std::invalid_argument when there is no picture, `columns` is not positive, or there are
    neither no captions nor as many as pictures.
@throws std::runtime_error when there is no font for captions. **/
Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, const ContactSheetStyle& style);

/** The same without captions, `gap` pixels of white around each.
@throws std::invalid_argument when there is no picture or `columns` is not positive. **/
Image makeContactSheet(const std::vector<Image>& images, int columns, int cellWidth = 480,
                       int gap = 6);

/** The same with captions. **/
Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, int cellWidth = 480, int gap = 6);

/** The same from PNG files. **/
Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth = 480,
                       int gap = 6);

}  // namespace simflex
