#pragma once
/** @file
Numbers that have names in a deck. Internal to fe.

    *PARAMETER
    width = 0.02
    half = 0.5*width + sqrt(1e-6)
    *NODE
    1, <half>, <width>

Expressions have + − * / **, brackets, and the functions of Abaqus (abs, acos, asin, atan, cos, exp,
float, int, log, log10, max, min, sin, sqrt, tan), angles in radians, as in Python; a text stands in
single quotes. As in Python, 7/2 is 3 for whole numbers in Abaqus before 2024, so that a quotient of
whole numbers that is none is refused. **/

#include <vector>

#include "InpCards.h"

namespace simflex {

/** Puts values for names in all cards and takes *PARAMETER out; a note for each name.
@throws std::invalid_argument naming file and line. **/
void applyParameters(std::vector<DeckCard>& cards);

}  // namespace simflex
