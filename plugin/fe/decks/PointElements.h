#pragma once
/** @file
Springs and point inertias of a deck. Internal to fe.

    *ELEMENT, TYPE=SPRINGA, ELSET=A     *SPRING, ELSET=A     along the line of its nodes
    1, 10, 20                           1e6
    *ELEMENT, TYPE=SPRING2, ELSET=B     *SPRING, ELSET=B     of one translation of each node
    2, 10, 20                           3, 3
                                        1e6

Both have the energy k (d·(u₁ − u₂))²/2. Springs to the ground (SPRING1) and dashpots (DASHPOTA,
DASHPOT1, DASHPOT2) are not part of it. **/

#include <array>
#include <string>
#include <vector>

#include "DeckElasticity.h"
#include "InpCards.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {

struct DeckModel;

/** An element of one or two points as given by *ELEMENT. **/
struct PointElement {
    std::string type;
    std::vector<int> nodes;  ///< deck numbers
    std::string where;       ///< "FILE:LINE: "
};

/** Returns the number of nodes of a mass, inertia, spring, dashpot, gap or distributing coupling; 0
for others. **/
int numPointNodesOf(const std::string& type);

/** Returns the card that defines elements of the type: "SPRING". **/
const std::string& getPointCard(const std::string& type);

struct DeckSpring {
    std::array<int, 2> nodes{};  ///< deck numbers
    Vec3d direction{};           ///< d, a unit vector
    double stiffness = 0;        ///< k [N/m]
};

/** Returns the spring defined by a *SPRING card for a SPRINGA or SPRING2 between two positions.
@param axes  of its ORIENTATION; null: the deck's
@throws std::invalid_argument naming file and line, also for a spring that resists a rotation of the
part. **/
DeckSpring readSpring(const DeckCard& card, const PointElement& element,
                      const std::array<Vec3d, 2>& places, const Axes* axes);

/** A mass at an offset that moves rigidly with its node. **/
struct PointMass {
    Vec3d arm{};      ///< from the node [m]
    double mass = 0;  ///< [kg]
};

/** Returns six masses in pairs with the inertia of a *ROTARY INERTIA card about their middle.
Together they have the mass of the point, which determines their distances. Without a point mass, a
negative mass at the node itself compensates theirs, and they are at a distance `size`.
@throws std::invalid_argument naming file and line for a physically impossible inertia. **/
std::vector<PointMass> spreadInertia(const DeckCard& card, double mass, double size,
                                     const Axes* axes);

/** Adds the springs' K to that of the model, whose mesh is the deck's. **/
void addSprings(const DeckModel& deck, FeModel& model);

}  // namespace simflex
