/** @file
What is wrong with a model is told with its place and what would be right. **/

#include "BuiltModel.h"

namespace simflex::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using ModelErrors = BuiltModelTest;

struct Mistake {
    std::string text;
    std::vector<std::string> told;
};

TEST_F(ModelErrors, OfBodiesAreNamedWithTheirPlace) {
    const std::vector<Mistake> mistakes = {
        {"bodies: {a: {part: bra}}", {"model.yaml:3:", "bodies.a.part", "'bra'", "bar"}},
        {"bodies: {a: {color: red}}", {"bodies.a", "mass and inertia"}},
        {"bodies: {a: {mass: 1}}", {"inertia"}},
        {"bodies: {a: {mass: 1, inertia: [1, 2, 4]}}", {"bodies.a.inertia", "1, 2 and 4"}},
        {"bodies: {a: {mass: 1, inertia: [1, -2, 4]}}", {"not positive"}},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], color: blu}}", {"blue"}},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], color: '#12'}}", {"'#12'"}},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], shape: {sphere: 1}, density: 3}}", {"density"}},
        {"bodies: {a: {part: bar, mass: 1}}", {"mass", "part"}},
        {"bodies: {a: {part: bar, damping: [0.1, 0.2]}}", {"bodies.a.damping", "2", "7"}},
        {"bodies: {a: {part: bar, stiffening: true}}", {"bodies.a.stiffening", "stiffening"}},
        {"bodies: {a: {part: bar}, b: {mass: 1, inertia: [1, 1, 1], mobilizer: {parent: a}}}",
         {"'a' is flexible", "joint"}},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: screw}}}", {"pitch"}},
        {"bodies: {a: {part: bar}}\nframes: {a: {on: ground}}", {"frames.a"}},
        {"bodies: {a: {part: bar}}\nframes: {f: {on: a, node: 900}}\nloads: {l: {on: f, force: [1, "
         "0, 0]}}",
         {"model.yaml:4:", "no node 900", "1 to 16"}},
        {"bodies: {a: {part: bar}}\ninitial: {bodies: {a: {modes: {9: 1}}}}", {"'9'", "1 to 7"}},
        {"bodies: {a: {part: bar}}\ninitial: {bodies: {a: {coordinates: [1]}}}", {"free"}},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1]}}\ninitial: {bodies: {b: {modes: {1: 1}}}}",
         {"rigid"}},
    };
    for (const Mistake& mistake : mistakes) {
        const std::string message = messageOf(mistake.text);
        for (const std::string& told : mistake.told)
            EXPECT_THAT(message, HasSubstr(told)) << mistake.text;
    }
}

TEST_F(ModelErrors, OfFramesThatNothingUsesAreNamedWithTheirPlace) {
    EXPECT_THAT(messageOf("bodies: {wheel: {mass: 1, inertia: [1, 1, 1]}}\n"
                          "frames:\n  good: {on: wheel}\n  bad: {on: weel}\n"),
                AllOf(HasSubstr("model.yaml:6:"), HasSubstr("did you mean 'wheel'?")));
}

TEST_F(ModelErrors, OfJointsMotionsLoadsAndConnectorsAreNamedWithTheirPlace) {
    const std::string bodies = "bodies: {boom: {part: bar}, cart: {mass: 1, inertia: [1, 1, 1]}}\n";
    const std::string joint = "joints: {j: {type: pin, between: [ground, boom.A]}}\n";
    const std::vector<Mistake> mistakes = {
        {"joints: {j: {type: pin, between: [ground, boom.C]}}",
         {"model.yaml:4:", "joints.j.between", "'C'", "A"}},
        {"joints: {j: {type: pin, between: [ground, bom.A]}}", {"boom.A"}},
        {"joints: {j: {type: pin, between: [boom.A, boom.B]}}", {"'boom'", "two bodies"}},
        {"joints: {j: {type: pin, between: [ground, {on: ground}]}}", {"ground"}},
        {"joints: {j: {type: pin, between: [ground, boom]}}",
         {"'boom' is flexible", "boom.A", "boom.B", "node"}},
        {"loads: {l: {on: boom, force: [1, 0, 0]}}", {"loads.l.on", "'boom' is flexible"}},
        {"joints: {j: {type: ball, axis: z, between: [ground, boom.A]}}", {"axis"}},
        {"joints: {j: {type: screw, between: [ground, boom.A]}}", {"pitch"}},
        {"joints: {j: {type: pin, between: [ground, cart.shaft]}}", {"cart.shaft", "rigid"}},
        {"joints: {j: {type: pin, between: [ground, boom.tip]}}",
         {"there is no interface of 'boom' called 'tip'; there are A, B"}},
        {"joints: {j: {type: rod, between: [ground, cart]}}", {"length"}},
        {joint + "motions: {m: {joint: k, position: t}}",
         {"model.yaml:5:", "motions.m.joint", "'k'", "j"}},
        {joint + "motions: {m: {joint: j, coordinate: 1, position: t}}",
         {"motions.m.coordinate", "it has one"}},
        {joint + "motions: {m: {joint: j, position: t}, n: {joint: j, position: 2*t}}",
         {"motions.n", "'m'", "already"}},
        {joint + "motions: {m: {position: t}}", {"motions.m", "joint"}},
        {joint + "motions: {m: {joint: j, between: [ground, cart], position: t}}", {"motions.m"}},
        {"joints: {j: {type: ball, between: [ground, boom.A]}}\nmotions: {m: {joint: j, position: "
         "t}}",
         {"'j' has no coordinate 0", "have none"}},
        {joint + "loads: {l: {on: ground, force: [1, 0, 0]}}", {"ground takes no load"}},
        {joint + "loads: {l: {on: cart}}", {"force or torque"}},
        {joint + "loads: {l: {body: cart, nodes: END, pressure: 1}}", {"'cart' is rigid"}},
        {joint + "loads: {l: {body: boom, nodes: ENDD, pressure: 1}}",
         {"loads.l.nodes", "ENDD", "END"}},
        {joint + "loads: {l: {body: boom, pressure: 1}}", {"nodes"}},
        {joint + "loads: {l: {body: boom, modes: {8: 1}}}", {"1 to 7"}},
        {joint + "connectors: {c: {type: bushing, between: [ground, cart], stiffness: 4}}",
         {"six"}},
        {joint + "connectors: {c: {type: stop, between: [ground, cart], stiffness: 0}}",
         {"more than 0"}},
        {joint + "joints2: {}", {"joints2", "joints"}},
        {"joints: {j: {type: gear, wheels: [j, j], teeth: [1, 2]}}", {"couple itself"}},
        {"joints: {p: {type: pin, between: [ground, cart]}, s: {type: slider, between: [ground, "
         "boom.A]}, "
         "g: {type: gear, wheels: [p, s], teeth: [1, 2]}}",
         {"joints.g", "displacement"}},
    };
    for (const Mistake& mistake : mistakes) {
        const std::string message = messageOf(bodies + mistake.text);
        for (const std::string& told : mistake.told)
            EXPECT_THAT(message, HasSubstr(told)) << mistake.text;
    }
}

}  // namespace
}  // namespace simflex::test
