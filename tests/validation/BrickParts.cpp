#include "validation/BrickParts.h"

#include "simflex/fe/CalculixDeck.h"

namespace simflex::test {

std::shared_ptr<const ReducedBody> reduceBrick(const simflex::testing::Brick& brick, int numModes,
                                               TieType tie, bool hasStiffening) {
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(folder / "brick.inp", brick.text());
    ReductionOptions options;
    options.name = "brick";
    options.interfaces = {{"left", "LEFT", tie}, {"right", "RIGHT", tie}};
    options.hasStiffening = hasStiffening;
    options.interfaces[0].master = {0, 0, 0};
    options.interfaces[1].master = {brick.size[0], 0, 0};
    options.numModes = numModes;
    return std::make_shared<const ReducedBody>(
        reduce(readCalculixDeck(folder / "brick.inp"), options));
}

}  // namespace simflex::test
