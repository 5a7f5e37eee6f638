#pragma once
/** @file
The table of a sweep in the form of results, for plotting. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Columns over one of the swept keys: one transient analysis for each combination of the other
keys, whose times are the key's values; the key is its first probe. **/
struct SweepResults {
    std::string key;
    std::vector<std::string> labels;  ///< "load=2"
    std::vector<Results> results;
};

/** True if the file is the sweep.h5 of a sweep. **/
bool isSweepTable(const std::string& path);

/** Reads the complete cases.
@param key  empty: the first numerical key with the most values
@throws std::runtime_error. **/
SweepResults readSweepTable(const std::string& path, const std::string& key);

/** Result files of the complete cases, with their values of the only key that may vary.
@throws std::runtime_error. **/
struct SweepCases {
    std::string key;
    std::vector<double> values;
    std::vector<std::string> paths;  ///< results.h5
};
SweepCases listSweepCases(const std::string& path, const std::string& key);

}  // namespace model
}  // namespace simflex
