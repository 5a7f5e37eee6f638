#include "simflex/base/UnfinishedFile.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr char Ending[] = ".part-";  // followed by the process number
constexpr int MostNames = 1000;      // tried for one unfinished file

[[noreturn]] void refuse(const fs::path& path, int error) {
    throw std::runtime_error(
        "cannot write '" + path.string() +
        "': " + (error == EEXIST ? "it is a device or a pipe, not a file" : std::strerror(error)));
}

struct Descriptor {
    int number;
    ~Descriptor() {
        if (number >= 0) close(number);
    }
};

void writeAll(const Descriptor& file, std::string_view bytes, const fs::path& path) {
    while (!bytes.empty()) {
        const ssize_t count = write(file.number, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) refuse(path, count < 0 ? errno : ENOSPC);
        bytes.remove_prefix(size_t(count));
    }
}

/** Flushes a file or folder to the disk. **/
void sync(const fs::path& path, const fs::path& name) {
    const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (file.number < 0) return;  // a folder may be writable but not readable
    if (fsync(file.number) != 0 && errno != EINVAL && errno != EROFS) refuse(name, errno);
}

/** Resolves symbolic links; the target need not exist. **/
fs::path followLinks(fs::path path) {
    constexpr int MostLinks = 40;  // the kernel's limit
    std::error_code none;
    for (int k = 0; k < MostLinks && fs::is_symlink(fs::symlink_status(path, none)); ++k) {
        const fs::path target = fs::read_symlink(path, none);
        if (none) break;
        path = path.parent_path() / target;
    }
    return path;
}

/** Returns an errno code why a path may not be replaced, 0 if it may. @param path  no link **/
int findObstacle(const fs::path& path) {
    std::error_code none;
    const fs::file_status status = fs::symlink_status(path, none);
    if (!fs::exists(status)) return 0;
    if (fs::is_directory(status)) return EISDIR;
    if (!fs::is_regular_file(status)) return EEXIST;
    return access(path.c_str(), W_OK) == 0 ? 0 : errno;
}

/** Returns 4711 for "crank.h5.part-4711", 0 if the name has no process number. **/
int findProcess(const std::string& name) {
    const size_t at = name.rfind(Ending);
    int process = 0;
    if (at != std::string::npos)
        std::from_chars(name.data() + at + sizeof Ending - 1, name.data() + name.size(), process);
    return process;
}

/** Returns whether a name starts with `begin` and belongs to an unfinished file of an ended
process. **/
bool isLeftover(const fs::path& path, const std::string& begin) {
    const std::string name = path.filename().string();
    const int process = findProcess(name);
    return name.compare(0, begin.size(), begin) == 0 && process > 0 && kill(process, 0) != 0 &&
           errno == ESRCH;
}

std::vector<fs::path> listLeftovers(const fs::path& folder, const std::string& begin) {
    std::error_code ignored;
    std::vector<fs::path> left;
    for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, ignored))
        if (isLeftover(entry.path(), begin)) left.push_back(entry.path());
    return left;
}

/** Creates an empty file next to `path`, under a name that nothing has: what has it may be a link
that others have put there. @return its path **/
fs::path createBeside(const fs::path& path) {
    const std::string first = path.string() + Ending + std::to_string(getpid());
    std::string name = first;
    for (int k = 1; k <= MostNames; ++k) {
        const Descriptor file{
            open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666)};
        if (file.number >= 0) return name;
        if (errno != EEXIST) refuse(path, errno);
        name = first + "-" + std::to_string(k);
    }
    throw std::runtime_error("cannot write '" + path.string() + "': there are " +
                             std::to_string(MostNames) + " files '" + first +
                             "-…' next to it; remove them");
}

/** Removes the leftovers of one file. Each folder is listed only once, since thousands of pictures
may be written to one. **/
void removeLeftovers(const fs::path& folder, const std::string& begin) {
    static std::mutex mutex;
    static std::map<fs::path, std::vector<fs::path>> known;
    const std::lock_guard<std::mutex> lock(mutex);
    const auto [entry, isNew] = known.try_emplace(folder);
    if (isNew) entry->second = listLeftovers(folder, "");
    std::error_code ignored;
    for (const fs::path& file : entry->second)
        if (isLeftover(file, begin)) fs::remove(file, ignored);
}

}  // namespace

UnfinishedFile::UnfinishedFile(const fs::path& path)
    : m_path(followLinks(path)), m_unfinished(createBeside(m_path)) {}

UnfinishedFile::~UnfinishedFile() {
    std::error_code ignored;
    if (!m_isFinished) fs::remove(m_unfinished, ignored);
}

void UnfinishedFile::finish(Durability durability) {
    if (durability == Durability::PowerFailure) sync(m_unfinished, m_path);
    if (const int obstacle = findObstacle(m_path)) refuse(m_path, obstacle);
    const fs::path folder = m_path.has_parent_path() ? m_path.parent_path() : ".";
    // Before the file is there: afterwards, nobody may write it again.
    removeLeftovers(folder, m_path.filename().string() + Ending);
    if (rename(m_unfinished.c_str(), m_path.c_str()) != 0) refuse(m_path, errno);
    m_isFinished = true;
    if (durability == Durability::PowerFailure) sync(folder, m_path);
}

void replaceFile(const fs::path& path, std::string_view bytes, Durability durability) {
    UnfinishedFile unfinished(path);
    {
        Descriptor file{open(unfinished.getPath().c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC)};
        if (file.number < 0) refuse(path, errno);
        writeAll(file, bytes, path);
        // Network file systems may report a full disk only on close.
        if (close(std::exchange(file.number, -1)) != 0) refuse(path, errno);
    }
    unfinished.finish(durability);
}

void appendToFile(const fs::path& path, std::uint64_t size, std::string_view bytes) {
    const Descriptor file{open(path.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666)};
    if (file.number < 0 || ftruncate(file.number, off_t(size)) != 0 ||
        lseek(file.number, 0, SEEK_END) < 0)
        refuse(path, errno);
    writeAll(file, bytes, path);
    if (fsync(file.number) != 0) refuse(path, errno);
}

void checkWritable(const fs::path& name) {
    const fs::path path = followLinks(name);
    const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
    const std::string what = "cannot write '" + path.string() + "': ";
    if (!fs::is_directory(folder))
        throw std::runtime_error(what + "there is no folder '" + folder.string() + "'");
    if (fs::is_directory(path)) throw std::runtime_error(what + "it is a folder");
    if (access(folder.c_str(), W_OK) != 0)
        throw std::runtime_error(what + "its folder is write-protected");
    if (const int obstacle = findObstacle(path)) refuse(path, obstacle);
}

void checkReplaceable(const fs::path& path, std::string_view begin, const std::string& kind) {
    checkWritable(path);
    if (!fs::exists(path) || fs::file_size(path) == 0) return;
    std::string found(begin.size(), '\0');
    std::ifstream(path, std::ios::binary).read(found.data(), std::streamsize(found.size()));
    if (found != begin) refuseReplacing(path, kind);
}

void refuseReplacing(const fs::path& path, const std::string& kind) {
    throw std::runtime_error("'" + path.string() + "' is there and is no " + kind +
                             ", so it is not replaced: give another name, or remove it");
}

void refuseLinkedFolder(const fs::path& folder) {
    std::error_code none;
    if (fs::is_symlink(fs::symlink_status(folder, none)))
        throw std::runtime_error(
            "'" + folder.string() + "' is a link to '" + fs::read_symlink(folder, none).string() +
            "', where files would be replaced: remove the link, or name another folder");
}

void removeUnfinishedFiles(const fs::path& folder, const std::string& begin) {
    std::error_code ignored;
    for (const fs::path& file : listLeftovers(folder, begin)) fs::remove(file, ignored);
}

}  // namespace simflex
