#pragma once
/** @file
Relation between the pixels of a picture and the surface points and nodes of flexible parts.

@code
    viz.drawFrame(state);
    if (const auto point = viz.pickNode(640, 360))
        std::printf("%s, node %d: %g Pa", point->body.c_str(), point->nodeNumber, point->value);
    const simflex::NodeView tip = viz.findNode("rod", 118);  // its pixel, value and colour
@endcode **/

#include <string>

#include "SimTKcommon.h"

namespace simflex {

/** A point on a flexible part's surface as drawn, with exaggerated deformation. **/
struct SurfacePoint {
    std::string body;           ///< its name
    SimTK::Vec3 location_G{0};  ///< [m]
    double distance = 0;        ///< along the view direction [m]
    double value = SimTK::NaN;  ///< of the contour, interpolated [SI]; NaN: unknown
    int nodeNumber = 0;         ///< deck number of the nearest node
    SimTK::Vec3 nodeLocation_G{0};
    double nodeValue = SimTK::NaN;
};

/** A node as drawn. **/
struct NodeView {
    SimTK::Vec3 location_G{0};  ///< [m]
    SimTK::Vec3 pixel{0};       ///< column, row and distance, see OffscreenVisualizer::calcPixel()
    double value = SimTK::NaN;  ///< of the contour [SI]; NaN inside the part and where unknown
    SimTK::Vec3 color{0};       ///< of that value, without lighting
    bool isVisible = false;     ///< inside the picture and not hidden by an opaque surface
};

}  // namespace simflex
