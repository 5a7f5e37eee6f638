#pragma once
/** @file
Makes a part from a mesh (.msh of Gmsh, .unv with its groups), a Gmsh script (.geo) or CAD geometry
(.step, .stp, .brep, .iges, .igs) and a material: Gmsh generates the mesh, whose deck is then read
and assembled.

Physical groups become node sets of their names. Surface and line elements are left out, unless
surfaces have a thickness.

Touching solids of a STEP file are joined: their meshes share nodes. The names of products, their
occurrences and solids also become groups.

A script is a program. Gmsh runs it in a sandbox (base/Sandbox.h), where it can read those of
listScriptFiles() that are in its folder and write in a temporary folder, but cannot start programs
or use the network. Meshes and CAD files are data; Gmsh reads them in the sandbox, too, with access
to that file only.

    GmshOptions options;
    options.material = findMaterial("aluminium");
    options.meshSize = 0.004;
    FeModel bracket = readGmshPart("bracket.step", options);  **/

#include <string>
#include <utility>
#include <vector>

#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/Material.h"

namespace simflex {

struct GmshOptions {
    Material material;  ///< of everything without its own material; without name: none
    /** Materials of solids of a STEP assembly, or of physical groups, by name. Names that exist in
    the file but not in the part are ignored, so that parts of one file can share them. **/
    std::vector<NamedMaterial> materials;
    /** Names of the solids or physical groups that make up the part; none: all. **/
    std::vector<std::string> solids;
    double meshSize = 0;  ///< largest element size [lengthUnit, or m]; 0: Gmsh's default
    int order = 0;        ///< element order 1 or 2; 0: unchanged for a mesh, else 2
    /** Thickness of sheet metal [m]: the surfaces of the geometry become mid-surfaces of shells,
    volumes are left out. 0: the volumes become solids. **/
    double thickness = 0;
    /** Runs Gmsh without a sandbox: scripts can do whatever you may. Otherwise Gmsh runs in a
    sandbox or, if the system does not support one, not at all (unless
    $SIMFLEX_SANDBOX=optional). **/
    bool allowsScripts = false;
    /** Unit of the geometry in metres; 0: metres, or the unit stated in STEP and IGES files. **/
    double lengthUnit = 0;
    /** Gmsh's own options (Mesh.Algorithm) and constants of the script, `-setnumber NAME VALUE`. A
    constant that the script does not contain is refused. **/
    std::vector<std::pair<std::string, double>> settings;
    std::string program;   ///< path of Gmsh; if empty, $SIMFLEX_GMSH, else `gmsh` on the PATH
    std::string keepDeck;  ///< if not empty, stores the deck under this name (.inp)
    CalculixOptions calculix;
};

/** Returns whether Gmsh runs the file as a program: .geo. **/
bool isGmshScript(const std::string& path);

/** Returns the files that a script reads, itself first: its options file NAME.opt, and those given
as literal text in Include, Merge and the like, recursively for scripts. Includes names of files
that do not exist. **/
std::vector<std::string> listScriptFiles(const std::string& path);

/** Generates the mesh and assembles the matrices.
@throws std::invalid_argument for invalid options, a mesh that is not one free solid part, or a .msh
that is no mesh.
@throws std::runtime_error if a file cannot be read or Gmsh fails (with its error text).
@throws Cancelled if options.calculix.progress requests it. **/
FeModel readGmshPart(const std::string& path, const GmshOptions& options);

}  // namespace simflex
