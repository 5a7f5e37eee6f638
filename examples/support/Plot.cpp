#include "support/Plot.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "support/Gnuplot.h"

namespace simflex::examples {
namespace {

void writeSeries(std::ostream& script, const Plot::Panel& panel, int panelIndex) {
    for (size_t i = 0; i < panel.series.size(); ++i) {
        const Plot::Series& series = panel.series[i];
        script << "$data_" << panelIndex << "_" << i << " << END_OF_DATA\n";
        const size_t count = std::min(series.x.size(), series.y.size());
        for (size_t k = 0; k < count; ++k) script << series.x[k] << ' ' << series.y[k] << '\n';
        script << "END_OF_DATA\n";
    }
}

/** Ranges of both axes, a little more than all values, with the same length for a unit on both.
@param aspect  width over height of the panel **/
std::string makeEqualRanges(const Plot::Panel& panel, double aspect) {
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (const Plot::Series& series : panel.series)
        for (int a = 0; a < 2; ++a)
            for (const double value : a == 0 ? series.x : series.y) {
                low[a] = std::min(low[a], value);
                high[a] = std::max(high[a], value);
            }
    const double height = 1.05 * std::max(high[1] - low[1], (high[0] - low[0]) / aspect);
    std::ostringstream text;
    for (int a = 0; a < 2; ++a) {
        const double half = 0.5 * height * (a == 0 ? aspect : 1), middle = 0.5 * (low[a] + high[a]);
        text << "set " << (a == 0 ? 'x' : 'y') << "range [" << middle - half << ":" << middle + half
             << "]\n";
    }
    return text.str();
}

void writePanel(std::ostream& script, const Plot& plot, int index) {
    const Plot::Panel& panel = plot.panels[index];
    const bool isLast = index + 1 == int(plot.panels.size());
    const bool hasRightAxis = std::any_of(panel.series.begin(), panel.series.end(),
                                          [](const Plot::Series& s) { return s.onRightAxis; });
    // Panels share the height between the title above and the x labels below.
    const double top = 0.885, bottom = 0.085, gap = 0.09;
    const int count = int(plot.panels.size());
    const double height = (top - bottom - gap * (count - 1)) / count;
    const double upper = top - index * (height + gap);
    script << "set tmargin at screen " << upper << "\nset bmargin at screen " << upper - height
           << '\n';
    script << "set label 1 " << quoteForGnuplot("{/:Bold " + panel.title + "}")
           << " at screen 0.085," << upper + 0.021 << " left textcolor rgb '#202020'\n"
           << "set key at screen 0.93,"
           << upper + (panel.title.empty() ? 0.06 : 0.04)  // room for a second row
           << " right top horizontal samplen 2.5 width -1\n";
    script << "set ylabel " << quoteForGnuplot(panel.yLabel) << " offset 0.5,0\n";
    script << (hasRightAxis ? "set y2tics\n" : "unset y2tics\n");
    script << "set y2label " << quoteForGnuplot(panel.rightLabel) << " offset -0.5,0\n";
    // Lines keep off the frame; logarithmic axes end at a power of ten.
    script << (panel.isLogarithmic
                   ? "set logscale y\nset format y '10^{%T}'\nunset offsets\nset autoscale y\n"
                   : "unset logscale y\nset format y '%g'\nset autoscale yfix\n"
                     "set offsets graph 0, graph 0, graph 0.06, graph 0.06\n")
           << (plot.hasLogarithmicX ? "set logscale x\nset autoscale x\n" : "unset logscale x\n");
    for (size_t i = 0; i < plot.marks.size(); ++i) {
        const Plot::Mark& mark = plot.marks[i];
        script << "set arrow " << i + 1 << " from first " << mark.x << ", graph 0 to first "
               << mark.x << ", graph 1 nohead lc rgb '#707070' lw 1 dt (4,4) back\n";
        script
            << "set label " << i + 3 << " " << quoteForGnuplot(mark.label) << " at first " << mark.x
            << ", graph 0.03 left rotate by 90 offset -0.8,0 textcolor rgb '#606060' font ',11'\n";
    }
    if (isLast)
        script << "set format x " << (plot.hasLogarithmicX ? "'10^{%T}'" : "'%g'")
               << "\nset xlabel " << quoteForGnuplot(plot.xLabel) << "\n";
    else
        script << "set format x ''\nunset xlabel\n";
    if (plot.hasEqualScales) script << makeEqualRanges(panel, 1400 * 0.84 / (900 * height));
    script << "plot ";
    for (size_t i = 0; i < panel.series.size(); ++i) {
        const Plot::Series& series = panel.series[i];
        script << (i ? ", " : "") << "$data_" << index << "_" << i << " using 1:2 axes "
               << (series.onRightAxis ? "x1y2" : "x1y1")
               << (!series.hasLine    ? " with points pt 6 ps 1.6 lw "
                   : series.hasPoints ? " with linespoints pt 7 ps 1.3 lw "
                                      : " with lines lw ")
               << series.width << " lc rgb " << quoteForGnuplot(series.color)
               << (!series.hasLine   ? ""
                   : series.isDashed ? " dt (12,6)"
                                     : " dt 1")
               << " title " << quoteForGnuplot(series.label);
    }
    script << '\n';
}

std::string makeScript(const Plot& plot, const std::string& pngFile) {
    std::ostringstream script;
    script.precision(10);
    for (size_t i = 0; i < plot.panels.size(); ++i) writeSeries(script, plot.panels[i], int(i));
    script
        << "set encoding utf8\n"
        << "set terminal pngcairo size 1400,900 font 'DejaVu Sans,13' linewidth 1.2 enhanced\n"
        << "set output " << quoteForGnuplot(pngFile) << '\n'
        << "set border lc rgb '#606060' lw 1\nset tics textcolor rgb '#202020' nomirror scale 0.6\n"
        << "set grid lc rgb '#d4d4d4' lw 0.8 lt 1 dt 1\nset autoscale xfix\n"
        << "set lmargin at screen 0.085\nset rmargin at screen 0.925\n"
        << "set multiplot\n"
        << "set label 2 " << quoteForGnuplot("{/:Bold*1.25 " + plot.title + "}")
        << " at screen 0.085,0.965 left textcolor rgb '#202020'\n";
    for (size_t i = 0; i < plot.panels.size(); ++i) writePanel(script, plot, int(i));
    script << "unset multiplot\n";
    return script.str();
}

}  // namespace

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

bool writePlot(const Plot& plot, const std::string& pngFile) {
    if (!isGnuplotAvailable()) return false;
    runGnuplot(makeScript(plot, pngFile), pngFile);
    return true;
}

}  // namespace simflex::examples
