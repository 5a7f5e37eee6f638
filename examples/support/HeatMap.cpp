#include "support/HeatMap.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "support/Gnuplot.h"

namespace simflex::examples {

bool writeHeatMap(const HeatMap& map, const std::string& pngFile) {
    if (!isGnuplotAvailable()) return false;
    if (map.values.size() != map.x.size())
        throw std::invalid_argument("heat map '" + map.title + "' has " +
                                    std::to_string(map.values.size()) + " columns for " +
                                    std::to_string(map.x.size()) + " places on its x axis");
    std::ostringstream script;
    script.precision(8);
    script << "$map << END_OF_DATA\n";
    for (size_t i = 0; i < map.x.size(); ++i) {
        if (map.values[i].size() != map.y.size())
            throw std::invalid_argument("heat map '" + map.title + "' has " +
                                        std::to_string(map.values[i].size()) + " values for " +
                                        std::to_string(map.y.size()) + " places on its y axis");
        for (size_t j = 0; j < map.y.size(); ++j)
            script << map.x[i] << ' ' << map.y[j] << ' '
                   << std::clamp(map.values[i][j], map.low, map.high) << '\n';
        script << '\n';
    }
    script << "END_OF_DATA\n";
    for (size_t i = 0; i < map.lines.size(); ++i) {
        script << "$line_" << i << " << END_OF_DATA\n";
        for (size_t k = 0; k < map.lines[i].x.size(); ++k)
            script << map.lines[i].x[k] << ' ' << map.lines[i].y[k] << '\n';
        script << "END_OF_DATA\n";
    }
    script
        << "set encoding utf8\n"
        << "set terminal pngcairo size 1400,900 font 'DejaVu Sans,13' linewidth 1.2 enhanced\n"
        << "set output " << quoteForGnuplot(pngFile) << '\n'
        << "set border lc rgb '#606060' lw 1 front\n"
        << "set tics textcolor rgb '#202020' nomirror out scale 0.6 front\n"
        << "set lmargin at screen 0.075\nset rmargin at screen 0.83\n"
        << "set tmargin at screen 0.91\nset bmargin at screen 0.085\n"
        << "set label 1 " << quoteForGnuplot("{/:Bold*1.25 " + map.title + "}")
        << " at screen 0.075,0.955 left textcolor rgb '#202020'\n"
        << "set xlabel " << quoteForGnuplot(map.xLabel) << "\nset ylabel "
        << quoteForGnuplot(map.yLabel) << "\nset cblabel " << quoteForGnuplot(map.colorLabel)
        << '\n'
        << "set colorbox user origin screen 0.915,0.085 size screen 0.018,0.825\n"
        // viridis
        << "set palette defined (0 '#440154', 1 '#472c7a', 2 '#3b518b', 3 '#2c718e', 4 '#21908d', "
           "5 '#27ad81', 6 '#5cc863', 7 '#aadc32', 8 '#fde725')\n"
        << "set logscale cb\nset format cb '%g'\nset cbrange [" << map.low << ':' << map.high
        << "]\n"
        << "set xrange [" << map.x.front() << ':' << map.x.back() << "]\nset yrange ["
        << map.y.front() << ':' << map.y.back() << "]\nunset key\n";
    for (size_t i = 0; i < map.lines.size(); ++i)
        script << "set label " << i + 2 << ' ' << quoteForGnuplot(map.lines[i].label)
               << " at first " << map.x.back() << ", first " << map.lines[i].y.back()
               << " left offset 0.7,0 textcolor rgb '#303030' font ',11'\n";
    script << "plot $map using 1:2:3 with image";
    for (size_t i = 0; i < map.lines.size(); ++i)
        script << ", $line_" << i << " using 1:2 with lines lw 1 dt (3,5) lc rgb '#ffffff'";
    script << '\n';
    runGnuplot(script.str(), pngFile);
    return true;
}

}  // namespace simflex::examples
