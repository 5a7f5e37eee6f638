#pragma once
/** @file
Combines two pictures: side by side, blended, or as their difference.

@code
    makeSideBySide(rigid, flexible, {"rigid parts", "flexible parts"}).writePng("both.png");
@endcode **/

#include <array>
#include <string>

#include "simflex/render/Image.h"

namespace simflex {

struct SideBySideStyle {
    enum class Arrangement { LeftRight, TopBottom };

    Arrangement arrangement = Arrangement::LeftRight;
    int gap = 4;  ///< between the pictures [pixel]
    Image::Pixel background{255, 255, 255, 255};
    Image::Pixel text{28, 34, 44, 255};
};

/** Places two pictures next to each other, with a narrow gap, each below its caption, if there are
captions. A smaller picture is centred.
@throws std::invalid_argument if a picture is empty or the gap is negative.
@throws std::runtime_error if there is no font for captions. **/
Image makeSideBySide(const Image& first, const Image& second,
                     const std::array<std::string, 2>& captions = {},
                     const SideBySideStyle& style = {});

/** Returns width and height of the result of makeSideBySide() for pictures of these sizes. **/
std::array<int, 2> calcSideBySideSize(const std::array<int, 2>& first,
                                      const std::array<int, 2>& second,
                                      const std::array<std::string, 2>& captions = {},
                                      const SideBySideStyle& style = {});

/** Returns the weighted mean of two pictures of the same size; `weight` of the second one, 0…1.
@throws std::invalid_argument if sizes differ or the weight is outside. **/
Image makeBlend(const Image& first, const Image& second, double weight = 0.5);

/** Draws the first picture in faint grey and differences of the second in red, of full intensity
from a difference of `full` (of 255).
@throws std::invalid_argument if sizes differ. **/
Image makeDifference(const Image& first, const Image& second, int full = 64);

}  // namespace simflex
