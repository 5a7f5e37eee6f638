/** @file
Model errors are reported with their place and the remedy. **/

#include "BuiltModel.h"

namespace simflex::test {
namespace {

class ModelErrors : public BuiltModelTest {
protected:
    /** The whole message, without the folder of the test. **/
    std::string tell(const std::string& text) {
        std::string message = messageOf(text);
        const std::string path = folder.path() + "/";
        for (size_t at; (at = message.find(path)) != std::string::npos;)
            message.erase(at, path.size());
        return message;
    }
};

struct Mistake {
    std::string text, told;
};

TEST_F(ModelErrors, OfBodiesAreNamedWithTheirPlace) {
    const std::vector<Mistake> mistakes = {
        {"bodies: {a: {part: bra}}",
         "model.yaml:3:20: bodies.a.part: there is no part 'bra'; did you mean 'bar'?"},
        {"bodies: {a: {color: red}}",
         "model.yaml:3:13: bodies.a: a rigid body needs mass and inertia, or a shape with density "
         "or mass (or `part`, for a flexible one)"},
        {"bodies: {a: {mass: 1}}",
         "model.yaml:3:20: bodies.a.mass: the body needs its inertia as well, or a shape to take "
         "it from"},
        {"bodies: {a: {mass: 1, inertia: [1, 2, 4]}}",
         "model.yaml:3:32: bodies.a.inertia: no body has this inertia: its principal moments are "
         "1, 2 and 4 kg m², and the largest is more than the other two together"},
        {"bodies: {a: {mass: 1, inertia: [1, -2, 4]}}",
         "model.yaml:3:32: bodies.a.inertia: the inertia is not positive: its principal moments "
         "are -2, 1 and 4 kg m²"},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], color: blu}}",
         "model.yaml:3:50: bodies.a.color: there is no colour 'blu'; did you mean 'blue'?"},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], color: '#12'}}",
         "model.yaml:3:51: bodies.a.color: '#12' is not a color: write '#rrggbb' with hexadecimal "
         "digits"},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], shape: {sphere: 1}, density: 3}}",
         "model.yaml:3:63: bodies.a.density: 'density' and 'mass' exclude each other: give one of "
         "them"},
        {"bodies: {a: {mass: 1, inertia: [1, 1, 1], color: [0.5, 1.5, 0]}}",
         "model.yaml:3:56: bodies.a.color.1: found 1.5; allowed is from 0 to 1"},
        {"bodies: {a: {inertia: [1, 1, 1]}}",
         "model.yaml:3:14: bodies.a.inertia: 'inertia' has a meaning only together with mass"},
        {"bodies: {a: {mass: 1, inertia: [1, 1]}}",
         "model.yaml:3:32: bodies.a.inertia: the list has 2 values; it must have 3 or 6, for "
         "example [1e-4, 1e-4, 2e-4]"},
        {"bodies: {a: {mass: 0, inertia: [1, 1, 1]}}",
         "model.yaml:3:20: bodies.a.mass: found 0; allowed is greater than 0"},
        {"bodies: {a: {mass: 1, center_of_mass: [1, 0, 0], shape: {sphere: 1}}}",
         "model.yaml:3:23: bodies.a.center_of_mass: 'center_of_mass' has a meaning only together "
         "with inertia"},
        {"bodies: {a: {density: 1}}",
         "model.yaml:3:14: bodies.a.density: 'density' has a meaning only together with shape"},
        {"bodies: {a: {density: 1, shape: []}}",
         "model.yaml:3:33: bodies.a.shape: the list is empty"},
        {"bodies: {a: {part: bar, mass: 1}}",
         "model.yaml:3:25: bodies.a.mass: 'mass' and 'part' exclude each other: give one of them"},
        {"bodies: {a: {part: bar, damping: [0.1, 0.2]}}",
         "model.yaml:3:34: bodies.a.damping: there are 2 damping ratios; 'a' has 7 modes"},
        {"bodies: {a: {part: bar, stiffening: true}}",
         "model.yaml:3:37: bodies.a.stiffening: FlexibleBody 'a': its part 'masses5' has no "
         "geometric stiffness; reduce it with `simflex reduce --stiffening`, or with "
         "ReductionOptions::stiffening"},
        {"bodies: {a: {part: bar}, b: {mass: 1, inertia: [1, 1, 1], mobilizer: {parent: a}}}",
         "model.yaml:3:79: bodies.b.mobilizer.parent: 'a' is flexible, and mobilizers stand on "
         "rigid bodies: leave the mobilizer out and hold the body by a joint to a"},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: screw}}}",
         "model.yaml:3:54: bodies.b.mobilizer: 'pitch' is missing, which 'screw' needs: Advance of "
         "a screw per radian. For example pitch: 0.002/(2*pi)"},
        {"bodies: {a: {part: bar}}\nframes: {a: {on: ground}}",
         "model.yaml:4:13: frames.a: there is a body of this name too"},
        {"bodies: {a: {part: bar}}\nframes: {f: {on: a, node: 900}}\nloads: {l: {on: f, force: [1, "
         "0, 0]}}",
         "model.yaml:4:27: frames.f.node: 'a' has no node 900; they are from 1 to 16"},
        {"bodies: {a: {part: bar}}\ninitial: {bodies: {a: {modes: {9: 1}}}}",
         "model.yaml:4:35: initial.bodies.a.modes.9: '9' is not one of its modes, which are "
         "numbered from 1 to 7"},
        {"bodies: {a: {part: bar}}\ninitial: {bodies: {a: {coordinates: [1]}}}",
         "model.yaml:4:37: initial.bodies.a.coordinates: a body on a mobilizer of type free has no "
         "coordinates to set: use place"},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1], mobilizer: {type: ball}}}\n"
         "initial: {bodies: {b: {rates: [0, 0, 1]}}}",
         "model.yaml:4:31: initial.bodies.b.rates: a body on a mobilizer of type ball has no rates "
         "to set: use angular_velocity"},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1]}}\ninitial: {rates: {b: [0, 0, 1]}}",
         "model.yaml:4:22: initial.rates.b: 'b' is a body: its rates stand in initial.bodies.b"},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1]}}\njoints: {j: {type: ball, between: [ground, "
         "b]}}\ninitial: {rates: {j: [0, 0, 1]}}",
         "model.yaml:5:22: initial.rates.j: joints of its type have no rates: give a body "
         "'angular_velocity' in initial.bodies"},
        {"bodies: {b: {mass: 1, inertia: [1, 1, 1]}}\ninitial: {bodies: {b: {modes: {1: 1}}}}",
         "model.yaml:4:31: initial.bodies.b.modes: 'b' is rigid"},
    };
    for (const Mistake& mistake : mistakes) {
        EXPECT_EQ(tell(mistake.text), mistake.told) << mistake.text;
    }
}

TEST_F(ModelErrors, OfShapesAreNamedWithTheirPlace) {
    simflex::testing::writeText(folder / "surface.txt", "");
    const std::string before = "bodies: {a: {mass: 1, shape: ", place = "model.yaml:3:";
    const std::vector<Mistake> mistakes = {
        {"{box: [1, 0, 1]}", "40: bodies.a.shape.box.1: found 0; allowed is greater than 0"},
        {"{sphere: 1, box: [1, 1, 1]}",
         "30: bodies.a.shape: 'box' and 'sphere' exclude each other: give one of them"},
        {"{position: [1, 0, 0]}",
         "30: bodies.a.shape: one of these keys is needed: box, sphere, cylinder, mesh"},
        {"{sphere: 1, axis: x}",
         "42: bodies.a.shape.axis: 'axis' has a meaning only together with cylinder"},
        {"{sphere: 1, scale: 2}",
         "42: bodies.a.shape.scale: 'scale' has a meaning only together with mesh"},
        {"{sphere: 0}", "39: bodies.a.shape.sphere: found 0; allowed is greater than 0"},
        {"{cylinder: [1]}",
         "41: bodies.a.shape.cylinder: the list has 1 values; it must have 2, for example [0.01, "
         "0.2]"},
        {"{cylinder: [1, -2]}",
         "45: bodies.a.shape.cylinder.1: found -2; allowed is greater than 0"},
        {"{mesh: model.obj, scale: 0}",
         "55: bodies.a.shape.scale: found 0; allowed is greater than 0"},
        {"{mesh: surface.txt}",
         "37: bodies.a.shape.mesh: the mesh 'surface.txt' cannot be read: a surface is a file "
         ".stl, .obj or .vtp"},
    };
    for (const Mistake& mistake : mistakes) {
        EXPECT_EQ(tell(before + mistake.text + "}}"), place + mistake.told) << mistake.text;
    }
}

TEST_F(ModelErrors, OfFramesThatNothingUsesAreNamedWithTheirPlace) {
    EXPECT_EQ(tell("bodies: {wheel: {mass: 1, inertia: [1, 1, 1]}}\n"
                   "frames:\n  good: {on: wheel}\n  bad: {on: weel}\n"),
              "model.yaml:6:13: frames.bad.on: there is no frame 'weel'; did you mean 'wheel'?");
}

TEST_F(ModelErrors, OfJointsMotionsLoadsAndConnectorsAreNamedWithTheirPlace) {
    const std::string bodies = "bodies: {boom: {part: bar}, cart: {mass: 1, inertia: [1, 1, 1]}}\n";
    const std::string joint = "joints: {j: {type: pin, between: [ground, boom.A]}}\n";
    const std::vector<Mistake> mistakes = {
        {"joints: {j: {type: pin, between: [ground, boom.C]}}",
         "model.yaml:4:43: joints.j.between.1: there is no interface of 'boom' called 'C'; did you "
         "mean 'A'?"},
        {"joints: {j: {type: pin, between: [ground, bom.A]}}",
         "model.yaml:4:43: joints.j.between.1: there is no frame 'bom.A'; did you mean 'boom.A'?"},
        {"joints: {j: {type: pin, between: [boom.A, boom.B]}}",
         "model.yaml:4:34: joints.j.between: both frames are on 'boom'; they must be on two "
         "bodies"},
        {"joints: {j: {type: pin, between: [ground, {on: ground}]}}",
         "model.yaml:4:34: joints.j.between: both frames are on ground; they must be on two "
         "bodies"},
        {"joints: {j: {type: pin, between: [ground, boom]}}",
         "model.yaml:4:43: joints.j.between.1: 'boom' is flexible and can be held at its "
         "interfaces and nodes only: boom.A, boom.B, or {on: boom, node: NUMBER}"},
        {"loads: {l: {on: boom, force: [1, 0, 0]}}",
         "model.yaml:4:17: loads.l.on: 'boom' is flexible and can be held at its interfaces and "
         "nodes only: boom.A, boom.B, or {on: boom, node: NUMBER}"},
        {"joints: {j: {type: ball, axis: z, between: [ground, boom.A]}}",
         "model.yaml:4:26: joints.j.axis: 'axis' is for type pin, slider, cylinder, universal, "
         "planar, screw, point_on_line, point_in_plane, not for ball"},
        {"joints: {j: {type: screw, between: [ground, boom.A]}}",
         "model.yaml:4:13: joints.j: 'pitch' is missing, which 'screw' needs: Advance per radian. "
         "For example pitch: 0.002/(2*pi)"},
        {"joints: {j: {type: pin, between: [ground, cart.shaft]}}",
         "model.yaml:4:43: joints.j.between.1: there is no frame of the rigid body 'cart' called "
         "'cart.shaft'; there are ground, boom, boom.A, boom.B, cart"},
        {"joints: {j: {type: pin, between: [ground, boom.tip]}}",
         "model.yaml:4:43: joints.j.between.1: there is no interface of 'boom' called 'tip'; there "
         "are A, B"},
        {"joints: {j: {type: rod, between: [ground, cart]}}",
         "model.yaml:4:13: joints.j: its ends are at one point at the placement: give the length "
         "of the rod"},
        {joint + "motions: {m: {joint: k, position: t}}",
         "model.yaml:5:22: motions.m.joint: there is no joint 'k'; did you mean 'j'?"},
        {joint + "motions: {m: {joint: j, coordinate: 1, position: t}}",
         "model.yaml:5:37: motions.m.coordinate: joint 'j' has no coordinate 1; it has one, number "
         "0"},
        {joint + "motions: {m: {joint: j, position: t}, n: {joint: j, position: 2*t}}",
         "model.yaml:5:42: motions.n: coordinate 0 of 'j' is driven by motion 'm' already"},
        {joint + "motions: {m: {position: t}}",
         "model.yaml:5:15: motions.m.position: 'position' has a meaning only together with joint "
         "or "
         "between"},
        {joint + "motions: {m: {joint: j, between: [ground, cart], position: t}}",
         "model.yaml:5:25: motions.m.between: 'between' and 'joint' exclude each other: give one "
         "of them"},
        {"joints: {j: {type: ball, between: [ground, boom.A]}}\nmotions: {m: {joint: j, position: "
         "t}}",
         "model.yaml:5:22: motions.m.joint: joint 'j' has no coordinate 0; joints of its type have "
         "none"},
        {joint + "loads: {l: {on: ground, force: [1, 0, 0]}}",
         "model.yaml:5:17: loads.l.on: a load cannot act on ground"},
        {joint + "loads: {l: {on: cart}}",
         "model.yaml:5:13: loads.l.on: 'on' has a meaning only together with force or torque"},
        {joint + "loads: {l: {body: cart, nodes: END, pressure: 1}}",
         "model.yaml:5:19: loads.l.body: 'cart' is rigid: put a force `on` a frame of it"},
        {joint + "loads: {l: {body: boom, nodes: ENDD, pressure: 1}}",
         "model.yaml:5:32: loads.l.nodes: part 'masses5' has no node set 'ENDD'; it has: END"},
        {joint + "loads: {l: {body: boom, pressure: 1}}",
         "model.yaml:5:12: loads.l: say on which node set it acts: nodes: SET"},
        {joint + "loads: {l: {body: boom, modes: {8: 1}}}",
         "model.yaml:5:36: loads.l.modes.8: '8' is not one of its modes, which are numbered from 1 "
         "to 7"},
        {joint + "connectors: {c: {type: bushing, between: [ground, cart], stiffness: 4}}",
         "model.yaml:5:69: connectors.c.stiffness: it must have six numbers, for rotation about "
         "and translation along x, y and z; there are 1"},
        {joint + "connectors: {c: {type: stop, between: [ground, cart], stiffness: 0}}",
         "model.yaml:5:66: connectors.c.stiffness: the stiffness of a stop must be more than 0"},
        {joint + "joints2: {}", "model.yaml:5:1: unknown key 'joints2'; did you mean 'joints'?"},
        {"joints: {p: {type: pin, between: [ground, cart]}, "
         "g: {type: gear, wheels: [p, p], teeth: [1, 1]}}",
         "model.yaml:4:75: joints.g.wheels: 'p' cannot mesh with itself; name the joints of two "
         "wheels"},
        {"joints: {j: {type: gear, wheels: [j, j], teeth: [1, 2]}}",
         "model.yaml:4:35: joints.j.wheels.0: a joint cannot couple itself"},
        {"joints: {p: {type: pin, between: [ground, cart]}, s: {type: slider, between: [ground, "
         "boom.A]}, "
         "g: {type: gear, wheels: [p, s], teeth: [1, 2]}}",
         "model.yaml:4:100: joints.g: joint 'g' is a gear of a displacement; use a Coupler for a "
         "rack"},
    };
    for (const Mistake& mistake : mistakes) {
        EXPECT_EQ(tell(bodies + mistake.text), mistake.told) << mistake.text;
    }
}

}  // namespace
}  // namespace simflex::test
