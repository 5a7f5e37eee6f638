#include "simflex/model/analyses/RunCheckpoint.h"

#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace model {

namespace {

constexpr char CheckpointKind[] = "simflex checkpoint of a run";
constexpr std::uint32_t CheckpointVersion = 9;
constexpr std::size_t MostPacked = 1 << 24;  // bytes of frames written at once

void visitFrame(Archive& archive, RunCheckpoint::Frame& frame) {
    archive.visit(frame.time, frame.q, frame.u, frame.z, frame.holding);
    Hash hash;
    hash.add(frame.time);
    hash.add(frame.q);
    hash.add(frame.u);
    hash.add(frame.z);
    hash.add(frame.holding);
    std::uint64_t sum = hash.get();
    archive.visit(sum);
    if (sum != hash.get()) throw std::runtime_error("a frame is damaged");
}

void appendFrames(const std::string& path, RunCheckpoint& checkpoint) {
    std::vector<RunCheckpoint::Frame>& frames = checkpoint.frames;
    RunCheckpoint::Kept kept = checkpoint.kept;
    while (kept.frames < frames.size()) {
        Archive archive;
        for (; kept.frames < frames.size() && archive.getBytes().size() < MostPacked; ++kept.frames)
            visitFrame(archive, frames[kept.frames]);
        appendToFile(getFramesPath(path), kept.bytes, archive.getBytes());
        kept.bytes += archive.getBytes().size();
    }
    checkpoint.kept = kept;
}

/** Reads as many frames as checkpoint.kept says. **/
void readFrames(const std::string& path, RunCheckpoint& checkpoint) {
    if (checkpoint.kept.frames == 0) return;
    const std::string framesPath = getFramesPath(path);
    std::string bytes = readInputFile(framesPath);
    if (bytes.size() < checkpoint.kept.bytes)
        throw std::runtime_error("'" + framesPath + "' is cut off");
    bytes.resize(checkpoint.kept.bytes);
    Archive archive(std::move(bytes));
    while (archive.getLeft() > 0) visitFrame(archive, checkpoint.frames.emplace_back());
    if (checkpoint.frames.size() != checkpoint.kept.frames)
        throw std::runtime_error("'" + framesPath + "' has another number of frames");
}

/** Visits all but the frames. **/
void visitCheckpoint(Archive& archive, RunCheckpoint& checkpoint) {
    archive.visit(checkpoint.analysis);
    archive.visitCount(checkpoint.numRows);
    RunCheckpoint::Energy& energy = checkpoint.energy;
    archive.visit(energy.balanceAtStart, energy.largestError, energy.largestKinetic,
                  energy.potentialAtStart, energy.largestPotentialChange, energy.largestWork,
                  energy.timeOfError, checkpoint.outputSeconds);
    archive.visit(checkpoint.kept.frames, checkpoint.kept.bytes);
    archive.visit(checkpoint.events, checkpoint.eventTimes);
    archive.visit(checkpoint.warnings, checkpoint.integrator);
}

}  // namespace

std::string makeCheckpointPath(const std::string& results) {
    return results + ".checkpoint";
}

std::string getFramesPath(const std::string& path) {
    return path + ".frames";
}

void removeRunCheckpoint(const std::string& path) {
    ::unlink(path.c_str());
    ::unlink(getFramesPath(path).c_str());
}

void writeRunCheckpoint(const std::string& path, RunCheckpoint& checkpoint) {
    appendFrames(path, checkpoint);
    Archive archive;
    visitCheckpoint(archive, checkpoint);
    std::ostringstream file;
    writeArchive(file, CheckpointKind, CheckpointVersion, archive.getBytes());
    replaceFile(path, file.str());
}

RunCheckpoint readRunCheckpoint(const std::string& path) {
    std::istringstream file(readInputFile(path));
    RunCheckpoint checkpoint;
    try {
        Archive archive(readArchive(file, CheckpointKind, CheckpointVersion));
        visitCheckpoint(archive, checkpoint);
        archive.requireEnd();
        readFrames(path, checkpoint);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("checkpoint '" + path + "' cannot be used: " + error.what() +
                                 "; remove it to begin anew");
    }
    return checkpoint;
}

}  // namespace model
}  // namespace simflex
