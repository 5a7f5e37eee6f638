#pragma once
/** @file
Line plots over one x axis, panel below panel, drawn into a PNG file; simflex::Figure does more.

    Plot plot{"Slider-crank", "time [ms]", {}};
    plot.panels.push_back({"slider position", "[mm]", {{"flexible", time, x, Plot::Blue}}});
    writePlot(plot, "plot.png");
**/

#include <string>
#include <vector>

#include "simflex/render/Figure.h"

namespace simflex::examples {

struct Plot {
    /** Colours that colour-blind eyes can tell apart (Okabe, Ito). **/
    static constexpr int Blue = 0, Orange = 1, Green = 2, Pink = 3, Gold = 4, Sky = 5, Slate = 6;
    static constexpr int Gray = -1;  ///< thin and broken: a line to compare with

    struct Series {
        std::string label;
        std::vector<double> x, y;
        int color = Blue;
        bool isDashed = false;
        bool hasPoints = false;  ///< a dot at each value
        bool hasLine = true;     ///< else circles only: of what a line is compared with
    };
    struct Panel {
        std::string title, yLabel;
        std::vector<Series> series;
        bool isLogarithmic = false;
    };
    std::string title, xLabel;
    std::vector<Panel> panels;
    std::vector<Figure::Mark> marks = {};
    bool hasLogarithmicX = false;
    bool hasEqualScales = false;  ///< y as long as x, for paths; with one panel
};

/** All values as "panel,series,x,y". @throws std::runtime_error if it cannot be written. **/
void writePlotValues(const Plot& plot, const std::string& csvFile);

/** @throws std::runtime_error if it cannot be written. **/
void writePlot(const Plot& plot, const std::string& pngFile);

}  // namespace simflex::examples
