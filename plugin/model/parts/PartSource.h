#pragma once
/** @file
Reduces a part given by its deck, geometry or matrices in a model file. **/

#include "simflex/model/Model.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace model {

/** Takes the part from the cache if it was reduced before, see PartCache.h.
@param value  entry of `parts`
@throws ModelError; Cancelled if the listener asks to stop. **/
ReducedBody reducePart(const ModelValue& value, const ModelOptions& options);

}  // namespace model
}  // namespace simflex
