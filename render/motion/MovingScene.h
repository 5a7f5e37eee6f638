#pragma once
/** @file
A motion as files of moving scenes have it: bodies with fixed surfaces and a pose at each time,
flexible ones with their modal coordinates. Springs and dampers are straight rods; what comes
and goes (arrows, lines, texts) is not in it. Internal to the renderer. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/render/scene/FrameSnapshot.h"

namespace simflex {

struct MovingScene {
    struct Body {
        std::string name;
        std::vector<SimTK::Transform> poses;  ///< in Ground, at each time; one: it does not move
        std::vector<SurfaceItem> items;       ///< of a rigid one, in its frame
        std::vector<PartSnapshot> motion;     ///< of a flexible one, at each time
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
    double factor = 1;  ///< of deformation
    SimTK::UnitVec3 up{SimTK::YAxis};
    SimTK::Vec3 center_G{0};
    double radius = 1, groundHeight = 0;
    std::vector<Body> bodies;
    std::vector<View> views;
    std::vector<Link> links;
    SurfaceGeometryPtr rod;  ///< what links are drawn as: along y, from −1 to 1, of radius 1
    PartStyle style;
    SimTK::Vec2 range{0, 1};  ///< of the contour
};

}  // namespace simflex
