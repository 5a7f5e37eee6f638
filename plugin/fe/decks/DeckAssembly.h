#pragma once
/** @file
Decks of parts and instances, as Abaqus/CAE writes them, as plain ones, with their nodes in the axes
of the deck. Internal to fe.

    *PART, NAME=BAR                 *ASSEMBLY, NAME=A
    *NODE …                         *INSTANCE, NAME=BAR-1, PART=BAR
    *ELEMENT …                      0.1, 0., 0.                     translation, then
    *NSET, NSET=END …               0.,0.,0., 0.,0.,1., 90.         turn about a line [°]
    *SOLID SECTION …                *END INSTANCE
    *END PART                       *NSET, NSET=ENDS, INSTANCE=BAR-1 …
                                    *TIE …
                                    *END ASSEMBLY

Nodes and elements of the first instance keep their numbers, those of the next and of the assembly
itself get numbers behind. Names of parts get their instance before them, BAR-1.END; where there is
one instance alone they stay, unless the assembly has the same.

*SYSTEM gives the axes of the nodes that follow up to the next one, or the end of the part: point a
at the origin, b on the x axis, then c in the x-y plane. Without c, z is the deck's; without b all
axes are. *NODE, SYSTEM=C gives r, θ [°], z in these axes. **/

#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

/** The cards without parts, instances and systems of nodes; those of a deck that has none as they
are.
@param notes  get what nodes and elements of instances are numbered by
@throws std::invalid_argument naming file and line. **/
std::vector<DeckCard> flattenAssembly(std::vector<DeckCard> cards, std::vector<std::string>& notes);

}  // namespace simflex
