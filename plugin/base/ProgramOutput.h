#pragma once
/** @file
Output of a child process, collected in an unnamed temporary file, so that a full pipe cannot block
the child, and read after it has ended. Internal.

    ProgramOutput said;
    setup.output = setup.error = said.getDescriptor();
    if (!ChildProcess(setup).wait().isSuccess()) throw std::runtime_error(said.read());  **/

#include <cstdio>
#include <memory>
#include <string>

namespace simflex {

class ProgramOutput {
public:
    /** @throws std::runtime_error if no temporary file can be created. **/
    ProgramOutput();

    /** Returns the file's descriptor, which other child processes do not inherit. **/
    int getDescriptor() const { return fileno(m_file.get()); }

    /** Returns the first `most` bytes. **/
    std::string read(size_t most = 4096) const;

private:
    struct Closer {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, Closer> m_file;
};

}  // namespace simflex
