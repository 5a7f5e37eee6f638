#pragma once
/** @file
Tick positions of an axis. Internal to the renderer. **/

namespace simflex {

/** Returns a tick step for an axis from low to high: 1, 2, 2.5, 4 or 5 times a power of ten with
four to ten intervals, preferably one with ticks at both ends. **/
double chooseTickStep(double low, double high);

/** Returns the number of decimals needed for multiples of a step. **/
int countDecimals(double step);

}  // namespace simflex
