#pragma once
/** @file
Mass properties of solid shapes of even density. **/

#include <string>

#include "Simbody.h"

namespace simflex {
namespace model {

/** Volume [m³], its centre [m] and its second moments about the origin, ∫r rᵀ dV [m⁵]. **/
struct SolidMoments {
    double volume = 0;
    SimTK::Vec3 center{0};
    SimTK::Mat33 second{0};

    /** Both solids together. **/
    SolidMoments& operator+=(const SolidMoments& other);
    /** The same solid placed at X. **/
    SolidMoments moved(const SimTK::Transform& X) const;
    /** In the frame of the moments. **/
    SimTK::MassProperties calcMassProperties(double density) const;
};

SolidMoments calcBoxMoments(const SimTK::Vec3& sides);
SolidMoments calcSphereMoments(double radius);
SolidMoments calcCylinderMoments(double radius, double length, SimTK::CoordinateAxis axis);

/** Of what a closed surface encloses, by the divergence theorem: sums over tetrahedra from a
common apex. Whole meshes whose faces are turned inside out are turned back.
@param name  for messages
@throws std::invalid_argument if the surface is not closed (names an edge that has not two faces),
    if neighbouring faces are turned against each other, or if there is no volume. **/
SolidMoments calcMeshMoments(const SimTK::PolygonalMesh& mesh, const std::string& name);

/** Checks mass > 0 and that principal moments are positive and satisfy the triangle inequality.
@throws std::invalid_argument naming the value found. **/
void checkInertia(double mass, const SimTK::Mat33& inertia);

}  // namespace model
}  // namespace simflex
