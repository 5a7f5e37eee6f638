#pragma once
/** @file
Sizes that make the coordinates of a system comparable, by speed in the solver's numbering (private
header). **/

#include <vector>

namespace simflex {

struct Blocks;

struct CoordinateScales {
    static constexpr double StepFraction = 3e-4;  ///< of a body's size, for differences

    explicit CoordinateScales(const Blocks& blocks);

    std::vector<double> metres;   ///< displacement per unit of the quasi-coordinate
    std::vector<double> step;     ///< quasi-displacement for differences
    std::vector<double> rate;     ///< [1/s]: 1, or a mode's natural frequency
    std::vector<double> lengths;  ///< size of each block [m]
    /** Distance of the furthest frame from Ground's origin, of the largest block's size. **/
    double originDistance = 0;
};

}  // namespace simflex
