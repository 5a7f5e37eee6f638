#pragma once
/** @file
Reduced parts in MBDyn's modal text format (.fem), which its `modal joint` reads.

The file holds nodes with six components of each mode (translation, rotation), modal mass and
stiffness (record groups 1 to 10), and mass properties in one of two ways:

- 12, 14 to 18: total mass, centre and inertia, and MBDyn's invariants 3, 4, 8, 5 and 9. They hold
  all that a ReducedBody knows:
      3: ∑m φ_i = 0      4: ∑m x×φ_i = 0      8: −∑m [x×][φ_i×] = ½ I₁ᵢ
      5: ∑m φ_i×φ_j = N_ij                     9: ∑m [φ_i×][φ_j×] = −I₂ᵢⱼ + ½ [N_ij×]
  Written like this. Older MBDyn reads 12 and leaves out the invariants.
- 11: lumped masses of the nodes. Read too.

Modes read from other programs need be neither orthonormal nor free of rigid motion: they are
brought to the mean-axis frame. Damping (13), stress stiffening (19) and initial values (3, 4) are
left out.

    writeMbdynFem("crank.fem", crank);
    ReducedBody same = readMbdynFem("crank.fem");

Source: P. Masarati, MBDyn input manual (modal joint) and theory manual. SI units. **/

#include <string>
#include <utility>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Which nodes of a part go into a file for another program. **/
enum class ExchangeNodes {
    All,        ///< all mesh nodes, without rotations, and the masters of the interfaces
    Interfaces  ///< the masters alone; of a part without interfaces, all
};

/** Writes a part in deck coordinates. Masters of interfaces get numbers beyond those of the mesh;
comments at the top of the file name them. Geometric stiffness is left out.
@throws std::invalid_argument if body.validate() does.
@throws std::runtime_error if the file cannot be written. **/
void writeMbdynFem(const std::string& path, const ReducedBody& body,
                   ExchangeNodes nodes = ExchangeNodes::All);

struct MbdynFemOptions {
    /** Names and node numbers; empty: those that the file's own comments name. **/
    std::vector<std::pair<std::string, int>> interfaces;
    std::string name;  ///< of the part; empty: that of the file
};

/** Reads a part. Its mesh has nodes without elements.
@param notes  if not null, receives what was left out without consequence.
@param warnings  if not null, receives what was left out that motions depend on.
@throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument naming file, line, what is wrong and what to do: record groups that
are missing or of the wrong size, masses that differ between directions, rotary inertia, an
interface node without rotations. **/
ReducedBody readMbdynFem(const std::string& path, const MbdynFemOptions& options = {},
                         std::vector<std::string>* notes = nullptr,
                         std::vector<std::string>* warnings = nullptr);

}  // namespace simflex
