// Two reduced bricks welded into an L, against one CalculiX model of the whole with the same rigid
// ties; columns of them against Euler's load.

#include <gtest/gtest.h>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/part/PartColumns.h"
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

/** A cantilever of 1 m of flexible pieces, compressed or stretched at its end. **/
struct Column {
    /** @param push  relative to Euler's load π²EI/4L² **/
    Column(int numPieces, Real push, TieType tie = TieType::Rigid, bool hasStiffening = false) {
        simflex::testing::Brick brick;
        brick.size = {1.0 / numPieces, 0.02, 0.03};  // bends in y
        brick.elements = {16 / numPieces, 1, 1};
        brick.type = hasStiffening ? "C3D20" : "C3D20R";
        brick.nu = 0;
        const auto part = test::reduceBrick(brick, 16, tie, hasStiffening);
        std::vector<FlexibleBody> pieces;
        for (int i = 0; i < numPieces; ++i)
            pieces.emplace_back(flexible, part, "piece" + std::to_string(i));
        Joint::Weld(flexible, matter.Ground(), pieces[0].interface("left"), "clamp");
        for (size_t i = 1; i < pieces.size(); ++i)
            Joint::Weld(flexible, pieces[i - 1].interface("right"), pieces[i].interface("left"),
                        "weld" + std::to_string(i));
        const Real I = brick.size[2] * std::pow(brick.size[1], 3) / 12;
        const Real euler = Pi * Pi * brick.E * I / 4;
        AttachmentForce(flexible, pieces.back().interface("right"),
                        SpatialVec(Vec3(0), Vec3(-push * euler, 0, 0)));
        state = system.realizeTopology();
        for (size_t i = 0; i < pieces.size(); ++i)
            pieces[i].setPoseByInterface(state, "left",
                                         Transform(Vec3(Real(i) * brick.size[0], 0, 0)));
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    State state;
};

/** Returns the load of the first bifurcation relative to Euler's load [-]. **/
Real calcBucklingLoad(int numPieces, TieType tie = TieType::Rigid, bool hasStiffening = false) {
    constexpr Real Most = 1.3;  // in z it buckles at 2.25
    const Column column(numPieces, Most, tie, hasStiffening);
    StaticEquilibrium equilibrium(column.system);
    Real load = NaN;
    for (const auto& point : equilibrium.followPath(column.state, {}))
        if (point.kind == StaticEquilibrium::PathPoint::Kind::Bifurcation) {
            EXPECT_TRUE(std::isnan(load)) << "two bifurcations";
            EXPECT_EQ(point.numChanging, 1);
            load = Most * point.fraction;
        }
    return load;
}

TEST(WeldedParts, ColumnsBuckleAtEulersLoad) {
    // Each piece is linear: the error is second order in its length.
    const Real two = calcBucklingLoad(2), four = calcBucklingLoad(4), eight = calcBucklingLoad(8);
    EXPECT_NEAR((two - four) / (four - eight), 4, 0.2);
    // Shear and shortening of the column reduce it by a few 1e-4.
    EXPECT_NEAR((4 * eight - four) / 3, 1, 1e-3);
}

/** The compression of a part and its Euler load on hinges, from its modes alone. **/
TEST(WeldedParts, ColumnsKnowTheirLoadsAndEulersLoad) {
    simflex::testing::Brick brick;
    brick.size = {1, 0.02, 0.03};
    brick.elements = {16, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    const Real euler = Pi * Pi * brick.E * brick.size[2] * std::pow(brick.size[1], 3) / 12;
    for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
        const auto part = test::reduceBrick(brick, 16, tie, false);
        PartColumns columns(*part);
        const auto calcXi = [&](Real push, Real moment) {  // on both ends, opposite to each other
            const auto &left = part->getInterface("left"), &right = part->getInterface("right");
            std::vector<double> xi(size_t(part->numModes));
            for (size_t i = 0; i < xi.size(); ++i)
                xi[i] = (push * (left.Phi[3 * i] - right.Phi[3 * i]) +
                         moment * (left.Psi[3 * i + 2] - right.Psi[3 * i + 2])) /
                        part->omegaSquared[i];
            return xi;
        };
        for (const Real moment : {0.0, 1.0}) {
            const PartColumns::Load load =
                columns.findLargest(calcXi(0.25 * euler, moment).data()).compression;
            EXPECT_NEAR(load.force, 0.25 * euler, 1e-6 * euler);
            EXPECT_NEAR(load.share, 0.25, 0.25 * 0.01);
        }
        const PartColumns::Loads pulled = columns.findLargest(calcXi(-2 * euler, 1).data());
        EXPECT_EQ(pulled.compression.share, 0);
        EXPECT_NEAR(pulled.tension.share, 2, 2 * 0.01);
    }
}

/** Greenhill: a column clamped at its foot buckles when its weight is 7.837 EI/L². **/
TEST(WeldedParts, AColumnKnowsItsWeightAndGreenhillsLoad) {
    simflex::testing::Brick brick;
    brick.size = {1, 0.02, 0.03};
    brick.elements = {16, 1, 1};
    brick.type = "C3D20";
    brick.nu = 0;
    const Real length = brick.size[0], inertia = brick.size[2] * std::pow(brick.size[1], 3) / 12,
               greenhill = 7.837 * brick.E * inertia / square(length);
    for (const TieType tie : {TieType::Rigid, TieType::Distributing})
        for (const bool hasBoth : {true, false}) {
            ReducedBody part = *test::reduceBrick(brick, 16, tie, false);
            if (!hasBoth) part.interfaces.erase(part.interfaces.begin() + 1);
            const ReducedBody::Interface& foot = part.interfaces[0];
            const Real up = foot.position[0] < 0 ? 1 : -1;
            std::vector<double> xi(size_t(part.numModes));
            for (size_t i = 0; i < xi.size(); ++i)
                xi[i] = up * 0.25 * greenhill * foot.Phi[3 * i] / part.omegaSquared[i];
            PartColumns columns(part);
            const PartColumns::Load load = columns.findLargest(xi.data()).compression;
            // Between both ends the mean counts, relative to Euler's load on hinges.
            const Real mean = hasBoth ? 0.5 : 1;
            EXPECT_NEAR(load.force, mean * 0.25 * greenhill, 1e-3 * greenhill) << hasBoth;
            const Real expected = hasBoth ? 0.5 * 0.25 * 7.837 / (Pi * Pi) : 0.25;
            EXPECT_NEAR(load.share, expected, 0.03 * expected) << hasBoth;
        }
}

/** With geometric stiffness a single piece can buckle, for any tie. **/
TEST(WeldedParts, StiffenedColumnsBuckleAtEulersLoadWithBothTies) {
    for (const TieType tie : {TieType::Rigid, TieType::Distributing})
        for (const int numPieces : {1, 2, 4, 8})
            EXPECT_NEAR(calcBucklingLoad(numPieces, tie, true), 1, 0.01)
                << numPieces << " pieces, " << (tie == TieType::Rigid ? "rigid" : "distributing");
}

}  // namespace
}  // namespace simflex
