/** @file
Runs driven by functions of time with dwells, switches, kinks, or undefined values. **/

#include "cli/run/RunTest.h"

namespace simflex {
namespace {

/** A body of 1 kg that slides along x, without gravity. **/
std::string makeCart(const std::string& more) {
    return "simflex: 1\n"
           "gravity: [0, 0, 0]\n"
           "bodies: {cart: {mass: 1, inertia: [1, 1, 1]}}\n"
           "joints: {guide: {type: slider, between: [ground, cart], axis: x}}\n"
           "probes: {x: {position: cart, component: x}, v: {velocity: cart, component: x}}\n" +
           more;
}

class DrivenRunTest : public RunTest {
protected:
    double calcLastSpeed(const std::string& force, const std::string& duration,
                         const std::string& more = "") {
        writeModel(makeCart(more + "loads: {push: {on: cart, force: [\"" + force +
                            "\", 0, 0]}}\nanalyses: {run: {type: transient, interval: " + duration +
                            ", duration: " + duration + "}}\n"));
        EXPECT_EQ(runModel(), 0) << err;
        return find(read("run"), "v").rows.back()[0];
    }
    /** Returns the program's message about a motion of the cart. **/
    std::string refuseMotion(const std::string& position, const std::string& duration = "1") {
        writeModel(makeCart("motions: {lead: {joint: guide, position: \"" + position +
                            "\"}}\nanalyses: {run: {type: transient, duration: " + duration +
                            "}}\n"));
        EXPECT_EQ(runModel("--threads 2"), 1);
        return err;
    }
};

TEST_F(DrivenRunTest, ImpulsesOfLoadsAreTheirSpeeds) {
    EXPECT_NEAR(calcLastSpeed("20*pulse(t, 0.5, 0.6)", "10"), 2, 1e-6);
    EXPECT_NEAR(calcLastSpeed("if(t > 500 && t <= 500.001, 20, 0)", "1000"), 0.02, 1e-8);
    // 20 N in a tenth of every 10 ms
    EXPECT_NEAR(calcLastSpeed("mod(t, 0.01) < 0.001 ? 20 : 0", "1"), 2, 1e-6);
    // where t² is between 4 and 4.41
    EXPECT_NEAR(calcLastSpeed("if(t^2 > 4 && t^2 < 4.41, 20, 0)", "10"), 2, 1e-6);
    // a triangle of 0.2 s, in steps of 0.1 s
    const std::string points = "x: [0, 3, 3.1, 3.2, 9], y: [0, 0, 20, 0, 0]";
    EXPECT_NEAR(
        calcLastSpeed("knock(t)", "10", "tables: {knock: {" + points + ", interpolation: step}}\n"),
        2, 1e-6);
}

TEST_F(DrivenRunTest, TheImpulseOfATriangleIsOffByItsKinksAlone) {
    // BDF2 is exact for ramps. After a kink where the force's slope changes by s, x is immediately
    // off by s h³/9, which is kept below the accuracy a, and v finally by s h²/4: at most
    // (81/64)^(1/3) s^(1/3) a^(2/3). s is 200, -400 and 200 N/s.
    const double kinks = std::cbrt(81.0 / 64) * (2 * std::cbrt(200) + std::cbrt(400));
    for (const char* accuracy : {"1e-6", "1e-8", "1e-9"}) {
        const double speed =
            calcLastSpeed("knock(t)", "10",
                          "tables: {knock: {x: [0, 3, 3.1, 3.2, 9], y: [0, 0, 20, 0, 0], "
                          "interpolation: linear}}\nsolver: {accuracy: " +
                              std::string(accuracy) + "}\n");
        EXPECT_NEAR(speed, 2, kinks * std::pow(std::strtod(accuracy, nullptr), 2.0 / 3))
            << accuracy;
    }
}

TEST_F(DrivenRunTest, LobesOfACamBetweenDwellsDriveWithTheirOwnForce) {
    // x = 0.01 s⁴, s = max(0, sin 600 t): v = 24 s³c, a = 14400 (3 s²c² − s⁴)
    writeModel(
        makeCart("motions: {cam: {joint: guide, position: \"0.01*max(0, sin(600*t))^4\"}}\n"
                 "solver: {accuracy: 1e-8}\n"
                 "analyses: {run: {type: transient, interval: 1e-4, duration: 0.03}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    double highest = 0, fastest = 0;
    for (size_t i = 0; i < run.time.size(); ++i) {
        const double s = std::max(0.0, std::sin(600 * run.time[i])),
                     c = std::cos(600 * run.time[i]);
        EXPECT_NEAR(find(run, "x").rows[i][0], 0.01 * std::pow(s, 4), 1e-9) << run.time[i];
        EXPECT_NEAR(find(run, "v").rows[i][0], 24 * s * s * s * c, 1e-6) << run.time[i];
        highest = std::max(highest, find(run, "x").rows[i][0]);
        fastest = std::max(fastest, find(run, "v").rows[i][0]);
    }
    EXPECT_NEAR(highest, 0.01, 1e-4);
    EXPECT_NEAR(fastest, 24 * std::pow(0.75, 1.5) / 2, 0.05);  // 7.8 m/s where s² = 3/4
}

TEST_F(DrivenRunTest, MotionsThatJumpAreRefusedWithTheirTime) {
    EXPECT_EQ(
        refuseMotion("t < 0.05 ? 0 : 1"),
        "simflex: model.yaml:6:43: motions.lead.position: the motion jumps at t = 0.05 from 0 "
        "to 1, which no finite force can do; step(t, t0, y0, t1, y1) goes from one value to "
        "another\n");
    const std::string advice =
        ", which asks for infinite force; let it change over a while: step(t, t0, y0, t1, y1), a "
        "spline through a table's points\n";
    EXPECT_EQ(refuseMotion("ramp(t, 0.25, 0, 0.5, 1)"),
              "simflex: model.yaml:6:43: motions.lead.position: the motion's speed jumps at t = "
              "0.25 from 0 to 4" +
                  advice);
    EXPECT_EQ(refuseMotion("abs(sin(5*t))"),
              "simflex: model.yaml:6:43: motions.lead.position: the motion's speed jumps at t = "
              "0.628319 from -5 to 5" +
                  advice);
    EXPECT_EQ(refuseMotion("sqrt((t - 0.25)^2)"),
              "simflex: model.yaml:6:43: motions.lead.position: the motion's speed jumps at t = "
              "0.25 from -1 to 1" +
                  advice);
    // Neither a jump of the acceleration alone nor a kink after the end counts.
    writeModel(
        makeCart("motions: {lead: {joint: guide, position: \"max(0, t - 0.1)^2 + "
                 "step(t, 0.3, 0, 0.4, 1) + abs(t - 2)\"}}\n"
                 "analyses: {run: {type: transient, duration: 1}}\n"));
    EXPECT_EQ(runModel(), 0) << err;
}

TEST_F(DrivenRunTest, FormulasWithoutValueEndTheRunWithTheReason) {
    // Enough bodies for two threads.
    std::string bodies, joints, motions;
    for (int i = 0; i < 40; ++i) {
        const std::string n = std::to_string(i);
        bodies += "  b" + n + ": {mass: 1, inertia: [1, 1, 1]}\n";
        joints += "  j" + n + ": {type: slider, between: [ground, b" + n + "], axis: x}\n";
        motions += "  m" + n + ": {joint: j" + n + ", position: \"road(t) + " + n + "\"}\n";
    }
    const std::string model =
        "simflex: 1\ntables: {road: {x: [0, 0.1, 0.2], y: [0, 1, 4], "
        "extrapolation: refuse}}\nbodies:\n" +
        bodies + "joints:\n" + joints + "motions:\n" + motions +
        "analyses: {run: {type: transient, duration: 1, interval: 0.01}}\n";
    writeModel(model);
    EXPECT_EQ(runModel("--threads 2"), 1);
    EXPECT_THAT(err,
                ::testing::HasSubstr("motions.m0.position: 'road(t) + 0' has no finite value"));
    EXPECT_THAT(err, ::testing::HasSubstr("table 'road' is evaluated at 0.2"));

    EXPECT_THAT(refuseMotion("sqrt(0.5 - t)"),
                ::testing::HasSubstr(
                    "model.yaml:6:43: motions.lead.position: 'sqrt(0.5 - t)' has no finite"));
}

}  // namespace
}  // namespace simflex
