// Copies of States, for any cached values and any number of changes of the original.

#include <gtest/gtest.h>

#include "Simbody.h"
#include "simflex/body/StateCopy.h"

namespace simflex::test {
namespace {

using namespace SimTK;

class StateCopies : public ::testing::Test {
protected:
    StateCopies() { matter.setShowDefaultGeometry(false); }

    Real calcHeight(const State& state) { return bar.getBodyTransform(state).p()[1]; }

    /** Returns the largest error of the energy m g h in copies that are changed up to ten times.
    @param makeCopy  (original, earlier copy), returns the copy **/
    template <class MakeCopy>
    Real findLargestError(const MakeCopy& makeCopy) {
        Real largest = 0;
        for (int changes = 1; changes <= 10; ++changes)
            for (const Stage stage :
                 {Stage::Model, Stage::Instance, Stage::Position, Stage::Velocity}) {
                State original = system.realizeTopology();
                for (int k = 0; k < changes; ++k) {
                    bar.setAngle(original, 0.1 * k);
                    system.realize(original, Stage::Velocity);
                    system.calcPotentialEnergy(original);
                }
                bar.setAngle(original, 1);
                if (stage < Stage::Instance) original.invalidateAll(Stage::Instance);
                system.realize(original, stage);
                State copy = makeCopy(original);
                for (int k = 0; k < 10; ++k) {
                    system.realize(copy, Stage::Velocity);
                    const Real height = calcHeight(copy);
                    const Real energy = system.calcPotentialEnergy(copy);
                    largest = std::max(largest, std::abs(energy - 9.81 * height));
                    bar.setAngle(copy, 1 + 0.2 * (k + 1));
                }
            }
        return largest;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Pin bar{matter.Ground(), Transform(),
                           Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))),
                           Transform(Vec3(0, 1, 0))};
};

TEST_F(StateCopies, HaveTheirOwnEnergyHoweverOftenTheyChange) {
    EXPECT_LT(findLargestError([](const State& state) { return copyState(state); }), 1e-12);
    State earlier = system.getDefaultState();
    system.realize(earlier, Stage::Velocity);
    system.calcPotentialEnergy(earlier);
    EXPECT_LT(findLargestError([&](const State& state) {
                  copyState(state, earlier);
                  return copyState(earlier);
              }),
              1e-12);
}

TEST_F(StateCopies, OfSimbodyTakeValuesOfTheOriginalForTheirOwn) {
    EXPECT_GT(findLargestError([](const State& state) { return State(state); }), 0.1);
}

TEST_F(StateCopies, OfThemselvesStayAsTheyAre) {
    State state = system.realizeTopology();
    system.realize(state, Stage::Velocity);
    copyState(state, state);
    EXPECT_EQ(state.getSystemStage(), Stage::Velocity);
}

}  // namespace
}  // namespace simflex::test
