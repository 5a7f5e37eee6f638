#pragma once
/** @file
Speeds of a Campbell diagram at which a natural frequency is once a revolution. **/

#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Of each branch the first speed [rad/s] at which 2π times its frequency is the speed, between the
speeds of the diagram by a straight line; NaN where that is at none of them, and at rest.
@param campbell  its speeds are in rad/s **/
std::vector<double> findCriticalSpeeds(const Results::Analysis& campbell);

}  // namespace model
}  // namespace simflex
