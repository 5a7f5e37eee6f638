#pragma once
/** @file
Scales that make the coordinates of a system comparable, per speed in the solver's numbering
(private header). **/

#include <vector>

namespace simflex {

struct Blocks;

struct CoordinateScales {
    static constexpr double StepFraction = 3e-4;  ///< difference step relative to a body's size

    explicit CoordinateScales(const Blocks& blocks);

    std::vector<double> metres;   ///< displacement per unit of the quasi-coordinate [m]
    std::vector<double> step;     ///< quasi-displacement for differences
    std::vector<double> rate;     ///< [1/s]: 1, or a mode's natural frequency
    std::vector<double> lengths;  ///< size of each block [m]
    /** Distance of the farthest frame from Ground's origin, relative to the largest block. **/
    double originDistance = 0;
};

}  // namespace simflex
