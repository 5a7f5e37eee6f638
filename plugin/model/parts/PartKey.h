#pragma once
/** @file
Name of a reduced part by its content: of what it is made from, byte by byte. **/

#include <string>

#include "simflex/base/Hash.h"

namespace simflex {

class IncludeLimit;

namespace model {

/** 128 bits over everything that a reduction depends on. **/
class PartKey {
public:
    /** Begins with the version of simflex and the bytes of the library that reduces. **/
    PartKey();
    void add(const std::string& text);
    void add(double number);
    /** The bytes of a file and of those that it includes: *INCLUDE of decks, listScriptFiles() of
    Gmsh's scripts. A file that does not exist counts as such. **/
    void addFile(const std::string& path);
    /** 32 hexadecimal digits. **/
    std::string getText() const;

private:
    void addFile(const std::string& path, int depth, IncludeLimit& includes);
    std::string addBytes(const std::string& path);
    Hash m_first, m_second;
};

}  // namespace model
}  // namespace simflex
