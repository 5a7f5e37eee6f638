#pragma once
/** @file
What is asked of the analyses of a model. **/

#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/base/AllowedCode.h"
#include "simflex/model/Listener.h"

namespace simflex {

/** What an earlier run has left does not fit any more. **/
class CannotResume : public std::runtime_error {
public:
    static constexpr int ExitStatus = 3;  ///< of `simflex run --resume`

    CannotResume(const std::string& path, const std::string& change)
        : std::runtime_error("cannot continue '" + path + "': " + change +
                             "; run without --resume to begin anew") {}
};

struct RunOptions {
    std::string output;             ///< path of the result file; empty: as the model says
    std::vector<std::string> only;  ///< names of analyses; empty: all
    int threads = 0;                ///< 0: as the model says
    bool resumes = false;
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
