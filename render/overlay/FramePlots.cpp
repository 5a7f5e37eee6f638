#include "FramePlots.h"

#include <stdexcept>

namespace simflex {

int FramePlots::add(const ProbePlot& plot, PlotSide side, int size) {
    if (size < 0)
        throw std::invalid_argument("addPlot: size must not be negative, not " +
                                    std::to_string(size));
    entries.push_back({plot, side, size, nullptr, nullptr});
    return int(entries.size()) - 1;
}

ProbePlot& FramePlots::upd(int plot) {
    if (plot < 0 || plot >= int(entries.size()))
        throw std::out_of_range("updPlot: no plot " + std::to_string(plot) + ", there are " +
                                std::to_string(entries.size()));
    entries[std::size_t(plot)].painter = nullptr;
    return entries[std::size_t(plot)].plot;
}

std::vector<PlacedPlot> FramePlots::place(int frameWidth, int frameHeight, const PlotTheme& theme,
                                          double scale) {
    constexpr double usualPart = 0.42;  // relative to the picture's size
    const int usualBelow = std::max(1, 2 * int(usualPart * frameHeight / 2));
    const int usualRight = std::max(1, 2 * int(usualPart * frameWidth / 2));
    std::vector<PlacedPlot> placed;
    for (Entry& entry : entries) {
        const bool isBelow = entry.side == PlotSide::Below;
        const int size = entry.size > 0 ? entry.size : isBelow ? usualBelow : usualRight;
        const int width = isBelow ? frameWidth : size, height = isBelow ? size : frameHeight;
        if (!entry.painter || entry.theme != &theme || entry.painter->getWidth() != width ||
            entry.painter->getHeight() != height) {
            entry.painter = std::make_shared<const PlotPainter>(entry.plot.makeFigure(), theme,
                                                                width, height, scale);
            entry.theme = &theme;
        }
        placed.push_back({entry.painter, entry.side, entry.plot.calcTimeUnit()});
        (isBelow ? frameHeight : frameWidth) += size;
    }
    return placed;
}

}  // namespace simflex
