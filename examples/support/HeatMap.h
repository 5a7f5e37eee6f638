#pragma once
/** @file
A coloured map over two axes, with lines on it, drawn by gnuplot into a PNG file: a spectrum that
changes with speed or time.

    HeatMap map{"Casing", "rotor speed [Hz]", "frequency [Hz]", "amplitude [µm]"};
    map.x = speeds; map.y = frequencies; map.values = amplitudes;   // values[i][j] at (x[i], y[j])
    writeHeatMap(map, "waterfall.png");
**/

#include <string>
#include <vector>

namespace simflex::examples {

struct HeatMap {
    struct Line {
        std::string label;
        std::vector<double> x, y;
    };
    std::string title, xLabel, yLabel, colorLabel;
    std::vector<double> x, y;                 ///< ascending
    std::vector<std::vector<double>> values;  ///< positive; colours are logarithmic
    double low = 0, high = 1;                 ///< ends of the colour bar
    std::vector<Line> lines;                  ///< thin, each with its word at its right end
};

/** @return false, with nothing written, when there is no gnuplot on this machine.
@throws std::runtime_error when gnuplot fails; std::invalid_argument when sizes do not match. **/
bool writeHeatMap(const HeatMap& map, const std::string& pngFile);

}  // namespace simflex::examples
