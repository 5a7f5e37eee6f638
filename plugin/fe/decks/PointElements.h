#pragma once
/** @file
Springs and inertias of points in a deck. Internal to fe.

    *ELEMENT, TYPE=SPRINGA, ELSET=A     *SPRING, ELSET=A     along the line of its nodes
    1, 10, 20                           1e6
    *ELEMENT, TYPE=SPRING2, ELSET=B     *SPRING, ELSET=B     of one translation of each node
    2, 10, 20                           3, 3
                                        1e6

Both are k (d·(u₁ − u₂))²/2. What would hold the part to the ground (SPRING1) or damp it (DASHPOTA,
DASHPOT1, DASHPOT2) is no part of it. **/

#include <array>
#include <string>
#include <vector>

#include "DeckElasticity.h"
#include "InpCards.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {

struct DeckModel;

/** An element of points as *ELEMENT gives it. **/
struct PointElement {
    std::string type;
    std::vector<int> nodes;  ///< deck numbers
    std::string where;       ///< "FILE:LINE: "
};

/** Number of nodes of a mass, inertia, spring, dashpot, gap or distributing coupling; 0 for others.
 * **/
int numPointNodesOf(const std::string& type);

/** The card that says what elements of the type are: "SPRING". **/
const std::string& getPointCard(const std::string& type);

struct DeckSpring {
    std::array<int, 2> nodes{};  ///< deck numbers
    Vec3d direction{};           ///< d, a unit vector
    double stiffness = 0;        ///< k [N/m]
};

/** The spring that a *SPRING card makes of a SPRINGA or SPRING2 between two places.
@param axes  of its ORIENTATION; null: the deck's
@throws std::invalid_argument naming file and line, also for one that resists a turn of the part.
**/
DeckSpring readSpring(const DeckCard& card, const PointElement& element,
                      const std::array<Vec3d, 2>& places, const Axes* axes);

/** A mass at a place that moves with its node. **/
struct PointMass {
    Vec3d arm{};      ///< from the node [m]
    double mass = 0;  ///< [kg]
};

/** Six masses in pairs that have the inertia of a *ROTARY INERTIA card about their middle and
together the mass of the point, which takes nothing but their places; without a mass the node's own
makes up for them, and they are `size` from it.
@throws std::invalid_argument naming file and line for what no body has. **/
std::vector<PointMass> spreadInertia(const DeckCard& card, double mass, double size,
                                     const Axes* axes);

/** Adds the springs' K to that of the model, whose mesh is the deck's. **/
void addSprings(const DeckModel& deck, FeModel& model);

}  // namespace simflex
