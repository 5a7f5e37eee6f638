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

    /** Style for dark pictures. **/
    static ContactSheetStyle dark();
};

/** Arranges pictures in rows, left to right, each scaled to the style's cell width with its own
aspect ratio and, if there are captions, with a line of text below. All cells have the height of the
highest picture.
@throws std::invalid_argument if there is no picture, `columns` is not positive, or the number of
captions is neither zero nor that of pictures.
@throws std::runtime_error if there is no font for captions. **/
Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, const ContactSheetStyle& style);

/** As above without captions, with a white margin of `gap` pixels around each picture.
@throws std::invalid_argument if there is no picture or `columns` is not positive. **/
Image makeContactSheet(const std::vector<Image>& images, int columns, int cellWidth = 480,
                       int gap = 6);

/** As above with captions. **/
Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, int cellWidth = 480, int gap = 6);

/** As above from PNG files. **/
Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth = 480,
                       int gap = 6);

}  // namespace simflex
