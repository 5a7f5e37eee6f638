/** @file
Angles of more than half a turn. **/

#include "cli/run/RunTest.h"
#include "simflex/base/Progress.h"
#include "simflex/model/Session.h"

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
    // Integration errors accumulate; a missed turn would be 6.3.
    EXPECT_NEAR(find(read("run"), "angle").rows.back()[0], -500, 1e-2);
    const Results::Analysis again = read("again");
    EXPECT_NEAR(find(again, "angle").rows.back()[0] - find(again, "angle").rows.front()[0], -50,
                1e-3);
}

TEST_F(RunTest, TorsionSpringsWindOverTurns) {
    // 1 rad/s with amplitude 25: four turns to each side; then continued.
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

TEST_F(RunTest, ABushingThatIsTurnedTooFarIsNamed) {
    // Forth and back between two rows.
    writeModel(makeWheel(
        "motions: {drive: {joint: bearing, position: \"3*sin(pi*t)\"}}\n"
        "connectors:\n"
        "  mount: {type: bushing, between: [ground, wheel], stiffness: [1, 1, 1, 9, 9, 9]}\n"
        "  slide: {type: bushing, between: [ground, wheel], stiffness: [0, 0, 0, 9, 9, 9]}\n"
        "analyses:\n"
        "  run: {type: transient, duration: 1, interval: 1}\n"));
    ASSERT_EQ(runModel("--only run"), 0) << err;
    const Results::Analysis run = read("run");
    ASSERT_EQ(run.warnings.size(), 1u);
    EXPECT_THAT(
        run.warnings[0],
        ::testing::ContainsRegex("at t = 0\\.[23][0-9]* s force 'mount' is turned by 2\\.[3-9]"));
    EXPECT_THAT(err, HasSubstr("warning: run: at t = 0."));
    ASSERT_EQ(runModel("--only run --set 'motions.drive.position=2.3*sin(pi*t)'"), 0) << err;
    EXPECT_TRUE(read("run").warnings.empty());
}

TEST_F(RunTest, EquilibriaAndModesNameABushingThatIsTurnedTooFar) {
    writeModel(
        "simflex: 1\n"
        "bodies: {wheel: {mass: 1, inertia: [0.01, 0.01, 0.01]}}\n"
        "joints: {bearing: {type: cylinder, between: [ground, wheel], axis: z}}\n"
        "motions: {drive: {joint: bearing, position: 3}}\n"
        "connectors:\n"
        "  mount: {type: bushing, between: [ground, wheel], stiffness: [1, 1, 1, 9, 9, 9]}\n"
        "analyses: {rest: {type: static}, modes: {type: eigen, about: rest, count: 1}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    for (const char* name : {"rest", "modes"}) {
        const Results::Analysis analysis = read(name);
        ASSERT_EQ(analysis.warnings.size(), 1u) << name;
        EXPECT_THAT(analysis.warnings[0], HasSubstr("force 'mount' is turned by 3 rad")) << name;
    }
}

TEST_F(RunTest, AWarningIsPrintedOnceWhereBothStreamsGoToOnePlace) {
    writeModel(makeWheel(
        "motions: {drive: {joint: bearing, position: 3*t}}\n"
        "connectors:\n"
        "  mount: {type: bushing, between: [ground, wheel], stiffness: [1, 1, 1, 9, 9, 9]}\n"
        "analyses: {run: {type: transient, duration: 1, interval: 1}}\n"));
    const auto count = [](const std::string& text) {
        int found = 0;
        for (size_t at = 0; (at = text.find("is turned by", at)) != std::string::npos; ++at)
            ++found;
        return found;
    };
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(count(out), 1);
    EXPECT_EQ(count(err), 1);
    ASSERT_EQ(
        runProgram("sh -c \"'" SIMFLEX_PROGRAM "' run model.yaml --quiet --verify 2>&1\"", ""), 0)
        << out;
    EXPECT_EQ(count(out), 1) << out;
    // The results store the warning, too.
    EXPECT_EQ(read("run").warnings.size(), 1u);
}

/** Freely rotating joints and driven joints, by several turns between two rows; a foot carries a
law's knowledge of an angle. **/
class TurnsTest : public RunTest {
protected:
    static constexpr const char* Free[] = {"pin", "cylinder", "universal", "planar"};
    static constexpr const char* Led[] = {"pin", "cylinder", "universal"};

    enum class Feet { OfLed, OfAll };
    static std::string makeJoints(const std::string& interval, Feet feet) {
        std::string bodies, joints, probes, loads, motions;
        const auto add = [&](const std::string& name, const std::string& type, bool hasFoot) {
            bodies += "  " + name + ": {mass: 1, inertia: [0.1, 0.1, 0.1]}\n";
            joints += "  " + name + ": {type: " + type + ", between: [ground, " + name + "]}\n";
            probes += "  " + name + ": {coordinate: " +
                      (type == "pin" ? name : "{joint: " + name + ", coordinate: 0}") + "}\n";
            if (!hasFoot) return;
            bodies += "  foot_" + name + ": {mass: 1, inertia: [1, 1, 1]}\n";
            joints += "  weld_" + name + ": {type: weld, between: [ground, foot_" + name + "]}\n";
            probes += "  law_" + name + ": {reaction: weld_" + name + ", component: x}\n";
            loads +=
                "  " + name + ": {on: foot_" + name + ", force: [\"-1*" + name + "\", 0, 0]}\n";
        };
        for (const char* type : Free) add(std::string("free_") + type, type, feet == Feet::OfAll);
        for (const char* type : Led) add(std::string("led_") + type, type, true);
        // A wheel driven by the first one, and the gear's own coordinates.
        bodies += "  wheel: {mass: 1, inertia: [0.1, 0.1, 0.1]}\n";
        joints +=
            "  wheel: {type: pin, between: [ground, wheel]}\n"
            "  gear: {type: gear, wheels: [led_pin, wheel], teeth: [20, 40]}\n";
        probes += "  wheel: {coordinate: wheel}\n  gear: {coordinate: gear}\n";
        return "simflex: 1\nbodies:\n" + bodies + "joints:\n" + joints + "probes:\n" + probes +
               "loads:\n" + loads +
               "motions:\n"
               "  a: {joint: led_pin, position: 30*sin(10*t)}\n"
               "  b: {joint: led_cylinder, coordinate: 0, position: 100 - 40*t^2}\n"
               "  c: {joint: led_universal, coordinate: 0, position: 25*t}\n"
               "initial:\n"
               "  rates: {free_pin: 50, free_cylinder: [-20, 0.1], free_universal: [30, 0],\n"
               "          free_planar: [40, 0, 0]}\n"
               "solver: {accuracy: 1e-8}\n"
               "analyses:\n"
               "  run: {type: transient, duration: 1, interval: " +
               interval +
               "}\n"
               "  on: {type: transient, from: run, duration: 0.5, interval: " +
               interval +
               "}\n"
               "  rest: {type: static, from: on}\n"
               "  again: {type: transient, from: rest, duration: 0.2, interval: " +
               interval + "}\n";
    }

    /** Angles of joints that stop at 1.5 s, and of driven ones. **/
    static std::map<std::string, double> calcAngles(double t) {
        const double moved = std::min(t, 1.5), led = 30 * std::sin(10 * t);
        return {{"free_pin", 50 * moved},
                {"free_cylinder", -20 * moved},
                {"free_universal", 30 * moved},
                {"free_planar", 40 * moved},
                {"led_pin", led},
                {"led_cylinder", 100 - 40 * t * t},
                {"led_universal", 25 * t},
                {"wheel", -0.5 * led}};
    }

    void expectAngles(const Results::Analysis& analysis, const std::vector<double>& times) {
        for (size_t i = 0; i < times.size(); ++i)
            for (const auto& [name, angle] : calcAngles(times[i])) {
                SCOPED_TRACE(analysis.name + ", " + name + ", t = " + std::to_string(times[i]));
                EXPECT_NEAR(find(analysis, name).rows.at(i)[0], angle, 1e-5);
                if (name == "wheel") {
                    EXPECT_EQ(find(analysis, "gear").rows[i][1], find(analysis, name).rows[i][0]);
                } else if (name.compare(0, 3, "led") == 0) {
                    EXPECT_NEAR(find(analysis, "law_" + name).rows[i][0],
                                find(analysis, name).rows[i][0], 1e-6);
                }
            }
    }
    void expectAllAngles(const std::string& file = "model.results.h5") {
        for (const char* name : {"run", "on", "again"}) {
            const Results::Analysis analysis = read(name, file);
            expectAngles(analysis, analysis.time);
        }
        expectAngles(read("rest", file), {1.5});
    }
};

TEST_F(TurnsTest, EveryWayToGoOnHasTheSameWholeAnglesAtRowsHoweverFarApart) {
    for (const char* interval : {"0.01", "0.2"}) {
        SCOPED_TRACE(interval);
        writeModel(makeJoints(interval, Feet::OfLed));
        ASSERT_EQ(runModel(), 0) << err;
        expectAllAngles();
        ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'",
                             "post model.results.h5 --quiet --set 'probes.rate={rate: wheel}'"),
                  0)
            << err;
        expectAllAngles("model.results.post.h5");
    }
    // Each analysis separately, continuing from the previous one.
    for (const char* only : {"run", "on", "rest", "again"})
        ASSERT_EQ(runModel(std::string("-o parts.h5 --only ") + only), 0) << err;
    expectAllAngles("parts.h5");
    // Stopped in the middle of the second.
    RunOptions options;
    options.output = folder / "stopped.h5";
    options.listener.progress = [](const std::string& phase, double fraction, const auto&) {
        return phase != "on" || fraction < 0.5;
    };
    const ModelText text = loadModelText(folder / "model.yaml");
    EXPECT_THROW(runAnalyses(text, options), Cancelled);
    options.listener = {};
    options.resumes = true;
    runAnalyses(text, options);
    expectAllAngles("stopped.h5");
}

TEST_F(TurnsTest, SessionsCountThem) {
    writeModel(makeJoints("0.2", Feet::OfLed));
    Session settled(loadModelText(folder / "model.yaml"));
    writeModel(makeJoints("0.2", Feet::OfAll));
    const ModelText text = loadModelText(folder / "model.yaml");
    Session session(text);
    const auto expectAt = [](const Session& there, double t) {
        for (const auto& [name, angle] : calcAngles(t)) {
            SCOPED_TRACE(name + ", t = " + std::to_string(t));
            EXPECT_NEAR(there.get(name)[0], angle, 1e-5);
            if (name != "wheel" && there.getModel().getFile().get("probes").has("law_" + name)) {
                EXPECT_NEAR(there.get("law_" + name)[0], angle, 1e-5);
            }
            if (name == "led_pin" || name == "free_pin") {
                EXPECT_EQ(there.get("joints." + name + ".angle"), there.get(name));
            }
        }
    };
    session.runTo(0.7, 0.7);
    expectAt(session, 0.7);
    session.keepState(folder / "kept.state");
    const std::string bytes = session.pack(session.save());
    session.change("bodies.wheel.mass", "2", Session::Restart::Never);
    expectAt(session, 0.7);
    session.runTo(1.5, 0.8);
    expectAt(session, 1.5);
    settled.runTo(1.5, 1.5);
    settled.settle();
    expectAt(settled, 1.5);
    settled.runTo(1.6, 0.1);
    expectAt(settled, 1.6);
    Session kept(text), unpacked(text);
    kept.restoreState(folder / "kept.state");
    expectAt(kept, 0.7);
    unpacked.restore(unpacked.unpack(bytes));
    unpacked.runTo(1, 0.3);
    expectAt(unpacked, 1);
    // Set angles include whole turns, and geared joints follow.
    session.reset();
    expectAt(session, 0);
    session.set("joints.free_pin.angle", {20});
    EXPECT_NEAR(session.get("free_pin")[0], 20, 1e-9);
    EXPECT_NEAR(session.get("law_free_pin")[0], 20, 1e-6);
}

TEST_F(TurnsTest, AMotionSaysWhichTurnItIsOnHoweverLongAStepIs) {
    // 47 rad in a step of 0.2 s; Radau's stages follow 6 rad in a step that may not be shortened.
    for (const auto& [method, step] :
         {std::pair("radau", "0.02"), {"bdf", "0.2"}, {"generalized_alpha", "0.2"}}) {
        writeModel(
            "simflex: 1\n"
            "bodies: {wheel: {mass: 1, inertia: [0.1, 0.1, 0.1]}}\n"
            "joints: {bearing: {type: pin, between: [ground, wheel]}}\n"
            "motions: {drive: {joint: bearing, position: 30*sin(10*t)}}\n"
            "probes: {angle: {coordinate: bearing}}\n"
            "solver: {fixed_step: " +
            std::string(step) + ", method: " + method +
            "}\n"
            "analyses: {run: {type: transient, duration: 3, interval: 0.1}}\n");
        ASSERT_EQ(runModel(), 0) << err;
        const Results::Analysis run = read("run");
        for (size_t i = 0; i < run.time.size(); i += 2)
            EXPECT_NEAR(find(run, "angle").rows[i][0], 30 * std::sin(10 * run.time[i]), 1e-6)
                << method << ", t = " << run.time[i];
    }
}

TEST_F(TurnsTest, AMotionThatLetsGoLeavesTheTurnsAsTheyAre) {
    writeModel(
        "simflex: 1\n"
        "bodies: {wheel: {mass: 1, inertia: [0.1, 0.1, 0.1]}}\n"
        "joints: {bearing: {type: pin, between: [ground, wheel]}}\n"
        "motions: {drive: {joint: bearing, position: 20*t + sin(7*t)}}\n"
        "events: {off: {when: t > 1, do: [{release: drive}]}}\n"
        "probes: {angle: {coordinate: bearing}}\n"
        "solver: {accuracy: 1e-8}\n"
        "analyses:\n"
        "  run: {type: transient, duration: 3, interval: 1}\n"
        "  on: {type: transient, from: run, duration: 1, interval: 1}\n");
    ASSERT_EQ(runModel(), 0) << err;
    const auto calcAngle = [](double t) {
        return t < 1 ? 20 * t + std::sin(7 * t)
                     : 20 + std::sin(7.) + (20 + 7 * std::cos(7.)) * (t - 1);
    };
    for (const char* name : {"run", "on"}) {
        const Results::Analysis run = read(name);
        for (size_t i = 0; i < run.time.size(); ++i)
            EXPECT_NEAR(find(run, "angle").rows[i][0], calcAngle(run.time[i]), 1e-4) << run.time[i];
    }
}

}  // namespace
}  // namespace simflex
