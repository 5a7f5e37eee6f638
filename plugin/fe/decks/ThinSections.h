#pragma once
/** @file
What a *SHELL SECTION or *BEAM SECTION says of its elements. Internal to fe. **/

#include <vector>

#include "InpCards.h"
#include "ThinElements.h"
#include "simflex/fe/elements/SolidElements.h"

namespace simflex {

/** The shape that SECTION= names, null for one that CalculiX has no geometry of. **/
const BeamSection* findBeamSection(const std::string& name);

/** Thickness (of layers together), offset, section and axes; number, type and nodes are left empty.
@throws std::invalid_argument naming file and line for what simflex does not know or do. **/
ThinElement readThinSection(const DeckCard& card);

/** A CIRC of one number, which is its radius, as in Abaqus; CalculiX has two diameters. **/
bool hasRadius(const DeckCard& card, const ThinElement& section);

/** The integration points of a pipe, 8 on the circle of its radius of gyration, or of a box, by
Simpson's rule along the middles of its walls, as CalculiX has them. **/
std::vector<SectionPoint> makeWallPoints(const ThinElement& section);

}  // namespace simflex
