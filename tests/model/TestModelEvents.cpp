/** @file
Events of model files: their counts, and the use of counts in laws. **/

#include <cmath>
#include <cstdio>

#include "cli/run/RunTest.h"
#include "simflex/model/Session.h"

namespace simflex {
namespace {

class ModelEventTest : public RunTest {};

TEST_F(ModelEventTest, CountsOfEventsAreWholeInEveryRow) {
    for (const std::string method : {"radau", "bdf", "generalized_alpha"}) {
        writeModel("simflex: 1\nsolver: {method: " + method +
                   "}\n"
                   "bodies: {wheel: {mass: 10, inertia: [1, 1, 1]}}\n"
                   "joints: {shaft: {type: pin, axis: z, between: [ground, wheel]}}\n"
                   "initial: {rates: {shaft: 30}}\n"
                   "connectors: {brake: {type: motor, joint: shaft, law: "
                   "'floor(pulled)*(-2)*sign(speed, 0.02)'}}\n"
                   "states: {third: {sample_and_hold: {input: 'pulled + 1/3', period: 0.7}},\n"
                   "         on: {hysteresis: {input: t, lower: 0.5, upper: 0.8}}}\n"
                   "probes: {n: {expression: pulled}, kept: {expression: third}, switch: "
                   "{expression: on}}\n"
                   "events: {pulled: {when: t > 0.4}}\n");
        Session session(loadModelText(folder / "model.yaml"));
        for (double t = 0.401; t < 2; t += 0.00937) {
            session.runTo(t, t);
            EXPECT_EQ(session.get("n")[0], 1) << t;
            const double third = session.get("kept")[0], on = session.get("switch")[0];
            EXPECT_EQ(third, (t < 0.7 ? 0 : 1) + 1.0 / 3) << t;
            EXPECT_EQ(on, t < 0.8 ? 0 : 1) << t;
        }
    }
}

TEST_F(ModelEventTest, EventsHappenAgainHoweverSoonTheirConditionDoes) {
    for (const double size : {1e-5, 1e-7, 3e-9, 1e-9}) {
        char model[400];
        std::snprintf(model, sizeof model,
                      "simflex: 1\n"
                      "bodies: {a: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}}}\n"
                      "states: {q: {rate: 1, initial: %.17g}}\n"
                      "events: {e: {when: q > 0, do: [{set: q, to: %.17g}]}}\n"
                      "probes: {n: {expression: e}}\n",
                      -size, -size);
        writeModel(model);
        Session session(loadModelText(folder / "model.yaml"));
        const double end = 40.5 * size;
        session.runTo(end, end);
        EXPECT_EQ(session.get("n")[0], 40) << size;
    }
}

TEST_F(ModelEventTest, WhatRepeatsItselfIsNotLateByAnyMargin) {
    writeModel(
        "simflex: 1\n"
        "bodies: {a: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: slider}}}\n"
        "states: {q: {rate: 1, initial: -1e-9}}\n"
        "events: {e: {when: q > 0, do: [{set: q, to: -1e-9}]}}\n"
        "probes: {n: {expression: e}}\n");
    Session session(loadModelText(folder / "model.yaml"));
    session.runTo(2e-6 + 0.5e-9, 2e-6);
    EXPECT_EQ(session.get("n")[0], 2000);
}

}  // namespace
}  // namespace simflex
