#pragma once
/** @file
Bricks along x as reduced parts, by CalculiX. **/

#include <memory>

#include "fe/TestDecks.h"
#include "simflex/part/ReducedBody.h"

namespace simflex::test {

/** Reduced with interfaces "left" (x = 0) and "right" at the middles of the end faces.
@param numModes  Craig–Bampton: 12 of the interfaces and the normal ones **/
std::shared_ptr<const ReducedBody> reduceBrick(const simflex::testing::Brick& brick, int numModes);

}  // namespace simflex::test
