#pragma once
/** @file
Looks for elements of a deck whose nodes are swapped. CalculiX itself refuses an element that is
turned inside out at its integration points, which of C3D8R is one, of C3D10 four: swapped nodes
slip through, and change mass and stiffness. Internal to fe. **/

#include <stdexcept>

#include "DeckModel.h"

namespace simflex {

/** An element that no solver should take. **/
class BadElementShape : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/** Checks that no element is turned inside out at the points of full integration or at its corners,
and that nodes on edges lie between their corners. O(elements).
@throws BadElementShape naming the deck, the element, the node, the value and what is allowed.
**/
void checkElementShapes(const DeckModel& deck);

}  // namespace simflex
