/** @file
Laws, states and controllers of model files: forces that depend on the motion. **/

#include <array>
#include <cmath>
#include <functional>
#include <regex>

#include "cli/run/RunTest.h"
#include "simflex/model/Session.h"
#include "simflex/model/probes/Probe.h"

namespace simflex {
namespace {

using SimTK::Vec3;
using ::testing::HasSubstr;

class LawsTest : public RunTest {
protected:
    Session start(const std::string& text) {
        writeModel("simflex: 1\nsolver: {accuracy: 1e-8}\n" + text);
        return Session(loadModelText(folder / "model.yaml"));
    }
    /** Returns the error message for a model. **/
    std::string findMistake(const std::string& text) {
        try {
            start(text);
        } catch (const ModelError& error) {
            return error.what();
        }
        return "nothing";
    }
    static double get(const Session& session, const std::string& path) {
        return session.get(path).at(0);
    }
    static double getState(const Session& session, const std::string& name) {
        const Model& model = session.getModel();
        return model.getStates().at(name).calcValue(model.getFlexibleBodies(), session.getState());
    }
};

/** 1 kg on a slide along x of Ground; probes x, v. **/
const std::string kSlide =
    "bodies:\n"
    "  mass: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}}\n"
    "probes:\n"
    "  x: {coordinate: {body: mass}}\n"
    "  v: {rate: {body: mass}}\n";

/** 2 kg m² about a pin at Ground's origin; probes angle, speed. **/
const std::string kWheel =
    "bodies:\n"
    "  wheel: {mass: 1, inertia: [1, 1, 2]}\n"
    "joints:\n"
    "  axle: {type: pin, axis: z, between: [ground, wheel]}\n"
    "probes:\n"
    "  angle: {coordinate: axle}\n"
    "  speed: {rate: axle}\n";

/** y' = f(t, y) by the classical Runge–Kutta method. **/
template <size_t N>
std::array<double, N> integrate(
    std::array<double, N> y, double end, int steps,
    const std::function<std::array<double, N>(double, const std::array<double, N>&)>& f) {
    const double h = end / steps;
    for (int i = 0; i < steps; ++i) {
        const double t = i * h;
        const auto add = [](std::array<double, N> a, double factor,
                            const std::array<double, N>& b) {
            for (size_t k = 0; k < N; ++k) a[k] += factor * b[k];
            return a;
        };
        const auto k1 = f(t, y), k2 = f(t + h / 2, add(y, h / 2, k1)),
                   k3 = f(t + h / 2, add(y, h / 2, k2)), k4 = f(t + h, add(y, h, k3));
        y = add(add(add(add(y, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
    }
    return y;
}

TEST_F(LawsTest, RowsHaveTheForcesOfTheirTimeHoweverFarApart) {
    // A block on a slope, held by a motion or by friction: nothing moves, and no step ends at the
    // switch.
    const std::string block =
        "gravity: [0, -9.81, 0]\n"
        "bodies: {block: {mass: 2, inertia: [0.01, 0.01, 0.01]}}\n"
        "frames: {plane: {on: ground, rotation: [0, 0, 20*deg]}}\n"
        "loads: {shake: {on: block, force: [0.5*sin(2*pi*t), 0, 0]}}\n";
    const std::pair<const char*, const char*> holders[] = {
        {"joints: {guide: {type: slider, between: [plane, block]}}\n"
         "motions: {hold: {joint: guide, position: 0}}\n"
         "probes: {force: {driving: hold}}\n",
         "motion"},
        {"joints: {guide: {type: slider, between: [plane, block], friction: {coulomb: 0.9}}}\n"
         "probes: {force: {friction: guide}}\n",
         "friction"}};
    for (const auto& [holder, name] : holders)
        for (const double interval : {1.0, 0.25, 0.0637}) {
            Session session = start(block + holder);
            for (int k = 1; k <= 5; ++k) {
                const double t = k * interval, angle = SimTK::Pi / 9;
                session.runTo(t, interval);
                EXPECT_NEAR(std::abs(get(session, "force")),
                            2 * 9.81 * std::sin(angle) -
                                0.5 * std::sin(2 * SimTK::Pi * t) * std::cos(angle),
                            1e-7)
                    << name << " " << t;
            }
        }
}

TEST_F(LawsTest, ColumnsOfCoordinatesAreNamedAsInExpressions) {
    // 9 N m/rad about a rod and 25 N/m along it, on 1 kg m² and 1 kg.
    Session session = start(
        "bodies: {mass: {mass: 1, inertia: [1, 1, 1]}}\n"
        "joints: {rod: {type: cylinder, between: [ground, mass]}}\n"
        "initial: {rates: {rod: [1, 2]}}\n"
        "probes: {q: {coordinate: rod}, turn: {expression: q.0}, way: {expression: q.1}}\n"
        "loads: {spring: {on: mass, force: [0, 0, -25*q.1], torque: [0, 0, -9*q.0]}}\n");
    session.runTo(1, 0.1);
    EXPECT_NEAR(get(session, "turn"), std::sin(3) / 3, 1e-5);
    EXPECT_NEAR(get(session, "way"), 2 * std::sin(5) / 5, 1e-5);
    const auto mistakeOf = [&](const std::string& word) {
        return findMistake(
            "bodies: {mass: {mass: 1, inertia: [1, 1, 1]}}\n"
            "joints: {rod: {type: cylinder, between: [ground, mass]}}\n"
            "probes: {q: {coordinate: rod}}\n"
            "loads: {spring: {on: mass, force: [0, 0, " +
            word + "]}}\n");
    };
    EXPECT_THAT(mistakeOf("q"),
                HasSubstr("loads.spring.force.2: probe 'q' has 2 columns; say which, as q.0"));
    EXPECT_THAT(mistakeOf("q.2"),
                HasSubstr("loads.spring.force.2: there is no column of probe 'q' '2'"));
}

TEST_F(LawsTest, AControlledArmMovesAsItsEquationsSay) {
    // 2 kg in the middle of an arm of 0.6 m: (I + m l²) θ'' = τ − m g l cos θ.
    Session session = start(
        "gravity: [0, -9.81, 0]\n"
        "parameters: {target: 0.5}\n"
        "bodies:\n"
        "  arm: {mass: 2, inertia: [0.01, 0.2, 0.2], place: {position: [0.3, 0, 0]}}\n"
        "joints:\n"
        "  shoulder: {type: pin, axis: z, between: [ground, {on: arm, position: [-0.3, 0, 0]}]}\n"
        "connectors: {drive: {type: motor, joint: shoulder, law: loop}}\n"
        "states:\n"
        "  loop:\n"
        "    pid: {input: target - angle, proportional: 80, integral: 60, derivative: 9,\n"
        "          filter: 0.01}\n"
        "    scale: 0.01\n"
        "probes: {angle: {coordinate: shoulder}, torque: {state: loop}}\n");
    const double inertia = 0.2 + 2 * 0.09, T = 0.01;
    const auto calcTorque = [&](const std::array<double, 4>& y) {
        const double e = 0.5 - y[0];
        return 80 * e + 60 * y[2] + 9 * (e - y[3]) / T;
    };
    const std::function<std::array<double, 4>(double, const std::array<double, 4>&)> f =
        [&](double, const std::array<double, 4>& y) {
            const double e = 0.5 - y[0];
            return std::array<double, 4>{
                y[1], (calcTorque(y) - 2 * 9.81 * 0.3 * std::cos(y[0])) / inertia, e,
                (e - y[3]) / T};
        };
    for (const double time : {0.05, 0.3, 2.}) {
        session.runTo(time, 0.05);
        // The derivative's filter starts at the error: no kick.
        const auto y = integrate<4>({0, 0, 0, 0.5}, time, 20000, f);
        EXPECT_NEAR(get(session, "angle"), y[0], 2e-7) << time;
        EXPECT_NEAR(get(session, "torque"), calcTorque(y), 2e-3) << time;
    }
}

TEST_F(LawsTest, TorqueOverTheAngleDoesItsWorkInEveryTurn) {
    // 12 N m over half of every turn: 12π J per turn.
    Session session = start(kWheel +
                            "initial: {rates: {axle: 10}}\n"
                            "connectors: {drive: {type: motor, joint: axle,\n"
                            "  law: 'mod(angle, 2*pi) < pi ? 12*sin(angle)^2 : 0'}}\n");
    while (get(session, "angle") < 6 * M_PI) session.step();
    session.runTo(session.getTime() + 1, 0.1);
    const double angle = get(session, "angle"), speed = get(session, "speed");
    const double turns = std::floor(angle / (2 * M_PI)), rest = angle - 2 * M_PI * turns;
    const auto calcWork = [](double x) { return 12 * (x / 2 - std::sin(2 * x) / 4); };
    const double work = turns * calcWork(M_PI) + calcWork(std::min(rest, M_PI));
    EXPECT_NEAR(speed * speed, 100 + work, 1e-4);
}

TEST_F(LawsTest, AMotorFollowsItsMapOfSpeedAndThrottle) {
    // Bilinear: 10 (1 − speed/100) throttle N m on 2 kg m², throttle = t/2.
    Session session = start(
        "tables:\n"
        "  map: {x: [0, 100], y: [0, 1], z: [[0, 10], [0, 0]], interpolation: linear}\n" +
        kWheel +
        "states: {throttle: {rate: 0.5}}\n"
        "connectors: {drive: {type: motor, joint: axle, law: 'map(speed, throttle)'}}\n");
    session.runTo(1.5, 0.1);
    EXPECT_NEAR(get(session, "speed"), 100 * (1 - std::exp(-0.025 * 1.5 * 1.5 / 2)), 1e-5);
}

TEST_F(LawsTest, AMapOfTwoVariablesIsReadFromAFile) {
    testing::writeText(folder / "map.csv",
                       "speed,torque,throttle\n100,0,0\n100,0,1\n0,0,0\n0,10,1\n");
    const std::string model = "probes: {torque: {expression: 'map(25, 0.5)'}}\n";
    const auto tables = [](const std::string& columns) {
        return "tables: {map: {file: map.csv, columns: " + columns + ", interpolation: linear}}\n";
    };
    EXPECT_NEAR(get(start(tables("[0, 2, 1]") + model), "torque"), 3.75, 1e-12);
    EXPECT_THAT(
        findMistake(tables("[0, 1, 2]") + model),
        HasSubstr("model.yaml:3:22: tables.map.file: the point (100, 0) stands there twice"));
    testing::writeText(folder / "map.csv", "0,0,1\n0,1,2\n1,0,3\n");
    EXPECT_THAT(findMistake(tables("[0, 1, 2]") + model), HasSubstr("the point (1, 1) is missing"));
}

TEST_F(LawsTest, ATableTakesAnyQuantity) {
    // 20 N/m on one side, 10 N/m on the other.
    Session session = start(
        "tables: {pull: {x: [-2, 0, 2], y: [-20, 0, 40], interpolation: linear}}\n"
        "initial: {bodies: {mass: {rates: [1]}}}\n" +
        kSlide + "loads: {spring: {on: mass, force: [-pull(x), 0, 0]}}\n");
    const double a = std::sqrt(20.), b = std::sqrt(10.), back = M_PI / a;
    session.runTo(0.9 * back, 0.1);
    EXPECT_NEAR(get(session, "x"), std::sin(0.9 * M_PI) / a, 1e-6);
    session.runTo(back + 0.7, 0.1);
    EXPECT_NEAR(get(session, "x"), -std::sin(b * 0.7) / b, 1e-6);
}

TEST_F(LawsTest, TimesInALawAreKnown) {
    // At rest, steps would grow beyond it.
    Session session = start(kSlide +
                            "loads: {push: {on: mass, force: [\"20*pulse(t, 5, 5.1) - "
                            "1e-12*x\", 0, 0]}}\n");
    session.runTo(10, 10);
    const double impulse = get(session, "v");
    EXPECT_NEAR(impulse, 2, 1e-6);
}

TEST_F(LawsTest, AOneSidedSpringBouncesWithoutLoss) {
    Session session = start(kSlide +
                            "gravity: [-10, 0, 0]\n"
                            "connectors: {rope: {type: spring,\n"
                            "  between: [{on: ground, position: [1, 0, 0]}, mass],\n"
                            "  law: '1e4*max(0, length - 2)'}}\n");
    // Falls 1 m, is stopped, and rebounds.
    const double stretch = (10 + std::sqrt(100 + 4 * 0.5e4 * 10)) / 1e4;
    double lowest = 0;
    while (session.getTime() < 0.8) {
        session.step();
        lowest = std::min(lowest, get(session, "x"));
    }
    EXPECT_GT(lowest, -1 - 1.001 * stretch);
    EXPECT_LT(lowest, -1 - 0.9 * stretch);
    const double speed = get(session, "v");
    EXPECT_GT(speed, 0);
    EXPECT_NEAR(0.5 * speed * speed + 10 * get(session, "x"), 0, 1e-4);
}

TEST_F(LawsTest, WheelsWithBacklashHitEachOtherAsInClosedForm) {
    // Between flanks they move freely; in contact, half a period of 1 and 2 kg m² on 1000 N m/rad.
    Session session = start(
        "bodies:\n"
        "  a: {mass: 1, inertia: [1, 1, 1]}\n"
        "  b: {mass: 1, inertia: [1, 1, 2]}\n"
        "joints:\n"
        "  ja: {type: pin, axis: z, between: [ground, a]}\n"
        "  jb: {type: pin, axis: z, between: [ground, b]}\n"
        "initial: {rates: {ja: 3}}\n"
        "probes:\n"
        "  a: {coordinate: ja}\n"
        "  b: {coordinate: jb}\n"
        "  teeth: {expression: \"1000*deadband(a - b, 0.01)\"}\n"
        "loads:\n"
        "  on_a: {on: a, torque: [0, 0, -teeth]}\n"
        "  on_b: {on: b, torque: [0, 0, teeth]}\n");
    const double omega = std::sqrt(1000 * 1.5), contact = M_PI / omega, flight = 0.02 / 3;
    const auto calcAngle = [&](double t) {  // of a relative to b
        if (t < flight / 2) return 3 * t;
        t -= flight / 2;
        const double period = contact + flight;
        const double sign = std::fmod(t, 2 * period) < period ? 1 : -1;
        t = std::fmod(t, period);
        return sign *
               (t < contact ? 0.01 + 3 / omega * std::sin(omega * t) : 0.01 - 3 * (t - contact));
    };
    for (int k = 1; k <= 50; ++k) {
        session.runTo(0.02 * k, 0.02);
        EXPECT_NEAR(get(session, "a") - get(session, "b"), calcAngle(0.02 * k), 5e-6) << k;
        EXPECT_NEAR(get(session, "a") + 2 * get(session, "b"), 3 * 0.02 * k, 1e-8);
    }
}

TEST_F(LawsTest, ARopeAroundAPostHoldsByItsFriction) {
    // 1 kg on a rope with half a turn around a post, held with 4 N: it moves up first, then sinks.
    Session session =
        start(kSlide +
              "gravity: [10, 0, 0]\n"
              "initial: {bodies: {mass: {rates: -2}}}\n"
              "loads: {rope: {on: mass, force: [\"-4*exp(0.2*pi*sign(v, 1e-6))\", 0, 0]}}\n");
    const double up = 10 - 4 * std::exp(-0.2 * M_PI), down = 10 - 4 * std::exp(0.2 * M_PI);
    const double turn = 2 / up, highest = -2 * turn + up * turn * turn / 2;
    session.runTo(0.1, 0.1);
    EXPECT_NEAR(get(session, "x"), -0.2 + up * 0.005, 1e-7);
    session.runTo(1, 0.1);
    EXPECT_NEAR(get(session, "x"), highest + down * (1 - turn) * (1 - turn) / 2, 2e-6);
    EXPECT_NEAR(get(session, "v"), down * (1 - turn), 2e-6);
}

/** A controller by Simbody's means: torques and an integral of the error, about the z axis. **/
class PidOfSimbody : public SimTK::Force::Custom::Implementation {
public:
    PidOfSimbody(const SimTK::GeneralForceSubsystem& forces, SimTK::MobilizedBody body)
        : m_forces(forces), m_body(body) {}
    void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                   SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
        const double torque = 80 * calcError(state) + 60 * m_forces.getZ(state)[m_z] -
                              9 * m_body.getBodyAngularVelocity(state)[2];
        m_body.applyBodyTorque(state, Vec3(0, 0, torque), bodyForces);
    }
    SimTK::Real calcPotentialEnergy(const SimTK::State&) const override { return 0; }
    void realizeTopology(SimTK::State& state) const override {
        m_z = m_forces.allocateZ(state, SimTK::Vector(1, 0.));
    }
    void realizeAcceleration(const SimTK::State& state) const override {
        m_forces.updZDot(state)[m_z] = calcError(state);
    }

private:
    double calcError(const SimTK::State& state) const {
        const SimTK::Rotation& R = m_body.getBodyRotation(state);
        return 0.5 - std::atan2(R[1][0], R[0][0]);
    }
    const SimTK::GeneralForceSubsystem& m_forces;
    SimTK::MobilizedBody m_body;
    mutable SimTK::ZIndex m_z;
};

TEST_F(LawsTest, AControllerIsTheSameAsOneOfSimbodys) {
    const std::string arm =
        "simflex: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "solver: {accuracy: 1e-10}\n"
        "bodies:\n"
        "  arm: {mass: 2, inertia: [0.01, 0.2, 0.2], place: {position: [0.3, 0, 0]}}\n"
        "joints:\n"
        "  shoulder: {type: pin, axis: z, between: [ground, {on: arm, position: [-0.3, 0, 0]}]}\n"
        "probes: {angle: {coordinate: shoulder}, speed: {rate: shoulder}}\n";
    writeModel(arm);
    ModelOptions options;
    options.extend = [](ModelSystem& system) {
        SimTK::Force::Custom(system.forces,
                             new PidOfSimbody(system.forces, system.bodies[0].mobod));
    };
    Session own(loadModelText(folder / "model.yaml"), options);
    writeModel(arm +
               "states: {loop: {pid: {input: 0.5 - angle, proportional: 80, integral: 60}}}\n"
               "connectors: {drive: {type: motor, joint: shoulder, law: loop - 9*speed}}\n");
    Session file(loadModelText(folder / "model.yaml"));
    for (const double time : {0.1, 0.5, 1., 3.}) {
        own.runTo(time, 0.1);
        file.runTo(time, 0.1);
        EXPECT_NEAR(get(own, "angle"), get(file, "angle"), 1e-8) << time;
        EXPECT_NEAR(get(own, "speed"), get(file, "speed"), 1e-7) << time;
    }
    EXPECT_NEAR(get(file, "angle"), 0.5, 0.1);
}

TEST_F(LawsTest, FiltersRespondAsTheirTransferFunctionsSay) {
    Session session = start(
        "bodies: {mass: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}}}\n"
        "states:\n"
        "  second: {transfer_function: {input: 1, numerator: [2, 3],\n"
        "           denominator: [0.01, 0.1, 1]}}\n"
        "  lead: {lead_lag: {input: t, lead: 0.5, lag: 0.1}}\n"
        "  smooth: {low_pass: {input: t + 1, time_constant: 0.2}}\n"
        "  clock: {rate: 2, initial: 3}\n"
        "probes:\n"
        "  second_now: {state: second}\n"
        "  lead_now: {state: lead}\n"
        "  smooth_now: {state: smooth}\n"
        "  both: {expression: clock + 2*smooth}\n");
    const double t = 0.37, a = 5, b = std::sqrt(75.0);
    session.runTo(t, 0.1);
    // 0.01 ẅ + 0.1 ẇ + w = 1
    const double w = 1 - std::exp(-a * t) * (std::cos(b * t) + a / b * std::sin(b * t)),
                 rate = std::exp(-a * t) * 100 / b * std::sin(b * t);
    const double smooth = 1 + t - 0.2 * (1 - std::exp(-5 * t));
    EXPECT_NEAR(get(session, "second_now"), 2 * rate + 3 * w, 1e-5);
    EXPECT_NEAR(get(session, "lead_now"), 5 * t - 4 * (t - 0.1 * (1 - std::exp(-10 * t))), 1e-6);
    EXPECT_NEAR(get(session, "smooth_now"), smooth, 1e-6);
    EXPECT_NEAR(get(session, "both"), 3 + 2 * t + 2 * smooth, 1e-6);
}

TEST_F(LawsTest, ALimitedRateFollowsWhereItMay) {
    Session session = start(
        kSlide +
        "states: {ramp: {rate_limit: {input: 't < 1 ? 0 : t < 4 ? 3 : -1', rise: 2, fall: 8,\n"
        "         time_constant: 1e-3}}}\n");
    // A step of 3 at 1 s, one of −4 at 4 s.
    const std::array<double, 2> expected[] = {{1, 0},    {1.5, 1},     {2.25, 2.5}, {3.9, 3},
                                              {4.25, 1}, {4.45, -0.6}, {4.9, -1}};
    for (const auto& [time, value] : expected) {
        session.runTo(time, 0.1);
        EXPECT_NEAR(getState(session, "ramp"), value, 1e-6) << time;
    }
}

TEST_F(LawsTest, AStateSpaceSystemIsItsMatrices) {
    Session session = start(
        kSlide +
        "states:\n"
        "  plant: {state_space: {inputs: [1, t], outputs: [a, b], A: [[-2, 0], [0, -5]],\n"
        "          B: [[3, 0], [0, 10]], C: [[1, 1], [0, 2]], D: [[0, 0], [4, -1]],\n"
        "          initial: [0.5, 0]}}\n"
        "  lag: {low_pass: {input: 2*plant.a, time_constant: 1e-4}}\n"
        "  whole: {state_space: {inputs: [1], outputs: [y], A: [[0, 1], [-100, -10]],\n"
        "          B: [[0], [1]], C: [[300, 200]]}}\n"
        "  same: {transfer_function: {input: 1, numerator: [200, 300],\n"
        "         denominator: [1, 10, 100]}}\n"
        "  loop: {transfer_function: {input: 1 - loop, numerator: [1], denominator: [1, 0]}}\n"
        "loads: {none: {on: mass, force: [0*plant.b, 0, 0]}}\n");
    const double t = 0.7;
    session.runTo(t, 0.1);
    const double x1 = 1.5 - std::exp(-2 * t), x2 = 2 * t - 0.4 * (1 - std::exp(-5 * t));
    EXPECT_NEAR(getState(session, "plant.a"), x1 + x2, 1e-6);
    EXPECT_NEAR(getState(session, "plant.b"), 2 * x2 + 4 - t, 1e-6);
    EXPECT_NEAR(getState(session, "lag"), 2 * (x1 + x2), 1e-3);
    EXPECT_NEAR(getState(session, "whole.y"), getState(session, "same"), 1e-6);
    EXPECT_NEAR(getState(session, "loop"), 1 - std::exp(-t), 1e-6);
}

/** 1 kg under a discrete controller of position and speed, target 1. **/
const std::string kSampled =
    "bodies:\n"
    "  mass: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}}\n"
    "states:\n"
    "  force: {sample_and_hold: {input: '20*(1 - x) - 6*v + sum', period: 0.05}}\n"
    "  sum: {sample_and_hold: {input: 'sum + 0.5*(1 - x)', period: 0.05}}\n"
    "loads: {push: {on: mass, force: [force, 0, 0]}}\n"
    "probes: {x: {coordinate: {body: mass}}, v: {rate: {body: mass}}, f: {state: force}}\n";

TEST_F(LawsTest, ASampledControllerIsItsDifferenceEquation) {
    Session session = start(kSampled);
    const double T = 0.05;
    double x = 0, v = 0, sum = 0, force = 0;
    for (int k = 0; k < 41; ++k) {
        if (k > 0) session.runTo(k * T, 0.01);
        EXPECT_NEAR(get(session, "x"), x, 1e-8) << k;
        EXPECT_NEAR(get(session, "v"), v, 1e-7) << k;
        // The previous sum: both are sampled at once.
        force = 20 * (1 - x) - 6 * v + sum;
        sum += 0.5 * (1 - x);
        session.runTo(k * T + 0.02, 0.01);
        EXPECT_NEAR(get(session, "f"), force, 1e-6) << k;
        x += T * v + T * T / 2 * force;
        v += T * force;
    }
}

TEST_F(LawsTest, ARelaySwitchesAtItsThresholds) {
    // T' = 10 (1 − on) − T between 2 and 3, from 1.
    Session session = start(kSlide +
                            "states:\n"
                            "  heat: {rate: '10*(1 - hot) - heat', initial: 1}\n"
                            "  hot: {hysteresis: {input: heat, lower: 2, upper: 3}}\n"
                            "  switched: {rate: hot}\n"
                            "");
    const double rise = std::log(9. / 7), cool = std::log(3. / 2), again = std::log(8. / 7);
    const double cycle = cool + again;
    for (int k = 0; k < 5; ++k) {
        const double on = rise + k * cycle;
        session.runTo(on + 0.5 * cool, 0.02);
        EXPECT_EQ(getState(session, "hot"), 1);
        EXPECT_NEAR(getState(session, "heat"), 3 * std::exp(-0.5 * cool), 1e-6);
        session.runTo(on + cool + 0.5 * again, 0.02);
        EXPECT_EQ(getState(session, "hot"), 0);
        EXPECT_NEAR(getState(session, "switched"), (k + 1) * cool, 1e-6);
    }
}

TEST_F(LawsTest, SamplesRelaysAndEventsSetEachOtherOff) {
    // x is sampled at 0.25, 0.5 … s: 0.7 is passed at 0.75 s, −0.2 never. An event then sets a
    // signal watched by another relay.
    Session session = start("initial: {bodies: {mass: {rates: [1]}}}\n" + kSlide +
                            "states:\n"
                            "  seen: {sample_and_hold: {input: x, period: 0.25}}\n"
                            "  near: {hysteresis: {input: seen, lower: -0.2, upper: 0.7}}\n"
                            "  level: {rate: 0*x}\n"
                            "  high: {hysteresis: {input: level, lower: 1, upper: 2}}\n"
                            "events:\n"
                            "  came: {when: near > 0.5, do: [{set: level, to: 5}]}\n"
                            "  rose: {when: high > 0.5}\n");
    session.runTo(1.1, 0.1);
    const auto occurrences = session.getModel().takeOccurrences();
    ASSERT_EQ(occurrences.size(), 2u);
    EXPECT_EQ(std::min(occurrences[0].first, occurrences[1].first), "came");
    EXPECT_EQ(std::max(occurrences[0].first, occurrences[1].first), "rose");
    for (const auto& occurrence : occurrences) EXPECT_DOUBLE_EQ(occurrence.second, 0.75);
    EXPECT_EQ(getState(session, "near"), 1);
    EXPECT_EQ(getState(session, "high"), 1);
}

TEST_F(LawsTest, ARelayThatSwitchesItselfBackIsRefused) {
    Session session = start(kSlide +
                            "states: {round: {hysteresis: {input: 't + 1 - 4*round', lower: 0,\n"
                            "         upper: 1.5}}}\n");
    try {
        session.runTo(1, 0.1);
        FAIL() << "it has an end";
    } catch (const std::exception& error) {
        EXPECT_THAT(error.what(), HasSubstr("set each other off without end at t = 0.5"));
    }
}

TEST_F(LawsTest, ASampledRunGoesOnFromACheckpointBitForBit) {
    const auto run = [&](bool stops) {
        Session session = start(kSampled);
        session.runTo(0.2, 0.01);  // a sampling time
        if (stops) {
            const SavedState saved = session.save();
            session.runTo(0.33, 0.01);
            session.restore(saved);
        }
        session.runTo(1, 0.01);
        return std::array<double, 3>{get(session, "x"), get(session, "v"), get(session, "f")};
    };
    EXPECT_EQ(run(false), run(true));
}

TEST_F(LawsTest, WhatHoldsItsValueHasNoEquilibrium) {
    for (const char* type : {"static", "eigen"}) {
        writeModel("simflex: 1\n" + kSampled + "analyses: {one: {type: " + type + "}}\n");
        EXPECT_NE(runModel(), 0) << type;
        EXPECT_THAT(err, HasSubstr("state 'force' changes at times of its own and holds its "
                                   "value between them"));
    }
}

TEST_F(LawsTest, EventsHappenWhereTheirConditionBeginsToHold) {
    writeModel(
        "simflex: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "bodies: {ball: {mass: 1, inertia: [1, 1, 1], place: {position: [0, 1, 0]}}}\n"
        "probes: {height: {position: ball, component: y}, seen: {state: low}}\n"
        "events:\n"
        "  low: {when: height < 0.5}\n"
        "  high: {when: height > 0.5}\n"
        "  landed: {when: height < 0, do: [stop: true]}\n"
        "analyses: {fall: {type: transient, duration: 2, interval: 0.1}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis fall = read("fall");
    EXPECT_NEAR(fall.time.back(), std::sqrt(2 / 9.81), 1e-7);
    EXPECT_NEAR(find(fall, "height").rows.back()[0], 0, 1e-6);
    EXPECT_EQ(find(fall, "seen").rows.front()[0], 0);
    EXPECT_EQ(find(fall, "seen").rows.back()[0], 1);
    ASSERT_EQ(fall.events.size(), 2u);
    EXPECT_EQ(fall.events[0].name, "low");
    EXPECT_NEAR(fall.events[0].time, std::sqrt(1 / 9.81), 1e-7);
    EXPECT_THAT(out, HasSubstr("event 'low' at t = 0.3192"));
    EXPECT_THAT(out, HasSubstr("event 'landed' at t = 0.4515"));
    EXPECT_THAT(out, ::testing::Not(HasSubstr("event 'high' at")));
    EXPECT_THAT(err, HasSubstr("event 'high': its condition is true from the start"));
}

TEST_F(LawsTest, EventsReleaseJointsAndSwitchLoads) {
    // A wheel is driven for one turn, then released and braked; counted.
    Session session =
        start(kWheel +
              "states: {turns: {rate: 0}}\n"
              "connectors: {drive: {type: motor, joint: axle, law: 'free ? -3 : 4'}}\n"
              "events:\n"
              "  free: {when: angle > 2*pi, once: true,\n"
              "         do: [{set: turns, to: turns + 1}]}\n"
              "  back: {when: speed < 0, do: [{release: axle}, {set: turns, to: 7}]}\n"
              "gravity: [0, 0, -10]\n");
    // θ̈ = 2 rad/s² over 2π, then −1.5 rad/s² until it stops.
    const double free = std::sqrt(2 * M_PI), speed = 2 * free, back = free + speed / 1.5;
    session.runTo(free + 0.5, 0.1);
    EXPECT_NEAR(get(session, "speed"), speed - 0.75, 1e-6);
    EXPECT_EQ(get(session, "states.turns"), 1);
    EXPECT_EQ(get(session, "states.free"), 1) << "a count";
    session.set("states.turns", {2.5});
    EXPECT_EQ(get(session, "states.turns"), 2.5);
    session.runTo(back + 1, 0.1);
    const auto occurrences = session.getModel().takeOccurrences();
    ASSERT_EQ(occurrences.size(), 2u);
    EXPECT_NEAR(occurrences[0].second, free, 1e-7);
    EXPECT_NEAR(occurrences[1].second, back, 1e-7);
    EXPECT_NEAR(get(session, "states.turns"), 7, 1e-13);
    // The wheel is unsupported now.
    const Vec3 place =
        session.getModel().getBodies()[0].mobod.getBodyOriginLocation(session.getState());
    EXPECT_NEAR(place[2], -5, 1e-5);
}

TEST_F(LawsTest, EventsSetEachOtherOffAndWaitForTheEndOfWhatTheyWaitedFor) {
    // A charge that leaks completely at 1, 40 times a second: each leak is counted by another
    // event, which triggers a third one. The threshold is held twice, by round-off and exactly.
    Session session = start(kSlide +
                            "states: {charge: {rate: 40}, still: {rate: 0, initial: 2}}\n"
                            "events:\n"
                            "  leak: {when: charge > 1, do: [{set: charge, to: charge - 1}]}\n"
                            "  tenth: {when: leak > 9.5, do: [{set: still, to: 3}]}\n"
                            "  after: {when: still > 2.5 && t > 0.1, once: true}\n"
                            "  moves: {when: x < 0 || t > 0.4}\n"
                            "loads: {push: {on: mass, force: [\"-1\", 0, 0]}}\n");
    session.runTo(0.51, 0.1);
    std::map<std::string, std::vector<double>> times;
    for (const auto& [event, time] : session.getModel().takeOccurrences())
        times[event].push_back(time);
    ASSERT_EQ(times["leak"].size(), 20u);
    for (int k = 0; k < 20; ++k) EXPECT_NEAR(times["leak"][size_t(k)], (k + 1) / 40.0, 1e-6) << k;
    ASSERT_EQ(times["tenth"].size(), 1u);
    EXPECT_EQ(times["tenth"][0], times["leak"][9]);
    ASSERT_EQ(times["after"].size(), 1u);
    EXPECT_EQ(times["after"][0], times["tenth"][0]);
    // From rest on the boundary: x = -t²/2.
    ASSERT_EQ(times["moves"].size(), 1u);
    EXPECT_LT(times["moves"][0], 1e-3);
    EXPECT_THAT(findMistake(kSlide + "events: {e: {when: x < 0, do: [{stop: false}]}}\n"),
                HasSubstr("leave it out to continue"));
    writeModel("simflex: 1\n" + kSlide +
               "states: {s: {rate: 1}}\n"
               "events:\n"
               "  a: {when: s > 0.5, do: [{set: s, to: 0}]}\n"
               "  b: {when: s < 0.4, do: [{set: s, to: 1}]}\n"
               "analyses: {run: {type: transient, duration: 1}}\n");
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("events set each other off without end at t = 0.5"));
}

TEST_F(LawsTest, ShortEventsAreFoundWithinSteps) {
    // 1 m/s: 40 ms between rows 0.1 s apart.
    writeModel("simflex: 1\n" + kSlide +
               "initial: {bodies: {mass: {rates: 1}}}\n"
               "events: {near: {when: abs(x - 0.53) < 0.02}}\n"
               "analyses: {run: {type: transient, duration: 1, interval: 0.1}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, HasSubstr("event 'near' at t = 0.51"));
}

TEST_F(LawsTest, WhatLocksTurnsTogetherUntilItIsUnlocked) {
    // 1 kg m² at 3 rad/s and 2 kg m² at rest.
    writeModel(
        "simflex: 1\n"
        "bodies:\n"
        "  a: {mass: 1, inertia: [1, 1, 1]}\n"
        "  b: {mass: 100, inertia: [1, 1, 2]}\n"
        "joints:\n"
        "  bearing: {type: pin, axis: z, between: [ground, a]}\n"
        "  clutch: {type: pin, axis: z, between: [a, b]}\n"
        "loads: {drive: {on: a, torque: [0, 0, \"t > 2 ? 3 : 0\"]}}\n"
        "initial: {rates: {bearing: 3, clutch: -3}}\n"
        "events:\n"
        "  shut: {when: t > 1, do: [{lock: clutch}]}\n"
        "  open: {when: t > 3, do: [{unlock: clutch}]}\n"
        "  again: {when: slip < -1.5, do: [{lock: clutch}]}\n"
        "probes: {speed: {rate: bearing}, slip: {rate: clutch}, at: {coordinate: clutch}}\n"
        "analyses:\n"
        "  run: {type: transient, duration: 3.75, interval: 0.25}\n"
        "  more: {type: transient, from: run, duration: 0.75, interval: 0.25}\n");
    ASSERT_EQ(runModel(), 0) << err;
    const auto speed = find(read("run"), "speed").rows, at = find(read("run"), "at").rows;
    EXPECT_NEAR(speed[6][0], 1, 1e-9);   // 3/(1 + 2)
    EXPECT_NEAR(at[8][0], -3, 1e-7);     // since t = 1
    EXPECT_NEAR(speed[12][0], 2, 1e-7);  // 3 N m on both for 1 s
    EXPECT_THAT(out, HasSubstr("event 'again' at t = 3.5"));
    const auto later = find(read("more"), "speed").rows;
    EXPECT_NEAR(later.back()[0], (3.5 + 4) / 3 + 1, 1e-6);
    EXPECT_NEAR(find(read("more"), "at").rows.back()[0], -3 - 0.375, 1e-6);
}

TEST_F(LawsTest, AKeptStateKnowsWhatIsReleasedAndLocked) {
    const std::string model =
        "gravity: [0, -9.81, 0]\n"
        "bodies: {a: {mass: 1, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
        "joints:\n"
        "  bearing: {type: pin, axis: z, between: [ground, a]}\n"
        "  glue: {type: weld, between: [ground, b]}\n"
        "initial: {rates: {bearing: 1}}\n"
        "events: {e: {when: t > 0.1, do: [{lock: bearing}, {release: glue}]}}\n";
    Session first = start(model), later = start(model);
    first.runTo(0.2, 0.1);
    first.keepState(folder / "kept.txt");
    later.restoreState(folder / "kept.txt");
    later.runTo(0.5, 0.1);
    EXPECT_NEAR(get(later, "joints.bearing"), 0.1, 1e-7);
    EXPECT_NEAR(later.get("bodies.b.position")[1], -9.81 * 0.16 / 2, 1e-7);
}

TEST_F(LawsTest, LocksAreRefusedWhereTheyMakeNoSense) {
    const std::string model =
        "simflex: 1\n"
        "bodies: {a: {mass: 1, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
        "joints:\n"
        "  bearing: {type: pin, axis: z, between: [ground, a]}\n"
        "  ball: {type: ball, between: [a, b]}\n";
    const std::string analysis =
        "analyses: {run: {type: transient, duration: 1, interval: 0.25}}\n";
    writeModel(model + "events: {e: {when: t > 0.5, do: [{lock: ball}]}}\n" + analysis);
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("'ball' has no coordinates to lock"));
    writeModel(model + "events: {e: {when: t > 0.5, do: [{lock: bal}]}}\n" + analysis);
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("did you mean 'ball'?"));
    writeModel(model + "motions: {m: {joint: bearing, position: t}}\n" +
               "events: {e: {when: t > 0.5, do: [{lock: bearing}]}}\n" + analysis);
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("'lock of bearing' follows from 'm'"));
    writeModel(model + "events: {e: {when: t > 0.5, do: [{release: bearing}, {lock: bearing}]}}\n" +
               analysis);
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("'bearing' is released"));
}

TEST_F(LawsTest, WhatEngagesKeepsItsMomentumAndLosesEnergy) {
    // 1 kg m² at 3 rad/s catches 2 kg m² at rest.
    writeModel(
        "simflex: 1\n"
        "bodies:\n"
        "  a: {mass: 1, inertia: [1, 1, 1]}\n"
        "  b: {mass: 100, inertia: [1, 1, 2]}\n"
        "joints:\n"
        "  ja: {type: pin, axis: z, between: [ground, a]}\n"
        "  jb: {type: pin, axis: z, between: [ground, b]}\n"
        "  clutch: {type: weld, between: [a, b]}\n"
        "loads: {drive: {on: a, torque: [0, 0, \"t < 1 && free ? 3 : 0\"]}}\n"
        "events:\n"
        "  free: {when: t > 0, do: [{release: clutch}]}\n"
        "  caught: {when: angle > 2*pi, do: [{engage: clutch}]}\n"
        "  slow: {when: speed < 2 && t > 0.9}\n"
        "probes:\n"
        "  angle: {expression: a - b}\n"
        "  a: {coordinate: ja}\n"
        "  b: {coordinate: jb}\n"
        "  speed: {rate: ja}\n"
        "  momentum: {momentum: angular, component: z}\n"
        "analyses:\n"
        "  run: {type: transient, duration: 4, interval: 0.05}\n"
        "  more: {type: transient, from: run, duration: 1, interval: 0.05}\n"
        "  rest: {type: static, from: run}\n");
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run"), more = read("more");
    EXPECT_NEAR(find(run, "momentum").rows.back()[0], 3, 1e-7);
    EXPECT_NEAR(find(run, "speed").rows.back()[0], 1, 1e-6);
    for (const auto& [name, value] : run.statistics)
        if (name == "largest_energy_error") {
            EXPECT_LT(value, 1e-6);
        }
    // θ̈ = 3 for 1 s, then 3 rad/s: 2π at 1 + (2π − 1.5)/3.
    EXPECT_THAT(out, HasSubstr("event 'caught' at t = 2.59439"));
    EXPECT_THAT(out, HasSubstr("event 'slow' at t = 2.59439")) << "speeds after the impact";
    // Turns persist from one analysis to another.
    const double end = find(run, "a").rows.back()[0];
    EXPECT_GT(end, 2 * M_PI);
    EXPECT_NEAR(find(more, "a").rows.front()[0], end, 1e-9);
    EXPECT_NEAR(find(more, "angle").rows.back()[0], 2 * M_PI, 1e-6);
}

TEST_F(LawsTest, TurnsBeginAsTheFileSays) {
    Session session = start(kWheel +
                            "initial: {joints: {axle: 7}, rates: {axle: 1}}\n"
                            "connectors: {spring: {type: motor, joint: axle, law: -2*angle}}\n");
    EXPECT_NEAR(get(session, "angle"), 7, 1e-9);
    session.runTo(1, 0.1);
    EXPECT_NEAR(get(session, "angle"), 7 * std::cos(1) + std::sin(1), 1e-6);
}

TEST_F(LawsTest, SpeedsThatJointsDoNotLetBeAreNotLostInSilence) {
    // 0.1 kg m² at 50 rad/s, with 0.5 kg at rest welded on at 0.5 m.
    writeModel(
        "simflex: 1\n"
        "bodies:\n"
        "  crank: {mass: 5, inertia: [0.1, 0.1, 0.1], mobilizer: {type: pin}}\n"
        "  link: {mass: 0.5, inertia: [1e-3, 1e-3, 1e-3], place: {position: [0.5, 0, 0]}}\n"
        "joints: {w: {type: weld, as_placed: true, between: [crank, link]}}\n"
        "initial: {bodies: {crank: {rates: 50}}}\n"
        "probes: {speed: {rate: {body: crank}}}\n"
        "analyses: {run: {type: transient, duration: 0.01}}\n");
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_NEAR(find(read("run"), "speed").rows.front()[0], 50 * 0.1 / (0.1 + 0.001 + 0.125), 1e-9);
    EXPECT_THAT(err, HasSubstr("begins with speeds ~[22.1239] instead of ~[50]"));
}

TEST_F(LawsTest, ALawWithoutValueIsNamedWithItsReason) {
    for (const char* law : {"sqrt(0.5 + x)", "sqrt(x - 1)"}) {
        writeModel("simflex: 1\ngravity: [-10, 0, 0]\n" + kSlide +
                   "loads: {push: {on: mass, force: [\"" + law +
                   "\", 0, 0]}}\n"
                   "analyses: {fall: {type: transient, duration: 2, interval: 0.1}}\n");
        EXPECT_NE(runModel(), 0);
        EXPECT_THAT(err, HasSubstr("loads.push.force.0 has no finite value: the root of -"));
    }
}

TEST_F(LawsTest, WhatNoForceCanDependOnIsRefused) {
    const auto withForce = [](const std::string& law, const std::string& probes = "") {
        return kSlide + probes + "loads: {push: {on: mass, force: [\"" + law + "\", 0, 0]}}\n";
    };
    EXPECT_EQ(findMistake(withForce("-3*x")), "nothing");
    EXPECT_THAT(findMistake(withForce("-3*y")),
                HasSubstr("loads.push.force.0: 'y' is not a parameter, table or function"));
    EXPECT_THAT(findMistake(withForce("place", "  place: {position: mass}\n")),
                HasSubstr("probe 'place' has 3 columns; say which, as place.x"));
    // Columns are named, and refused, as in probe expressions, at the law's place.
    const std::string at = "loads.push.force.0: ";
    EXPECT_THAT(findMistake(withForce("place.0", "  place: {position: mass}\n")),
                HasSubstr(at + "there is no column of probe 'place' '0'"));
    for (const char* wrong : {"place.w", "place.xy"})
        EXPECT_THAT(findMistake(withForce(wrong, "  place: {position: mass}\n")),
                    HasSubstr(at + "'" + wrong + "' is not a parameter, table or function"));
    for (const char* wrong : {"place.x", "place.0"})
        EXPECT_THAT(findMistake(withForce(wrong, "  place: {position: mass, component: x}\n")),
                    HasSubstr(at + "probe 'place' has one column: write place for " + wrong));
    EXPECT_THAT(findMistake(withForce("-x.1")),
                HasSubstr(at + "probe 'x' has one column: write x for x.1"));
    EXPECT_EQ(findMistake(withForce("-place.x", "  place: {position: mass}\n")), "nothing");
    EXPECT_THAT(findMistake(withForce("a.x", "  a: {acceleration: mass}\n")),
                HasSubstr("no law can depend on probe 'a', which is of kind 'acceleration'"));
    EXPECT_THAT(findMistake(withForce("a", "  a: {expression: b + x}\n  b: {expression: 2*a}\n")),
                HasSubstr("it depends on itself: 'a' → 'b' → 'a'"));
    EXPECT_THAT(findMistake(withForce("-3*(x + 0.1*x + x + v)")),
                HasSubstr("loads.push.force.0: 'x + 0.1*x + x + v' takes m and m/s together; if "
                          "one of them has a factor of 1, write it: 1*..."));
    EXPECT_THAT(findMistake(withForce("x > t ? 1 : 0")), HasSubstr("'x > t' takes "));
    EXPECT_EQ(findMistake(withForce("-3*(x + 1*v) + min(x, 2) - (v < 3)")), "nothing");
    EXPECT_THAT(findMistake(kWheel + "events: {e: {when: 'angle > speed'}}\n"),
                HasSubstr("'angle > speed' takes "));
    EXPECT_THAT(findMistake(kSlide + "states: {loop: {pid: {input: 1 - loop, proportional: 2}}}\n"),
                HasSubstr("it depends on itself: 'loop' → 'loop'"));
    EXPECT_THAT(findMistake(kSlide + "states: {x: {rate: 1}}\n"),
                HasSubstr("a probe has the name 'x' already"));
    EXPECT_EQ(findMistake(kWheel + "connectors: {m: {type: motor, joint: axle, law: -angle}}\n"),
              "nothing");
    const std::string spring =
        "connectors: {s: {type: spring, between: [{on: ground, position: [0, 1, 0]}, mass],\n"
        "  law: 'angle'}}\n";
    EXPECT_THAT(findMistake(kSlide + spring),
                HasSubstr("connectors.s.law: only laws of torsion springs and of motors of turning "
                          "joints know 'angle'; springs, actuators"));
    EXPECT_THAT(findMistake(kWheel + "connectors: {m: {type: motor, joint: axle, law: -length}}\n"),
                HasSubstr("'length'; torsion springs and motors of turning joints know 'angle'"));
    for (const char* t : {"probes: {t: {position: ground}}", "states: {t: {rate: 1}}",
                          "events: {t: {when: t > 1}}"})
        EXPECT_THAT(findMistake(t + std::string("\n")), HasSubstr("'t' is the time wherever")) << t;
    EXPECT_THAT(findMistake(withForce("-2*g", "  g: {rate: {body: mass}}\n")),
                HasSubstr("'g' is a word of formulas and a probe: write probes.g for the latter, "
                          "or rename one"));
    EXPECT_THAT(findMistake(kSlide + "motions: {lead: {between: [ground, mass], position: x}}\n"),
                HasSubstr("; it is a quantity of the motion, and this is a function of time "
                          "alone"));
    EXPECT_THAT(findMistake("tables: {m: {x: [0, 1], y: [0, 1], z: [[1, 2], [3]]}}\n" +
                            withForce("m(x, v)")),
                HasSubstr("tables.m: row 1 of z has 1 values and y 2; every y has one in each"));
    EXPECT_THAT(findMistake("tables: {m: {x: [0, 1], y: [0, 1], z: [[1, 2], [3, 4]]}}\n" +
                            withForce("m(x)")),
                HasSubstr("loads.push.force.0: the table 'm' has two arguments, here it gets 1"));
    EXPECT_THAT(findMistake("parameters: {v: 3}\n" + withForce("-2*v")),
                HasSubstr("'v' is a parameter and a probe: write parameters.v or probes.v, or "
                          "rename one"));
    EXPECT_THAT(findMistake(kSlide + "events: {e: {when: x}}\n"),
                HasSubstr("it must be a comparison, such as 'gap < 0'"));
    EXPECT_THAT(findMistake(kSlide + "events: {e: {when: x < 0, do: [{release: pivot}]}}\n"),
                HasSubstr("there is no joint or motion 'pivot'"));
}

/** 1 kg on a joint at 1 m/s or rad/s, under a connector's law, which is at the end. **/
struct LawOfItsOwn {
    std::string connector, joint;
    std::vector<std::string> own;
};
const std::vector<LawOfItsOwn> kLawsOfTheirOwn{
    {"type: spring, between: [ground, a], ", "slider, axis: x", {"length", "rate"}},
    {"type: actuator, between: [ground, a], ", "slider, axis: x", {"length", "rate"}},
    {"type: motor, joint: j, ", "slider, axis: x", {"length", "rate"}},
    {"type: torsion_spring, between: [ground, a], ", "pin, axis: z", {"angle", "speed"}},
    {"type: motor, joint: j, ", "pin, axis: z", {"angle", "speed"}}};

TEST_F(LawsTest, OwnQuantitiesOfALawWinOverEveryOtherName) {
    const std::vector<std::pair<std::string, std::string>> others{
        {"parameters", "0.3"},
        {"probes", "{function: 0.3}"},
        {"inputs", "0.3"},
        {"states", "{rate: 1, initial: 0.3}"},
        {"events", "{when: t > 0.01}"}};
    for (const LawOfItsOwn& of : kLawsOfTheirOwn)
        for (const std::string& word : of.own)
            for (const auto& [section, entry] : others) {
                std::vector<std::string> notes;
                const auto move = [&, &key = section, &value = entry](const std::string& name,
                                                                      const std::string& law) {
                    std::string text =
                        "simflex: 1\nbodies: {a: {mass: 1, inertia: [1, 1, 1], "
                        "place: {position: [0.5, 0, 0]}}}\n"
                        "joints: {j: {type: " +
                        of.joint + ", between: [ground, a]}}\nconnectors: {c: {" + of.connector +
                        "law: '" + law + "'}}\ninitial: {rates: {j: 1}}\nprobes: {q: {rate: j}}\n";
                    const std::string other = name + ": " + value;
                    if (key == "probes")
                        text.insert(text.find("{q:") + 1, other + ", ");
                    else
                        text += key + ": {" + other + "}\n";
                    writeModel(text);
                    ModelOptions options;
                    notes.clear();
                    options.listener.note = [&](const std::string& note) { notes.push_back(note); };
                    Session session(loadModelText(folder / "model.yaml"), options);
                    session.runTo(0.02, 0.02);
                    return get(session, "q");
                };
                SCOPED_TRACE(of.connector + word + " and " + section);
                const double right = move("other", "-20*" + word + " + 10*other");
                EXPECT_THAT(notes, ::testing::IsEmpty());
                const double found = move(word, "-20*" + word + " + 10*" + section + "." + word);
                EXPECT_NEAR(found, right, 1e-12);
                EXPECT_GT(std::abs(right - 1), 1e-3);
                EXPECT_THAT(notes, ::testing::ElementsAre(HasSubstr(
                                       "connectors.c.law: '" + word +
                                       "' is the connector's own; write " + section + "." + word)));
                // Names specific to one connector are specific to the other here.
                if (word != of.own[0]) continue;
                const std::string foreign = word == "length" ? "speed" : "rate";
                EXPECT_NEAR(move(foreign, "-20*" + word + " + 10*" + foreign), right, 1e-12);
                EXPECT_THAT(notes, ::testing::ElementsAre(
                                       HasSubstr("'" + foreign + "' is " + section + "." + foreign +
                                                 " here: this connector's own quantities are '" +
                                                 of.own[0] + "' and '" + of.own[1] + "'")));
            }
}

/** 2 kg on a slide along x, gravity as on an incline. **/
std::string makeIncline(const std::string& friction, const std::string& more = "") {
    return "parameters: {incline: atan(0.4)}\n"
           "gravity: [9.81*sin(incline), -9.81*cos(incline), 0]\n"
           "bodies: {block: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}}}\n"
           "joints: {slide: {type: slider, between: [ground, block]" +
           friction + "}}\n" + more;
}

const std::string kRubbing =
    "probes:\n"
    "  x: {position: block, component: x}\n"
    "  force: {friction: slide}\n"
    "  load: {friction: slide, what: load}\n"
    "  rate: {friction: slide, what: rate}\n"
    "  lost: {friction: slide, what: power}\n"
    "  reaction: {reaction: slide}\n"
    "  back: {reaction: slide, on: F, axes: M}\n"
    "  balance: {energy: balance}\n";

TEST_F(LawsTest, AJointOfAFileRubsByItsOwnReaction) {
    const double angle = std::atan(0.4), across = 2 * 9.81 * std::cos(angle),
                 pull = 2 * 9.81 * std::sin(angle);
    Session session = start(makeIncline(", friction: {coulomb: 0.3, static: 0.35}", kRubbing));
    const double a = pull / 2 - 0.3 * across / 2;
    session.runTo(1, 0.1);
    EXPECT_NEAR(get(session, "x"), a / 2, 1e-6);
    EXPECT_NEAR(get(session, "force"), -0.3 * across, 1e-9);
    EXPECT_NEAR(get(session, "load"), across, 1e-9);
    EXPECT_NEAR(get(session, "rate"), a, 1e-6);
    EXPECT_NEAR(get(session, "lost"), -0.3 * across * a, 1e-5);
    const std::vector<double> reaction = session.get("reaction"), back = session.get("back");
    EXPECT_NEAR(reaction[0], -0.3 * across, 1e-9);
    EXPECT_NEAR(reaction[1], across, 1e-9);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(back[k], -reaction[k], 1e-9) << k;
    EXPECT_NEAR(get(session, "balance"), 0, 1e-6);
    // It sticks where possible.
    Session held = start(makeIncline(", friction: {coulomb: 0.3, static: 0.41}", kRubbing));
    held.runTo(10, 1);
    EXPECT_LT(std::abs(get(held, "x")), 1e-12);
    EXPECT_NEAR(get(held, "force"), -pull, 1e-9);
    EXPECT_NEAR(get(held, "lost"), 0, 1e-12);
}

TEST_F(LawsTest, AMotionLeavesTheFrictionOfWhatItHoldsAtRestToItself) {
    // It drives the slide itself, or a block beside it that is welded on.
    for (const char* driven : {"a", "b"})
        for (const char* method : {"bdf", "generalized_alpha", "radau"}) {
            const std::string trace = std::string(driven) + ", " + method;
            SCOPED_TRACE(trace);
            writeModel(
                "simflex: 1\n"
                "gravity: [0, -10, 0]\n"
                "bodies: {a: {mass: 2, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
                "joints:\n"
                "  a: {type: slider, axis: x, between: [ground, a], friction: {coulomb: 0.25, "
                "static: 0.35}}\n"
                "  b: {type: slider, axis: x, between: [ground, b]}\n"
                "  rod: {type: rod, between: [{on: a, position: [1, 0, 0]}, b]}\n"
                "motions: {drive: {joint: " +
                std::string(driven) +
                ", position: 'step(t, 0, 0, 0.2, 1) - step(t, 0.4, 0, 0.6, 1)'}}\n"
                "probes: {x: {coordinate: a}, f: {friction: a}}\n"
                "solver: {accuracy: 1e-8, method: " +
                std::string(method) + "}\n");
            Session session(loadModelText(folder / "model.yaml"));
            // At rest nothing pulls, and the force in the joint is any below 0.35 of its load.
            const auto expectForce = [&](double time, double force) {
                session.runTo(time, 0.05);
                EXPECT_NEAR(get(session, "f"), force, 1e-4) << time;
            };
            EXPECT_EQ(get(session, "f"), 0);
            expectForce(0.1, -0.25 * 20);
            EXPECT_NEAR(get(session, "x"), 0.5, 1e-8);
            expectForce(0.3, 0);
            expectForce(0.5, 0.25 * 20);
            expectForce(0.7, 0);
            EXPECT_NEAR(get(session, "x"), 0, 1e-8);
        }
}

TEST_F(LawsTest, AStaticSearchStaysOnItsSideOfAnAnchor) {
    // Newton's iteration leaps over the anchor from more than twice the length at rest.
    for (const double anchor : {1.0, 1.78, 3.1, 5.0, 20.0}) {
        writeModel(
            "simflex: 1\n"
            "parameters: {anchor: " +
            std::to_string(anchor) +
            "}\n"
            "bodies: {a: {mass: 1, inertia: [1, 1, 1]}}\n"
            "joints: {s: {type: slider, axis: x, between: [ground, a]}}\n"
            "connectors: {push: {type: actuator, between: [{on: ground, position: [anchor, 0, 0]}, "
            "a], law: '10*(1/length - 1/1.5)'}}\n"
            "probes: {x: {coordinate: s}}\n"
            "analyses: {rest: {type: static}}\n");
        ASSERT_EQ(runModel(), 0) << err;
        EXPECT_NEAR(find(read("rest"), "x").rows.back()[0], anchor - 1.5, 1e-9) << anchor;
        EXPECT_EQ(err.find("leaps to another equilibrium") != std::string::npos, anchor > 3) << err;
    }
}

TEST_F(LawsTest, WhatStuckAgainTearsOffWhereItsLoadSays) {
    // Slides where 3 sin 2t exceeds μ m g, until the impulses balance: 0.436953 m each way.
    for (const char* interval : {"0.2", "0.1"}) {
        writeModel(
            "simflex: 1\n"
            "gravity: [0, -g, 0]\n"
            "bodies: {a: {mass: 1, shape: {box: [0.3, 0.1, 0.1]}}}\n"
            "joints: {s: {type: slider, axis: x, between: [ground, a], friction: {coulomb: 0.2}}}\n"
            "loads: {p: {on: a, force: ['3*sin(2*t)', 0, 0]}}\n"
            "probes: {x: {coordinate: s}, f: {friction: s}}\n"
            "analyses: {run: {type: transient, duration: 20, interval: " +
            std::string(interval) + "}}\n");
        ASSERT_EQ(runModel(), 0) << err;
        EXPECT_NEAR(find(read("run"), "x").rows.back()[0], 0.214398, 4e-5) << interval;
        const auto friction = find(read("run"), "f").rows;
        for (const auto& row : friction)
            EXPECT_LT(std::abs(row[0]), 1.0001 * 0.2 * 9.80665) << interval;
    }
}

TEST_F(LawsTest, FrictionOfADrivenMechanismFollowsTheLoadItMakes) {
    // A motion-driven crank moves a slider against 1000 N; nearly massless. Once with joints that
    // are redundant out of the plane.
    const std::pair<const char*, const char*> joints[] = {{"pin, axis: z", "pin, axis: z"},
                                                          {"cylinder, axis: z", "ball"}};
    for (const auto& [crankPin, gudgeonPin] : joints) {
        writeModel(
            std::string(
                "simflex: 1\n"
                "parameters: {a: 0.1, l: 0.3}\n"
                "bodies:\n"
                "  cr: {mass: 1e-4, shape: {box: [0.1, 0.01, 0.01]}, place: {position: [a/2, 0, "
                "0]}}\n"
                "  ro: {mass: 1e-4, shape: {box: [0.3, 0.01, 0.01]}, place: {position: "
                "[a+l/2, 0, 0]}}\n"
                "  sl: {mass: 1e-4, shape: {box: [0.03, 0.03, 0.03]}, place: {position: [a+l, "
                "0, 0]}}\n"
                "joints:\n"
                "  A: {type: pin, axis: z, between: [ground, {on: cr, position: [-a/2, 0, "
                "0]}]}\n"
                "  B: {type: ") +
            crankPin +
            ", between: [{on: cr, position: [a/2, 0, 0]}, {on: ro, position: [-l/2, 0, 0]}]}\n"
            "  C: {type: " +
            gudgeonPin +
            ", between: [{on: ro, position: [l/2, 0, 0]}, sl]}\n"
            "  S: {type: slider, axis: x, between: [ground, sl], friction: {coulomb: 1}}\n"
            "motions: {m: {joint: A, position: t}}\n"
            "loads: {p: {on: sl, force: [-1000, 0, 0]}}\n"
            "probes: {T: {driving: m}, n: {friction: S, what: load}, f: {friction: S}}\n"
            "analyses: {run: {type: transient, duration: 6, interval: 0.1}}\n");
        ASSERT_EQ(runModel(), 0) << err;
        const auto n = find(read("run"), "n").rows, f = find(read("run"), "f").rows;
        for (size_t k = 1; k < n.size(); ++k) {
            const double q = 0.1 * double(k), sine = std::sin(q) / 3,
                         slope = sine / std::sqrt(1 - sine * sine);
            // On the return, friction acts against the load; on the way out, with it.
            EXPECT_NEAR(n[k][0], 1000 * std::abs(slope) / (1 + slope), 1) << gudgeonPin << q;
            EXPECT_NEAR(std::abs(f[k][0]), n[k][0], 1e-3 * n[k][0]) << gudgeonPin << q;
        }
    }
}

TEST_F(LawsTest, WhatRubsMayBeginWithACoordinateAndARate) {
    writeModel(
        "simflex: 1\n"
        "gravity: [0, -10, 0]\n"
        "bodies: {b: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}}}\n"
        "joints: {s: {type: slider, axis: x, between: [ground, b], friction: {coulomb: 0.2}}}\n"
        "initial: {joints: {s: 0.5}, rates: {s: 3}}\n"
        "probes: {x: {coordinate: s}}\n"
        "analyses: {run: {type: transient, duration: 2}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_NEAR(find(read("run"), "x").rows.back()[0], 0.5 + 9. / 4, 1e-5);
}

TEST_F(LawsTest, AReactionKnowsWhatALockCarries) {
    writeModel(
        "simflex: 1\n"
        "bodies: {b: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}}}\n"
        "joints: {s: {type: slider, axis: x, between: [ground, b]}}\n"
        "loads: {p: {on: b, force: [10, 0, 0]}}\n"
        "events: {lk: {when: 't > 0.5', do: [{lock: s}]}}\n"
        "probes: {r: {reaction: s, component: x}}\n"
        "analyses: {run: {type: transient, duration: 1, interval: 0.2}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    const auto rows = find(read("run"), "r").rows;
    EXPECT_NEAR(rows[2][0], 0, 1e-9);
    EXPECT_NEAR(rows[4][0], -10, 1e-6);
}

TEST_F(LawsTest, WhereNothingCanVibrateOtherAnalysesAreDone) {
    writeModel(
        "simflex: 1\n"
        "bodies: {b: {mass: 2, shape: {box: [0.1, 0.1, 0.1]}}}\n"
        "joints: {s: {type: slider, axis: x, between: [ground, b], friction: {coulomb: 0.2}}}\n"
        "analyses: {e: {type: eigen}, run: {type: transient, duration: 1}}\n");
    EXPECT_NE(runModel(), 0);
    EXPECT_THAT(err, HasSubstr("no natural frequencies, as nothing in it is free to move"));
    EXPECT_TRUE(read("run").isComplete);
}

TEST_F(LawsTest, WhatIsArbitraryAtTheStartIsToldThoughAnEventEndsIt) {
    // Friction in two pins moves a welded pair together until it is separated.
    writeModel(
        "simflex: 1\n"
        "bodies:\n"
        "  w: {mass: 2, shape: {cylinder: [0.1, 0.02]}}\n"
        "  u: {mass: 2, shape: {cylinder: [0.1, 0.02]}}\n"
        "joints:\n"
        "  p: {type: pin, axis: z, between: [ground, w], friction: {coulomb: 0.1, radius: 0.05}}\n"
        "  q: {type: pin, axis: z, between: [ground, u], friction: {coulomb: 0.3, radius: 0.05}}\n"
        "  c: {type: weld, between: [w, u]}\n"
        "loads: {d: {on: w, torque: [0, 0, 10], force: [0, -100, 0]}}\n"
        "events: {r: {when: 't > 0.5', do: [{release: c}]}}\n"
        "analyses: {run: {type: transient, duration: 1}}\n");
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(out, HasSubstr("the friction of 'p', 'q' depends on what it leaves undetermined"));
}

TEST_F(LawsTest, AStartAtRestSaysThatFrictionHadNoPartInIt) {
    writeModel(
        "simflex: 1\ngravity: [0, -g, 0]\n"
        "bodies: {bar: {mass: 1, shape: {box: [1, 0.1, 0.1]}}}\n"
        "joints: {p: {type: pin, axis: z, between: [ground, {on: bar, position: [-0.5, 0, 0]}],\n"
        "             friction: {coulomb: 0.3, radius: 0.2}}}\n"
        "initial: {start: static, joints: {p: -1.5}}\n"
        "analyses: {run: {type: transient, duration: 0.1}}\n");
    ASSERT_EQ(runModel("-q"), 0) << err;
    EXPECT_THAT(out + err, HasSubstr("found without the friction of 'p'"));
}

TEST_F(LawsTest, RunsSayWhatBecomesOfFriction) {
    writeModel("simflex: 1\n" +
               makeIncline(", friction: {coulomb: 0.3, static: 0.5}",
                           "connectors: {hold: {type: spring, between: [{on: ground, position: "
                           "[-1, 0, 0]}, block], stiffness: 100}}\n"
                           "analyses:\n"
                           "  rest: {type: static}\n"
                           "  run: {type: transient, duration: 0.1}\n"
                           "probes: {x: {position: block, component: x}, rub: {friction: "
                           "slide}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_THAT(err, HasSubstr("rest: is found without the friction of 'slide'"));
    EXPECT_NEAR(find(read("rest"), "x").rows[0][0], 0.02 * 9.81 * std::sin(std::atan(0.4)), 1e-9);
    EXPECT_EQ(find(read("rest"), "rub").rows[0][0], 0);
    EXPECT_NEAR(find(read("run"), "x").rows.back()[0], 0, 1e-15);
}

TEST_F(LawsTest, WrongFrictionIsRefusedByName) {
    const auto tell = [&](const std::string& friction) {
        return findMistake(makeIncline(", friction: " + friction));
    };
    EXPECT_THAT(tell("{coulomb: -0.1}"),
                HasSubstr("model.yaml:6:78: joints.slide.friction.coulomb"));
    EXPECT_THAT(
        tell("{coulomb: 0.2, static: 0.1}"),
        HasSubstr("friction of joint 'slide': the coefficient of static friction is 0.1; it "
                  "must not be below that of Coulomb friction"));
    EXPECT_THAT(tell("{coulomb: 0.2, radius: 0.1}"), HasSubstr("a Slider has none"));
    EXPECT_THAT(tell("{radius: 0.1}"), HasSubstr("give 'coulomb', 'static' or 'viscous'"));
    EXPECT_THAT(tell("{coulom: 0.1}"), HasSubstr("did you mean 'coulomb'"));
    EXPECT_THAT(findMistake(makeIncline("", "probes: {rub: {friction: slide}}\n")),
                HasSubstr("joint 'slide' has no friction"));
    const auto tellOf = [&](const std::string& joint) {
        return findMistake(
            "bodies: {block: {mass: 2, shape: {box: [1, 1, 1]}}}\n"
            "joints: {seat: {between: [ground, block], " +
            joint + "}}\n");
    };
    EXPECT_THAT(tellOf("type: weld, friction: {coulomb: 0.1}"),
                HasSubstr("joints.seat.friction: 'friction' is for type pin, ball"));
    EXPECT_THAT(tellOf("type: pin, friction: {coulomb: 0.1}"),
                HasSubstr("a Pin with dry friction needs that of its bearing"));
}

/** Returns `count` probes, each made of the previous two. **/
std::string makeChain(int count) {
    std::string text = "probes:\n  p0: {expression: f(t)}\n  p1: {expression: p0}\n";
    for (int k = 2; k < count; ++k)
        text += "  p" + std::to_string(k) + ": {expression: p" + std::to_string(k - 1) + " + p" +
                std::to_string(k - 2) + "}\n";
    return text;
}

TEST_F(LawsTest, ProbesThatManyAreMadeOfAreEvaluatedOnce) {
    int numCalls = 0;
    ModelText text;
    text.path = folder / "model.yaml";
    text.text = "simflex: 1\nbodies: {a: {mass: 1, inertia: [1, 1, 1]}}\n" + makeChain(60);
    text.functions["f"] = {1, 1, [&](const double*, int) {
                               ++numCalls;
                               return 1.0;
                           }};
    const auto built = std::make_shared<const Model>(readModel(text), ModelOptions());
    const model::Probes probes = model::Probes::make(built);
    const SimTK::State state = built->makeInitialState();
    built->getSystem().realize(state, SimTK::Stage::Velocity);
    numCalls = 0;
    const SimTK::Vector none;
    const std::vector<double> values = probes.calc({state, none, none, 0});
    EXPECT_EQ(values.back(), 1548008755920);  // Fibonacci's
    EXPECT_EQ(numCalls, 1);
}

TEST_F(LawsTest, LawsMadeOfTooManyFormulasAreRefused) {
    const auto make = [](int count) {
        return "bodies: {a: {mass: 1, inertia: [1, 1, 1]}}\n"
               "loads: {push: {on: a, force: [p" +
               std::to_string(count - 1) + ", 0, 0]}}\n" +
               std::regex_replace(makeChain(count), std::regex("f\\(t\\)"), "t");
    };
    EXPECT_EQ(findMistake(make(15)), "nothing");
    EXPECT_THAT(findMistake(make(60)), HasSubstr("more than 100000 formulas"));
}

}  // namespace
}  // namespace simflex
