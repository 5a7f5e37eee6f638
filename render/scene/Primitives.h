#pragma once
/** @file
Unit shapes for Simbody's decorative geometry. `slices` is the number of divisions of a full circle.
Axes are Simbody's: cylinders along y, circles in x–y, tori about z. Internal. **/

#include <memory>

#include "SurfaceGeometry.h"

namespace simflex {

using SurfaceGeometryPtr = std::shared_ptr<const SurfaceGeometry>;

SurfaceGeometryPtr createBrick();               ///< half lengths 1
SurfaceGeometryPtr createSphere(int slices);    ///< radius 1
SurfaceGeometryPtr createCylinder(int slices);  ///< radius 1, half height 1
SurfaceGeometryPtr createCircle(int slices);    ///< filled disc of radius 1
SurfaceGeometryPtr createCone(int slices);      ///< base radius 1 at y = 0, tip at y = 1
SurfaceGeometryPtr createTorus(double tubeRadius, int slices);  ///< torus radius 1

/** Creates a polygonal mesh with welded vertices, faces divided into triangles and smoothed
normals.
@throws std::runtime_error if a face has fewer than three vertices or a vertex is not finite. **/
SurfaceGeometryPtr createFromPolygons(const SimTK::PolygonalMesh& mesh);

}  // namespace simflex
