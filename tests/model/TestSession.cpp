/** @file
Models that a program moves by Session alone. **/

#include "simflex/model/Session.h"

#include "cli/run/RunTest.h"
#include "simflex/base/Progress.h"

namespace simflex {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using Values = std::vector<double>;

const std::string kMore =
    "probes: {tip: {position: {on: rod, position: [0, -0.5, 0]}}, swing: {coordinate: pivot}}\n"
    "solver: {accuracy: 1e-6, maximum_step: 0.01}\n"
    "analyses: {run: {type: transient, duration: 0.5, interval: 0.01}}\n";

class SessionTest : public RunTest {
protected:
    ModelText readPendulum(const std::vector<std::string>& settings = {}) {
        writeModel(makePendulum("0.5", kMore));
        return loadModelText(folder / "model.yaml", settings);
    }
};

/** Holds the record to the results of `simflex run`, bit by bit. **/
void expectSameRows(const ProbeRecord& record, const Results::Analysis& run) {
    ASSERT_GT(record.time.size(), 10u);
    EXPECT_EQ(record.time, run.time);
    for (size_t i = 0; i < record.rows.size(); ++i) {
        Values row;
        for (const Results::Series& series : run.probes)
            row.insert(row.end(), series.rows[i].begin(), series.rows[i].end());
        ASSERT_EQ(record.rows[i], row) << "row " << i;
    }
}

TEST_F(SessionTest, AFileMovesAsSimflexRunMovesItToTheLastBit) {
    Session session(readPendulum());
    EXPECT_EQ(session.runTo(0.5, 0.01), Session::Outcome::ReachedTime);
    ASSERT_EQ(runModel(), 0) << err;
    expectSameRows(session.getRecord(), read("run"));
}

TEST_F(SessionTest, AModelWrittenInCppMovesAsTheFileThatSaysTheSame) {
    const ModelText file = readPendulum();
    ModelText written;
    written.set("gravity", {0, -9.81, 0});
    written.set("parameters", "{angle: 0.5}");
    for (const char* key : {"bodies", "joints", "probes"}) {
        const size_t begin = file.text.find(std::string("\n") + key + ":") + 1;
        size_t end = begin;
        do end = file.text.find('\n', end) + 1;
        while (end < file.text.size() && file.text[end] == ' ');
        const std::string block = file.text.substr(begin, end - begin);
        written.text += block;
    }
    written.set("solver.accuracy", 1e-6);
    written.set("solver.maximum_step", 0.01);
    Session session(written);
    session.runTo(0.5, 0.01);
    ASSERT_EQ(runModel(), 0) << err;
    expectSameRows(session.getRecord(), read("run"));
}

TEST_F(SessionTest, AnalysesRunFromCppLeaveTheResultsThatSimflexRunLeaves) {
    const ModelText text = readPendulum();
    RunOptions options;
    options.output = folder / "cpp.h5";
    int numTold = 0;
    options.listener.progress = [&](const std::string& phase, double, const auto&) {
        EXPECT_EQ(phase, "run");
        return ++numTold > 0;
    };
    const Results results = runAnalyses(text, options);
    EXPECT_GT(numTold, 10);
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis &run = results.findAnalysis("run"), other = read("run");
    EXPECT_EQ(run.time, other.time);
    EXPECT_EQ(run.findProbe("tip").rows, other.findProbe("tip").rows);
    EXPECT_EQ(run.q, other.q);
    EXPECT_THROW(run.findProbe("tipp"), std::out_of_range);
    // A listener that says no stops it; what was done stays.
    options.listener.progress = [](const std::string&, double fraction, const auto&) {
        return fraction < 0.5;
    };
    EXPECT_THROW(runAnalyses(text, options), Cancelled);
    EXPECT_GT(readResults(folder / "cpp.h5").findAnalysis("run").time.back(), 0.1);
    options.listener = {};
    options.resumes = true;
    EXPECT_EQ(runAnalyses(text, options).findAnalysis("run").findProbe("tip").rows,
              run.findProbe("tip").rows);
}

TEST_F(SessionTest, WhatIsRestoredGoesOnWithTheSameBits) {
    Session session(readPendulum());
    session.runTo(0.2, 0.01);
    const SavedState saved = session.save();
    session.runTo(0.5, 0.01);
    const Values tip = session.get("tip"), angle = session.get("joints.pivot.angle");
    const double energy = session.calcEnergy();
    session.setState(session.copyState());
    session.step(20);
    session.restore(saved);
    EXPECT_EQ(session.getTime(), 0.2);
    EXPECT_EQ(session.getRecord().time.back(), 0.2);
    session.runTo(0.5, 0.01);
    EXPECT_EQ(session.get("tip"), tip);
    EXPECT_EQ(session.get("joints.pivot.angle"), angle);
    EXPECT_EQ(session.calcEnergy(), energy);
}

TEST_F(SessionTest, WhatIsSavedOfAnotherModelIsRefused) {
    Session session(readPendulum());
    session.runTo(0.2, 0.01);
    const SavedState saved = session.save();
    session.change("title", "Swing");
    session.restore(saved);
    session.change("gravity", "[0, -1, 0]", Session::Restart::Never);
    EXPECT_THROW(session.restore(saved), std::invalid_argument);
    EXPECT_EQ(session.getTime(), 0.2);
    EXPECT_THROW(session.restore(SavedState()), std::invalid_argument);

    ModelText other;
    other.set("bodies.ball", "{shape: {sphere: 0.1}, density: 1000}");
    other.set("bodies.second", "{shape: {sphere: 0.1}, density: 1000}");
    Session two(other);
    EXPECT_THROW(two.setState(session.getState()), std::invalid_argument);
    EXPECT_THROW(two.setState(SimTK::State()), std::invalid_argument);
}

TEST_F(SessionTest, WhatCannotBeSetSaysWhatCan) {
    Session session(readPendulum());
    const auto messageOf = [&](const std::string& path, double value) -> std::string {
        try {
            session.set(path, {value});
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(messageOf("tip", 1), HasSubstr("is a probe"));
    EXPECT_THAT(messageOf("parameters.x", 1), HasSubstr("change() it"));
    EXPECT_THAT(messageOf("joints.pivot.angle", NAN), HasSubstr("cannot be set to nan"));
    EXPECT_THROW(session.step(-1), std::invalid_argument);
    EXPECT_THROW(session.runTo(0, 0.1), std::invalid_argument);
}

TEST_F(SessionTest, QuantitiesAreSetAndJointsStayClosed) {
    Session session(readPendulum());
    EXPECT_THAT(session.listQuantities(), Contains("joints.pivot.angle"));
    session.set("joints.pivot.angle", {-0.3});
    session.set("joints.pivot.angle_rate", {2});
    EXPECT_NEAR(session.get("joints.pivot.angle")[0], -0.3, 1e-12);
    EXPECT_NEAR(session.get("joints.pivot.angle_rate")[0], 2, 1e-12);
    const Values tip = session.get("tip");
    EXPECT_NEAR(std::hypot(tip[0], tip[1]), 1, 1e-9);
    try {
        session.set("joints.pivot.angel", {0});
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("joints.pivot.angle"));
    }
    EXPECT_THROW(session.set("joints.pivot.angle", {0, 1}), std::runtime_error);
    EXPECT_THROW(session.get("joints.pin.angle"), std::runtime_error);
}

TEST_F(SessionTest, AChangedParameterRestartsAndAnInputDoesNot) {
    Session session(readPendulum());
    session.runTo(0.2, 0.01);
    const Values tip = session.get("tip");
    EXPECT_FALSE(session.change("solver.accuracy", "1e-7"));
    EXPECT_EQ(session.getTime(), 0.2);
    EXPECT_FALSE(session.change("gravity", "[0, -1.62, 0]", Session::Restart::Never));
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(session.get("tip")[i], tip[i], 1e-9);
    EXPECT_EQ(session.getRecord().time.size(), 21u);
    EXPECT_TRUE(session.change("parameters.angle", "0.1"));
    EXPECT_EQ(session.getTime(), 0);
    EXPECT_EQ(session.get("parameters.angle"), Values{0.1});
    EXPECT_NEAR(session.get("tip")[0], std::sin(0.1), 1e-9);
    // What cannot be built leaves the Session as it was.
    EXPECT_THROW(session.change("bodies.rod.mass", "heavy"), ModelError);
    EXPECT_NEAR(session.get("tip")[0], std::sin(0.1), 1e-9);
}

/** A cart of 2 kg on rails along x, pushed by an input. **/
const char* const kCart =
    "simflex: 1\n"
    "bodies: {cart: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}, mobilizer: {type: slider}}}\n"
    "inputs: {push: {start: 3, unit: N}, brake: 0}\n"
    "loads: {push: {on: cart, force: [\"push - brake*v\", 0, 0]}}\n"
    "probes:\n"
    "  x: {position: cart, component: x}\n"
    "  v: {velocity: cart, component: x}\n"
    "  power: {expression: push*v, unit: W}\n"
    "  given: {state: push}\n";

TEST_F(SessionTest, InputsActAsTheyAreSet) {
    writeModel(kCart);
    Session session(loadModelText(folder / "model.yaml"));
    EXPECT_EQ(session.get("push"), Values{3});
    EXPECT_EQ(session.findQuantity("inputs.push.rate")->unit, "N/s");
    EXPECT_THAT(session.listQuantities(), Contains("inputs.brake"));
    // Constant, then linear, then constant: x(t) in closed form.
    session.runTo(0.5, 0.1);
    EXPECT_NEAR(session.get("x")[0], 3. / 2 * 0.5 * 0.5 / 2, 1e-12);
    const double x = session.get("x")[0], v = session.get("v")[0];
    session.setInputs({{"push", -4, 12}});
    EXPECT_EQ(session.getTime(), 0.5);
    EXPECT_EQ(session.get("given"), Values{-4});
    session.runTo(1, 0.25);
    EXPECT_NEAR(session.get("push")[0], 2, 1e-12);
    EXPECT_NEAR(session.get("v")[0], v + (-4 * 0.5 + 12 * 0.125) / 2, 1e-9);
    EXPECT_NEAR(session.get("x")[0], x + v * 0.5 + (-4 * 0.125 + 12 * 0.125 / 6) / 2, 1e-6);
    EXPECT_EQ(session.get("power")[0], session.get("push")[0] * session.get("v")[0]);
    session.set("push", {1});
    EXPECT_EQ(session.get("inputs.push.rate"), Values{0});
    session.set("push.rate", {-1});
    EXPECT_EQ(session.get("push"), Values{1});
    session.step(3);
    EXPECT_NEAR(session.get("push")[0], 1 - (session.getTime() - 1), 1e-12);
    EXPECT_NEAR(session.getIntegrator().getWork(), session.get("v")[0] * session.get("v")[0], 1e-6);
}

TEST_F(SessionTest, StepsEndWhereInputsMayChange) {
    writeModel(kCart);
    Session session(loadModelText(folder / "model.yaml"));
    double expected = 0, v = 0;
    for (int k = 0; k < 50; ++k) {
        const double push = k % 3 - 0.7;
        session.set("push", {push});
        session.runTo(0.01 * (k + 1), 0.01);
        EXPECT_FALSE(session.getIntegrator().isStateInterpolated());
        expected += v * 0.01 + push / 2 * 1e-4 / 2;
        v += push / 2 * 0.01;
    }
    EXPECT_NEAR(session.get("x")[0], expected, 1e-12);
    EXPECT_NEAR(session.get("v")[0], v, 1e-12);
}

TEST_F(SessionTest, WhatGoesOnWithInputsHasTheBitsOfWhatWasRestored) {
    writeModel(kCart);
    Session session(loadModelText(folder / "model.yaml"));
    const auto goOn = [&] {
        session.setInputs({{"brake", 2, -0.5}, {"push", 1}});
        session.runTo(session.getTime() + 0.2, 0.05);
        session.set("push", {7});
        session.runTo(session.getTime() + 0.2, 0.05);
        return session.get("x")[0];
    };
    session.setInputs({{"push", 2, 0.1}});
    session.runTo(0.3, 0.1);
    const SavedState saved = session.save();
    const double first = goOn();
    session.restore(saved);
    EXPECT_EQ(goOn(), first);
}

TEST_F(SessionTest, EventsSeeInputsJump) {
    writeModel(std::string(kCart) + "events: {pushed: {when: push > 5, do: [{stop: true}]}}\n");
    Session session(loadModelText(folder / "model.yaml"));
    session.runTo(0.1, 0.1);
    session.set("push", {6});
    EXPECT_EQ(session.get("states.pushed"), Values{1});
    EXPECT_EQ(session.runTo(0.2, 0.1), Session::Outcome::Terminated);
    EXPECT_EQ(session.getTime(), 0.1);
}

TEST_F(SessionTest, WrongInputsAreRefusedByName) {
    const auto fail = [&](const std::string& more) {
        writeModel(std::string(kCart) + more);
        try {
            Session session(loadModelText(folder / "model.yaml"));
            session.setInputs({{"pusch", 1}});
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(fail(""), HasSubstr("no input 'pusch'"));
    EXPECT_THAT(fail("states: {push: {rate: 1}}\n"), HasSubstr("an input has the name 'push'"));
    EXPECT_THAT(fail("frames: {v: {on: cart}}\nevents: {brake: {when: x > 1}}\n"),
                HasSubstr("an input has the name 'brake'"));
    Session session(loadModelText(folder / "model.yaml", {"events={}"}));
    EXPECT_THROW(session.set("push", {SimTK::NaN}), std::runtime_error);
    EXPECT_THROW(session.setInputs({{"push", 1, SimTK::Infinity}}), std::runtime_error);
    EXPECT_THROW(session.set("push.slope", {1}), std::runtime_error);
}

TEST_F(SessionTest, ForcesThatOnlyCppCanSayActAsThoseOfTheFile) {
    Session file(readPendulum());
    ModelOptions options;
    options.extend = [](ModelSystem& system) {
        SimTK::Force::Gravity(system.forces, system.matter, SimTK::Vec3(0, -9.81, 0));
    };
    Session extended(readPendulum({"gravity=[0, 0, 0]"}), options);
    file.runTo(0.5, 0.01);
    extended.runTo(0.5, 0.01);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(extended.get("tip")[i], file.get("tip")[i], 1e-12);
}

TEST_F(SessionTest, TheListenerStopsAMotionAndIsTold) {
    ModelOptions options;
    Session session(readPendulum(), options);
    int numAsked = 0;
    const auto outcome = session.runTo(0.5, 0.01, [&](double) { return ++numAsked < 3; });
    EXPECT_EQ(outcome, Session::Outcome::Stopped);
    EXPECT_EQ(numAsked, 3);
    EXPECT_LT(session.getTime(), 0.5);
    EXPECT_THROW(session.runTo(0, 0.01), std::invalid_argument);
}

TEST_F(SessionTest, DrawsWhereItIs) {
    Session session(readPendulum({"pictures={size: [80, 60]}"}));
    const Image before = session.draw();
    EXPECT_EQ(before.getWidth(), 80);
    session.runTo(0.3, 0.01);
    EXPECT_NE(session.draw(), before);
}

}  // namespace
}  // namespace simflex
