#pragma once
/** @file
Cards that make nodes and elements of others, in Abaqus's language. Internal to fe.

    *NGEN, NSET=LINE          *NFILL, NSET=AREA        *ELGEN, ELSET=BODY
    1, 11, 1                  LINE, OPPOSITE, 4, 100   1, 10, 1, 1, 4, 100, 10

    *NCOPY, OLD SET=AREA, CHANGE NUMBER=1000, NEW SET=ABOVE, SHIFT
    0., 0., 0.1
    *ELCOPY, OLD SET=BODY, ELEMENT SHIFT=100, SHIFT NODES=1000, NEW SET=MORE **/

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "InpCards.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {

/** What the deck has so far. **/
struct GeneratorModel {
    std::function<Vec3d(int node)> positionOf;
    /** The node or the nodes of the set that a field names. **/
    std::function<std::vector<int>(const std::string& field, int line)> nodesOf;
    std::function<std::vector<int>(const std::string& set)> elementsOf;
    /** Type and nodes. **/
    std::function<std::pair<std::string, std::vector<int>>(int element)> findElement;
};

/** True for the keywords of these cards. **/
bool isGenerator(const std::string& keyword);

/** The *NODE, *NSET and *ELEMENT cards that a generator stands for.
@throws std::invalid_argument naming file and line. **/
std::vector<DeckCard> generateCards(const DeckCard& card, const GeneratorModel& model);

}  // namespace simflex
