#pragma once
/** @file
Finds analyses and probes of result files by names from the user. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

struct ChosenColumn {
    std::string name;   ///< "tip.x", or "energy" for a single number
    std::string probe;  ///< "tip"
    std::string column;
    std::string unit;
    std::vector<double> values;  ///< one for each row
};

/** True if a pattern, with `*`, `?` and `[…]`, matches a column or its whole probe. **/
bool fits(const std::string& pattern, const ChosenColumn& column);

/** Columns that match one of the patterns, in the file's order; no patterns: all.
@throws std::runtime_error with suggestions if a pattern matches none. **/
std::vector<ChosenColumn> chooseColumns(const Results::Analysis& analysis,
                                        const std::vector<std::string>& patterns);

/** The analysis of that name; without a name the first transient one, else the first.
@throws std::runtime_error with a suggestion. **/
const Results::Analysis& chooseAnalysis(const Results& results, const std::string& path,
                                        const std::string& name);

/** @throws std::runtime_error with a suggestion if an analysis of these names is missing. **/
void requireAnalyses(const Results& results, const std::string& path,
                     const std::vector<std::string>& names);

/** A response of an analysis of type frequency_response. **/
struct ChosenResponse {
    std::string name;    ///< "tip.y by loads.push.force.y", or "tip.y" if there is one input
    std::string output;  ///< "tip.y"
    std::string input;   ///< "loads.push.force.y"
    std::string unit;    ///< "m/N"
    std::vector<double> magnitude, phase;  ///< at the analysis' frequencies; [degrees]
                                           ///< [degrees]
};

/** Responses of outputs that match one of the patterns, those of the first output first; no
patterns: all.
@throws std::runtime_error with suggestions if a pattern matches none. **/
std::vector<ChosenResponse> chooseResponses(const Results::Analysis& analysis,
                                            const std::vector<std::string>& patterns);

/** Short labels that distinguish files: names without folders and extension, or as much of their
paths as needed. **/
std::vector<std::string> makeFileLabels(const std::vector<std::string>& paths);

}  // namespace model
}  // namespace simflex
