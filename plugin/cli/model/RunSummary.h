#pragma once
/** @file
Prints the contents of a model and the results of a run on standard output. **/

#include "simflex/model/analyses/ErrorBars.h"

namespace simflex {
namespace cli {

using namespace model;

/** Assembles the model and prints its contents and analyses. **/
void printAssembly(ModelRun& run);

/** Prints extremes and last values of probes, frequencies, and costs. Equal runs print the
same. **/
void printSummary(const ModelRun& run);

/** As printSummary(), for everything that was complete before a failure. **/
void printComplete(const ModelRun& run);

/** Returns "integration 0.05 s, output 0.02 s" for the transient analyses, "" if there are
none. **/
std::string describeSeconds(const ModelRun& run);

/** Prints the largest and root-mean-square difference of each probe between a model and the same
with rigid parts. **/
void printDifference(const Results& flexible, const Results& rigid);

/** Prints the differences between a run and a more accurate one: an estimate of the run's error.
Warns of probes with an error of more than 1 % of their range.
@param change  setting of the second run, "solver.accuracy=1e-07" **/
void printVerification(const Results& run, const Results& fine, const std::string& change);

/** Prints how much further modes of the parts change each probe, and how many modes the parts
should have. **/
void printErrorBars(const Results& run, const ErrorBars& bars);

}  // namespace cli
}  // namespace simflex
