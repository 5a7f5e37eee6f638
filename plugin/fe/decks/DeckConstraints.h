#pragma once
/** @file
Puts everything that ties the nodes of a deck together into one u = T q: equations, surface ties,
rigid bodies and what connects the nodes of shells and beams to those of their solids. Internal to
fe. **/

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

/** Nodes that follow the rigid motion of a reference node: u = u_ref + θ × r. **/
struct DeckRigidBody {
    std::string where;               ///< "FILE:LINE: *RIGID BODY"
    int reference = 0;               ///< deck number; bodies with the same one share u_ref
    Vec3d place{};                   ///< of the reference node
    bool isReferenceInMesh = false;  ///< else its translations are coordinates of their own
    int rotation = 0;        ///< bodies with the same one share θ; of a ROT NODE its number
    std::vector<int> nodes;  ///< mesh indices
    std::vector<std::vector<Vec3d>> directions;  ///< in which each node follows; empty: in all
};

struct DeckConstraints {
    std::vector<DeckEquation> equations;
    std::vector<DeckTie> ties;
    std::vector<DeckRigidBody> bodies;
    ThinExpansion thin;

    bool empty() const {
        return equations.empty() && ties.empty() && bodies.empty() && thin.solids.empty();
    }
};

/** Ties the nodes of a mesh; moves slave nodes of ties onto their masters.
@param hasElement  of each node; others are never moved onto a master
@param notes, warnings  get what was left out or changed, without and with consequence
@throws std::invalid_argument naming file and line. **/
NodalConstraints applyConstraints(const DeckConstraints& constraints,
                                  const std::vector<char>& hasElement, Mesh& mesh,
                                  std::vector<std::string>& notes,
                                  std::vector<std::string>& warnings);

}  // namespace simflex
