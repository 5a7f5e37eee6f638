#pragma once
/** @file
Reads *RIGID BODY and *COUPLING cards. Internal to fe.

    *RIGID BODY, NSET=SEAT, REF NODE=1001, ROT NODE=1002
    *COUPLING, REF NODE=1001, SURFACE=SEAT, CONSTRAINT NAME=C1
    *KINEMATIC
    1, 3

Nodes follow the rigid motion of the reference node, u = u_ref + θ × r; a *COUPLING may be limited
to some directions. θ is the rotation of the ROT NODE, for a *COUPLING that of its reference node,
else the body's own. *DISTRIBUTING makes the reference node the mean of the others. **/

#include <array>
#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

struct DeckRigidCard {
    DeckCard card;
    bool isDistributing = false;
    int reference = 0;                           ///< deck number, 0: a separate one
    int rotation = 0;                            ///< deck number of the ROT NODE, 0: none
    std::string nodeSet, elementSet, surface;    ///< one of them
    std::array<bool, 3> axes{true, true, true};  ///< coupled directions …
    std::string orientation;                     ///< … along these axes, if not empty

    std::string where() const { return card.where() + card.title; }
};

/** Reads *RIGID BODY, or the *COUPLING card itself. @throws std::invalid_argument. **/
DeckRigidCard readRigidCard(const DeckCard& card);

/** Adds the *KINEMATIC or *DISTRIBUTING card of a *COUPLING. @throws std::invalid_argument. **/
void readCouplingKind(const DeckCard& card, DeckRigidCard& coupling);

}  // namespace simflex
