#pragma once
/** @file
What a program writes to: a terminal of some size and abilities, or a file. **/

namespace simflex {
namespace cli {

struct Terminal {
    bool isTerminal = false;
    bool hasColor = false;  ///< not elsewhere than on a terminal, not if NO_COLOR is set
    bool hasUnicode = true;
    int columns = 80, rows = 24;

    /** Of standard output, now: windows change their size. **/
    static Terminal detect();
};

}  // namespace cli
}  // namespace simflex
