#pragma once
/** @file
Several pictures on one sheet, for a README or a report. **/

#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {

/** Lays pictures out in rows, left to right, each scaled to `cellWidth` pixels with its own aspect
ratio; cells are as high as the highest picture. `gap` pixels of white lie around each.
@throws std::invalid_argument when there is no picture or `columns` is not positive. **/
Image makeContactSheet(const std::vector<Image>& images, int columns, int cellWidth = 480,
                       int gap = 6);

/** The same with a line of text under each picture.
@throws std::invalid_argument, too, unless there are as many captions as pictures.
@throws std::runtime_error when there is no font. **/
Image makeContactSheet(const std::vector<Image>& images, const std::vector<std::string>& captions,
                       int columns, int cellWidth = 480, int gap = 6);

/** The same from PNG files. **/
Image makeContactSheet(const std::vector<std::string>& pngFiles, int columns, int cellWidth = 480,
                       int gap = 6);

}  // namespace simflex
