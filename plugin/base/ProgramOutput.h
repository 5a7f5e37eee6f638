#pragma once
/** @file
What a program that simflex starts says: kept in a file without a name, so that no full pipe stops
it, and read when it has ended. Internal.

    ProgramOutput said;
    setup.output = setup.error = said.getDescriptor();
    if (!ChildProcess(setup).wait().isSuccess()) throw std::runtime_error(said.read()); **/

#include <cstdio>
#include <memory>
#include <string>

namespace simflex {

class ProgramOutput {
public:
    /** @throws std::runtime_error if there is no place for temporary files. **/
    ProgramOutput();

    /** Of the open file, which no other program inherits. **/
    int getDescriptor() const { return fileno(m_file.get()); }

    /** Its first bytes. **/
    std::string read(size_t most = 4096) const;

private:
    struct Closer {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, Closer> m_file;
};

}  // namespace simflex
