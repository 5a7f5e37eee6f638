#pragma once
/** @file
An exact reduced part without finite elements: point masses at the nodes of a small, jittered brick
mesh, smooth random mode shapes, invariants by direct sums. Everything in its ReducedBody can be
checked against the masses themselves.

    PointMassPartOptions options;
    options.numModes = 14;
    const PointMassPart part = makePointMassPart(options);
    FlexibleBody body(flexible, part.body);

The modes are mean-axis (∑mφ = 0, ∑m s×φ = 0) and mass-orthonormal. Interfaces "A" and "B" sit on
the nodes of least and greatest x, further ones ("C", "D", …) on other nodes. The Φ of an interface
is its node's mode shape, its Ψ half the curl of the smooth field there. SI units. **/

#include <array>
#include <memory>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex::test {

struct PointMassPartOptions {
    unsigned seed = 1;
    int numModes = 11;
    std::array<int, 3> cells{3, 1, 1};           ///< Hex8 elements along x, y, z
    std::array<double, 3> size{0.4, 0.12, 0.1};  ///< brick size [m]
    double jitter = 0.2;                         ///< of the nodes, relative to the cell size
    double mass = 2;                             ///< total [kg]; nodal masses vary by up to half
    double lowestFrequency = 20;                 ///< [Hz]
    double highestFrequency = 400;  ///< [Hz]; frequencies in between are random, ascending
    int numInterfaces = 2;
    /** Magnitude of the entries of a random geometric stiffness; 0 for none. **/
    double stiffening = 0;
};

struct PointMassPart {
    std::shared_ptr<const ReducedBody> body;
    std::vector<double>
        masses;  ///< of node k [kg]; its position and mode shapes are body->mesh, body->Phi
};

/** @throws std::invalid_argument if the mesh has too few nodes for the requested modes or
interfaces. **/
PointMassPart makePointMassPart(const PointMassPartOptions& options = {});

}  // namespace simflex::test
