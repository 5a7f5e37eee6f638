#pragma once
/** @file
Where in a picture the surface of a flexible part is, and what is under a pixel.

@code
    viz.drawFrame(state);
    if (const auto point = viz.pickNode(640, 360))
        std::printf("%s, node %d: %g Pa", point->body.c_str(), point->nodeNumber, point->value);
    const simflex::NodeView tip = viz.findNode("rod", 118);  // its pixel, value and colour
@endcode **/

#include <string>

#include "SimTKcommon.h"

namespace simflex {

/** A point of a flexible part's surface as it was drawn: deformed, the deformation exaggerated. **/
struct SurfacePoint {
    std::string body;           ///< its name
    SimTK::Vec3 location_G{0};  ///< [m]
    double distance = 0;        ///< along the view direction [m]
    double value = SimTK::NaN;  ///< of the contour, interpolated [SI]; NaN: none is known here
    int nodeNumber = 0;         ///< of the nearest node, as in the deck
    SimTK::Vec3 nodeLocation_G{0};
    double nodeValue = SimTK::NaN;
};

/** A node as it was drawn. **/
struct NodeView {
    SimTK::Vec3 location_G{0};  ///< [m]
    SimTK::Vec3 pixel{0};       ///< column, row and distance, see OffscreenVisualizer::calcPixel()
    double value =
        SimTK::NaN;          ///< of the contour [SI]; NaN inside the part and where none is known
    SimTK::Vec3 color{0};    ///< of that value, before light
    bool isVisible = false;  ///< in the picture, and nothing opaque before it
};

}  // namespace simflex
