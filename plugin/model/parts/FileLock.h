#pragma once
/** @file
A lock that processes of one machine (or of a disk with file locks) take one after the other.

    FileLock lock("entry.lock");
    while (lock.tryToHold() == FileLock::State::Busy) ...wait  **/

#include <string>

namespace simflex {
namespace model {

/** flock(2) on a file that exists while somebody holds it. The lock goes with the process, however
that ends; the file of a killed one is taken over. **/
class FileLock {
public:
    enum class State {
        Held,
        Busy,       ///< somebody else holds it
        Impossible  ///< the file cannot be made, or its disk knows no locks
    };

    explicit FileLock(const std::string& path);
    ~FileLock();
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;

    /** Does not wait. **/
    State tryToHold();

private:
    std::string m_path;
    int m_file = -1;
};

}  // namespace model
}  // namespace simflex
