#pragma once
/** @file
Reduced parts in MBDyn's modal text format (.fem), read by its `modal joint`.

The file contains nodes with six components of each mode (translation, rotation), modal mass and
stiffness (record groups 1 to 10), and mass properties in one of two forms:

- 12, 14 to 18: total mass, centre and inertia, and MBDyn's invariants 3, 4, 8, 5 and 9, which are
  equivalent to those of a ReducedBody:

      3: ∑m φ_i = 0      4: ∑m x×φ_i = 0      8: −∑m [x×][φ_i×] = ½ I₁ᵢ
      5: ∑m φ_i×φ_j = N_ij                     9: ∑m [φ_i×][φ_j×] = −I₂ᵢⱼ + ½ [N_ij×]

This form is written. Older MBDyn reads 12 and ignores the invariants.

- 11: lumped nodal masses. Only read.

Modes from other programs need be neither orthonormal nor free of rigid motion: they are transformed
to the mean-axis frame. Damping (13), stress stiffening (19) and initial values (3, 4) are ignored.

    writeMbdynFem("crank.fem", crank);
    ReducedBody same = readMbdynFem("crank.fem");

Source: P. Masarati, MBDyn input manual (modal joint) and theory manual. SI units. **/

#include <string>
#include <utility>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Nodes of a part that are written to another program's file. **/
enum class ExchangeNodes {
    All,        ///< all mesh nodes, without rotations, and the interfaces' master points
    Interfaces  ///< master points only; all nodes if the part has no interfaces
};

/** Writes a part in deck coordinates. Master points are numbered after the mesh nodes and named in
comments at the top of the file. Geometric stiffness is omitted.
@throws std::invalid_argument if body.validate() does.
@throws std::runtime_error if the file cannot be written. **/
void writeMbdynFem(const std::string& path, const ReducedBody& body,
                   ExchangeNodes nodes = ExchangeNodes::All);

struct MbdynFemOptions {
    /** Names and node numbers; empty: those named in the file's comments. **/
    std::vector<std::pair<std::string, int>> interfaces;
    std::string name;  ///< of the part; empty: the file's name
};

/** Reads a part. Its mesh has nodes but no elements.
@param notes  if not null, receives notes about ignored data without consequences.
@param warnings  if not null, receives warnings about ignored data that affects the motion.
@throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument naming file, line, error and remedy: record groups that are missing or
of the wrong size, masses that differ between directions, rotary inertia, an interface node without
rotations. **/
ReducedBody readMbdynFem(const std::string& path, const MbdynFemOptions& options = {},
                         std::vector<std::string>* notes = nullptr,
                         std::vector<std::string>* warnings = nullptr);

}  // namespace simflex
