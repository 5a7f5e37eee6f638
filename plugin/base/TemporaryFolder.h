#pragma once

#include <filesystem>

namespace simflex {

/** A folder of its own under $TMPDIR (else /tmp), removed with everything in it at the end. **/
class TemporaryFolder {
public:
    /** @throws std::runtime_error naming the place. **/
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return m_path; }

private:
    std::filesystem::path m_path;
};

}  // namespace simflex
