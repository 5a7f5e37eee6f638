#pragma once
/** @file
Converts Nastran bulk data to the cards of a deck. Internal to fe.

    GRID, CORD1R/C/S, CORD2R/C/S, GRDSET                 nodes
    CTETRA, CPENTA, CHEXA; PSOLID                        C3D4, C3D10, C3D6, C3D15, C3D8I, C3D20R
    CTRIA3, CTRIAR, CTRIA6, CQUAD4, CQUADR, CQUAD8;      S3, S6, S4, S8R, with ZOFFS, and NSM as
      PSHELL, PCOMP, PCOMPG                                density; THETA, MCID: *DISTRIBUTION
    CROD, CONROD; PROD                                   T3D2
    MAT1, MAT8; PARAM,WTMASS                             isotropic, and orthotropic in shells
    RBE2, RBAR; RBE3                                     rigid bodies, by GN; stiffens nothing
    CONM2                                                point masses

Each RBE2 also defines a node set RBE2_17 of its dependent grids, each property one of its nodes,
PID_3. Supports, loads, output and parameters irrelevant to stiffness and mass are left out;
everything else is refused with file and line. **/

#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

/** @throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument for unsupported features. **/
std::vector<DeckCard> readNastranCards(const std::string& path, const ProgressCallback& progress);

}  // namespace simflex
