#pragma once
/** @file
What is asked of the analyses of a model. **/

#include <string>
#include <vector>

#include "simflex/base/AllowedCode.h"
#include "simflex/model/Listener.h"

namespace simflex {

struct RunOptions {
    std::string output;  ///< path of the result file; empty: as the model says
    /** Names of analyses; empty: all. Those that they begin from are done, too, where earlier
    results do not have them or are out of date. **/
    std::vector<std::string> only;
    int threads = 0;       ///< 0: as the model says
    bool resumes = false;  ///< where earlier results are out of date, all is done anew
    bool writesCsv = false;
    bool drawsPictures = true;
    std::string animation;  ///< a moving scene (.glb) of each transient analysis; empty: none
    /** Of the longest step that an analysis chooses by itself, its interval: what verifies it has
    shorter ones. **/
    double longestStep = 1;
    /** The finer twin of every part runs beside, and each probe has its error: ErrorBars.h. **/
    bool hasErrorBars = false;
    AllowedCode code;         ///< of FMUs only where they run: not with onlyChecks
    bool onlyChecks = false;  ///< the model is built, nothing is run
    Listener listener;
    std::string resumeCommand;  ///< that goes on with such a run: told where it was stopped
};

}  // namespace simflex
