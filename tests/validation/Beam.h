#pragma once
/** @file
A prismatic beam along x as a reduced part, by CalculiX. Poisson's ratio is zero, so it follows beam
theory except for shear, of order (height/length)². **/

#include <memory>

#include "simflex/part/ReducedBody.h"

namespace simflex::test {

struct BeamOptions {
    double length = 1, height = 0.01, width = 0.01;  ///< along x, y, z [m]
    double E = 70e9, density = 2700;
    int numElements = 20;  ///< along the beam, 20-node bricks
    int numAcross = 1;     ///< elements over height and width
    int numModes = 30;     ///< Craig–Bampton modes, 12 of them for its ends "root" and "tip"
};

/** Reduces it with geometric stiffness, with interfaces "root" (x = 0) and "tip" (x = length). **/
std::shared_ptr<const ReducedBody> makeBeam(const BeamOptions& options);

}  // namespace simflex::test
