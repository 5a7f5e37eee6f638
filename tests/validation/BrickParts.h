#pragma once
/** @file
Bricks along x as reduced parts. **/

#include <memory>

#include "fe/TestDecks.h"
#include "simflex/reduction/Reduction.h"

namespace simflex::test {

/** Reduced with interfaces "left" (x = 0) and "right" at the middles of the end faces.
@param numModes       Craig–Bampton: 12 of the interfaces and the normal ones
@param hasStiffening  asks for geometric stiffness **/
std::shared_ptr<const ReducedBody> reduceBrick(const simflex::testing::Brick& brick, int numModes,
                                               TieType tie = TieType::Rigid,
                                               bool hasStiffening = false);

}  // namespace simflex::test
