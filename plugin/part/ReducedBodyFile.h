#pragma once
/** @file
The HDF5 file of a reduced part, one file per part.

Layout, version 5 (SI units; numbers are 64-bit floats, indices 32-bit integers, little-endian;
matrices are stored column by column, so HDF5 shows an r×c matrix as a c×r data set):

    /                 attributes: format = "simflex reduced body", version, name, units,
                      source, program, created
    /mass             1                 /center_of_mass    3, deck coordinates
    /inertia          6: xx yy zz xy xz yz about the centre of mass
    /omega_squared    n_f               /I1                n_f×6
    /I2               6×n_f×n_f         /N                 3×n_f×n_f
    /Phi              n_f×(3·nodes), row 3·node + axis
    /interfaces/K     K = 0, 1 …: attribute name; position 3, Phi n_f×3, Psi n_f×3, nodes;
                      since version 3 for a distributing tie: weights, one a node
    /stiffening       since version 2, if the part has geometric stiffness: turning 6×n_f×n_f,
                      interfaces/K 6×n_f×n_f for each interface (see ReducedBody::Stiffening)
    /modal_stress     since version 3, if there is: nodes, stress and strain n_f×(6·nodes),
                      32-bit floats (see ReducedBody::ModalStress)
    /report           since version 3, if there is: attributes num_constraint_modes,
                      num_attachment_modes; normal_frequencies, effective_masses modes×6,
                      rigid_masses 6, residuals 5 (mass and stiffness orthogonality, rigid residual,
                      rigid energy, condition number), full_frequencies; since version 4, if they
                      were checked: static_loads (texts), static_errors (see ReductionReport)
    /finer            since version 4, if there is: the part with further modes, a whole part with
                      attributes and data sets as above; and further/coordinates n_f×m,
                      displacements m (see ReducedBody::Further)
    /derivatives/K    since version 5, if there are: attributes parameter, unit; value 1, K and M
                      n_f×n_f (see ReducedBody::Derivative)
    /mesh             node_numbers, positions nodes×3 from the centre of mass
    /mesh/elements/K  attribute type ("Hex8" …); upper_side: of shells, that of their last corners;
                      nodes elements×(nodes per element)
    /mesh/node_sets/K attribute name; nodes
    /mesh/expanded_nodes  of shells and beams alone: numbers of the deck's nodes; counts and nodes
                      of what each became

The HDF5 data are followed by 16 bytes: a mark and a checksum (little-endian) of all bytes before,
so that a damaged file is found out. A program that edits the file through HDF5 drops them.

    writeReducedBody("crank.h5", crank);
    ReducedBody same = readReducedBody("crank.h5");   // equal to the last bit
**/

#include <string>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Newest version of the layout; the library reads all versions up to this one. A file gets the
oldest version that can represent its part, so that older programs either read it completely or
refuse it: 1 without optional data, 2 with geometric stiffness, 3 with distributing ties, modal
stress or a report, 4 with a finer twin or static errors, 5 with derivatives. **/
constexpr int ReducedBodyFileVersion = 5;

/** Writes a part. The file is written next to its destination and renamed when it is complete;
nothing remains after an error. Equal parts give equal bytes. An existing part file, even a damaged
one, is replaced, but no file of another kind, such as the part's deck.
@throws std::invalid_argument if body.validate() does.
@throws std::runtime_error if the file cannot be written or replaced. **/
void writeReducedBody(const std::string& path, const ReducedBody& body);

/** Checks that writeReducedBody() can write to a path, before there are results to lose.
@throws std::runtime_error **/
void checkPartFile(const std::string& path);

/** Reads a part and validates it.
@throws std::runtime_error naming a file that is missing, truncated, damaged, of another format or a
newer version, or that does not describe a valid part. **/
ReducedBody readReducedBody(const std::string& path);

}  // namespace simflex
