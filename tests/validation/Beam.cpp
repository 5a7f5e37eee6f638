#include "validation/Beam.h"

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/reduction/Reduction.h"

namespace simflex::test {

std::shared_ptr<const ReducedBody> makeBeam(const BeamOptions& options) {
    simflex::testing::Brick brick;
    brick.size = {options.length, options.height, options.width};
    brick.elements = {options.numElements, options.numAcross, options.numAcross};
    brick.type = "C3D20";
    brick.E = options.E;
    brick.nu = 0;
    brick.rho = options.density;
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(folder / "beam.inp", brick.text());

    ReductionOptions reduction;
    reduction.name = "beam";
    reduction.interfaces = {{"root", "LEFT"}, {"tip", "RIGHT"}};
    reduction.numModes = options.numModes;
    reduction.hasStiffening = true;
    return std::make_shared<const ReducedBody>(
        reduce(readCalculixDeck(folder / "beam.inp"), reduction));
}

}  // namespace simflex::test
