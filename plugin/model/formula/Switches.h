#pragma once
/** @file
Finds where a function of time changes course: where a comparison switches, `step`, `ramp` and
`pulse` begin and end, `abs`, `sign`, `min` and `max` change sides, `floor`, `ceil` and `mod` jump,
`sqrt`, roots and `hypot` touch 0 (√x² = |x|), `asin` and `acos` turn at ±1, and at the points of
tables.

Most switches happen where an argument a(t) crosses one of a set of levels (0, whole numbers, a
table's points). Intervals are skipped if the bounds of a exclude all levels. If the bounds of a'
show that a is monotone, each crossing is bracketed to the last bit; other intervals are bisected
(Moore, Interval Analysis, ch. 7). Short events are therefore not missed. Turning points are zeros
of a' where a is on the level. **/

#include <vector>

#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

/** Increasing times in (from, to], each the first on the new course; times closer than round-off
are merged.
@pre `tree` has one variable, the time **/
std::vector<double> findSwitches(const Tree& tree, double from, double to);

}  // namespace formula
}  // namespace simflex
