#pragma once
/** @file
Gives every element of a deck its material, and every material constants of one temperature: that of
the nodes of its elements, *INITIAL CONDITIONS, TYPE=TEMPERATURE. Internal to fe.

As CalculiX does, constants are interpolated between the temperatures of a card and held beyond
them, and of several sections of an element the last holds. **/

#include <unordered_map>
#include <vector>

#include "DeckModel.h"

namespace simflex {

struct DeckTemperatures {
    std::unordered_map<int, double> ofNode;               ///< by deck number
    std::unordered_map<int, std::vector<int>> thinNodes;  ///< of shells and beams: deck's own nodes
    const DeckCard* inStep = nullptr;                     ///< first *TEMPERATURE of a step
};

/** Leaves in deck.materials those that elements use, a line of constants for each property.
@throws std::invalid_argument naming file and line, for an element without material, a material
    without *ELASTIC or *DENSITY, constants that are missing, too many or make no solid, and one
that depends on temperature where its nodes have none or several. **/
void settleMaterials(const DeckTemperatures& temperatures, DeckModel& deck);

}  // namespace simflex
