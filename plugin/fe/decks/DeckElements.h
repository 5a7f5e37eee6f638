#pragma once
/** @file
The elements of a deck with their materials and layers. Internal to fe. **/

#include "DeckModel.h"
#include "simflex/fe/elements/FeElements.h"

namespace simflex {

/** Makes the elements of deck.solids, by type and then in deck order, on the nodes of deck.mesh.
@pre settleMaterials() was called.
@throws std::invalid_argument naming an element without material, or file and line. **/
FeElements makeElements(const DeckModel& deck);

}  // namespace simflex
