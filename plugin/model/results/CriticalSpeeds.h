#pragma once
/** @file
Critical speeds of a Campbell diagram, where a natural frequency equals the rotation frequency. **/

#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** For each branch, the first speed [rad/s] that equals 2π times its frequency, by linear
interpolation between the speeds of the diagram; NaN if there is none. A zero frequency at rest does
not count.
@param campbell  with speeds in rad/s **/
std::vector<double> findCriticalSpeeds(const Results::Analysis& campbell);

}  // namespace model
}  // namespace simflex
