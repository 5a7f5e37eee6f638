#pragma once
/** @file
By how much two results differ: probes, natural modes, frequency responses and linear models.

Responses are compared as complex numbers: |H₂ − H₁| of each output by each input, beside the
largest |H| of the probe by that input. Where the frequencies differ, as those of adaptive grids do,
they are compared at all that either file has in the range that both cover, the other one's value
being interpolated by cubics. A note tells what this alone would make differ: by how much either
response changes if it keeps the other one's rows only and is interpolated between.

The states of a linear model are a choice, its matrices so no result. What does not depend on them
is compared: the eigenvalues of A, each with the nearest of the other model, and the responses
C(iω − A)⁻¹B + D at frequencies between all poles of both. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Of one column of a probe, one frequency, response or pole. **/
struct ColumnDifference {
    std::string analysis, name, unit;
    std::string probe;  ///< whose column it is; empty of a frequency
    std::string axis;   ///< of x: "time [s]", "speed", "frequency [Hz]"; empty: single numbers
    double largest = 0, rms = 0;
    double time = 0;   ///< where the largest is on that axis
    double range = 0;  ///< of the probe's values, over all its columns; of a constant its size
    std::vector<double> x, first, second;  ///< what was compared; sizes of complex numbers
    std::vector<double> difference;        ///< second − first; its size of complex numbers

    /** Largest difference over range; 0 if there is no difference. **/
    double getRelative() const;
};

/** What cannot be compared. **/
struct NotCompared {
    enum class Reason {
        OnlyInFirst,
        OnlyInSecond,
        Different  ///< both have it, but not of one type, number or at common times
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

/** Analyses of the same name. Where their times differ, the second's values are interpolated (by
cubics) to the first's times.
@param patterns  of probes, and outputs of responses; none: all, and modes and poles
@param nameA, nameB  how the files are called in texts **/
ResultComparison compareResults(const Results& a, const Results& b,
                                const std::vector<std::string>& patterns, const std::string& nameA,
                                const std::string& nameB);

/** The largest |value| that probes of a unit have in an analysis: beside it, round-off of others of
the unit is small. Of joules the largest kinetic energy counts, too; 0 of no unit. **/
double findUnitScale(const Results::Analysis& analysis, const std::string& unit);

}  // namespace model
}  // namespace simflex
