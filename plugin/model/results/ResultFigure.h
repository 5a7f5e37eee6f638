#pragma once
/** @file
Figures of results. **/

#include <limits>
#include <string>
#include <vector>

#include "simflex/model/Results.h"
#include "simflex/render/Figure.h"

namespace simflex {
namespace model {

/** An analysis of one result file. **/
struct FigureSource {
    std::string label;  ///< of the file, if there are several
    const Results::Analysis* analysis;
    double value = 0;  ///< of the parameter, for a map
};

struct FigureWishes {
    std::vector<std::string> probes;  ///< patterns; empty: all
    std::string xProbe;               ///< empty: time
    enum class Panels { ByUnit, Together, Stacked } panels = Panels::ByUnit;
    double from = -std::numeric_limits<double>::infinity(), to = -from;  ///< [s]
    bool hasPoints = false;                                              ///< marks rows
    /** campbell and waterfall: draws lines at these multiples of the speed [rad/s]; transient with
    a speed: tracks these orders. **/
    std::vector<double> orders;
    /** Transient: replaces values over time, see Spectra.h. **/
    enum class Vibration { None, Spectrum, Waterfall } vibration = Vibration::None;
    std::string speedProbe;  ///< [rad/s]; without it, a waterfall is drawn over time
    double highest = 0;      ///< highest frequency shown [Hz]; 0: all
    int numPieces = 60;      ///< segments of a waterfall
    double revolutions = 8;  ///< per segment for order tracking
    bool isNyquist = false;  ///< frequency_response: imaginary over real part
    /** frequency_response: draws magnitude and phase of one response over frequency and this
    parameter, whose value each source gives. **/
    std::string mapOver;
    /** Warnings about what the figure does not show. **/
    mutable std::vector<std::string> warnings;
};

/** Draws probes over time (or over another probe), frequencies of eigenmodes, a Campbell diagram,
or a Bode or Nyquist diagram or map of a response; of transient analyses also spectra, a waterfall
or order tracks. All analyses must be of one type.
@throws std::runtime_error. **/
Figure makeResultFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes);

/** Writes the numbers of a figure as CSV: x and y of each curve side by side; x, y and value of a
map line by line, of its samples if it has any.
@throws std::runtime_error. **/
void writeFigureCsv(const std::string& path, const Figure& figure);

}  // namespace model
}  // namespace simflex
