#pragma once
/** @file
The deformed skin of a reduced part: positions s + factor·Φξ by one matrix product. Internal. This
is a workspace: each thread has its own for the shared SkinModes. **/

#include <memory>
#include <vector>

#include "SimTKcommon.h"
#include "SkinModes.h"
#include "simflex/render/scene/ReferenceMotion.h"

namespace simflex {

class DeformedSurface {
public:
    explicit DeformedSurface(std::shared_ptr<const SkinModes> skin);

    const SkinModes& getSkin() const { return *skin; }
    const ReducedBody& getPart() const { return *skin->part; }

    /** Returns the largest displacement on the skin from a reference, unscaled [m].
    @throws std::invalid_argument naming the part if ξ has the wrong size, as below. **/
    double calcLargestDisplacement(const SimTK::Vector& xi, const ReferenceMotion& reference = {});

    /** Returns Φξ, unscaled, 3 per skin node [m]. **/
    const std::vector<float>& calcDisplacements(const SimTK::Vector& xi);
    /** As above, relative to a reference. **/
    const std::vector<float>& calcDisplacements(const SimTK::Vector& xi,
                                                const ReferenceMotion& reference);

    /** Moves vertices according to ReferenceMotion (without one: s + factor·Φξ) and updates
    normals.
    @param nodeValues  contour values, one per skin node; NaN: no value; empty: leaves them
    unchanged **/
    void update(const SimTK::Vector& xi, double factor, const std::vector<float>& nodeValues,
                const ReferenceMotion& reference = {});

    /** As above with |Φξ| as values. **/
    void update(const SimTK::Vector& xi, double factor);

    /** Returns the position in B of any mesh node under the same deformation. **/
    SimTK::Vec3 calcNodePosition(int node, const SimTK::Vector& xi, double factor,
                                 const ReferenceMotion& reference = {}) const;

    std::shared_ptr<const SurfaceGeometry> getDeformed() const { return deformed; }
    std::shared_ptr<const SurfaceGeometry> getUndeformed() const { return skin->undeformed; }

private:
    std::shared_ptr<const SkinModes> skin;
    std::vector<float> displacements;  // Φξ, 3 each
    std::vector<float> relative;       // the same relative to a reference
    std::vector<float> modal, wanted;  // ξ of `displacements`; next ξ
    std::vector<float> positions;      // of points, 3 each
    std::vector<float> values;         // of points
    std::vector<float> triangleNormals;
    bool hasDisplacements = false;
    std::shared_ptr<SurfaceGeometry> deformed;
};

}  // namespace simflex
