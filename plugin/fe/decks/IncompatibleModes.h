#pragma once
/** @file
The internal degrees of freedom of C3D8I elements as nodes. Internal to fe. See FeElements.h.

They have the numbers behind all others, and stand at the centres of their elements. **/

#include "DeckModel.h"

namespace simflex {

/** Appends three nodes for each C3D8I element to the mesh, in the order of the deck's solids. **/
void addInternalNodes(DeckModel& deck);

/** Puts them at the centres of their elements. **/
void placeInternalNodes(DeckModel& deck);

}  // namespace simflex
