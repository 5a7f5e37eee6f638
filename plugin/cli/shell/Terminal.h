#pragma once
/** @file
Output device of a program: a terminal with its size and capabilities, or a file. **/

namespace simflex {
namespace cli {

struct Terminal {
    bool isTerminal = false;
    bool hasColor = false;  ///< on terminals only, and not if NO_COLOR is set
    bool hasUnicode = true;
    int columns = 80, rows = 24;

    /** Queries standard output. The size may change later. **/
    static Terminal detect();
};

}  // namespace cli
}  // namespace simflex
