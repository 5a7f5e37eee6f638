#pragma once
/** @file
Columns of probes as formulas name them (private header). **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Which of a probe's columns a formula means by `word`, NAME or NAME.COLUMN. A probe of one
column, whose name is empty, is NAME alone.
@throws ModelError at the formula that says which there are **/
size_t chooseColumn(const ModelValue& formula, const std::string& word,
                    const std::vector<std::string>& columns);

}  // namespace model
}  // namespace simflex
