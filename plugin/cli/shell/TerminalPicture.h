#pragma once
/** @file
Pictures in a terminal, by the graphics protocol of kitty, which WezTerm, Ghostty and Konsole also
support; other terminals show nothing. **/

#include <string>

#include "simflex/cli/shell/Terminal.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace cli {

/** As wide as the terminal, or as high as it except for two rows. Ends with a newline. **/
std::string drawTerminalPicture(const Image& image, const Terminal& terminal);

}  // namespace cli
}  // namespace simflex
