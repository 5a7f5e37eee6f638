#pragma once
/** @file
Where a function of time changes its course: where a comparison of its formula turns, `step`,
`ramp` and `pulse` begin and end, `abs`, `sign`, `min` and `max` change sides, `floor`, `ceil` and
`mod` jump, a table has its points.

Each of them happens where an argument a(t) passes one of a set of levels (0, whole numbers, a
table's points). Intervals on which bounds of a leave out all levels are passed over; where bounds
of a' show that a only rises or falls, each passing is bracketed to the last bit; others are halved
(Moore, Interval Analysis, ch. 7). So nothing is missed for being short. **/

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
