#pragma once
/** @file
Frequencies of a model directly from its matrices, including constraints: TᵀKT x = ω² TᵀMT x.
**/

#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {
namespace testing {

/** Returns the lowest frequencies [Hz] of the free part, including the rigid modes (0). **/
std::vector<double> calcFreeFrequencies(const FeModel& model, int numModes);

}  // namespace testing
}  // namespace simflex
