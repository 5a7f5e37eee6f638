#pragma once
/** @file
What a run has found, for people. **/

#include <string>
#include <vector>

#include "simflex/model/results/ResultFile.h"

namespace simflex {
namespace model {

/** Extremes and last values of probes, frequencies, what it cost; on standard output.
@param remarks  more lines **/
void printAnalysis(const ResultData::Analysis& analysis, const std::vector<std::string>& remarks);

/** Largest and root-mean-square difference of each probe between a model and the same all rigid.
 * **/
void printDifference(const ResultData& flexible, const ResultData& rigid);

}  // namespace model
}  // namespace simflex
