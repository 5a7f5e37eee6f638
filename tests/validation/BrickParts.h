#pragma once
/** @file
Bricks along x as reduced parts. **/

#include <memory>

#include "fe/TestDecks.h"
#include "simflex/reduction/Reduction.h"

namespace simflex::test {

/** Reduces a brick with interfaces "left" (x = 0) and "right" at the centres of the end faces.
@param numModes       Craig–Bampton modes: 12 for the interfaces plus the normal modes
@param hasStiffening  computes geometric stiffness **/
std::shared_ptr<const ReducedBody> reduceBrick(const simflex::testing::Brick& brick, int numModes,
                                               TieType tie = TieType::Rigid,
                                               bool hasStiffening = false);

}  // namespace simflex::test
