#pragma once
/** @file
Stiffness and mass of the solids that B32R beams become. Internal to fe.

CalculiX integrates these hexahedra of 20 nodes with 2 points along the beam and 5×5 across it (of
pipes and boxes, with points in their walls: ThinSections.h), so
that they bend without shearing and do not warp for nothing. Its plain solids have no such rule:
these are integrated here.

    K_e = ∫ Bᵀ D B dV,    m_e = ∫ ρ Nᵀ N dV **/

#include "DeckModel.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** The type under which DeckModel::solids holds them. **/
constexpr const char* BeamSolid = "B32R";

/** Adds their K and m to those of the model, whose mesh is the deck's.
@throws std::invalid_argument for a material that is not known to be linear and isotropic. **/
void addBeamMatrices(const DeckModel& deck, FeModel& model);

}  // namespace simflex
