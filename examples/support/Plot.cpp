#include "support/Plot.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace simflex::examples {

void writePlotValues(const Plot& plot, const std::string& csvFile) {
    std::ofstream file(csvFile);
    file.precision(std::numeric_limits<double>::max_digits10);
    file << "panel,series,x,y\n";
    for (const Plot::Panel& panel : plot.panels)
        for (const Plot::Series& series : panel.series)
            for (size_t k = 0; k < std::min(series.x.size(), series.y.size()); ++k)
                file << '"' << panel.title << "\",\"" << series.label << "\"," << series.x[k] << ','
                     << series.y[k] << '\n';
    if (!file) throw std::runtime_error("cannot write " + csvFile);
}

void writePlot(const Plot& plot, const std::string& pngFile) {
    Figure figure;
    figure.title = plot.title;
    figure.xLabel = plot.xLabel;
    figure.marks = plot.marks;
    figure.isLogarithmic = plot.hasLogarithmicX;
    figure.hasEqualScales = plot.hasEqualScales;
    for (const Plot::Panel& panel : plot.panels) {
        FigurePanel& drawn = figure.panels.emplace_back();
        drawn.label = panel.title;
        if (!panel.title.empty()) drawn.label += panel.yLabel[0] == '[' ? " " : ": ";
        drawn.label += panel.yLabel;
        drawn.isLogarithmic = panel.isLogarithmic;
        for (const Plot::Series& series : panel.series) {
            FigureCurve curve{series.label, series.x, series.y};
            const size_t count = std::min(curve.x.size(), curve.y.size());
            curve.x.resize(count);
            curve.y.resize(count);
            curve.isFaint = series.color == Plot::Gray;
            curve.color = std::max(0, series.color);
            curve.dash = series.isDashed ? 1 : 0;
            curve.marks = !series.hasLine    ? FigureCurve::Marks::Circles
                          : series.hasPoints ? FigureCurve::Marks::Points
                                             : FigureCurve::Marks::None;
            drawn.curves.push_back(std::move(curve));
        }
    }
    drawFigure(pngFile, figure);
}

}  // namespace simflex::examples
