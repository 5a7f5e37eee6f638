#pragma once
/** @file
Window settings of a visualizer, stored and returned but not used. Internal. **/

#include <map>
#include <utility>
#include <vector>

#include "Simbody.h"

namespace simflex {

struct WindowSettings {
    struct Slider {
        SimTK::Real low, high, value;
    };

    SimTK::Visualizer::Mode mode = SimTK::Visualizer::PassThrough;
    SimTK::Real frameRate = 0, realTimeScale = 1, bufferLength = -1;
    bool shutsDownWhenDestructed = false;
    std::vector<std::pair<int, int>> menuItems;  ///< (menu, item) in the order added
    std::vector<int> sliderOrder;
    std::map<int, Slider> sliders;
};

}  // namespace simflex
