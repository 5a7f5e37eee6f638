#pragma once
/** @file
The elements of a deck with what they are made of. Internal to fe. **/

#include "DeckModel.h"
#include "simflex/fe/elements/FeElements.h"

namespace simflex {

/** Those of deck.solids, by type and then as the deck has them, on the nodes of deck.mesh.
@pre the deck's materials are settled.
@throws std::invalid_argument naming an element without material, or file and line. **/
FeElements makeElements(const DeckModel& deck);

}  // namespace simflex
