#pragma once
/** @file
What a model is made of and what a run has found, on standard output. **/

#include "simflex/model/analyses/ErrorBars.h"

namespace simflex {
namespace cli {

using namespace model;

/** What the model is made of and what would be done; assembles it. **/
void printAssembly(ModelRun& run);

/** Extremes and last values of probes, frequencies, what it cost. The same run prints the same. **/
void printSummary(const ModelRun& run);

/** The same of what was complete before something failed. **/
void printComplete(const ModelRun& run);

/** "integration 0.05 s, output 0.02 s" of its transient analyses; empty if it had none. **/
std::string describeSeconds(const ModelRun& run);

/** Largest and root-mean-square difference of each probe between a model and the same all rigid.
 * **/
void printDifference(const Results& flexible, const Results& rigid);

/** The same between a run and one of more accuracy: an estimate of the run's error. Warns of probes
that more than a hundredth of their range is wrong with.
@param change  what the second run was asked for, "solver.accuracy=1e-07" **/
void printVerification(const Results& run, const Results& fine, const std::string& change);

/** By how much further modes of the parts change each probe, and how many modes these should have.
 * **/
void printErrorBars(const Results& run, const ErrorBars& bars);

}  // namespace cli
}  // namespace simflex
