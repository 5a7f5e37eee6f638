#pragma once
/** @file
Mass properties of solid shapes of uniform density. **/

#include <string>

#include "Simbody.h"

namespace simflex {
namespace model {

/** Volume [m³], its centroid [m] and its second moments about the origin, ∫r rᵀ dV [m⁵]. **/
struct SolidMoments {
    double volume = 0;
    SimTK::Vec3 center{0};
    SimTK::Mat33 second{0};

    SolidMoments& operator+=(const SolidMoments& other);
    /** The same solid moved by X. **/
    SolidMoments moved(const SimTK::Transform& X) const;
    /** Mass properties in the moments' frame. **/
    SimTK::MassProperties calcMassProperties(double density) const;
};

/** Solids centred at the origin; dimensions [m]. A cylinder's `length` is along `axis`. **/
SolidMoments calcBoxMoments(const SimTK::Vec3& sides);
SolidMoments calcSphereMoments(double radius);
SolidMoments calcCylinderMoments(double radius, double length, SimTK::CoordinateAxis axis);

/** Moments of the volume enclosed by a surface, by the divergence theorem: sums over tetrahedra
with a common apex. A mesh that is inside out as a whole is corrected.
@param name  for messages
@throws std::invalid_argument naming a place if the surface has a hole or neighbouring faces have
opposite orientations; also if there is no volume. **/
SolidMoments calcMeshMoments(const SimTK::PolygonalMesh& mesh, const std::string& name);

/** Checks mass > 0 [kg], and that principal moments [kg m²] are positive and satisfy the triangle
inequality.
@throws std::invalid_argument naming the value found. **/
void checkInertia(double mass, const SimTK::Mat33& inertia);

}  // namespace model
}  // namespace simflex
