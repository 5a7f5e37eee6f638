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
#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace model {

namespace {

constexpr char CheckpointKind[] = "simflex checkpoint of a run";
constexpr std::uint32_t CheckpointVersion = 8;
constexpr std::size_t MostPacked = 1 << 24;  // bytes of frames that are written at once

std::string readFile(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot read '" + path + "': " + std::strerror(errno));
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/** A frame, with a checksum behind it. **/
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

/** Those that checkpoint.kept counts. **/
void readFrames(const std::string& path, RunCheckpoint& checkpoint) {
    if (checkpoint.kept.frames == 0) return;
    const std::string framesPath = getFramesPath(path);
    std::string bytes = readFile(framesPath);
    if (bytes.size() < checkpoint.kept.bytes)
        throw std::runtime_error("'" + framesPath + "' is cut off");
    bytes.resize(checkpoint.kept.bytes);
    Archive archive(std::move(bytes));
    while (archive.getLeft() > 0) visitFrame(archive, checkpoint.frames.emplace_back());
    if (checkpoint.frames.size() != checkpoint.kept.frames)
        throw std::runtime_error("'" + framesPath + "' has another number of frames");
}

/** All but the frames. **/
void visitCheckpoint(Archive& archive, RunCheckpoint& checkpoint) {
    std::vector<std::string> names, sums;
    for (const auto& [name, sum] : checkpoint.inputs) {
        names.push_back(name);
        sums.push_back(sum);
    }
    archive.visit(names, sums);
    if (names.size() != sums.size()) throw std::runtime_error("an input has no checksum");
    for (size_t k = 0; k < names.size(); ++k) checkpoint.inputs[names[k]] = sums[k];
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

std::string sumNumbers(const ReducedBody& part) {
    Hash hash;
    hash.add(part.mass);
    hash.add(part.omegaSquared);
    hash.add(part.Phi);
    hash.add(part.mesh.positions);
    return hash.getText();
}

}  // namespace

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
    std::istringstream file(readFile(path));
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

std::map<std::string, std::string> calcInputChecksums(const Model& model) {
    std::map<std::string, std::string> sums;
    std::map<const ReducedBody*, std::string> ofParts;
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (!body.flexible) continue;
        std::string& sum = ofParts[&body.flexible->getPart()];
        if (sum.empty()) sum = sumNumbers(body.flexible->getPart());
        sums["the part of body '" + body.name + "'"] = sum;
    }
    const auto addFile = [&](const std::string& what, const ModelValue& file) {
        if (!file.isGiven()) return;
        Hash hash;
        hash.add(readFile(file.getFilePath()));
        sums[what] = hash.getText();
    };
    const ModelValue tables = model.getFile().get("tables"), bodies = model.getFile().get("bodies");
    for (const std::string& name : tables.getKeys())
        addFile("the file of table '" + name + "'", tables.get(name).get("file"));
    for (const std::string& name : bodies.getKeys()) {
        const ModelValue shapes = bodies.get(name).get("shape");
        const int count = shapes.isList() ? shapes.getSize() : int(shapes.isGiven());
        for (int k = 0; k < count; ++k)
            addFile("mesh " + std::to_string(k + 1) + " of body '" + name + "'",
                    (shapes.isList() ? shapes.at(k) : shapes).get("mesh"));
    }
    return sums;
}

}  // namespace model
}  // namespace simflex
