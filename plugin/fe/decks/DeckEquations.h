#pragma once
/** @file
Equations among nodal translations from *EQUATION and *MPC cards. Internal to fe.

    *EQUATION              *MPC
    2                      STRAIGHT, 1, 9, 3, 5, 7
    3,2,1., 28,2,-1.       PLANE, 1, 2, 3, 4, 5
                           BEAM, 1, 9

An *MPC is linearised at zero displacement: STRAIGHT keeps nodes on the line of the first two, PLANE
in the plane of the first three, BEAM keeps the distance of two. **/

#include <functional>
#include <string>
#include <vector>

#include "InpCards.h"
#include "simflex/fe/FaceShapes.h"

namespace simflex {

/** Σ coefficient · translation = 0. **/
struct DeckEquation {
    struct Term {
        int node;  ///< deck number
        int axis;  ///< 0…2
        double coefficient;
    };
    std::vector<Term> terms;  ///< the first is the dependent one
    std::string where;        ///< "FILE:LINE: *EQUATION"
};

/** Returns the nodes named by a field: a number, or a set, whose nodes are ordered by number. **/
using FindDeckNodes =
    std::function<std::vector<int>(const std::string& field, const DeckLine& data)>;

/** Returns the equations of an *EQUATION card. If terms name sets, there is one for each of their
nodes; sets of one equation must have equal numbers of nodes, or one. @throws std::invalid_argument
with file and line. **/
std::vector<DeckEquation> readEquations(const DeckCard& card, const FindDeckNodes& nodesOf);

/** Returns the equations of an *MPC card, which may name sets of nodes.
@param positionOf  by deck number
@param averaged    receives the last node of each MEANROT, which shows the mean rotation of the
others
@throws std::invalid_argument with file and line, also if the nodes are not on the line or in the
plane. **/
std::vector<DeckEquation> readMultiPointConstraints(
    const DeckCard& card, const FindDeckNodes& nodesOf,
    const std::function<Vec3d(int node)>& positionOf, std::vector<int>& averaged);

}  // namespace simflex
