#pragma once
/** @file
Represents the internal degrees of freedom of C3D8I elements by nodes. Internal to fe. See
FeElements.h. These nodes are numbered after all others and lie at the centres of their
elements. **/

#include "DeckModel.h"

namespace simflex {

/** Appends three nodes for each C3D8I element to the mesh, in the order of the deck's solids. **/
void addInternalNodes(DeckModel& deck);

/** Moves them to the centres of their elements. **/
void placeInternalNodes(DeckModel& deck);

}  // namespace simflex
