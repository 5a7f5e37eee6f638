#pragma once
/** @file
What *EQUATION and *MPC cards say about nodal translations. Internal to fe.

    *EQUATION              *MPC
    2                      STRAIGHT, 1, 9, 3, 5, 7
    3,2,1., 28,2,-1.       PLANE, 1, 2, 3, 4, 5
                           BEAM, 1, 9

An *MPC is linear at zero displacement: STRAIGHT keeps nodes on the line of the first two, PLANE in
the plane of the first three, BEAM keeps the distance of two. **/

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

/** The nodes that a field names: a number, or a set, whose nodes come by their numbers. **/
using FindDeckNodes =
    std::function<std::vector<int>(const std::string& field, const DeckLine& data)>;

/** The equations of one *EQUATION card: where terms name sets, one for each of their nodes; sets of
one equation have as many nodes, or one. @throws std::invalid_argument with file and line. **/
std::vector<DeckEquation> readEquations(const DeckCard& card, const FindDeckNodes& nodesOf);

/** Those of one *MPC card, which may name sets of nodes.
@param positionOf  of a node by its deck number
@param averaged    gets the last node of each MEANROT, which shows how the others turn in the mean
@throws std::invalid_argument with file and line, also where the nodes do not lie on the line or in
    the plane. **/
std::vector<DeckEquation> readMultiPointConstraints(
    const DeckCard& card, const FindDeckNodes& nodesOf,
    const std::function<Vec3d(int node)>& positionOf, std::vector<int>& averaged);

}  // namespace simflex
