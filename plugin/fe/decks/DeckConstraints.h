#pragma once
/** @file
Combines all constraints on the nodes of a deck into one u = T q: equations, surface ties, rigid
bodies and the connections of shell and beam nodes to those of their solids. Internal to fe. **/

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
    double tolerance = 0;                 ///< ≤ 0: based on the size of the faces [m]
    bool adjust = true;                   ///< moves slave nodes onto the master
};

/** Nodes that follow the rigid motion of a reference node: u = u_ref + θ × r. **/
struct DeckRigidBody {
    std::string where;               ///< "FILE:LINE: *RIGID BODY"
    int reference = 0;               ///< deck number; bodies with the same one share u_ref
    Vec3d place{};                   ///< position of the reference node
    bool isReferenceInMesh = false;  ///< otherwise its translations are separate coordinates
    int rotation = 0;        ///< bodies with the same one share θ; number of the ROT NODE if there
                             ///< is one
    std::vector<int> nodes;  ///< mesh indices
    std::vector<std::vector<Vec3d>> directions;  ///< in which each node follows; empty: all
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

/** Constrains the nodes of a mesh; moves slave nodes of ties onto their masters.
@param hasElement  by node; nodes without elements are never moved onto a master
@param notes, warnings  receive data left out or changed, without and with consequence
@throws std::invalid_argument naming file and line. **/
NodalConstraints applyConstraints(const DeckConstraints& constraints,
                                  const std::vector<char>& hasElement, Mesh& mesh,
                                  std::vector<std::string>& notes,
                                  std::vector<std::string>& warnings);

}  // namespace simflex
