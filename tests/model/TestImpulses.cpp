/** @file
Speed jumps by events of model files: an impulse acts through joints alone, regardless of the forces
on the bodies. **/

#include <cmath>
#include <sstream>

#include "cli/run/RunTest.h"
#include "simflex/model/Session.h"

namespace simflex {
namespace {

const std::string kMethods[] = {"radau", "bdf", "generalized_alpha"};

class ImpulseTest : public RunTest {
protected:
    /** Runs to the end set by the model's events. **/
    Session runToStop(const std::string& text) {
        writeModel("simflex: 1\n" + text);
        Session session(loadModelText(folder / "model.yaml"));
        EXPECT_EQ(session.runTo(3, 3), Session::Outcome::Terminated) << text;
        return session;
    }
    /** Stores speeds and energies just before an event's actions, and after. **/
    void run(const std::string& text, const std::string& when, const std::string& action) {
        const std::string actions = m_atStart.empty() ? "" : ", do: [" + m_atStart + "]";
        const std::string events = "events: {start: {when: t > 1e-3, once: true" + actions +
                                   "}, e: {when: '" + when + "', do: [";
        const Session first = runToStop(text + events + "{stop: true}]}}\n");
        const Session second = runToStop(text + events + action + ", {stop: true}]}}\n");
        EXPECT_EQ(first.getTime(), second.getTime()) << text;
        EXPECT_GT(first.getTime(), 1e-3) << text;
        const auto read = [](const Session& session, Moments& moments) {
            moments.clear();
            for (const char* probe : {"w1", "w2", "w3", "bend", "T", "balance"})
                moments[probe] = session.get(probe).at(0);
        };
        read(first, m_before);
        read(second, m_after);
    }
    /** Returns the momentum that only the second pin can change: rod b's about it, plus the wheel's
    through the gear. **/
    static double calcMomentum(std::map<std::string, double>& at, double wheel) {
        return (at["w1"] + at["w2"]) / 3 + 0.5 * std::cos(at["bend"]) * at["w1"] -
               0.5 * wheel * at["w3"];
    }

    using Moments = std::map<std::string, double>;
    Moments m_before, m_after;
    std::string m_atStart;  ///< actions at 1 ms
};

/** Two rods of 1 kg and 1 m in a row, a wheel beside them. **/
const std::string kRods =
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  a: {mass: 1, inertia: [0.001, 1/12, 1/12], place: {position: [0.5, 0, 0]}}\n"
    "  b: {mass: 1, inertia: [0.001, 1/12, 1/12], place: {position: [1.5, 0, 0]}}\n"
    "  c: {mass: 1, inertia: [1, 1, 0.2], place: {position: [0, 2, 0]}}\n"
    "probes: {w1: {rate: first}, w2: {rate: second}, w3: {rate: third},\n"
    "         turn: {coordinate: first}, bend: {coordinate: second}, T: {energy: kinetic}, "
    "balance: {energy: balance}}\n"
    "analyses: {run: {type: transient, duration: 1}}\n";
std::string makeRodJoints(const std::string& more = "", const std::string& friction = "") {
    return "joints:\n"
           "  first: {type: pin, axis: z, between: [ground, {on: a, position: [-0.5, 0, 0]}]}\n"
           "  second: {type: pin, axis: z" +
           friction +
           ", between: [{on: a, position: [0.5, 0, 0]}, {on: b, position: [-0.5, 0, 0]}]}\n"
           "  third: {type: pin, axis: z, between: [{on: ground, position: [0, 2, 0]}, c]}\n" +
           more;
}
const std::string kFirst = "[ground, {on: a, position: [-0.5, 0, 0]}]",
                  kSecond = "[{on: a, position: [0.5, 0, 0]}, {on: b, position: [-0.5, 0, 0]}]";
/** All kinds of forces on bodies and between them. **/
const std::string kForces[] = {
    "",
    "connectors: {k: {type: bushing, between: " + kSecond + ", stiffness: [0, 0, 50, 0, 0, 0]}}\n",
    "connectors: {k: {type: bushing, between: " + kSecond +
        ", stiffness: [0, 0, 0, 0, 0, 0], damping: [0, 0, 0.3, 0, 0, 0]}}\n",
    "connectors: {k: {type: torsion_spring, between: " + kSecond +
        ", stiffness: 30, damping: 0.2}}\n",
    "connectors: {k: {type: torsion_spring, between: " + kFirst +
        ", stiffness: 30, damping: 0.2}}\n",
    "connectors: {k: {type: spring, between: [{on: ground, position: [1, 1, 0]}, b], stiffness: "
    "200, damping: 3}}\n",
    "connectors: {k: {type: spring, between: [a, {on: b, position: [0.3, 0.1, 0]}], law: "
    "'100*(length - 0.9) + 2*rate'}}\n",
    "connectors: {k: {type: actuator, between: [{on: ground, position: [1, 1, 0]}, b], law: "
    "'10 - 20*rate'}}\n",
    "connectors: {k: {type: motor, joint: second, law: '3 - 0.5*speed'}}\n",
    "connectors: {k: {type: motor, joint: first, law: '-5*speed - 20*angle'}}\n",
    "connectors: {k: {type: stop, between: [{on: ground, position: [0, 0.01, 0], rotation: "
    "[-pi/2, 0, 0]}, b], stiffness: 500, dissipation: 0.1}}\n",
    "loads: {f: {on: b, force: [3, 40*sin(20*t), 0]}}\n"};

TEST_F(ImpulseTest, WhatLocksAJointKeepsTheMomentumOfTheRestWhateverForcesAct) {
    for (const std::string& method : kMethods)
        for (const std::string& forces : kForces) {
            const std::string model = "solver: {method: " + method +
                                      "}\ninitial: {rates: {first: 1, second: 0.5}}\n" + kRods +
                                      makeRodJoints() + forces;
            run(model, "t > 0.05", "{lock: first}");
            const double momentum = calcMomentum(m_before, 0);
            EXPECT_GT(std::abs(momentum), 0.1) << forces;
            EXPECT_NEAR(m_after["w1"], 0, 1e-10) << method << forces;
            EXPECT_NEAR(m_after["w2"], 3 * momentum, 1e-9) << method << forces;
            EXPECT_LT(m_after["T"], m_before["T"]) << method << forces;
            EXPECT_NEAR(m_after["balance"], m_before["balance"], 1e-9) << method << forces;
        }
}

TEST_F(ImpulseTest, FrictionAndGearsHaveTheirPartAsJointsOnly) {
    const std::string gear = "  mesh: {type: gear, wheels: [second, third], teeth: [10, 20]}\n";
    for (const std::string friction :
         {"", ", friction: {coulomb: 0.3, radius: 0.02}", ", friction: {viscous: 0.4}"}) {
        run("initial: {rates: {first: 1, second: 0.5}}\n" + kRods + makeRodJoints(gear, friction) +
                kForces[1],
            "t > 0.05", "{lock: first}");
        EXPECT_NEAR(m_after["w1"], 0, 1e-10);
        EXPECT_NEAR(m_after["w2"], -2 * m_after["w3"], 1e-10);
        EXPECT_NEAR(calcMomentum(m_after, 0.2), calcMomentum(m_before, 0.2), 1e-9);
        EXPECT_LT(m_after["T"], m_before["T"]);
    }
}

TEST_F(ImpulseTest, AMotionThatIsEngagedWorksAsItMoves) {
    // The double pendulum falls before it and swings back to it.
    m_atStart = "{release: drive}";
    for (const std::string& method : kMethods)
        for (const std::string& forces : {kForces[0], kForces[2], kForces[11]}) {
            run("solver: {method: " + method + "}\n" + kRods + makeRodJoints() + forces +
                    "motions: {drive: {joint: first, position: -1.5*t}}\n",
                "turn > -1.5*t && t > 0.1", "{engage: drive}");
            EXPECT_NEAR(m_after["w1"], -1.5, 1e-9) << method << forces;
            // It is engaged with a gap of 1e-9 rad.
            EXPECT_NEAR(calcMomentum(m_after, 0), calcMomentum(m_before, 0), 1e-8)
                << method << forces;
            EXPECT_NEAR(m_after["balance"], m_before["balance"], 1e-9);
        }
}

TEST_F(ImpulseTest, WhatLetsGoOrSetsValuesChangesNoSpeed) {
    m_atStart = "{lock: first}";
    for (const std::string& method : kMethods)
        for (const std::string& forces : kForces)
            for (const char* action :
                 {"{unlock: first}", "{release: first}", "{release: second}", "{set: s, to: 3}"}) {
                if (method != kMethods[0] && (&forces - kForces > 2)) continue;
                run("solver: {method: " + method + "}\n" + kRods + makeRodJoints() + forces +
                        "states: {s: {rate: 1}}\n"
                        "initial: {rates: {first: 1, second: 0.5}}\n",
                    "t > 0.05", action);
                for (const char* speed : {"w1", "w2", "w3", "T"})
                    EXPECT_NEAR(m_after[speed], m_before[speed], 1e-10)
                        << method << forces << action;
            }
}

TEST_F(ImpulseTest, CartsThatAreHookedTogetherKeepTheirMomentum) {
    for (const std::string& method : kMethods)
        for (const char* more :
             {"", "  d: {type: motor, joint: rb, law: '-0.5*rate'}\n",
              "  d: {type: bushing, between: [a, b], stiffness: [0, 0, 0, 0, 0, 0], damping: [0, "
              "0, 0, 3, 0, 0]}\n",
              "  d: {type: bushing, between: [a, b], stiffness: [1, 1, 1, 30, 30, 30], damping: "
              "[0, 0, 0, 1, 1, 1]}\n"}) {
            const std::string model =
                "solver: {method: " + method +
                "}\n"
                "bodies: {a: {mass: 2, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
                "joints:\n"
                "  ra: {type: slider, axis: x, between: [ground, a]}\n"
                "  rb: {type: slider, axis: x, between: [ground, b]}\n"
                "  hook: {type: weld, between: [a, b]}\n"  // redundant with the slides
                "connectors:\n"
                "  k: {type: spring, between: [{on: ground, position: [0.5, 0, 0]}, b], "
                "stiffness: 1000, free_length: 0.3}\n" +
                more +
                "motions: {ma: {joint: ra, position: 0}}\n"
                "loads: {f: {on: a, force: [10, 0, 0]}}\n"
                "probes: {xa: {coordinate: ra}, xb: {coordinate: rb}, w1: {rate: ra}, w2: {rate: "
                "rb}, w3: {rate: rb}, bend: {rate: rb}, T: {energy: kinetic}, balance: {energy: "
                "balance}}\n";
            m_atStart = "{release: hook}, {release: ma}";
            run(model, "xb <= xa && t > 0.02", "{engage: hook}");
            const double speed = (2 * m_before["w1"] + m_before["w2"]) / 3;
            EXPECT_LT(m_before["w2"], -1);
            EXPECT_NEAR(m_after["w1"], speed, 1e-9) << method << more;
            EXPECT_NEAR(m_after["w2"], speed, 1e-9) << method << more;
            EXPECT_NEAR(m_after["T"], 1.5 * speed * speed, 1e-8) << method << more;
        }
}

/** A bar rotates rigidly about its end; when the end is stopped, the rest continues at its
speed. **/
TEST_F(ImpulseTest, BendingPartsSwingOnWhereTheirEndIsStopped) {
    testing::Brick brick;
    brick.type = "C3D20R";
    testing::writeText(folder / "bar.inp", brick.text());
    const std::string bar =
        "parts: {bar: {deck: bar.inp, modes: 30, interfaces: {root: LEFT, tip: RIGHT}}}\n"
        "bodies: {bar: {part: bar}, hub: {mass: 0.1, inertia: [0.01, 0.01, 0.01]}}\n"
        "probes: {w1: {rate: first}, w2: {velocity: bar.tip, component: y}, w3: {rate: first}, "
        "bend: {rate: first}, T: {energy: kinetic}, balance: {energy: balance}}\n"
        "initial: {rates: {first: 3}}\n";
    const std::string onBar =
        "joints: {first: {type: pin, axis: z, between: [ground, bar.root]}}\n";
    const std::string onHub =
        "joints: {first: {type: pin, axis: z, between: [ground, hub]}, "
        "held: {type: weld, between: [hub, bar.root]}}\n";
    for (const std::string& joints : {onBar, onHub})
        for (const std::string& method : kMethods) {
            SCOPED_TRACE(method + " " + joints);
            run("solver: {method: " + method + "}\n" + bar + joints, "t > 0.05", "{lock: first}");
            const double hub = joints == onHub ? 0.5 * 0.01 * 9 : 0;
            EXPECT_NEAR(m_before["w2"], 3 * brick.size[0] * std::cos(0.15), 1e-3);
            EXPECT_NEAR(m_after["w1"], 0, 1e-10);
            EXPECT_NEAR(m_after["w2"], m_before["w2"], 0.02 * m_before["w2"]);
            // More modes lose less energy.
            EXPECT_LT(m_after["T"], m_before["T"] - hub);
            EXPECT_GT(m_after["T"], 0.98 * (m_before["T"] - hub));
            EXPECT_NEAR(m_after["balance"], m_before["balance"], 1e-9);
        }
}

/** Engaging a joint closes it. A gap is reported with the energy it takes, or refused. **/
TEST_F(ImpulseTest, GapsThatAreEngagedAreToldOrRefused) {
    const auto engage = [&](double size, double gap) {
        std::ostringstream text;
        text << "simflex: 1\n"
             << "bodies:\n"
             << "  a: {mass: 1, inertia: [1, 1, 1]}\n"
             << "  b: {mass: 1, inertia: [1, 1, 1]}\n"
             << "  far: {mass: 1, inertia: [1, 1, 1], place: {position: [0, " << size << ", 0]}}\n"
             << "joints:\n"
             << "  ra: {type: slider, axis: x, between: [ground, a]}\n"
             << "  rb: {type: slider, axis: x, between: [ground, b]}\n"
             << "  hook: {type: weld, between: [a, b]}\n"
             << "connectors:\n"
             << "  ka: {type: bushing, between: [{on: ground, position: [" << gap
             << ", 0, 0]}, a], stiffness: [0, 0, 0, 1e6, 0, 0], damping: [0, 0, 0, 2e3, 0, 0]}\n"
             << "  kb: {type: bushing, between: [ground, b], stiffness: [0, 0, 0, 1e6, 0, 0], "
                "damping: [0, 0, 0, 2e3, 0, 0]}\n"
             << "events: {r: {when: t > 1e-3, once: true, do: [{release: hook}]},\n"
             << "  e: {when: t > 0.1, once: true, do: [{engage: hook}]}}\n"
             << "analyses: {run: {type: transient, duration: 0.2}}\n";
        writeModel(text.str());
        Session session(loadModelText(folder / "model.yaml"));
        session.runTo(0.2, 0.2);
        return session.getModel().takeEventWarnings();
    };
    EXPECT_TRUE(engage(1, 0).empty());
    const std::vector<std::string> told = engage(1, 2e-4);
    ASSERT_EQ(told.size(), 1u);
    // Each moves half of the gap: k g²/4.
    EXPECT_THAT(told[0], ::testing::HasSubstr("event 'e' engages joint 'hook'"));
    EXPECT_THAT(told[0], ::testing::HasSubstr("0.0002 m"));
    EXPECT_THAT(told[0], ::testing::HasSubstr("changes the potential energy by 0.01 J"));
    EXPECT_THROW(engage(0.1, 2e-4), std::exception);
    EXPECT_THROW(engage(1, 2e-3), std::exception);
}

TEST_F(ImpulseTest, MotionsThatCannotBeEngagedAreCalledMotions) {
    writeModel(
        "simflex: 1\n"
        "bodies: {a: {mass: 1, inertia: [1, 1, 1]}}\n"
        "joints: {rail: {type: slider, axis: x, between: [ground, a]}}\n"
        "motions: {drive: {joint: rail, position: t}}\n"
        "events:\n"
        "  free: {when: t > 0.1, once: true, do: [{release: drive}]}\n"
        "  back: {when: t > 0.3, once: true, do: [{engage: drive}]}\n"
        "loads: {brake: {on: a, force: [-5, 0, 0]}}\n"
        "analyses: {run: {type: transient, duration: 1}}\n");
    Session session(loadModelText(folder / "model.yaml"));
    try {
        session.runTo(1, 0.1);
        ADD_FAILURE() << "engaged 0.1 m away";
    } catch (const std::exception& error) {
        EXPECT_THAT(error.what(), ::testing::HasSubstr("motion 'drive' cannot be engaged"));
    }
}

TEST_F(ImpulseTest, SpeedsThatJointsDoNotAllowAreThoseOfAnImpactAtTheStart) {
    // Rod b is free, then caught by its pin: the same projection as after an event.
    for (const std::string& forces : kForces) {
        writeModel("simflex: 1\n" + kRods + makeRodJoints() + forces +
                   "initial: {bodies: {b: {velocity: [0, 2, 0]}}}\n");
        const Session session(loadModelText(folder / "model.yaml"));
        // (1/3 + 1)w₁ + w₁/2 + … = impulses of the pins: M = [[5/3 + cos, …]] of the double
        // pendulum; M⁻¹ times 2 m/s times the moments about both pins, 1.5 and 0.5 m.
        const double m11 = 8.0 / 3, m12 = 5.0 / 6, m22 = 1.0 / 3;  // straight
        const double p1 = 1.5 * 2, p2 = 0.5 * 2, det = m11 * m22 - m12 * m12;
        EXPECT_NEAR(session.get("w1")[0], (m22 * p1 - m12 * p2) / det, 1e-9) << forces;
        EXPECT_NEAR(session.get("w2")[0], (m11 * p2 - m12 * p1) / det, 1e-9) << forces;
    }
}

}  // namespace
}  // namespace simflex
