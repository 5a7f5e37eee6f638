#pragma once
/** @file
By how much the probes of two results differ. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Of one column of a probe, or of one frequency. **/
struct ColumnDifference {
    std::string analysis, name, unit;
    std::string probe;  ///< whose column it is; empty of a frequency
    double largest = 0, rms = 0;
    double time = 0;   ///< of the largest [s], or its speed in a Campbell diagram
    double range = 0;  ///< of the probe's values, over all its columns; of a constant its size
    std::vector<double> x, first, second;  ///< what was compared, over time

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
@param patterns  of probes; none: all
@param nameA, nameB  how the files are called in texts **/
ResultComparison compareResults(const Results& a, const Results& b,
                                const std::vector<std::string>& patterns, const std::string& nameA,
                                const std::string& nameB);

}  // namespace model
}  // namespace simflex
