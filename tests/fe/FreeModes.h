#pragma once
/** @file
Frequencies of a model straight from its matrices, the constraints among them: TᵀKT x = ω² TᵀMT x.
**/

#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {
namespace testing {

/** The lowest frequencies [Hz] of the free part, the rigid modes (0) among them. **/
std::vector<double> calcFreeFrequencies(const FeModel& model, int numModes);

}  // namespace testing
}  // namespace simflex
