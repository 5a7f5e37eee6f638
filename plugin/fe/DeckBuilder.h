#pragma once
/** @file
Reads the cards of a CalculiX deck into a DeckModel. Internal to fe. **/

#include <string>
#include <vector>

#include "DeckModel.h"

namespace simflex {

/** @throws std::invalid_argument naming file and line for what cannot be a free solid part. **/
DeckModel buildDeckModel(const std::string& path, std::vector<DeckCard> cards);

}  // namespace simflex
