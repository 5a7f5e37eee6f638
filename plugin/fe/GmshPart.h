#pragma once
/** @file
A part from a mesh (.msh of Gmsh, .unv with its groups), a Gmsh script (.geo) or CAD geometry
(.step, .stp, .brep, .iges, .igs) and a material: Gmsh meshes it, CalculiX assembles its matrices.
Physical groups become node sets of their names. Surface and line elements are left out, unless
surfaces have a thickness.

Of a STEP file with several solids, those that touch are one: their meshes share nodes. The names of
products, of their occurrences and of solids are groups, too.

A script is a program. Gmsh runs it in a sandbox (base/Sandbox.h) where it reads those of
listScriptFiles() that lie in its folder, writes in a temporary folder, starts no program and has no
network. Meshes and CAD files are data; Gmsh reads them in the sandbox, too, where it sees the file
and nothing beside it.

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
    Material material;  ///< of all that has none of its own; without name: of nothing
    /** Of solids of a STEP assembly, or of physical groups, by their names; those that the file has
    and the part has not are no matter, so that parts of one file may share them. **/
    std::vector<NamedMaterial> materials;
    /** Names of the solids or physical groups that are the part; none: all. **/
    std::vector<std::string> solids;
    double meshSize = 0;  ///< largest element [lengthUnit, or m]; 0: Gmsh's own choice
    int order = 0;        ///< 1 or 2; 0: as it is for a mesh, else 2
    /** Of sheet metal [m]: the surfaces of the geometry become shells about them, volumes are left
    out. 0: the volumes become solids. **/
    double thickness = 0;
    /** Gmsh runs without a sandbox: scripts can do whatever you may. Otherwise it runs in one, or,
    on a system that has none, not at all (with $SIMFLEX_SANDBOX=optional it does). **/
    bool allowsScripts = false;
    /** One unit of the geometry in metres; 0: metres, of STEP and IGES as they say. **/
    double lengthUnit = 0;
    /** Gmsh's own options (Mesh.Algorithm) and constants of the script, `-setnumber NAME VALUE`. A
    constant that the script does not name is refused. **/
    std::vector<std::pair<std::string, double>> settings;
    std::string program;   ///< of Gmsh; if empty, $SIMFLEX_GMSH, else `gmsh` on the PATH
    std::string keepDeck;  ///< if not empty, the deck is kept under this name (.inp)
    CalculixOptions calculix;
};

/** True for what Gmsh runs as a program: .geo. **/
bool isGmshScript(const std::string& path);

/** The files that a script reads, itself first: its options beside it, NAME.opt, and those that it
names by a plain text in Include, Merge and their like, and so on from those that are scripts. Names
of files that are not there are among them. **/
std::vector<std::string> listScriptFiles(const std::string& path);

/** Meshes and assembles.
@throws std::invalid_argument for options that cannot be; for a mesh that is not one free solid
part; for a .msh that is no mesh.
@throws std::runtime_error if a file cannot be read or Gmsh (with its own error text) or CalculiX
fails.
@throws Cancelled if options.calculix.progress asks to stop. **/
FeModel readGmshPart(const std::string& path, const GmshOptions& options);

}  // namespace simflex
