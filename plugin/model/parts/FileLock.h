#pragma once
/** @file
A lock between processes of one machine, or of several that share a disk with file locks.

    FileLock lock("entry.lock");
    while (lock.tryToHold() == FileLock::State::Busy) ...wait  **/

#include <string>

namespace simflex {
namespace model {

/** flock(2) on a file that exists while the lock is held. The system releases the lock when the
process ends in any way; the file left by a killed process is reused. **/
class FileLock {
public:
    enum class State {
        Held,
        Busy,       ///< another process holds it
        Impossible  ///< the file cannot be created, or its disk has no locks
    };

    explicit FileLock(const std::string& path);
    ~FileLock();
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;

    /** Returns at once. **/
    State tryToHold();

private:
    std::string m_path;
    int m_file = -1;
};

}  // namespace model
}  // namespace simflex
