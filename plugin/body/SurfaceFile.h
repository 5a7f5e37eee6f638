#pragma once
/** @file
Surfaces in the files of other programs. Read by simflex: Simbody's own readers print a file's words
into a buffer of 1024 bytes, however long they are. Internal.

- .stl: text, all its solids, or binary; vertices at one place are one, within 1e-6 of its extent;
- .obj: lines "v x y z" and "f 1 2 3", "f 1/7/2 …", "f -3 -2 -1"; others are passed over;
- .vtp: the polygons of all pieces of VTK's PolyData, as text (format="ascii"). **/

#include <SimTKcommon.h>

#include <string>

namespace simflex {

/** Faces refer to vertices that there are.
@throws std::runtime_error that says what is wrong, and in which line, but not the file's name **/
SimTK::PolygonalMesh readSurface(const std::string& path);

}  // namespace simflex
