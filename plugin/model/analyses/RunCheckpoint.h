#pragma once
/** @file
Where a transient analysis was when it was last kept: all that the rest of it depends on. **/

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

struct RunCheckpoint {
    std::string analysis;
    int numRows = 0;

    /** Extremes of energy up to now. **/
    struct Energy {
        double balanceAtStart = 0, largestError = 0, largestKinetic = 0;
        double potentialAtStart = 0, largestPotentialChange = 0, largestWork = 0;
        double timeOfError = 0;  ///< of the largest one
    };
    Energy energy;
    double outputSeconds = 0;  ///< spent on rows and pictures' States

    /** States to be drawn. **/
    struct Frame {
        double time = 0;
        std::vector<double> q, u, z, holding;
    };
    std::vector<Frame> frames;
    /** How many of them stand in the file of frames, and in how many bytes. **/
    struct Kept {
        std::uint64_t frames = 0, bytes = 0;
    };
    Kept kept;

    /** Events that have happened, and when. **/
    std::vector<std::string> events;
    std::vector<double> eventTimes;

    std::vector<double> warnings;  ///< as MotionWarnings saves them
    std::string integrator;        ///< as the integrator writes itself
};

/** Path of the checkpoint that belongs to a result file. **/
std::string makeCheckpointPath(const std::string& results);

/** Path of the file beside a checkpoint that has its frames: they are only ever appended to it. **/
std::string getFramesPath(const std::string& path);

/** Appends the frames that are new since it was `kept` last, then replaces the checkpoint as a
whole; it is never half written. @throws std::runtime_error. **/
void writeRunCheckpoint(const std::string& path, RunCheckpoint& checkpoint);

/** Removes both files. **/
void removeRunCheckpoint(const std::string& path);

/** @throws std::runtime_error naming the file and what is wrong with it: cut off, damaged, of
another kind, of a newer version. **/
RunCheckpoint readRunCheckpoint(const std::string& path);

}  // namespace model
}  // namespace simflex
