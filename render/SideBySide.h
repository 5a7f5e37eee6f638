#pragma once
/** @file
Two pictures in one: beside each other, over each other, or what differs between them.

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

/** Two pictures, a thin gap between them, each under its caption; without captions there is no
room for them. A smaller picture stands in the middle of its place.
@throws std::invalid_argument when a picture is empty or the gap is negative.
@throws std::runtime_error when there is no font for captions. **/
Image makeSideBySide(const Image& first, const Image& second,
                     const std::array<std::string, 2>& captions = {},
                     const SideBySideStyle& style = {});

/** Width and height of what makeSideBySide() makes of pictures of these. **/
std::array<int, 2> calcSideBySideSize(const std::array<int, 2>& first,
                                      const std::array<int, 2>& second,
                                      const std::array<std::string, 2>& captions = {},
                                      const SideBySideStyle& style = {});

/** The mean of two pictures of the same size, `weight` that of the second one, 0…1.
@throws std::invalid_argument when sizes differ or the weight is outside. **/
Image makeBlend(const Image& first, const Image& second, double weight = 0.5);

/** The first picture in faint grey and red where the second one differs, the fuller the more, a
difference of `full` of 255 being full red.
@throws std::invalid_argument when sizes differ. **/
Image makeDifference(const Image& first, const Image& second, int full = 64);

}  // namespace simflex
