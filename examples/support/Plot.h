#pragma once
/** @file
Line plots over one x axis, panel below panel, drawn by gnuplot into a PNG file.

    Plot plot{"Slider-crank", "time [ms]", {}};
    plot.panels.push_back({"slider position", "[mm]", {{"flexible", time, x, Plot::Blue}}});
    writePlot(plot, "plot.png");
**/

#include <string>
#include <vector>

namespace simflex::examples {

struct Plot {
    /** Colours that colour-blind eyes can tell apart (Okabe, Ito). **/
    static constexpr const char* Blue = "#0072b2";
    static constexpr const char* Orange = "#d55e00";
    static constexpr const char* Green = "#009e73";
    static constexpr const char* Gray = "#a8a8a8";

    struct Series {
        std::string label;
        std::vector<double> x, y;
        std::string color;
        double width = 2;
        bool isDashed = false;
        bool onRightAxis = false;
        bool hasPoints = false;  ///< a dot at each value
        bool hasLine = true;     ///< else circles only: of what a line is compared with
    };
    struct Panel {
        std::string title, yLabel;
        std::vector<Series> series;
        std::string rightLabel = {};  ///< of the right axis, if a series wants one
        bool isLogarithmic = false;   ///< left axis
    };
    /** A vertical line through all panels, with a word above. **/
    struct Mark {
        double x;
        std::string label;
    };
    std::string title, xLabel;
    std::vector<Panel> panels;
    std::vector<Mark> marks = {};
    bool hasLogarithmicX = false;
    bool hasEqualScales = false;  ///< y as long as x, for paths; with one panel
};

/** All values as "panel,series,x,y". @throws std::runtime_error if it cannot be written. **/
void writePlotValues(const Plot& plot, const std::string& csvFile);

/** @return false, with nothing written, when there is no gnuplot on this machine.
@throws std::runtime_error when gnuplot fails. **/
bool writePlot(const Plot& plot, const std::string& pngFile);

}  // namespace simflex::examples
