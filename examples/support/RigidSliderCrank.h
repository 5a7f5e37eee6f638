#pragma once
/** @file
The same crank-slider with rigid parts, in plain Simbody: crank, rod and slider in a tree, the loop
closed by two equations, integrated by Runge-Kutta-Merson. **/

#include "support/SliderCrankModel.h"

namespace simflex::examples {

struct RigidSample {
    double sliderPosition;     ///< [m]
    SimTK::Vec3 bearingForce;  ///< of Ground on the crank [N]
};

/** Samples at the given times, which ascend from 0; fewer if `keepGoing(fraction)` returned false.
@param accuracy  of Simbody's error control **/
std::vector<RigidSample> runRigidSliderCrank(const SliderCrankOptions& options,
                                             const ReducedBody& crankPart,
                                             const ReducedBody& rodPart,
                                             const std::vector<double>& times, double accuracy,
                                             const std::function<bool(double)>& keepGoing);

}  // namespace simflex::examples
