#pragma once
/** @file
Linear elastic materials and their directions, as CalculiX reads them from a deck. Internal to fe.

*ELASTIC with TYPE=ISOTROPIC, ENGINEERING CONSTANTS, ORTHOTROPIC and ANISOTROPIC; of a material
given for several temperatures the first. *ORIENTATION with SYSTEM=RECTANGULAR and CYLINDRICAL. **/

#include "InpCards.h"
#include "simflex/fe/elements/ElasticLaw.h"

namespace simflex {

/** D of an *ELASTIC card in the material's own axes.
@throws std::invalid_argument naming file and line for constants that make no solid. **/
ElasticMatrix parseElasticLaw(const DeckCard& elastic);

/** The axes of an *ORIENTATION card. @throws std::invalid_argument naming file and line. **/
Orientation parseOrientation(const DeckCard& orientation);

}  // namespace simflex
