#pragma once
/** @file
What the user asks of `simflex run`. **/

#include <string>
#include <vector>

namespace simflex {
namespace model {

struct RunOptions {
    std::string model;                  ///< path of the model file
    std::string output;                 ///< path of the result file; empty: as the model says
    std::vector<std::string> settings;  ///< PATH=VALUE
    std::vector<std::string> only;      ///< names of analyses; empty: all
    int threads = 0;                    ///< 0: as the model says
    bool isRigidToo = false;            ///< run all rigid as well, and compare
    bool resumes = false;
    bool writesCsv = false;
    bool drawsPictures = true;
    bool isQuiet = false;
    bool allowsScripts = false;  ///< of Gmsh, outside the sandbox
    bool onlyChecks = false;
    std::string resumeCommand;  ///< that goes on with such a run: told where it was stopped
};

}  // namespace model
}  // namespace simflex
