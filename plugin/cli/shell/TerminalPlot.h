#pragma once
/** @file
Curves over time drawn with characters: braille dots or plain ASCII. On a terminal with colours,
curves of the same unit share a panel; otherwise each has its own. **/

#include <string>
#include <vector>

#include "simflex/cli/shell/Terminal.h"

namespace simflex {
namespace cli {

struct TerminalCurve {
    std::string name, unit;
    std::vector<double> time, values;  ///< non-finite values leave a gap
};

/** Fills the terminal except for two rows; each panel has at least six. Ends with a newline.
@throws std::invalid_argument unless there is a curve with a finite value. **/
std::string drawTerminalPlot(const std::vector<TerminalCurve>& curves, const Terminal& terminal);

}  // namespace cli
}  // namespace simflex
