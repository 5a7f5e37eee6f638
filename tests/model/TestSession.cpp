/** @file
Models moved by a program through Session alone. **/

#include "simflex/model/Session.h"

#include <complex>
#include <fstream>

#include "cli/run/RunTest.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/model/file/ModelError.h"

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

/** Compares the record with the results of `simflex run`, bit by bit. **/
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

/** Winds a torsion spring to the set angle and back. **/
TEST_F(SessionTest, AnglesThatAreSetAreWholeOnes) {
    writeModel(
        "simflex: 1\n"
        "bodies: {bar: {mass: 1, inertia: [0.1, 0.1, 0.1]}}\n"
        "joints: {A: {type: pin, between: [ground, bar], axis: z}}\n"
        "connectors: {coil: {type: torsion_spring, between: [ground, bar], stiffness: 10}}\n"
        "probes: {angle: {coordinate: A}, stored: {energy: potential}}\n"
        "solver: {accuracy: 1e-8}\n"
        "analyses: {run: {type: transient, duration: 0.1}}\n");
    Session session(loadModelText(folder / "model.yaml"));
    for (const double angle : {2.0, 4.0, 0.0, 7.0, -3.0, 3.0, 20.0, 0.5}) {
        SCOPED_TRACE(angle);
        session.set("joints.A.angle", {angle});
        EXPECT_NEAR(session.get("joints.A.angle")[0], angle, 1e-9);
        EXPECT_NEAR(session.get("angle")[0], angle, 1e-9);
        EXPECT_NEAR(session.get("stored")[0], 5 * angle * angle, 1e-6);
    }
    // It swings about zero, with ω² = k/I; set speeds leave the turns unchanged.
    session.set("joints.A.angle", {9});
    session.runTo(0.1, 0.01);
    EXPECT_NEAR(session.get("angle")[0], 9 * std::cos(1), 1e-5);
    session.set("joints.A.rate", {0});
    EXPECT_NEAR(session.get("angle")[0], 9 * std::cos(1), 1e-5);
    EXPECT_NEAR(session.get("stored")[0], 5 * std::pow(9 * std::cos(1), 2), 1e-3);

    // The same from the file.
    Session wound(loadModelText(folder / "model.yaml", {"initial.joints={A: 7}"}));
    EXPECT_NEAR(wound.get("angle")[0], 7, 1e-9);
    EXPECT_NEAR(wound.get("stored")[0], 5 * 49, 1e-6);
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
    // A listener that returns false stops it; completed results stay.
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
    EXPECT_THAT(messageOf("parameters.x", 1), HasSubstr("use change()"));
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
    // A failed build leaves the Session unchanged.
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

// ---- linearized

using SimTK::Complex;
using SimTK::Matrix_;

/** C (s − A)⁻¹B + D. **/
Matrix_<Complex> calcTransfer(const LinearSystem& linear, Complex s) {
    const int n = linear.A.nrow();
    Matrix_<Complex> A(n, n), transfer(linear.C.nrow(), linear.B.ncol());
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) A(i, j) = (i == j ? s : 0.0) - linear.A(i, j);
    const SimTK::FactorLU factors(A);
    for (int k = 0; k < transfer.ncol(); ++k) {
        SimTK::Vector_<Complex> b(n), x;
        for (int i = 0; i < n; ++i) b[i] = linear.B(i, k);
        factors.solve(b, x);
        for (int o = 0; o < transfer.nrow(); ++o) {
            transfer(o, k) = linear.D(o, k);
            for (int i = 0; i < n; ++i) transfer(o, k) += linear.C(o, i) * x[i];
        }
    }
    return transfer;
}

void expectNear(Complex found, Complex expected, double tolerance = 1e-8) {
    EXPECT_LT(std::abs(found - expected), tolerance * std::abs(expected)) << found << expected;
}

/** A mass on a rail, pulled by a spring and a damper of a shaker that a motion drives. **/
const char* const kShaker = R"(simflex: 1
gravity: [0, -9.81, 0]
parameters: {k: 300, c: 2}
bodies:
  shaker: {mass: 1, inertia: [1, 1, 1]}
  mass: {mass: 2, inertia: [1, 1, 1], place: {position: [0.6, 0, 0]}}
joints:
  guide: {type: slider, between: [ground, shaker], axis: x}
  rail: {type: slider, between: [ground, mass], axis: x}
motions:
  shake: {joint: guide, position: 0}
connectors:
  spring: {type: spring, between: [shaker, mass], stiffness: k, damping: c, free_length: 0.5}
loads:
  push: {on: mass, force: [30, 0, 0]}
probes:
  place: {position: mass}
  speed: {velocity: mass}
  acceleration: {acceleration: mass}
  force: {reaction: rail}
)";

class LinearModelTest : public SessionTest {
protected:
    Session readShaker() {
        writeModel(std::string(kShaker) + "solver: {accuracy: 1e-6}\n");
        return Session(loadModelText(folder / "model.yaml"));
    }
};

TEST_F(LinearModelTest, OfADrivenMassHasItsTransferFunctions) {
    Session session = readShaker();  // the placed push stretches the spring by 0.1 m
    const LinearSystem linear = session.linearize(
        {"motions.shake.position", "loads.push.force.x", "parameters.k"}, {"place.x"});
    ASSERT_EQ(linear.A.nrow(), 2);
    EXPECT_EQ(linear.inputs[1].name, "loads.push.force.x");
    EXPECT_EQ(linear.inputs[1].unit, "N");
    EXPECT_EQ(linear.outputs[0].name, "place.x");
    for (const double omega : {3.0, 12.0, 40.0}) {
        const Complex s(0, omega), stiffness = 2.0 * s * s + 2.0 * s + 300.0;
        const auto transfer = calcTransfer(linear, s);
        expectNear(transfer(0, 0), (2.0 * s + 300.0) / stiffness);
        expectNear(transfer(0, 1), 1.0 / stiffness);
        expectNear(transfer(0, 2), -0.1 / stiffness);
    }
}

TEST_F(LinearModelTest, TellsSpeedsAccelerationsAndReactions) {
    Session session = readShaker();
    const LinearSystem linear = session.linearize({"loads.push.force", "gravity.y"},
                                                  {"speed.x", "acceleration.x", "force"});
    ASSERT_EQ(linear.B.ncol(), 4);
    ASSERT_EQ(linear.C.nrow(), 5);
    const Complex s(0, 9), stiffness = 2.0 * s * s + 2.0 * s + 300.0;
    const auto transfer = calcTransfer(linear, s);
    expectNear(transfer(0, 0), s / stiffness);
    expectNear(transfer(1, 0), s * s / stiffness);
    expectNear(transfer(3, 1), -1.0);  // the rail carries lateral forces
    expectNear(transfer(3, 3), -2.0);  // and the weight
    expectNear(transfer(4, 2), -1.0);
    EXPECT_LT(std::abs(transfer(0, 3)), 1e-12);
}

/** m ẍ = kp (w − x) + ki z − c ẋ, ż = w − x: the set point w also acts on the controller's state.
 **/
TEST_F(LinearModelTest, InputsActOnStatesOfTheModel) {
    writeModel(R"(simflex: 1
parameters: {target: 0}
inputs: {wanted: {start: 0, unit: m}}
bodies:
  cart: {mass: 2, inertia: [1, 1, 1]}
joints:
  rail: {type: slider, between: [ground, cart], axis: x}
states:
  integral: {rate: "wanted + target - place.x"}
loads:
  drive: {on: cart, force: ["40*(wanted + target - place.x) + 30*integral - 5*speed.x", 0, 0]}
probes:
  place: {position: cart}
  speed: {velocity: cart}
)");
    Session session(loadModelText(folder / "model.yaml"));
    const LinearSystem linear = session.linearize({"wanted", "parameters.target"}, {"place.x"});
    ASSERT_EQ(linear.A.nrow(), 3);  // no separate state for the input
    EXPECT_EQ(linear.inputs[0].name, "wanted");
    EXPECT_EQ(linear.inputs[0].unit, "m");
    for (const double omega : {0.3, 2.0, 9.0}) {
        const Complex s(0, omega);
        const Complex wanted =
            (40.0 * s + 30.0) / (2.0 * s * s * s + 5.0 * s * s + 40.0 * s + 30.0);
        expectNear(calcTransfer(linear, s)(0, 0), wanted);
        expectNear(calcTransfer(linear, s)(0, 1), wanted);
    }
}

TEST_F(LinearModelTest, SaysWhatCannotBe) {
    const auto refuse = [&](Session& session, const std::vector<std::string>& inputs,
                            const std::vector<std::string>& outputs, const std::string& why) {
        try {
            session.linearize(inputs, outputs);
            ADD_FAILURE() << "no exception: " << why;
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr(why));
        }
    };
    Session session = readShaker();
    EXPECT_THROW(session.linearize({"loads.pusch.force.x"}, {}), ModelError);
    EXPECT_THROW(session.linearize({"loads.push.force.x"}, {"nowhere"}), ModelError);
    refuse(session, {"loads.push.force.x", "loads.push.force"}, {}, "given twice");
    refuse(session, {}, {}, "needs an input");
    refuse(session, {"loads.pusch.force.x"}, {}, "'push'");
    refuse(session, {"loads.push.force.w"}, {}, "did you mean 'x'?");
    refuse(session, {"connectors.spring.type"}, {}, "there is no number in it");
    refuse(session, {"loads.push.force.x"}, {"place.w"}, "place.x");
    refuse(session, {"motions.shake.position"}, {"acceleration.x"}, "follows the speed");
    refuse(session, {"solver.accuracy"}, {"place.x"}, "changes nothing");
    // 20 N more than the spring's force there.
    session.change("loads.push.force", "[50, 0, 0]");
    refuse(session, {"loads.push.force.x"}, {},
           "this is not an equilibrium: forces of up to 20 N on 'mass'");
    session.settle();
    session.linearize({"loads.push.force.x"});
}

TEST_F(LinearModelTest, HasThePolesOfTheEigenAnalysis) {
    writeModel(std::string(kShaker) +
               "analyses:\n"
               "  linear: {type: linear, inputs: [loads.push], outputs: [place.x]}\n"
               "  modes: {type: eigen, about: static}\n");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, HasSubstr("linear: linear model, 2 states, 3 inputs, 1 output"));
    const Results::Analysis linear = read("linear"), modes = read("modes");
    EXPECT_EQ(linear.inputs, (std::vector<std::string>{"loads.push.force.x", "loads.push.force.y",
                                                       "loads.push.force.z"}));
    const auto& A = linear.matrices.at("A");
    const double trace = A[0][0] + A[1][1], determinant = A[0][0] * A[1][1] - A[0][1] * A[1][0];
    const double omega = 2 * SimTK::Pi * modes.frequency[0][0];
    EXPECT_NEAR(determinant, omega * omega, 1e-9 * determinant);
    EXPECT_NEAR(trace, -2 * modes.dampingRatio[0][0] * omega, 1e-9);
    // The format that control engineers load.
    ASSERT_EQ(runProgram("/usr/bin/python3",
                         "-c \"import scipy.io; m = scipy.io.loadmat('model.results.linear.mat'); "
                         "print(m['A'][1, 0], m['B'].shape, m['inputs'][2][0][0], "
                         "m['output_units'][0][0][0])\""),
              0)
        << err;
    double found = 0;
    EXPECT_TRUE(readNumber(out.substr(0, out.find(' ')), found));
    EXPECT_NEAR(found, A[1][0], 1e-12 * std::abs(A[1][0]));
    EXPECT_THAT(out, HasSubstr(" (2, 3) loads.push.force.z m\n"));
}

TEST_F(LinearModelTest, TheModalFormHasThePolesOfTheEigenAnalysis) {
    // Three masses on rails, coupled by dampers.
    writeModel(R"(simflex: 1
bodies:
  a: {mass: 2, inertia: [1, 1, 1], place: {position: [0.5, 0, 0]}}
  b: {mass: 1, inertia: [1, 1, 1], place: {position: [1, 0, 0]}}
  c: {mass: 0.1, inertia: [1, 1, 1], place: {position: [1.5, 0, 0]}}
joints:
  rail_a: {type: slider, between: [ground, a], axis: x}
  rail_b: {type: slider, between: [ground, b], axis: x}
  rail_c: {type: slider, between: [ground, c], axis: x}
connectors:
  one: {type: spring, between: [ground, a], stiffness: 300, damping: 0.5, free_length: 0.5}
  two: {type: spring, between: [a, b], stiffness: 600, damping: 3, free_length: 0.5}
  three: {type: spring, between: [b, c], stiffness: 90000, damping: 1, free_length: 0.5}
loads:
  push: {on: a, force: [0, 0, 0]}
probes:
  place: {position: c, component: x}
  fast: {velocity: b, component: x}
analyses:
  full: {type: linear, inputs: [loads.push.force.x]}
  modal: {type: linear, inputs: [loads.push.force.x], form: modal}
  slow: {type: linear, inputs: [loads.push.force.x], form: modal, modes: 2}
  modes: {type: eigen, about: static}
)");
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml"), 0) << err;
    EXPECT_THAT(out, HasSubstr("slow: linear model, 4 states"));
    EXPECT_THAT(out, HasSubstr("6 states before; modes that are left out answer as springs do"));
    const Results::Analysis modes = read("modes");
    const auto A = read("modal").matrices.at("A");
    ASSERT_EQ(A.size(), 6u);
    for (size_t k = 0; k < 3; ++k) {
        const double omega = 2 * SimTK::Pi * modes.frequency[0][k], zeta = modes.dampingRatio[0][k];
        EXPECT_NEAR(A[2 * k][2 * k], -zeta * omega, 1e-9 * omega) << k;
        EXPECT_NEAR(std::abs(A[2 * k][2 * k + 1]), omega * std::sqrt(1 - zeta * zeta), 1e-9 * omega)
            << k;
    }
    // Control engineering programs get the same system, and static gains are preserved.
    const std::string compare = R"(
import numpy, scipy.io, scipy.signal
def response(name, w):
    m = scipy.io.loadmat('model.results.' + name + '.mat')
    return m['C'] @ numpy.linalg.solve(1j*w*numpy.eye(len(m['A'])) - m['A'], m['B']) + m['D']
for w in (0.1, 5, 30, 1000):
    assert numpy.allclose(response('full', w), response('modal', w), rtol=1e-9, atol=0), w
assert numpy.allclose(response('full', 1e-6)[0], response('slow', 1e-6)[0], rtol=1e-9)
assert numpy.allclose(response('full', 10), response('slow', 10), rtol=1e-3)
print('same')
)";
    testing::writeText(folder / "compare.py", compare);
    ASSERT_EQ(runProgram("/usr/bin/python3", "compare.py"), 0) << err;
    EXPECT_NE(runProgram("'" SIMFLEX_PROGRAM "'",
                         "run model.yaml --only full --set analyses.full.form=full --set "
                         "analyses.full.modes=2 -o other.h5"),
              0);
    EXPECT_THAT(err, HasSubstr("choose form: modal"));
}

TEST_F(LinearModelTest, ASpinningRotorTellsWhatTurnsAndWhatDoesNot) {
    // A rigid rotor on a pin in a housing on springs, with gyroscopic moments.
    writeModel(R"(simflex: 1
bodies:
  housing: {mass: 1, inertia: [0.2, 0.2, 0.2]}
  rotor: {mass: 3, inertia: [0.5, 0.3, 0.3]}
joints:
  spindle: {type: pin, between: [housing, rotor], axis: x}
connectors:
  bearing: {type: bushing, between: [ground, housing], stiffness: [900, 900, 900, 500, 500, 500], damping: [2, 2, 2, 1, 1, 1]}
motions:
  spin: {joint: spindle, position: 40*t}
initial: {start: steady}
loads:
  push: {on: rotor, torque: [0, 0, 0]}
  stuck: {on: rotor, torque: [0, 0, 0], axes: frame}
probes:
  tilt: {angular_velocity: housing}
  mark: {position: {on: rotor, position: [0, 0.1, 0]}}
)");
    Session session(loadModelText(folder / "model.yaml"));
    const LinearSystem linear =
        session.linearize({"loads.push.torque.y", "loads.push.torque.z"}, {"tilt.y", "tilt.z"});
    // I θ̈ + (c + H×) θ̇ + k θ = τ for tilts about y and z, with H = 0.5·40 about x.
    for (const double omega : {10.0, 60.0}) {
        const Complex s(0, omega), own = 0.5 * s + 2.0 + 900.0 / s, gyro = 20.0;
        const Complex determinant = own * own + gyro * gyro;
        const auto transfer = calcTransfer(linear, s);
        expectNear(transfer(0, 0), own / determinant, 1e-7);
        expectNear(transfer(1, 1), own / determinant, 1e-7);
        expectNear(transfer(1, 0), gyro / determinant, 1e-7);
        expectNear(transfer(0, 1), -gyro / determinant, 1e-7);
    }
    try {
        session.linearize({"loads.push.torque.y"}, {"mark.x"});
        ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("rotated by a radian"));
    }
}

TEST_F(LinearModelTest, WhatTurnsInBearingsAtRestIsNotLoadedOrObservedInAxesAtRest) {
    // An isotropic rotor looks the same after a radian; the axes of its displacements do not.
    writeModel(R"(simflex: 1
bodies: {disc: {mass: 3, inertia: [0.02, 0.01, 0.01]}}
connectors:
  bearing: {type: bushing, between: [ground, disc], stiffness: [0, 0, 0, 0, 12000, 12000], damping: [0, 0, 0, 0, 10, 10]}
joints: {plane: {type: planar, between: [ground, disc], axis: x}}
motions: {spin: {joint: plane, coordinate: 0, position: 60*t}}
initial: {start: steady}
loads:
  still: {on: disc, force: [0, 0, 0]}
  turning: {on: disc, force: [0, 0, 0], axes: frame}
probes:
  still: {position: disc}
  turning: {distance: [ground, {on: disc, position: [0, 1, 0]}]}
)");
    Session session(loadModelText(folder / "model.yaml"));
    const auto refusal = [&](const char* input, const char* output) {
        try {
            session.linearize({input}, {output});
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(refusal("loads.still.force.y", "turning"),
                HasSubstr("'loads.still.force.y' is another input when the system has rotated"));
    EXPECT_THAT(refusal("loads.turning.force.y", "still.y"),
                HasSubstr("'still.y' is another output when the system has rotated"));
    EXPECT_THAT(refusal("loads.still.force.y", "still.y"), HasSubstr("rotated by a radian"));
    // In co-rotating axes: m (s + iΩ)² + c (s + iΩ) + k for y + iz.
    const LinearSystem linear = session.linearize({"loads.turning.force.y"}, {"turning"});
    const Complex s(0, 25);
    const double Omega = 60, m = 3, c = 10, k = 12000;
    const Complex own = m * (s * s - Omega * Omega) + c * s + k, cross = (2 * m * s + c) * Omega;
    expectNear(calcTransfer(linear, s)(0, 0), own / (own * own + cross * cross), 1e-6);
}

TEST_F(LinearModelTest, CampbellDiagramsSayWhoSeesTheirFrequencies) {
    // √(k/m) from rest, minus the speed in co-rotating axes.
    const double own = std::sqrt(4000.0), speed = 60;
    const std::string begin = "simflex: 1\nparameters: {speed: 60}\n",
                      spring = "stiffness: [0, 0, 0, 0, 12000, 12000]",
                      end =
                          "initial: {start: steady}\n"
                          "analyses: {whirl: {type: campbell, speeds: [10, 60], count: 2}}\n";
    writeModel(begin +
               "bodies: {disc: {mass: 3, inertia: [0.02, 0.01, 0.01]}}\n"
               "connectors: {bearing: {type: bushing, between: [ground, disc], " +
               spring + "}}\n" +
               "joints: {plane: {type: planar, between: [ground, disc], axis: x}}\n"
               "motions: {spin: {joint: plane, coordinate: 0, position: speed*t}}\n" +
               end);
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml"), 0) << err;
    EXPECT_NEAR(read("whirl").frequency.at(1).at(0), (own - speed) / (2 * SimTK::Pi), 1e-5);
    EXPECT_THAT(out, HasSubstr("frequencies are those in the rotating frame"));

    writeModel(begin +
               "bodies: {hub: {mass: 1e-6, inertia: [1, 1, 1]}, "
               "disc: {mass: 3, inertia: [0.02, 0.01, 0.01]}}\n"
               "connectors: {bearing: {type: bushing, between: [ground, hub], " +
               spring + "}}\n" +
               "joints:\n"
               "  plane: {type: planar, between: [ground, hub], axis: x}\n"
               "  pin: {type: pin, between: [hub, disc], axis: x}\n"
               "motions:\n"
               "  spin: {joint: pin, position: speed*t}\n"
               "  still: {joint: plane, coordinate: 0, position: 0}\n" +
               end);
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", "run model.yaml"), 0) << err;
    EXPECT_NEAR(read("whirl").frequency.at(1).at(0), own / (2 * SimTK::Pi), 1e-5);
    EXPECT_THAT(out, ::testing::Not(HasSubstr("frequencies are those in the rotating frame")));
}

TEST_F(LinearModelTest, FrequencyResponseIsWhatAForcedMotionSettlesTo) {
    std::string model = kShaker;
    const size_t force = model.find("[30, 0, 0]");
    model.replace(force, 10, "['30 + 5*sin(2*pi*1.5*t)', 0, 0]");
    writeModel(model +
               "analyses:\n"
               "  shake: {type: frequency_response, inputs: [loads.push.force.x], outputs: "
               "[place.x, acceleration.x, force.x], frequencies: [1.5], adaptive: false}\n"
               "  run: {type: transient, duration: 40, interval: 0.01}\n"
               "solver: {accuracy: 1e-8}\n");
    ASSERT_EQ(runModel("--csv"), 0) << err;
    const Results::Analysis shake = read("shake"), run = read("run");
    ASSERT_EQ(shake.frequency.at(0), Values{1.5});
    const double magnitude = shake.matrices.at("magnitude")[0][0],
                 phase = shake.matrices.at("phase")[0][0] * SimTK::Pi / 180;
    double sine = 0, cosine = 0;  // over the last 10 periods: 0.02·e⁻²⁰ of the start remains
    int count = 0;
    for (size_t i = 0; i + 1 < run.time.size(); ++i) {
        const double t = run.time[i];
        if (t < 40 - 10 / 1.5 - 1e-9) continue;
        const double x = find(run, "place").rows[i][0] - 0.6;
        sine += x * std::sin(2 * SimTK::Pi * 1.5 * t);
        cosine += x * std::cos(2 * SimTK::Pi * 1.5 * t);
        ++count;
    }
    EXPECT_NEAR(2 * sine / count, 5 * magnitude * std::cos(phase), 5e-3 * 5 * magnitude);
    EXPECT_NEAR(2 * cosine / count, 5 * magnitude * std::sin(phase), 5e-3 * 5 * magnitude);
    const double omega = 2 * SimTK::Pi * 1.5;
    EXPECT_NEAR(shake.matrices.at("magnitude")[0][1], omega * omega * magnitude, 1e-9);
    EXPECT_NEAR(shake.matrices.at("magnitude")[0][2], 0, 1e-9);
    EXPECT_THAT(testing::readText(folder / "model.results.shake.csv"),
                ::testing::StartsWith("frequency [Hz],place.x [m/N],acceleration.x [(m/s^2)/N]"));
}

TEST_F(LinearModelTest, FrequenciesAreAddedWhereAResponseTurns) {
    writeModel(std::string(kShaker) +
               "analyses:\n"
               "  shake: {type: frequency_response, inputs: [loads.push.force.x], outputs: "
               "[place.x], frequencies: {from: 0.2, to: 20, count: 10}}\n");
    ASSERT_EQ(runModel("--set parameters.c=0.02"), 0) << err;
    EXPECT_THAT(out, HasSubstr("shake: frequency response"));
    const Results::Analysis shake = read("shake");
    EXPECT_GT(shake.frequency[0].size(), 40u);
    EXPECT_LT(shake.frequency[0].size(), 400u);
    double largest = 0;
    for (size_t k = 0; k < shake.frequency[0].size(); ++k) {
        const double omega = 2 * SimTK::Pi * shake.frequency[0][k],
                     magnitude = shake.matrices.at("magnitude")[k][0];
        const Complex expected = 1.0 / Complex(300 - 2 * omega * omega, 0.02 * omega);
        EXPECT_NEAR(magnitude, std::abs(expected), 1e-8 * std::abs(expected));
        EXPECT_NEAR(shake.matrices.at("phase")[k][0], std::arg(expected) * 180 / SimTK::Pi, 1e-5);
        largest = std::max(largest, magnitude);
    }
    EXPECT_NEAR(largest, 1 / (0.02 * std::sqrt(150)), 0.01 * largest);
}

TEST_F(LinearModelTest, RefusesFrequenciesThatCannotBe) {
    const auto refuse = [&](const std::string& frequencies, const std::string& why) {
        writeModel(std::string(kShaker) +
                   "analyses:\n  shake: {type: frequency_response, inputs: [loads.push.force.x], " +
                   frequencies + "}\n");
        EXPECT_NE(runModel(), 0);
        EXPECT_THAT(err, HasSubstr(why));
    };
    refuse("frequencies: {from: 0, to: 20, count: 10}", "spacing: linear");
    refuse("frequencies: [-1]", "must not be negative");
    refuse("outputs: [place.x]", "frequencies");
}

TEST_F(LinearModelTest, UnbalanceWhirlsASpinningRotorAsInClosedForm) {
    // A Jeffcott rotor with its unbalance 0.2 m from the middle, so that gyroscopic moments matter.
    writeModel(R"(simflex: 1
parameters: {speed: 10}
bodies:
  housing: {mass: 1, inertia: [0.3, 0.3, 0.3]}
  rotor: {mass: 3, inertia: [0.5, 0.3, 0.3]}
frames:
  disc: {on: rotor, position: [0.2, 0, 0]}
joints:
  spindle: {type: pin, between: [housing, rotor], axis: x}
connectors:
  bearing: {type: bushing, between: [ground, housing], stiffness: [900, 900, 900, 5000, 5000, 5000], damping: [2, 2, 2, 6, 6, 6]}
motions:
  spin: {joint: spindle, position: speed*t}
initial: {start: steady}
probes:
  mark: {position: {on: housing, position: [0.2, 0, 0]}}
analyses:
  runup: {type: frequency_response, speed: speed, unbalance: {on: disc, moment: 1e-3, axis: x}, outputs: [mark.y, mark.z], frequencies: {from: 2, to: 20, count: 5}, adaptive: false}
)");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis runup = read("runup");
    EXPECT_EQ(runup.inputs, std::vector<std::string>{"unbalance"});
    ASSERT_EQ(runup.frequency[0].size(), 5u);
    for (size_t k = 0; k < 5; ++k) {
        const double omega = 2 * SimTK::Pi * runup.frequency[0][k], square = omega * omega;
        const Complex shift = 1.0 / Complex(5000 - 4 * square, 6 * omega),
                      tilt = 0.2 * 0.2 / Complex(900 - (0.6 - 0.5) * square, 2 * omega),
                      expected = 1e-3 * square * (shift + tilt);
        const auto found = [&](size_t column) {
            return std::polar(runup.matrices.at("magnitude")[k][column],
                              runup.matrices.at("phase")[k][column] * SimTK::Pi / 180);
        };
        expectNear(found(0), expected, 1e-6);
        expectNear(found(1), Complex(0, -1) * expected, 1e-6);  // a quarter turn later
    }
    // A frame can replace its name.
    ASSERT_EQ(runModel("--set 'analyses.runup.unbalance.on={on: rotor, position: [0.1 + 0.1, 0, "
                       "0], rotation: [0, 90*deg, 0]}'"),
              0)
        << err;
    EXPECT_EQ(read("runup").matrices, runup.matrices);
}

TEST_F(LinearModelTest, RoundOffAttractsNoFrequenciesAndIsNoResponse) {
    const char* model = R"(simflex: 1
parameters: {speed: 10}
bodies:
  housing: {mass: 1, inertia: [0.3, 0.3, 0.3]}
  rotor: {mass: 3, inertia: [0.5, 0.3, 0.3]}
joints:
  spindle: {type: pin, between: [housing, rotor], axis: x}
connectors:
  bearing: {type: bushing, between: [ground, housing], stiffness: [5000, 5000, 5000, 9000, 9000, 18000], damping: [6, 6, 6, 12, 12, 12]}
motions:
  spin: {joint: spindle, position: speed*t}
initial: {start: steady}
loads:
  push: {on: housing, force: [0, 0, 0]}
probes:
  y: {position: housing, component: y}
  tilt: {orientation: housing, component: y}
analyses:
  runup: {type: frequency_response, speed: speed, unbalance: {on: housing, moment: 1e-3, axis: x}, frequencies: {from: 4, to: 5, count: 2}}
  shake: {type: frequency_response, inputs: [loads.push.force.y], frequencies: {from: 4, to: 5, count: 2}}
)";
    for (const bool turns : {true, false}) {
        std::string text = model;
        if (!turns) {
            text.replace(text.find("speed*t"), 7, "0");
            text.erase(text.find("initial: {start: steady}\n"), 25);
            text.erase(text.find("  runup:"), text.find("  shake:") - text.find("  runup:"));
        }
        writeModel(text);
        ASSERT_EQ(runModel(), 0) << err;
        EXPECT_THAT(err, HasSubstr("no input changes 'tilt'"));
        for (const char* name : {"runup", "shake"}) {
            if (!turns && name[0] == 'r') continue;
            const Results::Analysis response = read(name);
            EXPECT_LT(response.frequency[0].size(), 20u) << name;
            for (const auto& row : response.matrices.at("magnitude")) {
                EXPECT_GT(row[0], 1e-6);
                EXPECT_EQ(row[1], 0);
            }
        }
    }
}

TEST_F(LinearModelTest, NamesOfAllAnalysesAreCheckedBeforeTheFirst) {
    const auto refuse = [&](const std::string& ports, const std::string& why) {
        writeModel(std::string(kShaker) +
                   "analyses:\n  first: {type: transient, duration: 1}\n  last: {type: linear, " +
                   ports + "}\n");
        EXPECT_NE(runModel(), 0);
        EXPECT_THAT(err, HasSubstr("analyses.last." + why));
        EXPECT_THAT(err, HasSubstr("model.yaml:"));
        EXPECT_FALSE(std::ifstream(folder / "model.results.h5").good());
    };
    refuse("inputs: [loads.pusch.force.x]", "inputs: input 'loads.pusch.force.x'");
    refuse("inputs: [loads.push.force.x, loads.push.force.x]",
           "inputs: input 'loads.push.force.x' is given twice");
    refuse("inputs: [loads.push.force.x], outputs: [plase.x]", "outputs: ");
}

TEST_F(LinearModelTest, RandomForcesGiveTheEffectiveValuesOfTheClosedForm) {
    writeModel(std::string(kShaker) +
               "analyses:\n"
               "  shake: {type: frequency_response, inputs: [loads.push.force.x], outputs: "
               "[place.x, speed.x], frequencies: {from: 0.001, to: 400, count: 30}, "
               "spectra: {loads.push.force.x: 0.01}}\n");
    ASSERT_EQ(runModel("--csv"), 0) << err;
    EXPECT_THAT(out, HasSubstr("effective value"));
    const Results::Analysis shake = read("shake");
    // For white noise, one-sided: W/(4ck) and W/(4cm).
    EXPECT_NEAR(shake.statistics.at("rms of place.x"), std::sqrt(0.01 / (4 * 2 * 300)),
                2e-3 * std::sqrt(0.01 / (4 * 2 * 300)));
    EXPECT_NEAR(shake.statistics.at("rms of speed.x"), std::sqrt(0.01 / (4 * 2 * 2)),
                2e-3 * std::sqrt(0.01 / (4 * 2 * 2)));
    const double magnitude = shake.matrices.at("magnitude")[7][0];
    EXPECT_NEAR(shake.matrices.at("density")[7][0], 0.01 * magnitude * magnitude, 1e-15);
    EXPECT_NE(runModel("--set 'analyses.shake.spectra={loads.push.force.z: 1}'"), 0);
    EXPECT_THAT(err, HasSubstr("loads.push.force.x"));
}

}  // namespace
}  // namespace simflex
