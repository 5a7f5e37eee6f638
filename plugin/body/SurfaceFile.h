#pragma once
/** @file
Surface files of other programs. Read by simflex because Simbody's own readers copy words of any
length into a buffer of 1024 bytes. Internal.

- .stl: text (all its solids) or binary; vertices within 1e-6 of the extent are merged;
- .obj: lines "v x y z" and "f 1 2 3", "f 1/7/2 …", "f -3 -2 -1"; other lines are ignored;
- .vtp: polygons of all pieces of VTK's PolyData, as text (format="ascii"). **/

#include <SimTKcommon.h>

#include <string>

namespace simflex {

/** Reads a surface and checks its vertex indices.
@throws std::runtime_error with the reason and line, without the file's name **/
SimTK::PolygonalMesh readSurface(const std::string& path);

}  // namespace simflex
