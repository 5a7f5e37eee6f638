#pragma once
/** @file
A part from a Gmsh mesh (.msh), a Gmsh script (.geo) or CAD geometry (.step, .stp, .brep) and a
material: Gmsh meshes it, CalculiX assembles its matrices. Physical groups become node sets of their
names. Surface and line elements are left out.

    GmshOptions options;
    options.material = findMaterial("aluminium");
    options.meshSize = 0.004;
    FeModel bracket = readGmshPart("bracket.step", options);
**/

#include <string>
#include <utility>
#include <vector>

#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/Material.h"

namespace simflex {

struct GmshOptions {
    Material material;
    double meshSize = 0;    ///< largest element, in the geometry's unit; 0: Gmsh's own choice
    int order = 0;          ///< 1 or 2; 0: as it is for a mesh, else 2
    double lengthUnit = 0;  ///< one unit of the geometry in metres; 0: metres, of STEP as it says
    /** Gmsh's own options and constants of the script, `-setnumber NAME VALUE`. **/
    std::vector<std::pair<std::string, std::string>> settings;
    std::string program;   ///< of Gmsh; if empty, $SIMFLEX_GMSH, else `gmsh` on the PATH
    std::string keepDeck;  ///< if not empty, the deck is kept under this name (.inp)
    CalculixOptions calculix;
};

/** Meshes and assembles.
@throws std::invalid_argument for options that cannot be; for a mesh that is not one free solid
part.
@throws std::runtime_error if a file cannot be read or Gmsh (with its own error text) or CalculiX
fails.
@throws Cancelled if options.calculix.progress asks to stop. **/
FeModel readGmshPart(const std::string& path, const GmshOptions& options);

}  // namespace simflex
