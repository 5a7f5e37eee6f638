#pragma once
/** @file
Pictures in a terminal, by libchafa: as kitty or sixel graphics where the terminal says that it has
them, else made of characters. **/

#include <string>

#include "simflex/cli/shell/Terminal.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace cli {

enum class PictureKind { Automatic, Symbols, Sixel, Kitty };

/** Symbols, sixel or kitty. **/
PictureKind choosePictureKind(PictureKind wanted, const Terminal& terminal);

/** As wide as the terminal, or as high as it is but for two rows. Without colour, plain characters
with no control sequences. Ends with a new line. **/
std::string drawTerminalPicture(const Image& image, const Terminal& terminal,
                                PictureKind kind = PictureKind::Automatic);

}  // namespace cli
}  // namespace simflex
