#pragma once
/** @file
Reads *SHELL SECTION and *BEAM SECTION cards. Internal to fe. **/

#include <vector>

#include "InpCards.h"
#include "ThinElements.h"
#include "simflex/fe/elements/SolidElements.h"

namespace simflex {

/** Returns the shape named by SECTION=, null for one without geometry in CalculiX. **/
const BeamSection* findBeamSection(const std::string& name);

/** Reads thickness (total of layers), offset, section and axes; number, type and nodes are left
empty.
@throws std::invalid_argument naming file and line for unsupported input. **/
ThinElement readThinSection(const DeckCard& card);

/** Returns whether a CIRC has a single number, its radius, as in Abaqus; CalculiX has two
diameters. **/
bool hasRadius(const DeckCard& card, const ThinElement& section);

/** How the section of a beam is integrated: a pipe at 8 points on the circle of its radius of
gyration, a box by Simpson's rule along the middles of its walls, as CalculiX has them.
CalculiX fills rectangles and circles with points, which no rule here stands for; of its own,
simflex has the circle as a pipe without a hole, so that its area and moments are exact, and shear
of rectangles and boxes nearer to their middle, so that they have Saint-Venant's torsion constant, a
box Bredt's. (Displacements of second order warp a section by yz alone: a square would be too stiff
by 18.5 %, a thin square box by a third.)
@param size  along n₁ and n₂ [m] **/
BeamRule makeBeamRule(const ThinElement& section, const std::array<double, 2>& size, ShellUse use);

}  // namespace simflex
