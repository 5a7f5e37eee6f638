#pragma once
/** @file
The skin of a reduced part, deformed: positions s + factor·Φξ by one matrix product. Internal.

Only the rows of Φ that belong to the skin are kept, in single precision. **/

#include <memory>
#include <vector>

#include "SimTKcommon.h"
#include "SurfaceGeometry.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

class DeformedSurface {
public:
    /** @throws std::invalid_argument that names the part, when Φ and mesh do not fit together. **/
    DeformedSurface(std::shared_ptr<const ReducedBody> part, double creaseAngle);

    const ReducedBody& getPart() const { return *part; }

    /** Largest displacement |Φξ| on the skin, not exaggerated [m]. **/
    double calcLargestDisplacement(const SimTK::Vector& xi);

    /** Moves vertices to s + factor·Φξ, with normals, and their contour values to |Φξ| [m]. **/
    void update(const SimTK::Vector& xi, double factor);

    /** Position in B of any mesh node under the same deformation. **/
    SimTK::Vec3 calcNodePosition(int node, const SimTK::Vector& xi, double factor) const;

    std::shared_ptr<const SurfaceGeometry> getDeformed() const { return deformed; }
    std::shared_ptr<const SurfaceGeometry> getUndeformed() const { return undeformed; }

private:
    void calcDisplacements(const SimTK::Vector& xi);

    std::shared_ptr<const ReducedBody> part;
    std::vector<int> vertexNode;       // skin node of each vertex
    std::vector<float> restPositions;  // s of skin nodes, 3 each
    std::vector<float> skinPhi;        // (3·skin nodes)×n_f
    std::vector<float> displacements;  // Φξ, 3 each
    std::vector<float> modal;          // ξ of `displacements`
    bool hasDisplacements = false;
    std::shared_ptr<SurfaceGeometry> deformed, undeformed;
};

}  // namespace simflex
