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

TEST_F(RunTest, TorsionSpringTurnedTooFarIsReported) {
    const auto run = [&](const char* rate) {
        writeModel(makeWheel(std::string("initial: {rates: {bearing: ") + rate +
                             "}}\n"
                             "connectors:\n"
                             "  clock: {type: torsion_spring, between: [ground, wheel], "
                             "stiffness: 0.01, free_angle: 0}\n"
                             "analyses: {run: {type: transient, duration: 7, interval: 0.1}}\n"));
        return runModel();
    };
    // One rad/s of amplitude 1: back and forth.
    ASSERT_EQ(run("3"), 0) << err;
    EXPECT_THAT(err, ::testing::Not(HasSubstr("half a turn")));
    EXPECT_NEAR(find(read("run"), "angle").rows[20][0], 3 * std::sin(2), 1e-5);
    ASSERT_EQ(run("5"), 0) << err;
    EXPECT_THAT(err, HasSubstr("torsion spring 'clock' has been turned by more than half a turn"));
    EXPECT_THAT(out, HasSubstr("torsion spring 'clock'"));
}

}  // namespace
}  // namespace simflex
