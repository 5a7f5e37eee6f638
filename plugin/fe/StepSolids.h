#pragma once
/** @file
Names and corners of the solids in a STEP file (ISO 10303-21), with the structure of its assembly.
Internal to fe. Gmsh's volumes have no names, so they are matched to the file's solids by their
corners (matchSolids()). **/

#include <string>
#include <vector>

#include "simflex/fe/Vec3d.h"

namespace simflex {

/** A solid, listed once per occurrence in the assembly. **/
struct StepSolid {
    /** Names of products and their occurrences, from the top of the assembly downwards, and its
    own; without empty names and duplicates. **/
    std::vector<std::string> names;
    std::vector<Vec3d> corners;  ///< ends of edges [m], sorted, without duplicates
};

/** Returns the solids in the order of the file.
@throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument for an assembly that contains itself. **/
std::vector<StepSolid> readStepSolids(const std::string& path);

/** Returns whether all points of each list are in the other. **/
bool haveSameCorners(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b);

/** Returns for each solid the index of a volume with the same corners, -1 if there is none; several
such volumes are assigned in order. **/
std::vector<int> matchSolids(const std::vector<StepSolid>& solids,
                             const std::vector<std::vector<Vec3d>>& volumes);

}  // namespace simflex
