// Two reduced bricks welded into an L, against one CalculiX model of the whole with the same rigid
// ties.

#include <gtest/gtest.h>

#include "simflex/solver/Eigenmodes.h"
#include "validation/WeldedParts.h"

namespace simflex {
namespace {

TEST(WeldedParts, FrequenciesAreThoseOfTheWholeFiniteElementModel) {
    test::WeldedParts model(40);
    const std::vector<double> expected = model.calcCalculixFrequencies(8);
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, model.makeState()));
    for (size_t k = 0; k < 6; ++k) {
        // Reduced parts are never softer than their meshes.
        EXPECT_GT(modes[k].frequency, expected[k] * (1 - 1e-5)) << k;
        EXPECT_LT(modes[k].frequency, expected[k] * 1.005) << k;
    }
}

}  // namespace
}  // namespace simflex
