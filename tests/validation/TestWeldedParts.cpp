// Two reduced bricks welded into an L, against one CalculiX model of the whole with the same rigid
// ties; columns of them, against Euler's load.

#include <gtest/gtest.h>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/WeldedParts.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(WeldedParts, FrequenciesAreThoseOfTheWholeFiniteElementModel) {
    SIMFLEX_NEEDS_CALCULIX();
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

/** Load under which a cantilever of 1 m of bending pieces first has another equilibrium, over
Euler's π²EI/4L² [-]. **/
Real calcBucklingLoad(int numPieces, TieType tie = TieType::Rigid, bool hasStiffening = false) {
    simflex::testing::Brick brick;
    brick.size = {1.0 / numPieces, 0.02, 0.03};  // bends in y
    brick.elements = {16 / numPieces, 1, 1};
    brick.type = hasStiffening ? "C3D20" : "C3D20R";
    brick.nu = 0;
    const auto part = test::reduceBrick(brick, 16, tie, hasStiffening);
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    std::vector<FlexibleBody> pieces;
    for (int i = 0; i < numPieces; ++i)
        pieces.emplace_back(flexible, part, "piece" + std::to_string(i));
    Joint::Weld(flexible, matter.Ground(), pieces[0].interface("left"), "clamp");
    for (size_t i = 1; i < pieces.size(); ++i)
        Joint::Weld(flexible, pieces[i - 1].interface("right"), pieces[i].interface("left"),
                    "weld" + std::to_string(i));
    const Real I = brick.size[2] * std::pow(brick.size[1], 3) / 12;
    const Real euler = Pi * Pi * brick.E * I / 4;
    constexpr Real Most = 1.3;  // in z it buckles at 2.25
    AttachmentForce(flexible, pieces.back().interface("right"),
                    SpatialVec(Vec3(0), Vec3(-Most * euler, 0, 0)));
    State state = system.realizeTopology();
    for (size_t i = 0; i < pieces.size(); ++i)
        pieces[i].setPoseByInterface(state, "left", Transform(Vec3(Real(i) * brick.size[0], 0, 0)));
    StaticEquilibrium equilibrium(system);
    Real load = NaN;
    for (const auto& point : equilibrium.followPath(state, {}))
        if (point.kind == StaticEquilibrium::PathPoint::Kind::Bifurcation) {
            EXPECT_TRUE(std::isnan(load)) << "two bifurcations";
            EXPECT_EQ(point.numChanging, 1);
            load = Most * point.fraction;
        }
    return load;
}

TEST(WeldedParts, ColumnsBuckleAtEulersLoad) {
    // Each piece is linear: the error is of the second order in its length.
    const Real two = calcBucklingLoad(2), four = calcBucklingLoad(4), eight = calcBucklingLoad(8);
    EXPECT_NEAR((two - four) / (four - eight), 4, 0.2);
    // Shear in the section and the shortened column take a few 1e-4.
    EXPECT_NEAR((4 * eight - four) / 3, 1, 1e-3);
}

/** With their geometric stiffness pieces buckle within, whatever ties them. **/
TEST(WeldedParts, StiffenedColumnsBuckleAtEulersLoadWithBothTies) {
    for (const TieType tie : {TieType::Rigid, TieType::Distributing})
        for (const int numPieces : {1, 2, 4, 8})
            EXPECT_NEAR(calcBucklingLoad(numPieces, tie, true), 1, 0.01)
                << numPieces << " pieces, " << (tie == TieType::Rigid ? "rigid" : "distributing");
}

}  // namespace
}  // namespace simflex
