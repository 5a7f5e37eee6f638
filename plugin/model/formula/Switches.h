#pragma once
/** @file
Where a function of time changes its course: where a comparison of its formula turns, `step`,
`ramp` and `pulse` begin and end, `abs`, `sign`, `min` and `max` change sides, `floor`, `ceil` and
`mod` jump, `sqrt`, roots and `hypot` come down to 0 and rise again (√x² = |x|), `asin` and `acos`
turn at ±1, a table has its points.

Most of them happen where an argument a(t) passes one of a set of levels (0, whole numbers, a
table's points). Intervals on which bounds of a leave out all levels are passed over; where bounds
of a' show that a only rises or falls, each passing is bracketed to the last bit; others are halved
(Moore, Interval Analysis, ch. 7). So nothing is missed for being short. Turns are passings of zero
by a', where a is on the level. **/

#include <vector>

#include "simflex/model/formula/Tree.h"

namespace simflex {
namespace formula {

/** Increasing times in (from, to], each the first at which the formula takes its new course; none
that lie closer together than a few last bits.
@pre `tree` has one variable, the time **/
std::vector<double> findSwitches(const Tree& tree, double from, double to);

}  // namespace formula
}  // namespace simflex
