#pragma once
/** @file
The skin of a reduced part, deformed: positions s + factor·Φξ by one matrix product. Internal.

A workspace: each thread has its own of the SkinModes that they share. **/

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

    /** Largest displacement on the skin from a reference, not exaggerated [m].
    @throws std::invalid_argument that names the part, when ξ has another size, as below. **/
    double calcLargestDisplacement(const SimTK::Vector& xi, const ReferenceMotion& reference = {});

    /** Φξ, not exaggerated, 3 per skin node [m]. **/
    const std::vector<float>& calcDisplacements(const SimTK::Vector& xi);
    /** The same from a reference. **/
    const std::vector<float>& calcDisplacements(const SimTK::Vector& xi,
                                                const ReferenceMotion& reference);

    /** Moves vertices to where ReferenceMotion has them, s + factor·Φξ without one, with normals.
    @param nodeValues  the contour's, one per skin node; NaN: none there; empty: leave them **/
    void update(const SimTK::Vector& xi, double factor, const std::vector<float>& nodeValues,
                const ReferenceMotion& reference = {});

    /** The same with |Φξ| as values. **/
    void update(const SimTK::Vector& xi, double factor);

    /** Position in B of any mesh node under the same deformation. **/
    SimTK::Vec3 calcNodePosition(int node, const SimTK::Vector& xi, double factor,
                                 const ReferenceMotion& reference = {}) const;

    std::shared_ptr<const SurfaceGeometry> getDeformed() const { return deformed; }
    std::shared_ptr<const SurfaceGeometry> getUndeformed() const { return skin->undeformed; }

private:
    std::shared_ptr<const SkinModes> skin;
    std::vector<float> displacements;  // Φξ, 3 each
    std::vector<float> relative;       // the same from a reference
    std::vector<float> modal, wanted;  // ξ of `displacements`, and the next
    std::vector<float> positions;      // of points, 3 each
    std::vector<float> values;         // of points
    std::vector<float> triangleNormals;
    bool hasDisplacements = false;
    std::shared_ptr<SurfaceGeometry> deformed;
};

}  // namespace simflex
