#pragma once
/** @file
Pictures in a terminal, by the graphics protocol of kitty, which others know as well (WezTerm,
Ghostty, Konsole); terminals that do not know it show nothing. **/

#include <string>

#include "simflex/cli/shell/Terminal.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace cli {

/** As wide as the terminal, or as high as it is but for two rows. Ends with a new line. **/
std::string drawTerminalPicture(const Image& image, const Terminal& terminal);

}  // namespace cli
}  // namespace simflex
