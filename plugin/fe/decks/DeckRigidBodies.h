#pragma once
/** @file
What *RIGID BODY and *COUPLING cards say. Internal to fe.

    *RIGID BODY, NSET=SEAT, REF NODE=1001, ROT NODE=1002
    *COUPLING, REF NODE=1001, SURFACE=SEAT, CONSTRAINT NAME=C1
    *KINEMATIC
    1, 3

Nodes follow the rigid motion of the reference node, u = u_ref + θ × r; a *COUPLING may say so of
some directions alone. Turns θ are those of the ROT NODE, of a *COUPLING those of its reference
node, else the body's own. *DISTRIBUTING makes the reference node the mean of the others. **/

#include <array>
#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

struct DeckRigidCard {
    DeckCard card;
    bool isDistributing = false;
    int reference = 0;                           ///< deck number, 0: one of its own
    int rotation = 0;                            ///< deck number of the ROT NODE, 0: none
    std::string nodeSet, elementSet, surface;    ///< one of them
    std::array<bool, 3> axes{true, true, true};  ///< directions that follow …
    std::string orientation;                     ///< … along its axes, if not empty

    std::string where() const { return card.where() + card.title; }
};

/** Reads *RIGID BODY; of a *COUPLING its first part. @throws std::invalid_argument. **/
DeckRigidCard readRigidCard(const DeckCard& card);

/** Adds the *KINEMATIC or *DISTRIBUTING below a *COUPLING. @throws std::invalid_argument. **/
void readCouplingKind(const DeckCard& card, DeckRigidCard& coupling);

}  // namespace simflex
