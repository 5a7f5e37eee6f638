#pragma once
/** @file
Reads a CalculiX input deck into an FeModel: mesh, node sets and the free matrices K and M.

K and m are those of the elements alone (elements/FeElements.h); FeModel::constraints, u = T q,
connects their nodes.

- Read: *NODE, *ELEMENT (C3D4, C3D6, C3D8, C3D8I, C3D8R, C3D10, C3D10T, C3D15, C3D20, C3D20R), *NSET
  and *ELSET (GENERATE, sets of sets), *MATERIAL, *ELASTIC, *DENSITY, *ORIENTATION, *SOLID SECTION,
  *INCLUDE. The internal degrees of freedom of C3D8I become three additional nodes per element,
  numbered after all others (IncompatibleModes.h). Abaqus types unknown to CalculiX (C3D10M, hybrid
  ones, S3R …) are replaced by the nearest known one, with a warning.
- Orthotropic and anisotropic materials in axes of *ORIENTATION, also element by element by a
  *DISTRIBUTION; for shells rotated into their plane (DeckOrientations.h).
- Trusses T3D2, T3D3 with *SOLID SECTION, membranes M3D3 … M3D8R with *MEMBRANE SECTION, on their
  own nodes (HingedElements.h). *PARAMETER (DeckParameters.h).
- *PART, *INSTANCE, *ASSEMBLY: flattened (DeckAssembly.h). *NGEN, *NFILL, *NCOPY, *ELGEN, *ELCOPY
  (DeckGenerators.h).
- Shells S3, S4, S4R, S6, S8, S8R with *SHELL SECTION (OFFSET, NODAL THICKNESS, *NODAL THICKNESS,
  COMPOSITE but of S8), *NORMAL, and beams B31, B32, B32R with *BEAM SECTION (RECT, CIRC, PIPE,
  BOX, by *BEAM GENERAL SECTION, too; OFFSET1, OFFSET2) become solids as ccx expands them
  (ThinElements.h), with new nodes that have numbers behind the deck's.
  The deck's own node stays as a place between its expanded nodes; node sets take both in, so that
  an interface on the edge of a shell holds rotation too. Where normals, thicknesses or kinds
  differ, the node is a knot. A shell or beam that shares one row of nodes with solids is hinged
  there, as in ccx.
- *EQUATION among translations, of nodes or sets, also in axes of *TRANSFORM, which else is left
  out; *MPC of STRAIGHT, PLANE, BEAM, linear at zero displacement. Rigid motions must satisfy them.
- *SURFACE (TYPE=ELEMENT of faces S1…S6, SNEG, SPOS; TYPE=NODE) also becomes a node set of its name.
- *TIE of a slave surface to a master's faces (POSITION TOLERANCE, ADJUST): as ccx does, slave nodes
  are moved onto the master. With ADJUST=NO they stay, and the gap turns with the face, where ccx
  would resist a rotation of the part.
- *RIGID BODY (NSET, ELSET, REF NODE, ROT NODE), *COUPLING with *KINEMATIC (ORIENTATION, some
  directions alone): nodes follow the rigid motion of the reference node; of a shell or beam the
  expanded nodes, so that its thickness there does not stretch as in ccx. *DISTRIBUTING stiffens
  nothing.
- *MASS of elements of type MASS, in nodes of elements or of rigid bodies, *ROTARY INERTIA in those
  of rigid bodies (PointElements.h); *SPRING of elements SPRINGA and SPRING2.
- *INITIAL CONDITIONS, TYPE=TEMPERATURE: a material that depends on temperature is taken at that of
  the nodes of its elements, which must be one.
- Left out and reported: steps, *BOUNDARY, loads, amplitudes, output, other initial conditions,
  springs to the ground (SPRING1), dashpots, *DISTRIBUTING COUPLING and *MPC of MEANROT (which
  stiffen nothing), surface and line elements that Gmsh writes, nodes of no element that nothing
  ties.
- Refused, with file and line: what makes K or M other than that of free solids, such as contact,
  springs that are not linear, equations of rotations, other beam sections, and B31R (in ccx without
  inertia about its axis); keywords and parameters that are not known; elements without material,
  materials without *ELASTIC or *DENSITY; nodes given twice at different places; elements with
  swapped nodes. DeckVocabulary.h decides on every keyword of CalculiX 2.20.

    CalculixOptions options;
    options.note = [](const std::string& text) { std::cerr << text << "\n"; };
    FeModel crank = readCalculixDeck("crank.inp", options);  **/

#include <functional>
#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/Checkpoint.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

struct CalculixOptions {
    /** Leaves contact pairs and gaps out with a warning; otherwise they are refused. **/
    bool leavesContactOut = false;
    /** S3, S4, S4R and beams are the solids that CalculiX makes of them, which lock. **/
    bool hasCalculixShells = false;
    /** Refuses *INCLUDE: for decks that another program wrote, which open no other file. **/
    bool refusesIncludes = false;
    /** Parameters of the deck with respect to which the reduced K and M are differentiated,
    "thickness:SKIN": see DesignParameter.h. **/
    std::vector<std::string> derivatives;
    /** Called for everything left out or changed; also stored in FeModel::notes. **/
    std::function<void(const std::string&)> note;
    /** As `note` for FeModel::warnings, which must never be hidden. **/
    std::function<void(const std::string&)> warn;
    ProgressCallback progress;
    /** If not null, the matrices are stored there and reused for the same deck. **/
    const ReductionCheckpoint* checkpoint = nullptr;
};

/** Reads a deck and assembles its matrices.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument for a deck that is not one free solid part, naming file, line and
reason.
@throws Cancelled if options.progress requests it. **/
FeModel readCalculixDeck(const std::string& path, const CalculixOptions& options = {});

/** Reads only mesh and node sets of a deck: FeModel::mesh of readCalculixDeck(). @throws as
readCalculixDeck(). **/
Mesh readCalculixMesh(const std::string& path);

}  // namespace simflex
