// A beam welded to Ground by its end: frequencies of Euler and Bernoulli, sag under its weight as
// CalculiX has it.

#include <gtest/gtest.h>

#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"
#include "validation/Cantilever.h"

namespace simflex {
namespace {

using namespace SimTK;
using simflex::testing::Brick;
using test::Cantilever;

TEST(Cantilever, FrequenciesMatchEulerBernoulli) {
    Brick brick;
    brick.size = {1, 0.01, 0.013};
    brick.elements = {50, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    Cantilever model(test::reduceBrick(brick, 30), Vec3(0));
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, model.makeState()));
    std::vector<std::pair<double, double>> expected;  // and what shear and rotation lower it by
    for (const double root : {1.8751, 4.6941, 7.8548})
        for (const double depth : {brick.size[1], brick.size[2]})
            expected.emplace_back(
                root * root * depth * std::sqrt(brick.E / (12 * brick.rho)) / (2 * Pi),
                0.5 * root * root * depth * depth / 12 * (1 + 2 * 1.2));
    std::sort(expected.begin(), expected.end());
    for (size_t k = 0; k < expected.size(); ++k) {
        const double error = modes[k].frequency / expected[k].first - 1;
        EXPECT_LT(error, 1e-4) << k;  // of the reduction
        EXPECT_GT(error, -1.5 * expected[k].second - 1e-4) << k;
    }
}

TEST(Cantilever, SagsUnderItsWeightAsInCalculix) {
    const Brick brick;
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(folder / "brick.inp", brick.text());
    const std::array<double, 6> expected =
        simflex::testing::calcCalculixSag(folder, folder / "brick.inp", {"LEFT", {0, 0, 0}},
                                          {"RIGHT", {brick.size[0], 0, 0}}, 9.81, {0, -0.8, 0.6});
    Cantilever model(test::reduceBrick(brick, 50), 9.81 * Vec3(0, -0.8, 0.6));
    StaticEquilibrium equilibrium(model.system);
    equilibrium.setTolerance(1e-14);
    equilibrium.solve(model.makeState());
    const Transform X = model.beam.interface("right").calcMotion(equilibrium.getState()).X;
    const Vec3 shift = X.p() - Vec3(brick.size[0], 0, 0);
    const Vec4 turn = X.R().convertRotationToAngleAxis();
    for (int a = 1; a < 3; ++a) {
        EXPECT_NEAR(shift[a], expected[size_t(a)], 1e-3 * std::abs(expected[size_t(a)])) << a;
        const double rotation = turn[0] * turn[1 + a], own = expected[size_t(3 + a)];
        EXPECT_NEAR(rotation, own, 1e-3 * std::abs(own)) << a;
    }
    // The clamp carries weight and moment.
    const SpatialVec force =
        model.clamp.calcForceOnM(equilibrium.getState(), equilibrium.getMultipliers(model.clamp));
    const double weight = brick.mass() * 9.81;
    EXPECT_NEAR(force[1][1], 0.8 * weight, 1e-8 * weight);
    EXPECT_NEAR(force[0][2], 0.8 * weight * brick.size[0] / 2, 1e-5 * weight * brick.size[0]);
}

}  // namespace
}  // namespace simflex
