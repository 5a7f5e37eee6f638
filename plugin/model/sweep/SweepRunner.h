#pragma once
/** @file
Runs the cases of a sweep, several at once, each in its own process and folder.

    FOLDER/CASE/results.h5   results, as written by `simflex run`
                log.txt      its output
                case.txt     inputs of the case, and how it ended
    FOLDER/sweep.csv, .h5    the table

A complete case with the same inputs is skipped, an interrupted one continued, and an outdated one
run again, with its old results kept until then. A process that runs a case holds a lock on its log,
so that others that share the folder skip the case; the lock is released however the process ends.
**/

#include <string>
#include <vector>

#include "simflex/model/Listener.h"
#include "simflex/model/sweep/SweepPlan.h"
#include "simflex/model/sweep/SweepShare.h"

namespace simflex {
namespace model {

struct SweepOptions {
    std::string folder;
    std::string program;                 ///< `simflex`
    int numJobs = 0;                     ///< number of processes; 0: one for each core
    int numThreads = 0;                  ///< of each process; 0: an equal share of the cores
    std::vector<std::string> arguments;  ///< options of the cases about code they may run
    Listener listener;
    SweepShare share;
};

struct SweepOutcome {
    enum class Status { Waiting, Complete, Failed, Interrupted };
    Status status = Status::Waiting;
    std::string error;     ///< last line of a failed case
    bool wasDone = false;  ///< done before this sweep
};

/** Text of a case.txt: a line for each input, and how the case ended: "complete", "failed: …",
"interrupted", "begun". **/
std::string makeCaseText(const InputChecksums& inputs, const std::string& ending);

/** "complete", "failed" … **/
std::string nameOf(SweepOutcome::Status status);

/** Runs all remaining cases. If the listener stops the sweep, running cases are stopped, too, and
keep their results so far.
@returns the outcome of each case; other processes may be running those that are Waiting
@throws std::runtime_error if a folder cannot be made or the program cannot be started. **/
std::vector<SweepOutcome> runSweep(const SweepPlan& plan, const SweepOptions& options);

/** Reads the state of each case from its folder. **/
std::vector<SweepOutcome> readSweepOutcomes(const SweepPlan& plan, const std::string& folder);

}  // namespace model
}  // namespace simflex
