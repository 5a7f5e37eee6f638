#pragma once
/** @file
Where a transient analysis was when it was last kept: all that the rest of it depends on. **/

#include <map>
#include <string>
#include <vector>

#include "simflex/cli/model/Model.h"

namespace simflex {
namespace cli {

struct RunCheckpoint {
    /** Checksums of what a run reads besides the model's text: parts, tables, meshes; by name. **/
    std::map<std::string, std::string> inputs;
    std::string analysis;
    int numRows = 0;

    /** Extremes of energy up to now. **/
    struct Energy {
        double balanceAtStart = 0, largestError = 0, largestKinetic = 0;
        double potentialAtStart = 0, largestPotentialChange = 0, largestWork = 0;
        double timeOfError = 0;  ///< of the largest one
    };
    Energy energy;

    /** States to be drawn: time, q and u. **/
    struct Frame {
        double time = 0;
        std::vector<double> q, u;
    };
    std::vector<Frame> frames;

    std::vector<double> turns;  ///< as TurnCounter saves them
    std::string integrator;     ///< as the integrator writes itself
};

/** Replaces the file as a whole; it is never half written. @throws std::runtime_error. **/
void writeRunCheckpoint(const std::string& path, const RunCheckpoint& checkpoint);

/** @throws std::runtime_error naming the file and what is wrong with it: cut off, damaged, of
another kind, of a newer version. **/
RunCheckpoint readRunCheckpoint(const std::string& path);

/** RunCheckpoint::inputs of a model. **/
std::map<std::string, std::string> calcInputChecksums(const Model& model);

}  // namespace cli
}  // namespace simflex
