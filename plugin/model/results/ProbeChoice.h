#pragma once
/** @file
Analyses and probes of result files by the names that a user gives. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** A column of a probe. **/
struct ChosenColumn {
    std::string name;   ///< "tip.x", or "energy" of a single number
    std::string probe;  ///< "tip"
    std::string column;
    std::string unit;
    std::vector<double> values;  ///< one for each row
};

/** Whether a pattern, which may have `*`, `?` and `[…]`, means a column or its whole probe. **/
bool fits(const std::string& pattern, const ChosenColumn& column);

/** Columns that one of the patterns fits, in the file's order; no patterns: all.
@throws std::runtime_error proposing others if a pattern fits none. **/
std::vector<ChosenColumn> chooseColumns(const Results::Analysis& analysis,
                                        const std::vector<std::string>& patterns);

/** The analysis of that name; with no name the first transient one, else the first.
@throws std::runtime_error proposing another. **/
const Results::Analysis& chooseAnalysis(const Results& results, const std::string& path,
                                        const std::string& name);

/** @throws std::runtime_error proposing another if there is no analysis of one of these names. **/
void requireAnalyses(const Results& results, const std::string& path,
                     const std::vector<std::string>& names);

/** One of an analysis' responses, of type frequency_response. **/
struct ChosenResponse {
    std::string name;    ///< "tip.y by loads.push.force.y", or "tip.y" if there is one input
    std::string output;  ///< "tip.y"
    std::string input;   ///< "loads.push.force.y"
    std::string unit;    ///< "m/N"
    std::vector<double> magnitude, phase;  ///< at its frequencies; [degrees]
};

/** Responses of outputs that one of the patterns fits, those of the first output first; no
patterns: all. @throws std::runtime_error proposing others if a pattern fits none. **/
std::vector<ChosenResponse> chooseResponses(const Results::Analysis& analysis,
                                            const std::vector<std::string>& patterns);

/** Short names that tell files apart: their names without folders and extension, or as much of
their paths as it takes. **/
std::vector<std::string> makeFileLabels(const std::vector<std::string>& paths);

}  // namespace model
}  // namespace simflex
