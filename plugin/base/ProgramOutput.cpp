#include "simflex/base/ProgramOutput.h"

#include <fcntl.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace simflex {

ProgramOutput::ProgramOutput() : m_file(std::tmpfile()) {
    if (!m_file)
        throw std::runtime_error(std::string("cannot make a temporary file: ") +
                                 std::strerror(errno));
    fcntl(getDescriptor(), F_SETFD, FD_CLOEXEC);
}

std::string ProgramOutput::read(size_t most) const {
    std::string text(most, '\0');
    std::fflush(m_file.get());
    std::rewind(m_file.get());
    text.resize(std::fread(text.data(), 1, text.size(), m_file.get()));
    return text;
}

}  // namespace simflex
