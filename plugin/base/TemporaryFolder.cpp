#include "simflex/base/TemporaryFolder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace simflex {

namespace fs = std::filesystem;

namespace {

constexpr char Beginning[] = "simflex-locked-";  // followed by six letters

fs::path findPlace() {
    const char* given = std::getenv("TMPDIR");
    return fs::absolute(given && *given ? given : "/tmp");
}

/** Locks a folder. Returns −1 if another process has locked it or it no longer exists. **/
int lock(const fs::path& folder) {
    const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (file < 0) return -1;
    struct stat opened {
    }, named{};
    const bool isOurs = flock(file, LOCK_EX | LOCK_NB) == 0 && fstat(file, &opened) == 0 &&
                        lstat(folder.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
                        opened.st_dev == named.st_dev && opened.st_uid == geteuid();
    if (isOurs) return file;
    close(file);
    return -1;
}

/** Removes folders that no process has locked. **/
void sweep(const fs::path& place) {
    std::error_code ignored;
    std::vector<fs::path> folders;
    for (const auto& entry : fs::directory_iterator(place, ignored))
        if (entry.path().filename().string().rfind(Beginning, 0) == 0)
            folders.push_back(entry.path());
    for (const fs::path& folder : folders) {
        const int file = lock(folder);
        if (file < 0) continue;
        fs::remove_all(folder, ignored);
        close(file);
    }
}

}  // namespace

void TemporaryFolder::removeAbandoned() {
    static std::atomic<long> doneBy{0};  // process that has swept; a forked child sweeps again
    if (doneBy.exchange(getpid()) != getpid()) sweep(findPlace());
}

TemporaryFolder::TemporaryFolder() {
    removeAbandoned();
    const fs::path place = findPlace();
    constexpr int MostTrials = 10;  // another process may remove a folder before it is locked
    for (int trial = 0; trial < MostTrials && m_lock < 0; ++trial) {
        std::error_code ignored;
        if (trial > 0) fs::remove(m_path, ignored);
        std::string pattern = (place / Beginning).string() + "XXXXXX";
        if (!mkdtemp(pattern.data()))
            throw std::runtime_error("cannot make a temporary folder '" + pattern +
                                     "': " + std::strerror(errno));
        m_path = pattern;
        m_lock = lock(m_path);
    }
    fs::create_directory(m_path);  // for file systems without locks
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(m_path, ignored);
    if (m_lock >= 0) close(m_lock);
}

}  // namespace simflex
