#pragma once
/** @file
Trusses and membranes of a deck, which have stiffness along themselves only and are hinged at their
nodes. Internal to fe.

    *ELEMENT, TYPE=T3D2, ELSET=TIES      *SOLID SECTION, ELSET=TIES, MATERIAL=STEEL
    1, 10, 20                            1e-4                            (area)
    *ELEMENT, TYPE=M3D4, ELSET=SKIN      *MEMBRANE SECTION, ELSET=SKIN, MATERIAL=STEEL
    2, 10, 20, 21, 11                    0.001                           (thickness)

    K_e = ∫ A E g gᵀ ds   or  ∫ t Bᵀ D B dA,  D of plane stress
    m_e = ∫ ρ A Nᵀ N ds   or  ∫ ρ t Nᵀ N dA

CalculiX makes hinged solids of them, whose own rotations have some inertia but no stiffness: in a
free part these would be modes of zero frequency. Here they have translations of their nodes
only. **/

#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

struct DeckModel;

struct HingedElement {
    int number = 0;
    std::string type;        ///< T3D2, T3D3, M3D3, M3D4, M3D6, M3D8, M3D8R
    std::vector<int> nodes;  ///< deck numbers
    double size = 0;         ///< area [m²] or thickness [m]
    std::string material;
    std::string where;  ///< "FILE:LINE: "
};

/** Returns the number of nodes of a truss or membrane; 0 for other types. **/
int numHingedNodesOf(const std::string& type);
bool isTruss(const std::string& type);

/** Adds their K and m to those of the model, whose mesh is the deck's.
@throws std::invalid_argument for a material that is not isotropic, or an element of zero size. **/
void addHingedElements(const DeckModel& deck, FeModel& model);

}  // namespace simflex
