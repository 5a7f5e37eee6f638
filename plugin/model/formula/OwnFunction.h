#pragma once
/** @file
A user-defined function that formulas may call:

    ModelText text = loadModelText("arm.yaml");
    text.functions["controller"] = {2, 2, [](const double* x, int) { return 80*x[0] - 9*x[1]; }};
    text.set("loads.motor.torque", "[0, 0, 'controller(target - angle, speed)']");  **/

#include <functional>

namespace simflex {
namespace formula {

struct OwnFunction {
    int fewest = 1, most = 1;  ///< number of arguments
    /** Must depend on its arguments alone; NaN outside its domain. Several threads may call it at
    once. **/
    std::function<double(const double* arguments, int count)> calc;
};

}  // namespace formula
}  // namespace simflex
