#include "simflex/base/TemporaryFolder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace simflex {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
    const char* place = std::getenv("TMPDIR");
    std::string pattern =
        fs::absolute(place && *place ? place : "/tmp").string() + "/simflex-XXXXXX";
    if (!mkdtemp(pattern.data()))
        throw std::runtime_error("cannot make a temporary folder '" + pattern +
                                 "': " + std::strerror(errno));
    m_path = pattern;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(m_path, ignored);
}

}  // namespace simflex
