#pragma once
/** @file
Curves of probes over time, drawn as a figure beside the pictures of a run, with a moving mark.

@code
    simflex::ProbePlot plot("Slider-crank");
    plot.setTimeUnit("ms", 1e-3);
    plot.addPanel("slider position", "mm", 1e-3);
    plot.addCurve("flexible", time, flexible);              // seconds and metres
    plot.addCurve("rigid", time, rigid, simflex::ProbePlot::Line::Dashed);
    viz.addPlot(plot, simflex::PlotSide::Below);
    plot.draw(1200, 500).writePng("plot.png");              // or by itself
@endcode **/

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "simflex/render/Figure.h"

namespace simflex {

class ProbePlot {
public:
    enum class Line { Solid, Dashed };

    explicit ProbePlot(const std::string& plotTitle = "") : title(plotTitle) {}

    /** Sets the unit of the time axis and its length in seconds; default: s, ms or µs. **/
    ProbePlot& setTimeUnit(const std::string& name, double seconds);
    /** Fixes the ends of the time axis [s]; default: those of the curves.
    @throws std::invalid_argument unless low < high, both finite. **/
    ProbePlot& setTimeRange(double low, double high);
    /** Fixes the ends of the last panel's value axis, in the unit of the values.
    @throws std::invalid_argument unless low < high, both finite; std::logic_error without a
    panel. **/
    ProbePlot& setValueRange(double low, double high);

    /** Adds a panel at the bottom. `unitSize` converts the displayed unit to that of the values:
    1e-3 for values in metres displayed in mm.
    @throws std::invalid_argument unless it is positive. **/
    ProbePlot& addPanel(const std::string& quantity, const std::string& unit = "",
                        double unitSize = 1);

    /** Adds a curve to the last panel, creating one if necessary. Non-finite values leave a gap.
    @return its index, counted over all panels.
    @throws std::invalid_argument unless times are finite, non-decreasing and as many as the
    values. **/
    int addCurve(const std::string& name, const std::vector<double>& time = {},
                 const std::vector<double>& values = {}, Line line = Line::Solid);
    /** Appends a point to a curve. @throws std::out_of_range, std::invalid_argument. **/
    void append(int curve, double time, double value);

    int getNumPanels() const { return int(panels.size()); }
    int getNumCurves() const { return int(curves.size()); }

    /** Interpolates a curve linearly; NaN outside its range. **/
    double calcValue(int curve, double time) const;

    /** Returns the figure of all curves, in the displayed units. **/
    Figure makeFigure() const;
    /** Returns the unit of the time axis [s]. **/
    double calcTimeUnit() const;

    /** Draws the figure. Curves after `markTime` [s] are faint, and a mark is drawn there; NaN: no
    mark. `scale` is the size of letters and lines, 1 for a picture of 720 rows. Several threads may
    draw the same plot.
    @throws std::invalid_argument unless both sizes are between 1 and 32767.
    @throws std::runtime_error if there is no font. **/
    Image draw(int width, int height, double markTime = std::numeric_limits<double>::quiet_NaN(),
               double scale = 1, const PlotTheme& theme = PlotTheme::light()) const;

private:
    struct Curve {
        std::string name;
        int panel;
        Line line;
        std::vector<double> time, values;
    };
    struct Panel {
        std::string quantity, unit;
        double unitSize = 1;
        double low = 0, high = 0;  // fixed if low < high
    };

    const Curve& getCurve(int index) const;
    std::pair<double, double> calcTimeRange() const;

    std::string title;
    std::string timeUnit;  // empty: chosen when drawn
    double timeUnitSize = 1;
    double timeLow = 0, timeHigh = 0;  // fixed if low < high
    std::vector<Panel> panels;
    std::vector<Curve> curves;
};

}  // namespace simflex
