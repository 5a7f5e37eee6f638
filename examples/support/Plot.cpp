#include "support/Plot.h"

#include <algorithm>
#include <sstream>

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
           << " at graph 0,1.055 left textcolor rgb '#202020'\n"
           << "set key at graph 1,1.105 right top horizontal samplen 2.5 width -3\n";
    script << "set ylabel " << quoteForGnuplot(panel.yLabel) << " offset 0.5,0\n";
    script << (hasRightAxis ? "set y2tics\n" : "unset y2tics\n");
    script << "set y2label " << quoteForGnuplot(panel.rightLabel) << " offset -0.5,0\n";
    script << (panel.isLogarithmic ? "set logscale y\n" : "unset logscale y\n")
           << (plot.hasLogarithmicX ? "set logscale x\n" : "unset logscale x\n");
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
    script << "plot ";
    for (size_t i = 0; i < panel.series.size(); ++i) {
        const Plot::Series& series = panel.series[i];
        script << (i ? ", " : "") << "$data_" << index << "_" << i << " using 1:2 axes "
               << (series.onRightAxis ? "x1y2" : "x1y1")
               << (series.hasPoints ? " with linespoints pt 7 ps 1.3 lw " : " with lines lw ")
               << series.width << " lc rgb " << quoteForGnuplot(series.color)
               << (series.isDashed ? " dt (12,6)" : " dt 1") << " title "
               << quoteForGnuplot(series.label);
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
        << "set lmargin at screen 0.075\nset rmargin at screen 0.925\n"
        << "set multiplot\n"
        << "set label 2 " << quoteForGnuplot("{/:Bold*1.25 " + plot.title + "}")
        << " at screen 0.075,0.965 left textcolor rgb '#202020'\n";
    for (size_t i = 0; i < plot.panels.size(); ++i) writePanel(script, plot, int(i));
    script << "unset multiplot\n";
    return script.str();
}

}  // namespace

bool writePlot(const Plot& plot, const std::string& pngFile) {
    if (!isGnuplotAvailable()) return false;
    runGnuplot(makeScript(plot, pngFile), pngFile);
    return true;
}

}  // namespace simflex::examples
