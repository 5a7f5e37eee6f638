#pragma once
/** @file
The table of a sweep as results that can be drawn. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** Columns over one of the swept keys: a transient analysis for each choice of the others, whose
times are the key's values; the key is its first probe. **/
struct SweepResults {
    std::string key;
    std::vector<std::string> labels;  ///< "load=2"
    std::vector<Results> results;
};

/** Whether the file is sweep.h5 of a sweep. **/
bool isSweepTable(const std::string& path);

/** Complete cases. @param key  the first numerical one with most values if empty
@throws std::runtime_error. **/
SweepResults readSweepTable(const std::string& path, const std::string& key);

/** What each complete case has left, with its value of a key that is the only one to vary.
@throws std::runtime_error. **/
struct SweepCases {
    std::string key;
    std::vector<double> values;
    std::vector<std::string> paths;  ///< results.h5
};
SweepCases listSweepCases(const std::string& path, const std::string& key);

}  // namespace model
}  // namespace simflex
