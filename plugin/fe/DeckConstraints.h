#pragma once
/** @file
Puts everything that ties the nodes of a deck together into one u = T q: equations, surface ties and
what connects the nodes of shells and beams to those of their solids. Internal to fe. **/

#include <string>
#include <vector>

#include "DeckEquations.h"
#include "ThinElements.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** A *TIE with its surfaces in mesh indices. **/
struct DeckTie {
    std::string where;                    ///< "FILE:LINE: *TIE NAME"
    std::vector<int> slaves;              ///< nodes
    std::vector<std::vector<int>> faces;  ///< of the master, nodes of each
    double tolerance = 0;                 ///< ≤ 0: by the size of the faces [m]
    bool adjust = true;                   ///< slave nodes are moved onto the master
};

struct DeckConstraints {
    std::vector<DeckEquation> equations;
    std::vector<DeckTie> ties;
    ThinExpansion thin;

    bool empty() const { return equations.empty() && ties.empty() && thin.solids.empty(); }
};

/** Ties the nodes of a mesh; moves slave nodes of ties onto their masters.
@param hasElement  of each node; others are never moved onto a master
@param notes       gets what was left out or changed
@throws std::invalid_argument naming file and line. **/
NodalConstraints applyConstraints(const DeckConstraints& constraints,
                                  const std::vector<char>& hasElement, Mesh& mesh,
                                  std::vector<std::string>& notes);

}  // namespace simflex
