#pragma once
/** @file
Detects elements of a deck with swapped nodes. CalculiX itself refuses an element that is inverted
at its integration points, of which C3D8R has one and C3D10 four: swapped nodes may remain
undetected and change mass and stiffness. Internal to fe. **/

#include <stdexcept>

#include "DeckModel.h"

namespace simflex {

/** Thrown for an element that no solver should accept. **/
class BadElementShape : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/** Checks that no element is inverted at the points of full integration or at its corners, and that
mid-edge nodes lie between their corners. O(elements).
@throws BadElementShape naming the deck, the element, the node, the value and the allowed range. **/
void checkElementShapes(const DeckModel& deck);

}  // namespace simflex
