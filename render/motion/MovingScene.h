#pragma once
/** @file
A motion for animation files: bodies with fixed surfaces and a pose at each time, flexible ones with
their modal coordinates. Springs and dampers are straight rods; temporary objects (arrows, lines,
texts) are omitted. Internal to the renderer. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/render/scene/FrameSnapshot.h"

namespace simflex {

struct MovingScene {
    struct Body {
        std::string name;
        std::vector<SimTK::Transform> poses;  ///< in Ground, at each time; a single one: fixed
        std::vector<SurfaceItem> items;       ///< of a rigid body, in its frame
        std::vector<PartSnapshot> motion;     ///< of a flexible body, at each time
        bool isFlexible() const { return !motion.empty(); }
    };
    struct View {
        std::string name;
        double aspect = 1;
        std::vector<Camera> cameras;  ///< at each time
    };
    /** Both ends of a spring or damper, at each time. **/
    using Link = std::vector<std::array<SimTK::Vec3, 2>>;

    std::vector<double> time;
    double factor = 1;  ///< deformation factor
    SimTK::UnitVec3 up{SimTK::YAxis};
    SimTK::Vec3 center_G{0};
    double radius = 1, groundHeight = 0;
    std::vector<Body> bodies;
    std::vector<View> views;
    std::vector<Link> links;
    SurfaceGeometryPtr rod;  ///< shape of links: along y, from −1 to 1, of radius 1
    PartStyle style;
    SimTK::Vec2 range{0, 1};  ///< of the contour
};

}  // namespace simflex
