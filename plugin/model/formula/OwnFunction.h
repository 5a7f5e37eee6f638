#pragma once
/** @file
A function of a program's own that formulas may call:

    ModelText text = loadModelText("arm.yaml");
    text.functions["controller"] = {2, 2, [](const double* x, int) { return 80*x[0] - 9*x[1]; }};
    text.set("loads.motor.torque", "[0, 0, 'controller(target - angle, speed)']");

Its slopes are taken by central differences: a Newton matrix costs two more calls for each argument.
It has no second derivative, so that no motion can be prescribed by it, and nobody knows at which
times it changes its course: steps find that by their error. **/

#include <functional>

namespace simflex {
namespace formula {

struct OwnFunction {
    int fewest = 1, most = 1;  ///< arguments
    /** The same value for the same arguments, NaN where it has none. Several threads may call it at
    once. **/
    std::function<double(const double* arguments, int count)> calc;
};

}  // namespace formula
}  // namespace simflex
