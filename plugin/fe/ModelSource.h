#pragma once
/** @file
Reads a finite element model from any supported source, selected by the file's suffix:

- .inp: a CalculiX or Abaqus deck (CalculixDeck.h);
- .bdf .nas .dat: Nastran bulk data, .cdb: an Ansys model (also CalculixDeck.h);
- .mtx + mass matrix + nodes: Matrix Market (MatrixMarket.h) or Abaqus (AbaqusMatrices.h);
- .pch [+ mass matrix] + nodes: Nastran DMIG (NastranDmig.h);
- .mat, .npz: arrays of MATLAB and NumPy (ArrayMatrices.h);
- .msh .unv .geo .step .stp .brep .iges .igs + material: Gmsh mesh or geometry (GmshPart.h);

then converts it to SI and warns if the numbers are implausible. **/

#include <string>

#include "simflex/fe/GmshPart.h"
#include "simflex/fe/NastranDmig.h"
#include "simflex/fe/UnitSystem.h"

namespace simflex {

struct SourceOptions {
    std::string path;
    std::string massMatrix;                                 ///< for .mtx, .pch
    std::string nodes;                                      ///< for .mtx, .pch
    std::string dofs;                                       ///< for Matrix Market
    std::string stiffnessName = "KAAX", massName = "MAAX";  ///< for .pch
    std::string material;                                   ///< for Gmsh: see parseMaterials()
    GmshOptions gmsh;              ///< its materials and calculix are set from the members here
    std::string units = "m-kg-s";  ///< see UnitSystem.h
    CalculixOptions calculix;      ///< note and progress also apply to all other sources
};

/** Returns whether the source is a deck or bulk data in SI units, whose mesh is that of the part:
readCalculixMesh(). **/
bool isCalculixDeck(const SourceOptions& options);

/** Reads, converts and checks a model. Notes go to options.calculix.note and FeModel::notes,
warnings to options.calculix.warn and FeModel::warnings.
@throws std::invalid_argument for a file of unknown kind and for missing or inapplicable options;
otherwise as the reader it calls. **/
FeModel readModelSource(const SourceOptions& options);

}  // namespace simflex
