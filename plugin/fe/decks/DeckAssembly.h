#pragma once
/** @file
Flattens decks with parts and instances, as written by Abaqus/CAE, to plain decks with nodes in the
global axes. Internal to fe.

    *PART, NAME=BAR                 *ASSEMBLY, NAME=A
    *NODE …                         *INSTANCE, NAME=BAR-1, PART=BAR
    *ELEMENT …                      0.1, 0., 0.                     translation, then
    *NSET, NSET=END …               0.,0.,0., 0.,0.,1., 90.         turn about a line [°]
    *SOLID SECTION …                *END INSTANCE
    *END PART                       *NSET, NSET=ENDS, INSTANCE=BAR-1 …
                                    *TIE …
                                    *END ASSEMBLY

Nodes and elements of the first instance keep their numbers; those of later instances and of the
assembly itself are numbered after them. Names of parts are prefixed by their instance, BAR-1.END;
with a single instance they are unchanged, unless the assembly uses the same name.

*SYSTEM sets the axes of the following nodes up to the next one, or the end of the part: point a at
the origin, b on the x axis, then c in the x-y plane. Without c, z is the deck's; without b all axes
are. *NODE, SYSTEM=C gives r, θ [°], z in these axes. **/

#include <functional>
#include <string>
#include <vector>

#include "InpCards.h"

namespace simflex {

/** Returns the cards without parts, instances and node systems; those of a plain deck are
unchanged.
@param notes  receives the numbering of instances' nodes and elements
@param report  called for each instance and card; may throw Cancelled
@throws std::invalid_argument naming file and line. **/
std::vector<DeckCard> flattenAssembly(
    std::vector<DeckCard> cards, std::vector<std::string>& notes,
    const std::function<void()>& report = [] {});

}  // namespace simflex
