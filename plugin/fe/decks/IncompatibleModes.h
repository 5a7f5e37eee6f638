#pragma once
/** @file
The internal degrees of freedom of C3D8I elements as nodes. Internal to fe.

    u(ξ) = Σ N_k u_k + (1 − ξ₁²) a₁ + (1 − ξ₂²) a₂ + (1 − ξ₃²) a₃

CalculiX adds three nodes of the displacements a_j to each element, behind all others, and gives
them mass. Here they are u_j = ⅛ Σ u_k + a_j: displacements that a rigid motion has at the element's
centre, so that K and M keep their form. **/

#include "DeckModel.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** The type under which DeckModel::solids holds them. **/
constexpr const char* IncompatibleSolid = "C3D8I";

/** Appends three nodes for each C3D8I element to the mesh, in the order of the deck's solids. **/
void addInternalNodes(DeckModel& deck);

/** Puts them at the centres of their elements. **/
void placeInternalNodes(DeckModel& deck);

/** From a_j to u_j. O(entries) **/
void turnToInternalNodes(const DeckModel& deck, FeModel& model);

}  // namespace simflex
