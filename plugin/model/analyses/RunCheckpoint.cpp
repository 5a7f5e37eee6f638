#include "simflex/model/analyses/RunCheckpoint.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "simflex/base/Hash.h"

namespace simflex {
namespace model {

namespace {

constexpr char kMagic[] = "simflex checkpoint of a run\n";
constexpr std::uint64_t kCheckpointVersion = 5;
constexpr std::size_t kMostPacked = 1 << 24;  // bytes of frames that are written at once

std::uint64_t calcChecksum(const char* bytes, size_t size) {
    Hash hash;
    hash.addBytes(bytes, size);
    return hash.get();
}

class Packer {
public:
    std::string bytes;

    void put(std::uint64_t number) { putRaw(&number, sizeof number); }
    void put(double number) { putRaw(&number, sizeof number); }
    void put(const std::string& text) {
        put(std::uint64_t(text.size()));
        bytes += text;
    }
    void put(const std::vector<double>& numbers) {
        put(std::uint64_t(numbers.size()));
        putRaw(numbers.data(), numbers.size() * sizeof(double));
    }

private:
    void putRaw(const void* data, size_t size) {
        bytes.append(static_cast<const char*>(data), size);
    }
};

class Unpacker {
public:
    Unpacker(const std::string& packed, const std::string& path) : _bytes(packed), _path(path) {}

    void get(std::uint64_t& number) { getRaw(&number, sizeof number); }
    void get(double& number) { getRaw(&number, sizeof number); }
    void get(std::string& text) {
        text.resize(getSize(1));
        getRaw(text.data(), text.size());
    }
    void get(std::vector<double>& numbers) {
        numbers.resize(getSize(sizeof(double)));
        getRaw(numbers.data(), numbers.size() * sizeof(double));
    }
    /** Of so many things of at least this size, which must be there. **/
    size_t getSize(size_t itemSize) {
        std::uint64_t size = 0;
        get(size);
        if (size > (_bytes.size() - _at) / itemSize) fail();
        return size_t(size);
    }
    bool isAtEnd() const { return _at == _bytes.size(); }
    size_t getPlace() const { return _at; }
    [[noreturn]] void fail() const {
        throw std::runtime_error("checkpoint '" + _path + "' is damaged; remove it to begin anew");
    }

private:
    void getRaw(void* data, size_t size) {
        if (size > _bytes.size() - _at) fail();
        if (size > 0) std::memcpy(data, _bytes.data() + _at, size);
        _at += size;
    }

    const std::string& _bytes;
    std::string _path;
    size_t _at = 0;
};

/** A file that is being written; errors name the checkpoint. **/
class OpenFile {
public:
    OpenFile(const std::string& path, int flags, const std::string& checkpoint)
        : _file(::open(path.c_str(), flags | O_CLOEXEC, 0666)), _checkpoint(checkpoint) {
        if (_file < 0) fail("make");
    }
    ~OpenFile() {
        if (_file >= 0) ::close(_file);
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;

    void cutTo(std::uint64_t size) {
        if (::ftruncate(_file, off_t(size)) != 0 || ::lseek(_file, 0, SEEK_END) < 0) fail("write");
    }
    void write(const std::string& bytes) {
        size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t count = ::write(_file, bytes.data() + done, bytes.size() - done);
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) fail("write");
            done += size_t(count);
        }
    }
    void sync() {
        if (::fsync(_file) != 0) fail("write");
    }
    [[noreturn]] void fail(const char* what) const {
        throw std::runtime_error("cannot " + std::string(what) + " checkpoint '" + _checkpoint +
                                 "': " + std::strerror(errno));
    }

private:
    int _file;
    std::string _checkpoint;
};

/** A file of its own that appears under its name when it is complete. **/
void replaceCheckpoint(const std::string& path, const std::string& bytes) {
    const std::string aside = path + ".new";
    try {
        OpenFile file(aside, O_WRONLY | O_CREAT | O_TRUNC, path);
        file.write(bytes);
        file.sync();
        if (::rename(aside.c_str(), path.c_str()) != 0) file.fail("replace");
    } catch (const std::runtime_error&) {
        ::unlink(aside.c_str());
        throw;
    }
}

std::string readCheckpoint(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot read '" + path + "': " + std::strerror(errno));
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/** Each with a checksum behind it. **/
void appendFrames(const std::string& path, RunCheckpoint& checkpoint) {
    const std::vector<RunCheckpoint::Frame>& frames = checkpoint.frames;
    RunCheckpoint::Kept kept = checkpoint.kept;
    if (kept.frames == frames.size()) return;
    OpenFile file(getFramesPath(path), O_WRONLY | O_CREAT, path);
    file.cutTo(kept.bytes);
    while (kept.frames < frames.size()) {
        Packer packer;
        for (; kept.frames < frames.size() && packer.bytes.size() < kMostPacked; ++kept.frames) {
            const RunCheckpoint::Frame& frame = frames[kept.frames];
            const size_t begin = packer.bytes.size();
            packer.put(frame.time);
            packer.put(frame.q);
            packer.put(frame.u);
            packer.put(calcChecksum(&packer.bytes[begin], packer.bytes.size() - begin));
        }
        file.write(packer.bytes);
        kept.bytes += packer.bytes.size();
    }
    file.sync();
    checkpoint.kept = kept;
}

/** Those that checkpoint.kept counts. **/
void readFrames(const std::string& path, RunCheckpoint& checkpoint) {
    if (checkpoint.kept.frames == 0) return;
    const std::string framesPath = getFramesPath(path);
    std::string bytes = readCheckpoint(framesPath);
    if (bytes.size() < checkpoint.kept.bytes)
        throw std::runtime_error("'" + framesPath + "' is cut off; remove checkpoint '" + path +
                                 "' to begin anew");
    bytes.resize(checkpoint.kept.bytes);
    Unpacker unpacker(bytes, framesPath);
    while (!unpacker.isAtEnd()) {
        RunCheckpoint::Frame frame;
        const size_t begin = unpacker.getPlace();
        unpacker.get(frame.time);
        unpacker.get(frame.q);
        unpacker.get(frame.u);
        const std::uint64_t expected =
            calcChecksum(bytes.data() + begin, unpacker.getPlace() - begin);
        std::uint64_t sum = 0;
        unpacker.get(sum);
        if (sum != expected) unpacker.fail();
        checkpoint.frames.push_back(std::move(frame));
    }
    if (checkpoint.frames.size() != checkpoint.kept.frames) unpacker.fail();
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
    Packer packer;
    packer.bytes = kMagic;
    packer.put(kCheckpointVersion);
    packer.put(std::uint64_t(checkpoint.inputs.size()));
    for (const auto& [name, sum] : checkpoint.inputs) {
        packer.put(name);
        packer.put(sum);
    }
    packer.put(checkpoint.analysis);
    packer.put(std::uint64_t(checkpoint.numRows));
    packer.put(checkpoint.energy.balanceAtStart);
    packer.put(checkpoint.energy.largestError);
    packer.put(checkpoint.energy.largestKinetic);
    packer.put(checkpoint.energy.potentialAtStart);
    packer.put(checkpoint.energy.largestPotentialChange);
    packer.put(checkpoint.energy.largestWork);
    packer.put(checkpoint.energy.timeOfError);
    packer.put(checkpoint.kept.frames);
    packer.put(checkpoint.kept.bytes);
    packer.put(checkpoint.turns);
    packer.put(checkpoint.warnings);
    packer.put(checkpoint.integrator);
    packer.put(calcChecksum(packer.bytes.data(), packer.bytes.size()));
    replaceCheckpoint(path, packer.bytes);
}

RunCheckpoint readRunCheckpoint(const std::string& path) {
    std::string bytes = readCheckpoint(path);
    const size_t magic = sizeof kMagic - 1;
    if (bytes.compare(0, magic, kMagic) != 0)
        throw std::runtime_error("'" + path + "' is not a checkpoint of simflex run");
    std::uint64_t sum = 0, number = 0;
    if (bytes.size() < magic + 2 * sizeof sum)
        throw std::runtime_error("checkpoint '" + path + "' is cut off; remove it to begin anew");
    std::memcpy(&sum, bytes.data() + bytes.size() - sizeof sum, sizeof sum);
    std::memcpy(&number, bytes.data() + magic, sizeof number);
    if (number > kCheckpointVersion && number < 1000)
        throw std::runtime_error("checkpoint '" + path + "' has format " + std::to_string(number) +
                                 "; it needs a newer simflex");
    bytes.resize(bytes.size() - sizeof sum);
    if (sum != calcChecksum(bytes.data(), bytes.size()))
        throw std::runtime_error("checkpoint '" + path + "' is damaged; remove it to begin anew");

    if (number != kCheckpointVersion)
        throw std::runtime_error("checkpoint '" + path + "' has format " + std::to_string(number) +
                                 " of an older simflex; remove it to begin anew");

    const std::string packed = bytes.substr(magic + sizeof number);
    Unpacker unpacker(packed, path);
    RunCheckpoint checkpoint;
    for (size_t k = unpacker.getSize(16); k > 0; --k) {
        std::string name;
        unpacker.get(name);
        unpacker.get(checkpoint.inputs[name]);
    }
    unpacker.get(checkpoint.analysis);
    unpacker.get(number);
    if (number > std::uint64_t(std::numeric_limits<int>::max())) unpacker.fail();
    checkpoint.numRows = int(number);
    unpacker.get(checkpoint.energy.balanceAtStart);
    unpacker.get(checkpoint.energy.largestError);
    unpacker.get(checkpoint.energy.largestKinetic);
    unpacker.get(checkpoint.energy.potentialAtStart);
    unpacker.get(checkpoint.energy.largestPotentialChange);
    unpacker.get(checkpoint.energy.largestWork);
    unpacker.get(checkpoint.energy.timeOfError);
    unpacker.get(checkpoint.kept.frames);
    unpacker.get(checkpoint.kept.bytes);
    unpacker.get(checkpoint.turns);
    unpacker.get(checkpoint.warnings);
    unpacker.get(checkpoint.integrator);
    if (!unpacker.isAtEnd()) unpacker.fail();
    readFrames(path, checkpoint);
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
        hash.add(readCheckpoint(file.getFilePath()));
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
