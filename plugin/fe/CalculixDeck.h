#pragma once
/** @file
Reads a CalculiX input deck into an FeModel: mesh, node sets and the free matrices K and M.

simflex reads the deck itself, writes a clean one (nodes, solid elements, materials, sections) in
a temporary folder and runs `ccx` on it with `*FREQUENCY, SOLVER=MATRIXSTORAGE`.

- Kept: *NODE, *ELEMENT (C3D4, C3D6, C3D8, C3D8R, C3D10, C3D10T, C3D15, C3D20, C3D20R), *NSET
  and *ELSET (GENERATE, sets of sets), *MATERIAL, *ELASTIC, *DENSITY, *ORIENTATION, *SOLID SECTION,
  *INCLUDE.
- Left out and reported: steps, *BOUNDARY, loads, *RIGID BODY and *COUPLING (interfaces are tied by
  the reduction), amplitudes, surfaces, initial conditions, surface and line elements that Gmsh
  writes, nodes of no element.
- Refused, with file and line: what makes K other than that of free solids, such as *EQUATION,
  *MPC, *TIE, *TRANSFORM, contact, shells, beams, springs, point masses, and C3D8I (ccx gives it
  internal degrees of freedom with mass).

    CalculixOptions options;
    options.note = [](const std::string& text) { std::cerr << text << "\n"; };
    FeModel crank = readCalculixDeck("crank.inp", options);
**/

#include <functional>
#include <string>

#include "simflex/fe/Checkpoint.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/Progress.h"

namespace simflex {

struct CalculixOptions {
    /** The ccx program; if empty, $SIMFLEX_CCX, else `ccx` on the PATH. **/
    std::string program;
    /** Called with each thing left out or changed; FeModel::notes holds them too. **/
    std::function<void(const std::string&)> note;
    ProgressCallback progress;
    /** If not null, the matrices are kept there, and taken from there if they are of this deck. **/
    const Checkpoint* checkpoint = nullptr;
};

/** Reads a deck and assembles its matrices with ccx. Temporary files go to $TMPDIR (else /tmp) and
are removed, also after an error.
@throws std::runtime_error if a file cannot be read, ccx cannot be run or refuses the deck (with
    ccx's own error text).
@throws std::invalid_argument for a deck that is not one free solid part: names file, line, reason.
@throws Cancelled if options.progress asks to stop. **/
FeModel readCalculixDeck(const std::string& path, const CalculixOptions& options = {});

/** Reads mesh and node sets of a deck alone, without ccx: what readCalculixDeck() would give in
FeModel::mesh. @throws as readCalculixDeck(). **/
Mesh readCalculixMesh(const std::string& path);

}  // namespace simflex
