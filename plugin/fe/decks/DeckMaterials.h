#pragma once
/** @file
Assigns a material to every element of a deck, and constants at one temperature to every material:
the temperature of its elements' nodes, *INITIAL CONDITIONS, TYPE=TEMPERATURE. Internal to fe.

As in CalculiX, constants are interpolated between the temperatures of a card and constant beyond
them, and the last of several sections of an element applies. **/

#include <unordered_map>
#include <vector>

#include "DeckModel.h"

namespace simflex {

struct DeckTemperatures {
    std::unordered_map<int, double> ofNode;               ///< by deck number
    std::unordered_map<int, std::vector<int>> thinNodes;  ///< deck nodes of shells and beams
    const DeckCard* inStep = nullptr;                     ///< first *TEMPERATURE of a step
};

/** Reduces deck.materials to those used by elements, with one line of constants per property.
@throws std::invalid_argument naming file and line, for an element without material, a material
without *ELASTIC or *DENSITY, missing, excess or unstable constants, and a temperature-dependent
material whose nodes have no temperature or several. **/
void settleMaterials(const DeckTemperatures& temperatures, DeckModel& deck);

}  // namespace simflex
