#pragma once
/** @file
The HDF5 file of Results.h, written from a journal. Internal to results. **/

#include <string>
#include <vector>

#include "simflex/model/results/ResultJournal.h"

namespace simflex {
namespace model {

constexpr int ResultFormat = 1;

constexpr double LargestTime = 1e20;  ///< of a row [s]
/** @throws std::runtime_error if the times of rows do not increase, or exceed LargestTime. **/
void checkTimes(const std::vector<double>& times);

std::string getJournalPath(const std::string& path);

/** Writes the whole HDF5 file: the same bytes for the same contents.
@throws std::runtime_error. **/
void writeResultLayout(const std::string& path, const ResultJournal& journal);

/** Reads the file.
@throws std::runtime_error that names the object, not the file. **/
Results readResultLayout(const std::string& path, ReadStates states);

}  // namespace model
}  // namespace simflex
