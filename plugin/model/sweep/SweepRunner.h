#pragma once
/** @file
Runs the cases of a sweep, several at once, each in a process and a folder of its own.

    FOLDER/CASE/results.h5   what `simflex run` writes
                log.txt      what it says
                case.txt     what the case is made of, and how it ended
    FOLDER/sweep.csv, .h5    the table

A case that is complete and made of the same is skipped; one that was interrupted goes on; one that
is out of date is done anew, and what it had stays until then. A process that runs a case holds a
lock on its log, so that others which share the folder leave it alone; the lock goes with the
process, however that ends. **/

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
    int numJobs = 0;                     ///< processes at once; 0: one for each core
    int numThreads = 0;                  ///< of each; 0: the cores shared out
    std::vector<std::string> arguments;  ///< of the cases: what code they may run
    Listener listener;
    SweepShare share;
};

struct SweepOutcome {
    enum class Status { Waiting, Complete, Failed, Interrupted };
    Status status = Status::Waiting;
    std::string error;     ///< last line of a failed case
    bool wasDone = false;  ///< before this sweep
};

/** What case.txt has of a case: a line for each thing that it is made of, and how it ended:
"complete", "failed: …", "interrupted", "begun". **/
std::string makeCaseText(const InputChecksums& inputs, const std::string& ending);

/** "complete", "failed" … **/
std::string nameOf(SweepOutcome::Status status);

/** Runs what is left to do. @returns what is known of each case at the end; other processes may be
busy with those that are Waiting. When the listener asks
for it the cases that run are stopped, each with what it has.
@throws std::runtime_error if a folder cannot be made or the program not be started. **/
std::vector<SweepOutcome> runSweep(const SweepPlan& plan, const SweepOptions& options);

/** How each case stands, from its folder. **/
std::vector<SweepOutcome> readSweepOutcomes(const SweepPlan& plan, const std::string& folder);

}  // namespace model
}  // namespace simflex
