#pragma once
/** @file
The result table of a sweep, one line for each case. **/

#include <string>
#include <vector>

#include "simflex/model/sweep/SweepPlan.h"
#include "simflex/model/sweep/SweepRunner.h"

namespace simflex {
namespace model {

constexpr int SweepFormat = 2;

struct SweepTable {
    struct Column {
        std::string name;  ///< "tip.x.maximum"
        std::string unit;
        std::vector<double> values;  ///< one for each case; NaN if unknown
    };
    std::vector<Column> columns;
    std::vector<std::string> warnings;  ///< of each case; empty: none
    bool hasWarnings() const;
};

/** Makes the table from all complete cases: statistics of probes (mean and rms over time), values
of static analyses, frequencies and damping ratios of modes; for Campbell diagrams those at the
first and last speed, and critical speeds; for responses their peaks. plan.of selects PROBE.maximum,
.minimum, .mean, .rms, .final or .range, where PROBE may include its column and `*`; default:
maximum, minimum and final value of all probes.
@throws std::runtime_error if an entry of plan.of matches nothing. **/
SweepTable makeSweepTable(const SweepPlan& plan, const std::vector<SweepOutcome>& outcomes,
                          const std::string& folder);

/** To be called before a sweep starts.
@throws std::runtime_error if the folder has the table of a sweep with other keys. **/
void refuseOtherSweep(const SweepPlan& plan, const std::string& folder);

/** Writes FOLDER/sweep.csv and FOLDER/sweep.h5, and reports the cases' warnings to `listener`.
Processes that share the folder take turns. The HDF5 file has one number for each case in
values/KEY, columns/NAME (attribute unit) and status (0 complete, 1 failed, 2 not finished); one
text for each in texts/KEY (values as given), folders and warnings (omitted if there are none); and
the attribute simflex_sweep = 2.
@returns the path of sweep.csv. **/
std::string writeSweepTable(const SweepPlan& plan, const std::string& folder,
                            const Listener& listener = {});

}  // namespace model
}  // namespace simflex
