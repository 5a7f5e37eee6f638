#pragma once
/** @file
What lies behind a scene: background, ground with its grid, and the shadow on it, as GlGround draws
them. Internal to the rasterizer. **/

#include <vector>

#include "Spans.h"
#include "simflex/render/Image.h"
#include "simflex/render/gl/GlView.h"
#include "simflex/render/scene/GroundShadow.h"

namespace simflex {
namespace raster {

/** The ground as the camera sees it: a pixel's place on it, where the pixel shows it. **/
class GroundView {
public:
    explicit GroundView(const GlView& view);

    /** Place on the ground, from the middle of the scene, times `depth`, which is positive where
    there is ground. **/
    struct Place {
        double x, y, depth;
    };
    Place at(double column, double row) const;
    /** How it changes by a pixel to the right, and downwards. **/
    Place byColumn, byRow;
    Place start;  ///< at the top left corner

    /** Depth in the picture, 0 … 1 between the clipping planes, of a place: linear in it. **/
    double zStart, zByColumn, zByRow;
};

class Backdrop {
public:
    /** Draws it unless it shows the same already. **/
    void update(const GlView& view, bool hasGround);

    /** Copies a row. **/
    void copy(int row, const GlView& view, std::uint8_t* to) const;

private:
    std::vector<double> key;
    Image image;
};

/** Pixels that may lie in the shadow. **/
Area findShaded(const GlView& view, const GroundShadow& shadow);

/** Darkens those of a row, which is given from its first pixel on, as the shadow does.
@param isHidden  of the row's pixels: no need to; null: none **/
void darken(int row, const Area& area, const GlView& view, const GroundShadow& shadow,
            const std::uint8_t* isHidden, std::uint8_t* pixels);

}  // namespace raster
}  // namespace simflex
