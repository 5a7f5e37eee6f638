#pragma once

#include <filesystem>

namespace simflex {

/** A unique folder under $TMPDIR (else /tmp), removed with its contents by the destructor. It is
locked until then, so that folders left by killed processes can be recognised. **/
class TemporaryFolder {
public:
    /** @throws std::runtime_error naming the location. **/
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return m_path; }

    /** Removes folders left by killed processes. The first TemporaryFolder of a process does so,
    too. **/
    static void removeAbandoned();

private:
    std::filesystem::path m_path;
    int m_lock = -1;
};

}  // namespace simflex
