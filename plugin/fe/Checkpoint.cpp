#include "simflex/fe/Checkpoint.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr char kMagic[8] = {'s', 'i', 'm', 'f', 'l', 'e', 'x', '1'};

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

}  // namespace

void CheckpointWriter::put(const void* bytes, size_t size) {
    if (size > 0 && std::fwrite(bytes, 1, size, _file) != size)
        throw std::runtime_error(std::strerror(errno));
    _hash.addBytes(bytes, size);
}

void CheckpointReader::checkLeft(std::uint64_t count, size_t elementSize) const {
    if (count > _left / elementSize) throw std::runtime_error("it ends early");
}

void CheckpointReader::get(void* bytes, size_t size) {
    checkLeft(size, 1);
    if (size > 0 && std::fread(bytes, 1, size, _file) != size)
        throw std::runtime_error("it ends early");
    _left -= size;
    _hash.addBytes(bytes, size);
}

ReductionCheckpoint::ReductionCheckpoint(std::string folder, double worthSeconds,
                                         std::function<void(const std::string&)> note)
    : _folder(std::move(folder)), _worthSeconds(worthSeconds), _note(std::move(note)) {}

bool ReductionCheckpoint::load(const std::string& name, std::uint64_t key,
                               const std::function<void(CheckpointReader&)>& read) const {
    const std::string path = pathOf(name);
    const File file(std::fopen(path.c_str(), "rbe"));
    if (!file) return false;
    const auto note = [&](const std::string& text) {
        if (_note) _note(text);
    };
    try {
        CheckpointReader reader;
        reader._file = file.get();
        reader._left = fs::file_size(path);
        char magic[sizeof kMagic];
        std::uint64_t found = 0, checksum = 0;
        reader.get(magic, sizeof magic);
        if (std::memcmp(magic, kMagic, sizeof magic) != 0)
            throw std::runtime_error("it is no such file");
        reader.get(&found, sizeof found);
        if (found != key) {
            note(path + " is of another part or other options: not resumed");
            return false;
        }
        read(reader);
        const std::uint64_t expected = reader._hash.get();
        reader.get(&checksum, sizeof checksum);
        if (checksum != expected || reader._left != 0)
            throw std::runtime_error("its checksum is wrong");
    } catch (const std::exception& error) {
        note(path + " is damaged (" + error.what() + "): not resumed");
        return false;
    }
    note("resumed from " + path);
    return true;
}

void ReductionCheckpoint::save(const std::string& name, std::uint64_t key, double seconds,
                               const std::function<void(CheckpointWriter&)>& write) const {
    if (seconds < _worthSeconds) return;
    const std::string path = pathOf(name);
    std::error_code ignored;
    fs::create_directory(_folder, ignored);
    removeUnfinishedFiles(_folder, name + ".");
    UnfinishedFile unfinished(path);
    try {
        File file(std::fopen(unfinished.getPath().c_str(), "wbe"));
        if (!file) throw std::runtime_error(std::strerror(errno));
        CheckpointWriter writer;
        writer._file = file.get();
        writer.put(kMagic, sizeof kMagic);
        writer.put(&key, sizeof key);
        write(writer);
        const std::uint64_t checksum = writer._hash.get();
        writer.put(&checksum, sizeof checksum);
        if (std::fclose(file.release()) != 0) throw std::runtime_error(std::strerror(errno));
        unfinished.finish();
    } catch (const std::exception& error) {
        if (_note) _note("cannot keep " + path + " to resume from: " + error.what());
    }
}

void ReductionCheckpoint::remove() const {
    std::error_code ignored;
    if (!fs::is_directory(_folder, ignored)) return;
    // Only what a checkpoint writes: the name may be someone's folder.
    for (const std::string name : {"matrices", "factor", "constraint modes", "normal modes"}) {
        fs::remove(pathOf(name), ignored);
        removeUnfinishedFiles(_folder, name + ".");
    }
    fs::remove(_folder, ignored);
}

}  // namespace simflex
