#pragma once
/** @file
Names and corners of the solids of a STEP file (ISO 10303-21), with its assembly's structure.
Internal to fe.

Gmsh's volumes have no names. Those of the file are found by geometry: a solid is the volume that
has its corners (matchSolids()). **/

#include <string>
#include <vector>

#include "simflex/fe/Vec3d.h"

namespace simflex {

/** A solid, as often as it stands in the assembly. **/
struct StepSolid {
    /** Of products and of their occurrences, from the whole assembly down, and its own; none is
    empty, none comes twice. **/
    std::vector<std::string> names;
    std::vector<Vec3d> corners;  ///< where edges end [m], sorted, each once
};

/** Solids in the order of the file.
@throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument for a file whose assembly holds itself. **/
std::vector<StepSolid> readStepSolids(const std::string& path);

/** Whether all points of each list are among the other's. **/
bool haveSameCorners(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b);

/** For each solid the index of the volume that has the same corners, -1 if none has; of volumes
with the same corners the next one. **/
std::vector<int> matchSolids(const std::vector<StepSolid>& solids,
                             const std::vector<std::vector<Vec3d>>& volumes);

}  // namespace simflex
