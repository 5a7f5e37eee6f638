#pragma once
/** @file
Limits the number of files a deck may include. Internal to fe, and to code that identifies parts by
their content. **/

#include <string>

namespace simflex {

/** Counts the files of one deck: a few files that each include the next one many times would take
years to read.

    IncludeLimit limit;
    const std::string mistake = limit.enter(depth);   // of each file, the first one included  **/
class IncludeLimit {
public:
    /** @returns why another file at this depth is refused; "" if it is allowed. **/
    std::string enter(int depth) {
        if (depth > Deepest)
            return "INCLUDE goes " + std::to_string(depth) +
                   " files deep; does a file include itself?";
        if (++m_number > Most)
            return "INCLUDE reads more than " + std::to_string(Most) +
                   " files; do some include others many times?";
        return "";
    }

private:
    static constexpr int Deepest = 20, Most = 10000;
    int m_number = 0;
};

}  // namespace simflex
