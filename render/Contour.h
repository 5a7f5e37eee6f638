#pragma once
/** @file
What the colours of a flexible part show, and over which range. **/

namespace simflex {

enum class Contour { None, Displacement };

/** Ends of the colour bar found from what is drawn: over the whole run, or over each frame anew.
 **/
enum class ContourRange { PerRun, PerFrame };

}  // namespace simflex
