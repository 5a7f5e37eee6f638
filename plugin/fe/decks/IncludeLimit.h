#pragma once
/** @file
How many files a deck may include. Internal to fe, and to what names parts by their content. **/

#include <string>

namespace simflex {

/** Counts the files of one deck: a few that each include the next one many times would be read for
years.

    IncludeLimit limit;
    const std::string mistake = limit.enter(depth);   // of each file, the first one included **/
class IncludeLimit {
public:
    /** @returns why there may not be one more, at this depth; empty: there may. **/
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
