#pragma once
/** @file
The plots beside a visualizer's frames. Internal to the renderer. **/

#include <memory>
#include <vector>

#include "simflex/render/ProbePlot.h"
#include "simflex/render/frame/FrameOutput.h"

namespace simflex {

class FramePlots {
public:
    /** @throws std::invalid_argument if the size is negative. **/
    int add(const ProbePlot& plot, PlotSide side, int size);
    /** @throws std::out_of_range if there is no such plot. **/
    ProbePlot& upd(int plot);

    /** Returns the plots in their current state, for frames of this size. **/
    std::vector<PlacedPlot> place(int frameWidth, int frameHeight, const PlotTheme& theme,
                                  double scale);

private:
    struct Entry {
        ProbePlot plot;
        PlotSide side;
        int size;
        std::shared_ptr<const PlotPainter> painter;  // reused until the plot changes
        const PlotTheme* theme;
    };
    std::vector<Entry> entries;
};

}  // namespace simflex
