#include "simflex/cli/shell/TerminalPicture.h"

#include <algorithm>

#include "simflex/base/Base64.h"

namespace simflex {
namespace cli {

std::string drawTerminalPicture(const Image& image, const Terminal& terminal) {
    constexpr size_t piece = 4096;      // limit of the protocol
    constexpr double heightOfCell = 2;  // approximately, relative to its width
    const double columnsOfHeight =
        heightOfCell * std::max(terminal.rows - 2, 2) * image.getWidth() / image.getHeight();
    const int columns = std::max(4, int(std::min<double>(terminal.columns, columnsOfHeight)));
    const std::vector<std::uint8_t> png = image.encodePng();
    const std::string bytes = encodeBase64(png.data(), png.size());
    std::string text;
    for (size_t begin = 0; begin < bytes.size(); begin += piece)
        text += "\033_G" + (begin > 0 ? "" : "a=T,f=100,c=" + std::to_string(columns) + ",") +
                "m=" + (begin + piece < bytes.size() ? "1;" : "0;") + bytes.substr(begin, piece) +
                "\033\\";
    return text + "\n";
}

}  // namespace cli
}  // namespace simflex
