#pragma once
/** @file
Key of a reduced part: a hash of all its inputs. **/

#include <string>

#include "simflex/base/Hash.h"

namespace simflex {

class IncludeLimit;

namespace model {

/** 128-bit hash of everything that a reduction depends on. **/
class PartKey {
public:
    /** Starts with the version of simflex and the bytes of the reduction library. **/
    PartKey();
    void add(const std::string& text);
    void add(double number);
    /** Adds the bytes of a file and of the files it includes: *INCLUDE of decks, listScriptFiles()
    of Gmsh scripts. That a file does not exist is part of the key, too. **/
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
