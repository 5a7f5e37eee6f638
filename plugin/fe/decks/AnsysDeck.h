#pragma once
/** @file
Converts an Ansys model written by CDWRITE (.cdb) to the cards of a deck. Internal to fe.

    NBLOCK, EBLOCK (SOLID)          nodes, elements
    SOLID185, 45                    C3D8I (KEYOPT(2) = 1: C3D8R), degenerate C3D4, C3D6
    SOLID186, 95; 187, 92           C3D20R (KEYOPT(2) = 1 and 95: C3D20), degenerate C3D10, C3D15;
                                    C3D10
    SHELL181; 281                   S4, S3; S8R, S6, of one layer; KEYOPT(1) = 1: M3D4, M3D3
    LINK180, 8; COMBIN14            T3D2 with its area by R; SPRINGA
    MASS21                          point masses without inertia
    MP, MPDATA; SEC…, R, RLBLOCK    isotropic materials, thicknesses and offsets
    CMBLOCK                         node sets, and element sets with the sets of their nodes

Supports, loads and control are left out; everything else that affects K or M is refused with file
and line. **/

#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

/** @throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument for unsupported features. **/
std::vector<DeckCard> readAnsysCards(const std::string& path, const ProgressCallback& progress);

}  // namespace simflex
