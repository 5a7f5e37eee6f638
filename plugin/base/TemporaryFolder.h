#pragma once

#include <filesystem>

namespace simflex {

/** A folder of its own under $TMPDIR (else /tmp), removed with everything in it at the end. It is
locked until then, so that those of processes that were killed can be told. **/
class TemporaryFolder {
public:
    /** @throws std::runtime_error naming the place. **/
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return m_path; }

    /** Removes those of processes that were killed; the first folder that a process makes does it,
    too. **/
    static void removeAbandoned();

private:
    std::filesystem::path m_path;
    int m_lock = -1;
};

}  // namespace simflex
