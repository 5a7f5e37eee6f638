#pragma once
/** @file
The result table of a sweep: a line for each case. **/

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
        std::vector<double> values;  ///< one for each case; NaN where it is not known
    };
    std::vector<Column> columns;
    std::vector<std::string> warnings;  ///< of each case; empty: none
    bool hasWarnings() const;
};

/** Statistics of the probes of all complete cases (mean and rms are over time), values of static
analyses, frequencies and damping ratios of modes; of Campbell diagrams those at the first and the
last speed, and each branch's critical speed; of responses their peaks. plan.of chooses:
PROBE.maximum, .minimum, .mean, .rms, .final or .range, PROBE with or without its column and with
`*`; default: maximum, minimum and final value of all. @throws std::runtime_error if one of plan.of
fits nothing. **/
SweepTable makeSweepTable(const SweepPlan& plan, const std::vector<SweepOutcome>& outcomes,
                          const std::string& folder);

/** Before a sweep begins. @throws std::runtime_error if the folder has the table of one that varies
something else. **/
void refuseOtherSweep(const SweepPlan& plan, const std::string& folder);

/** Writes FOLDER/sweep.csv and FOLDER/sweep.h5; processes that share the folder one after the
other, and tells the cases' warnings to `listener`. The HDF5 file has, one number for each case:
values/KEY, columns/NAME (attribute unit), status (0 complete, 1 failed, 2 not finished); one text
for each: texts/KEY (values as given), folders, warnings (left out where there are none); and the
attribute simflex_sweep = 2.
@returns the table's path. **/
std::string writeSweepTable(const SweepPlan& plan, const std::string& folder,
                            const Listener& listener = {});

}  // namespace model
}  // namespace simflex
