#pragma once
/** @file
How different two pictures look: for comparing a frame with a reference picture.

Both pictures are brought to CIELAB (sRGB, white point D65), each channel is smoothed by a Gaussian
of one pixel, and the smaller of the distances ΔE (CIE76) to the pixels within half a pixel of the
same place counts: what a driver rounds differently, at an edge or in a shade, disappears; a colour,
a letter or an edge that has moved by a pixel or more stays. ΔE = 2.3 is a just noticeable
difference. **/

#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {
namespace test {

struct PictureDifference {
    double largest = 0;      ///< ΔE
    double fraction = 0;     ///< of pixels that differ visibly, ΔE > visible
    int numClustered = 0;    ///< visible pixels in the 9 × 9 window that has most of them
    std::vector<float> map;  ///< ΔE of each pixel, row by row
    int width = 0, height = 0;

    static constexpr double visible = 6;

    /** A grey copy of the difference: white is nothing, black is ΔE of 30 and more. **/
    Image makePicture() const;

    /** No spot of visible difference that an eye would find. **/
    bool isNegligible() const { return numClustered <= 12 && fraction <= 2e-4; }
};

/** @throws std::invalid_argument when the sizes differ. **/
PictureDifference comparePictures(const Image& a, const Image& b);

/** Compares a frame with the file NAME.png in the folder of reference pictures. With the
environment variable SIMFLEX_UPDATE_REFERENCES=1 the frame becomes the reference instead. On a
failure the frame, the reference and their difference are written to a folder, which the message
names. Empty when they look alike. **/
std::string compareWithReference(const Image& frame, const std::string& name);

}  // namespace test
}  // namespace simflex
