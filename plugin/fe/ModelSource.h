#pragma once
/** @file
Reads a finite element model from whatever there is, by the name of the file:

- .inp: a CalculiX or Abaqus deck (CalculixDeck.h);
- .bdf .nas .dat: Nastran bulk data, .cdb: a model of Ansys (CalculixDeck.h, too);
- .mtx + mass matrix + nodes: Matrix Market (MatrixMarket.h) or Abaqus (AbaqusMatrices.h);
- .pch [+ mass matrix] + nodes: Nastran DMIG (NastranDmig.h);
- .mat, .npz: arrays of MATLAB and NumPy (ArrayMatrices.h);
- .msh .unv .geo .step .stp .brep .iges .igs + material: Gmsh mesh or geometry (GmshPart.h);

then converts it to SI and warns if its numbers cannot be that. **/

#include <string>

#include "simflex/fe/GmshPart.h"
#include "simflex/fe/NastranDmig.h"
#include "simflex/fe/UnitSystem.h"

namespace simflex {

struct SourceOptions {
    std::string path;
    std::string massMatrix;                                 ///< of .mtx, .pch
    std::string nodes;                                      ///< of .mtx, .pch
    std::string dofs;                                       ///< of Matrix Market
    std::string stiffnessName = "KAAX", massName = "MAAX";  ///< of .pch
    std::string material;                                   ///< of Gmsh: see parseMaterials()
    GmshOptions gmsh;              ///< its materials and calculix are taken from here
    std::string units = "m-kg-s";  ///< see UnitSystem.h
    CalculixOptions calculix;      ///< also note and progress for all other sources
};

/** True for a deck or bulk data in SI units, whose mesh is that of the part: readCalculixMesh().
 * **/
bool isCalculixDeck(const SourceOptions& options);

/** Reads, converts and checks. Notes go to options.calculix.note and FeModel::notes, warnings
to options.calculix.warn and FeModel::warnings.
@throws std::invalid_argument for a file of unknown kind, an option that is missing or does not
belong to it; otherwise as the reader it calls. **/
FeModel readModelSource(const SourceOptions& options);

}  // namespace simflex
