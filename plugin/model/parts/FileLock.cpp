#include "simflex/model/parts/FileLock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace simflex {
namespace model {

namespace {

/** True if the path still refers to the open file, which its last holder may have removed. **/
bool isStillThere(int file, const std::string& path) {
    struct stat opened, named;
    return fstat(file, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
           opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

FileLock::FileLock(const std::string& path) : m_path(path) {}

FileLock::~FileLock() {
    if (m_file < 0) return;
    unlink(m_path.c_str());  // before the lock is released
    close(m_file);
}

FileLock::State FileLock::tryToHold() {
    if (m_file >= 0) return State::Held;
    for (;;) {
        const int file = open(m_path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (file < 0) return State::Impossible;
        if (flock(file, LOCK_EX | LOCK_NB) != 0) {
            const bool isBusy = errno == EWOULDBLOCK || errno == EINTR;
            close(file);
            return isBusy ? State::Busy : State::Impossible;
        }
        if (isStillThere(file, m_path)) {
            m_file = file;
            return State::Held;
        }
        close(file);
    }
}

}  // namespace model
}  // namespace simflex
