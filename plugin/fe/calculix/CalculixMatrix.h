#pragma once
/** @file
Reads the matrices that ccx stores as text, one entry "row column value" a line. Internal to fe.

A million degrees of freedom make files of gigabytes: they are read through a small buffer, once to
count the entries of each column and once to put them in place, so that nothing is held but the
result. **/

#include <filesystem>
#include <vector>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** @param dofs  3·node + axis of each equation: row and column of the result.
Exact zeros off the diagonal are left out, entries given several times are added.
@throws std::runtime_error if the file is missing, cut off or no such file, with the line.
@throws std::invalid_argument for a number that is not finite. @throws Cancelled. **/
SymmetricMatrix readCalculixMatrix(const std::filesystem::path& path, const std::vector<int>& dofs,
                                   const char* phase, const ProgressCallback& progress);

}  // namespace simflex
