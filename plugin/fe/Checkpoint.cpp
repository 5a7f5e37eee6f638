#include "simflex/fe/Checkpoint.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr char Magic[8] = {'s', 'i', 'm', 'f', 'l', 'e', 'x', '1'};

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

/** An archive written to or read from a file directly, because its bytes may fill most of the
memory. **/
class FileArchive : public Archive {
public:
    /** For writing. **/
    explicit FileArchive(std::FILE* file) : Archive(false, 0), m_file(file) {}
    /** For reading this many bytes. **/
    FileArchive(std::FILE* file, std::uint64_t size) : Archive(true, size), m_file(file) {}

    /** Writes or checks a checksum of all preceding bytes. **/
    void visitChecksum() {
        const std::uint64_t expected = m_hash.get();
        std::uint64_t sum = expected;
        visit(sum);
        if (sum != expected) fail("its checksum is wrong");
    }

private:
    void move(void* data, size_t size) override {
        const size_t done =
            isReading() ? std::fread(data, 1, size, m_file) : std::fwrite(data, 1, size, m_file);
        if (done != size) fail(isReading() ? "it ends early" : std::strerror(errno));
        m_hash.addBytes(data, size);
    }

    std::FILE* m_file;
    Hash m_hash;
};

}  // namespace

ReductionCheckpoint::ReductionCheckpoint(std::string folder, double worthSeconds,
                                         std::function<void(const std::string&)> note)
    : m_folder(std::move(folder)), m_worthSeconds(worthSeconds), m_note(std::move(note)) {}

bool ReductionCheckpoint::load(const std::string& name, std::uint64_t key,
                               const std::function<void(Archive&)>& read) const {
    const std::string path = pathOf(name);
    const File file(isInputFile(path) ? std::fopen(path.c_str(), "rbe") : nullptr);
    if (!file) return false;
    const auto note = [&](const std::string& text) {
        if (m_note) m_note(text);
    };
    try {
        FileArchive archive(file.get(), fs::file_size(path));
        char magic[sizeof Magic];
        std::uint64_t found = 0;
        archive.visitBytes(magic, sizeof magic);
        if (std::memcmp(magic, Magic, sizeof magic) != 0)
            throw std::runtime_error("it is no such file");
        archive.visit(found);
        if (found != key) {
            note(path + " is of another part or other options: not resumed");
            return false;
        }
        read(archive);
        archive.visitChecksum();
        archive.requireEnd();
    } catch (const std::exception& error) {
        note(path + " is damaged (" + error.what() + "): not resumed");
        return false;
    }
    note("resumed from " + path);
    return true;
}

void ReductionCheckpoint::save(const std::string& name, std::uint64_t key, double seconds,
                               const std::function<void(Archive&)>& write) const {
    if (seconds < m_worthSeconds) return;
    const std::string path = pathOf(name);
    std::error_code ignored;
    fs::create_directory(m_folder, ignored);
    try {
        refuseLinkedFolder(m_folder);
        removeUnfinishedFiles(m_folder, name + ".");
        UnfinishedFile unfinished(path);
        File file(std::fopen(unfinished.getPath().c_str(), "wbe"));
        if (!file) throw std::runtime_error(std::strerror(errno));
        FileArchive archive(file.get());
        char magic[sizeof Magic];
        std::memcpy(magic, Magic, sizeof magic);
        archive.visitBytes(magic, sizeof magic);
        archive.visit(key);
        write(archive);
        archive.visitChecksum();
        if (std::fclose(file.release()) != 0) throw std::runtime_error(std::strerror(errno));
        unfinished.finish();
    } catch (const std::exception& error) {
        if (m_note) m_note("cannot keep " + path + " to resume from: " + error.what());
    }
}

void ReductionCheckpoint::remove() const {
    std::error_code ignored;
    if (!fs::is_directory(fs::symlink_status(m_folder, ignored))) return;
    // Remove only a checkpoint's own files: the folder may have other contents.
    for (const std::string name : {"matrices", "factor", "constraint modes", "normal modes"}) {
        fs::remove(pathOf(name), ignored);
        removeUnfinishedFiles(m_folder, name + ".");
    }
    fs::remove(m_folder, ignored);
}

}  // namespace simflex
