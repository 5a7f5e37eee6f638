#pragma once
/** @file
A prismatic beam along x as a reduced part, by CalculiX: no Poisson's effect, so that it obeys beam
theory but for shear, a matter of (height/length)². **/

#include <memory>

#include "simflex/part/ReducedBody.h"

namespace simflex::test {

struct BeamOptions {
    double length = 1, height = 0.01, width = 0.01;  ///< along x, y, z [m]
    double E = 70e9, density = 2700;
    int numElements = 20;  ///< along the beam, 20-node bricks
    int numAcross = 1;     ///< of them over height and width
    int numModes = 30;     ///< Craig–Bampton, 12 of its ends "root" and "tip" among them
};

/** Reduced with geometric stiffness, with interfaces "root" (x = 0) and "tip" (x = length). **/
std::shared_ptr<const ReducedBody> makeBeam(const BeamOptions& options);

}  // namespace simflex::test
