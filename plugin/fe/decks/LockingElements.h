#pragma once
/** @file
Detects elements of a deck that are inherently too stiff in bending. Internal to fe. **/

#include <array>
#include <map>
#include <vector>

#include "DeckModel.h"
#include "ThinElements.h"

namespace simflex {

/** Adds a warning to the deck for each kind of element that locks: linear tetrahedra and wedges;
bricks where the part is thin; linear shells and beams as CalculiX's solids; curved shells whose
displacements cannot follow inextensional bending. O(elements log elements).

Of a beam of CalculiX's or a shell over an arc of length h and radius R, with thickness t, the
bending stiffness is too high by the factor 1 + k (h²/Rt)². The numbers k were measured in thin
rings (frequency of the mode n = 2, h²/Rt from 1 to 27): 0.07 for B32 and S8, 0.017 for S6, 0.01 for
B32R with a circular section, and next to nothing for S8R and B32R with other sections. Of B31,
whose neighbours meet at an angle θ ≤ 20°, it is 1 + 0.25 (θ² h/t)².

The thickness of a part at a brick is the length of the row of bricks through it, from skin to skin.
Where it is a third or less of the length along another direction, bending along this is too stiff
by 0.07 (h²/Rt)² with C3D20, 0.25 (θ² h/t)² with C3D8I, as above, and in n layers of C3D8 by
0.385 (h/t)², the shear of its straight edges (G/E at ν = 0.3), and 0.23/n², its constant strain
across.
@param deck  with its mesh
@param thin, nodes  of the deck, by deck numbers **/
void warnOfLockingElements(const std::vector<ThinElement>& thin,
                           const std::map<int, std::array<double, 3>>& nodes, ShellUse use,
                           DeckModel& deck);

}  // namespace simflex
