#pragma once
/** @file
Figures of results. **/

#include <limits>
#include <string>
#include <vector>

#include "simflex/model/Results.h"
#include "simflex/model/results/Figure.h"

namespace simflex {
namespace model {

/** An analysis of one result file. **/
struct FigureSource {
    std::string label;  ///< of the file, where there are several
    const Results::Analysis* analysis;
};

struct FigureWishes {
    std::vector<std::string> probes;  ///< patterns; none: all
    std::string xProbe;               ///< empty: time
    enum class Panels { ByUnit, Together, Stacked } panels = Panels::ByUnit;
    double from = -std::numeric_limits<double>::infinity(), to = -from;  ///< [s]
    bool hasPoints = false;                                              ///< rows are marked
    std::vector<double> orders;  ///< campbell: lines of this many times the speed [rad/s]
};

/** Probes over time (or over another probe), frequencies of eigenmodes, a Campbell diagram or a
Bode diagram: the analyses must be of one type. @throws std::runtime_error. **/
Figure makeResultFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes);

}  // namespace model
}  // namespace simflex
