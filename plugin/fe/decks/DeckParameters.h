#pragma once
/** @file
Named numbers in a deck. Internal to fe.

    *PARAMETER
    width = 0.02
    half = 0.5*width + sqrt(1e-6)
    *NODE
    1, <half>, <width>

Expressions have + − * / **, brackets, and the functions of Abaqus (abs, acos, asin, atan, cos, exp,
float, int, log, log10, max, min, sin, sqrt, tan), angles in radians, as in Python; texts are in
single quotes. As in Python 2, 7/2 is 3 for integers in Abaqus before 2024, so a non-integer
quotient of integers is refused. **/

#include <vector>

#include "InpCards.h"

namespace simflex {

/** Replaces names by values in all cards and removes *PARAMETER; adds a note for each name.
@throws std::invalid_argument naming file and line. **/
void applyParameters(std::vector<DeckCard>& cards);

}  // namespace simflex
