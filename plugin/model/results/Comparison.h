#pragma once
/** @file
Differences of two results: probes, natural modes, frequency responses and linear models.

Responses are compared as complex numbers: |H₂ − H₁| of each output and input, relative to the
largest |H| of the probe for that input. If the frequencies differ, as on adaptive grids, responses
are compared at all frequencies of either file in the common range, with cubic interpolation of the
other one. A note gives the error of this interpolation: the change of either response if only the
rows at the other one's frequencies are kept and interpolated.

The states of a linear model are arbitrary, so its matrices are not compared, but only what does not
depend on the states: the eigenvalues of A, each with the nearest one of the other model, and the
responses C(iω − A)⁻¹B + D at frequencies between all poles of both models. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Difference of one column of a probe, one frequency, response or pole. **/
struct ColumnDifference {
    std::string analysis, name, unit;
    std::string probe;  ///< the column's probe; empty for a frequency
    std::string axis;   ///< of x: "time [s]", "speed", "frequency [Hz]"; empty for single numbers
    double largest = 0, rms = 0;
    double time = 0;   ///< position of the largest difference on that axis
    double range = 0;  ///< of the probe's values over all columns; magnitude of a constant
    std::vector<double> x, first, second;  ///< the compared values; magnitudes of complex numbers
    std::vector<double> difference;        ///< second − first; its magnitude for complex numbers

    /** Largest difference over range; 0 if there is no difference. **/
    double getRelative() const;
};

struct NotCompared {
    enum class Reason {
        OnlyInFirst,
        OnlyInSecond,
        Different  ///< both have it, but with different types, sizes or without common times
    };
    Reason reason;
    std::string analysis;
    std::string column;  ///< of a probe; empty: the whole analysis
    std::string text;    ///< "probe 'tip' of analysis 'run' is only in a.h5"
};

struct ResultComparison {
    std::vector<ColumnDifference> columns;
    std::vector<NotCompared> missing;
    std::vector<std::string> notes;  ///< "times of analysis 'run' differ: …"
};

/** Compares analyses of the same name. If their times differ, the second one's values are
interpolated (by cubics) at the first one's times.
@param patterns  of probes, and outputs of responses; empty: everything, including modes and poles
@param nameA, nameB  names of the files in texts **/
ResultComparison compareResults(const Results& a, const Results& b,
                                const std::vector<std::string>& patterns, const std::string& nameA,
                                const std::string& nameB);

/** The largest |value| of all probes with this unit in an analysis, as a reference for round-off.
For joules it includes the largest kinetic energy; 0 for an empty unit. **/
double findUnitScale(const Results::Analysis& analysis, const std::string& unit);

}  // namespace model
}  // namespace simflex
