#pragma once
/** @file
Reduction of a part that a model file gives by its deck, geometry or matrices. **/

#include "simflex/model/Model.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace model {

/** From the cache if it has been reduced before, see PartCache.h.
@param value  of `parts`
@throws ModelError; Cancelled if the listener asks to stop. **/
ReducedBody reducePart(const ModelValue& value, const ModelOptions& options);

}  // namespace model
}  // namespace simflex
