#pragma once
/** @file
Checkpoint of a transient analysis, with everything needed to continue it. **/

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

    /** Extreme energies so far. **/
    struct Energy {
        double balanceAtStart = 0, largestError = 0, largestKinetic = 0;
        double potentialAtStart = 0, largestPotentialChange = 0, largestWork = 0;
        double timeOfError = 0;  ///< of the largest error
    };
    Energy energy;
    double outputSeconds = 0;  ///< spent on rows and on States for pictures

    /** States to be drawn. **/
    struct Frame {
        double time = 0;
        std::vector<double> q, u, z, holding;
    };
    std::vector<Frame> frames;
    /** Number and size of the frames already in the file of frames. **/
    struct Kept {
        std::uint64_t frames = 0, bytes = 0;
    };
    Kept kept;

    /** Events so far, and their times. **/
    std::vector<std::string> events;
    std::vector<double> eventTimes;

    std::vector<double> warnings;  ///< from MotionWarnings::save()
    std::string integrator;        ///< checkpoint of the integrator
};

std::string makeCheckpointPath(const std::string& results);

/** Path of the file of a checkpoint's frames, to which frames are only ever appended. **/
std::string getFramesPath(const std::string& path);

/** Appends new frames, then replaces the checkpoint as a whole, so that it is never half written.
@throws std::runtime_error. **/
void writeRunCheckpoint(const std::string& path, RunCheckpoint& checkpoint);

/** Removes both files. **/
void removeRunCheckpoint(const std::string& path);

/** @throws std::runtime_error naming the file and its defect: truncated, damaged, of another kind,
or of a newer version. **/
RunCheckpoint readRunCheckpoint(const std::string& path);

}  // namespace model
}  // namespace simflex
