#pragma once
/** @file
Stiffness and mass of solids that CalculiX makes of beams and layered shells, and integrates as it
does none of those that a deck can name: they are integrated here. Internal to fe.

B32R: hexahedra of 20 nodes with 2 points along the beam and 5×5 across it (of pipes and boxes, with
points in their walls: ThinSections.h), so that they bend without shearing and do not warp for
nothing. Layered S8R and S6: 2×2 or 3 points in the plane of each layer and 2 through it.

    K_e = ∫ Bᵀ D B dV,    m_e = ∫ ρ Nᵀ N dV **/

#include <string>

#include "DeckModel.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** The types under which DeckModel::solids holds them; no deck can name the layered ones. **/
constexpr const char* BeamSolid = "B32R";
constexpr const char* LayeredHex = "S8R, COMPOSITE";
constexpr const char* LayeredWedge = "S6, COMPOSITE";

bool isIntegratedSolid(const std::string& type);

/** Adds their K and m to those of the model, whose mesh is the deck's.
@throws std::invalid_argument for an element that is turned inside out. **/
void addIntegratedSolids(const DeckModel& deck, FeModel& model);

}  // namespace simflex
