#pragma once
/** @file
Where an axis has ticks. Internal to the renderer. **/

namespace simflex {

/** Step between ticks of an axis from low to high: 1, 2, 2.5, 4 or 5 times a power of ten, of those
that give four to ten intervals one that ends on both ends, if any. **/
double chooseTickStep(double low, double high);

/** Digits after the decimal point that multiples of a step need. **/
int countDecimals(double step);

}  // namespace simflex
