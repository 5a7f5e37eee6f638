#pragma once
/** @file
Provides the parts of a model file, read from part files, or reduced and kept in the cache. **/

#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

/** Makes all parts by name, with the modes that the file keeps of them.
@throws ModelError; Cancelled if the listener asks to stop. **/
Parts makeParts(const ModelValue& file, const ModelOptions& options);

}  // namespace model
}  // namespace simflex
