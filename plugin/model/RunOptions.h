#pragma once
/** @file
Options of a run of a model's analyses. **/

#include <string>
#include <vector>

#include "simflex/base/AllowedCode.h"
#include "simflex/model/Listener.h"

namespace simflex {

struct RunOptions {
    std::string output;  ///< path of the result file; empty: as the model says
    /** Names of analyses; empty: all. Analyses that these start from are run too, unless earlier
    results have them and are up to date. **/
    std::vector<std::string> only;
    int threads = 0;       ///< 0: as the model says
    bool resumes = false;  ///< continues earlier results; if they are out of date, everything is
                           ///< run again
    bool writesCsv = false;
    bool drawsPictures = true;
    std::string animation;  ///< animated scene (.glb) of each transient analysis; empty: none
    /** Factor on the longest step that an analysis chooses by itself, its output interval;
    verification runs use less than 1. **/
    double longestStep = 1;
    /** Also runs the finer twin of every part, so that each probe gets an error: ErrorBars.h. **/
    bool hasErrorBars = false;
    AllowedCode code;         ///< FMUs run only without onlyChecks
    bool onlyChecks = false;  ///< builds the model and runs nothing
    Listener listener;
    std::string resumeCommand;  ///< command that continues the run, shown where it was stopped
};

}  // namespace simflex
