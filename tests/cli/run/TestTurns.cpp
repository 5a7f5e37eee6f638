/** @file
Angles of more than half a turn. **/

#include "cli/run/RunTest.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

/** A wheel of 0.01 kg m² on a pin. **/
std::string makeWheel(const std::string& more) {
    return "simflex: 1\n"
           "bodies: {wheel: {mass: 1, inertia: [0.01, 0.01, 0.01]}}\n"
           "joints: {bearing: {type: pin, between: [ground, wheel], axis: z}}\n"
           "probes: {angle: {coordinate: bearing}, rate: {rate: bearing},\n"
           "         twice: {expression: 2*angle}}\n"
           "solver: {accuracy: 1e-9}\n" +
           more;
}

TEST_F(RunTest, AngleOfADrivenJointIsThatOfItsMotion) {
    // 30 rad/s, faster, slower and backwards: up to 1.4 turns between two rows.
    writeModel(
        makeWheel("motions: {drive: {joint: bearing, position: 10*t + 20*sin(3*t)}}\n"
                  "analyses: {run: {type: transient, duration: 4, interval: 0.1}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    for (size_t i = 0; i < run.time.size(); ++i) {
        const double t = run.time[i], angle = 10 * t + 20 * std::sin(3 * t);
        EXPECT_NEAR(find(run, "angle").rows[i][0], angle, 1e-7) << t;
        EXPECT_NEAR(find(run, "twice").rows[i][0], 2 * angle, 2e-7) << t;
        EXPECT_NEAR(find(run, "rate").rows[i][0], 10 + 60 * std::cos(3 * t), 1e-5) << t;
    }
}

TEST_F(RunTest, AngleOfAFreeJointCountsTurnsOfEachRun) {
    writeModel(
        makeWheel("initial: {rates: {bearing: -50}}\n"
                  "analyses:\n"
                  "  run: {type: transient, duration: 10, interval: 0.25}\n"
                  "  again: {type: transient, duration: 1, interval: 0.25}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    // The integrator's errors add up; a turn would be 6.3.
    EXPECT_NEAR(find(read("run"), "angle").rows.back()[0], -500, 1e-2);
    const Results::Analysis again = read("again");
    EXPECT_NEAR(find(again, "angle").rows.back()[0] - find(again, "angle").rows.front()[0], -50,
                1e-3);
}

TEST_F(RunTest, TorsionSpringsWindOverTurns) {
    // 1 rad/s of amplitude 25: four turns to each side; then on from there.
    writeModel(
        makeWheel("initial: {rates: {bearing: 25}}\n"
                  "connectors:\n"
                  "  clock: {type: torsion_spring, between: [ground, wheel], stiffness: 0.01}\n"
                  "analyses:\n"
                  "  run: {type: transient, duration: 1.5, interval: 0.1}\n"
                  "  more: {type: transient, from: run, duration: 5, interval: 0.1}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    for (const char* name : {"run", "more"}) {
        const Results::Analysis analysis = read(name);
        for (size_t i = 0; i < analysis.time.size(); ++i)
            EXPECT_NEAR(find(analysis, "angle").rows[i][0], 25 * std::sin(analysis.time[i]), 1e-4)
                << analysis.time[i];
        for (const auto& [key, value] : analysis.statistics)
            if (key == "largest_energy_error") {
                EXPECT_LT(value, 1e-5);
            }
    }
}

}  // namespace
}  // namespace simflex
