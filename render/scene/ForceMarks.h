#pragma once
/** @file
Connectors and loads in pictures. Internal to the renderer. **/

#include <vector>

#include "DrawnPoses.h"
#include "FrameSnapshot.h"
#include "Simbody.h"
#include "simflex/render/DrawnForces.h"

namespace simflex {

class ForceMarks {
public:
    bool showConnectors = true, showLoads = true;
    std::vector<DrawnConnector> connectors;
    std::vector<DrawnLoad> loads;
    std::vector<DrawnSpreadLoad> spreadLoads;

    bool isEmpty() const {
        return !(showConnectors && !connectors.empty()) &&
               !(showLoads && !(loads.empty() && spreadLoads.empty()));
    }

    /** Appends the symbols. Stage::Position.
    @param scale  of symbols, the radius of the largest part [m] **/
    void append(const SimTK::SimbodyMatterSubsystem& matter, const SimTK::State& state,
                const DrawnPoses& drawn, double scale, const FrameSnapshot& frame,
                SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

    /** Resets the largest loads, which set the scale of the arrows. **/
    void forgetRun() { largestForce = largestTorque = 0; }

private:
    struct Arrow {
        SimTK::Vec3 point_G, force_G, torque_G;
    };
    std::vector<Arrow> calcArrows(const SimTK::State& state, const DrawnPoses& drawn) const;
    void appendArrows(const std::vector<Arrow>& arrows, double scale, const Scene& scene,
                      SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

    double largestForce = 0, largestTorque = 0;
};

}  // namespace simflex
