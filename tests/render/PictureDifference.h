#pragma once
/** @file
Perceptual difference of two pictures, for comparing a frame with a reference picture.

Both pictures are converted to CIELAB (sRGB, white point D65), and each channel is smoothed by a
Gaussian of one pixel. The difference at a pixel is the smallest ΔE (CIE76) to the pixels within
half a pixel. Driver round-off at edges or in shades disappears; a colour, letter or edge that has
moved by a pixel or more remains. ΔE = 2.3 is a just noticeable difference. **/

#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {
namespace test {

struct PictureDifference {
    double largest = 0;      ///< ΔE
    double fraction = 0;     ///< of pixels that differ visibly, ΔE > visible
    int numClustered = 0;    ///< visible pixels in the 9 × 9 window with the most of them
    std::vector<float> map;  ///< ΔE of each pixel, row by row
    int width = 0, height = 0;

    static constexpr double visible = 6;

    /** Returns a grey picture of the difference: white for none, black for ΔE of 30 and more. **/
    Image makePicture() const;

    /** True if no visible spot of difference remains. **/
    bool isNegligible() const { return numClustered <= 12 && fraction <= 2e-4; }
};

/** @throws std::invalid_argument if the sizes differ. **/
PictureDifference comparePictures(const Image& a, const Image& b);

/** Compares a frame with the file NAME.png in the folder of reference pictures and returns an empty
string if they look alike. Otherwise, writes the frame, the reference and their difference to a
folder and names it in the returned message. With the environment variable
SIMFLEX_UPDATE_REFERENCES=1 the frame becomes the reference instead. **/
std::string compareWithReference(const Image& frame, const std::string& name);

}  // namespace test
}  // namespace simflex
