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
    std::string label;  ///< of the file, where there are several
    const Results::Analysis* analysis;
    double value = 0;  ///< of the parameter, in a map
};

struct FigureWishes {
    std::vector<std::string> probes;  ///< patterns; none: all
    std::string xProbe;               ///< empty: time
    enum class Panels { ByUnit, Together, Stacked } panels = Panels::ByUnit;
    double from = -std::numeric_limits<double>::infinity(), to = -from;  ///< [s]
    bool hasPoints = false;                                              ///< rows are marked
    /** campbell and waterfall: lines of this many times the speed [rad/s]; transient with a speed:
    these orders of it are tracked. **/
    std::vector<double> orders;
    /** Of a transient analysis, in place of values over time: see Spectra.h. **/
    enum class Vibration { None, Spectrum, Waterfall } vibration = Vibration::None;
    std::string speedProbe;  ///< [rad/s]; a waterfall without one is over time
    double highest = 0;      ///< frequency that is shown [Hz]; 0: all
    int numPieces = 60;      ///< of a waterfall
    double revolutions = 8;  ///< of a piece in which orders are tracked
    bool isNyquist = false;  ///< frequency_response: imaginary over real parts
    /** frequency_response, of one response: magnitude and phase over frequency and this parameter,
    of which each source has a value. **/
    std::string mapOver;
    /** What the figure does not tell and ought to. **/
    mutable std::vector<std::string> warnings;
};

/** Probes over time (or over another probe), frequencies of eigenmodes, a Campbell diagram, Bode's
or Nyquist's diagram or a map of a response; of a transient analysis also spectra, a waterfall or
orders of a speed: the analyses must be of one type. @throws std::runtime_error. **/
Figure makeResultFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes);

/** The numbers of a figure as CSV: x and y of each curve side by side; a map's x, y and value line
by line, of its samples if it has such. @throws std::runtime_error. **/
void writeFigureCsv(const std::string& path, const Figure& figure);

}  // namespace model
}  // namespace simflex
