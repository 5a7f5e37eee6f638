#pragma once
/** @file
Linear elastic materials and their orientations, as read by CalculiX from a deck. Internal to fe.
*ELASTIC with TYPE=ISOTROPIC, ENGINEERING CONSTANTS, ORTHOTROPIC and ANISOTROPIC; of several
temperatures the first is used. *ORIENTATION with SYSTEM=RECTANGULAR and CYLINDRICAL. **/

#include "InpCards.h"
#include "simflex/fe/elements/ElasticLaw.h"

namespace simflex {

/** Returns D of an *ELASTIC card in the material's own axes.
@throws std::invalid_argument naming file and line for constants of no stable solid. **/
ElasticMatrix parseElasticLaw(const DeckCard& elastic);

/** Returns the axes of an *ORIENTATION card. @throws std::invalid_argument naming file and
line. **/
Orientation parseOrientation(const DeckCard& orientation);

}  // namespace simflex
