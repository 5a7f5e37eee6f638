/** @file
Every form of every key of the schema is read when the model is built, and unread ones are
refused. **/

#include <functional>
#include <set>

#include "BuiltModel.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/probes/Probe.h"

namespace simflex::test {
namespace {

using namespace simflex::model;
using ::testing::HasSubstr;

/** Only sections that are built at once: analyses, output and pictures are read when they run. **/
const char* const kSections[] = {"gravity", "parts",   "bodies",     "frames", "joints",
                                 "motions", "loads",   "connectors", "inputs", "states",
                                 "events",  "initial", "probes",     "solver"};

/** Keys that need a reduction, or a part with modal stress: covered by TestPartCache and
TestProbes. **/
bool isElsewhere(const std::string& path) {
    for (const char* begin : {"parts.NAME.", "probes.NAME.stress", "probes.NAME.strain"})
        if (path.rfind(begin, 0) == 0)
            return path != "parts.NAME.file" && path.rfind("parts.NAME.keep", 0) != 0;
    return false;
}

std::string describe(const SchemaForm& map, const std::string& key, const SchemaForm& form) {
    return map.title + ", " + key + " as " + std::to_string(int(form.kind)) + " (" + form.title +
           ")";
}

/** Describes the items of a list, and entries. **/
std::string describeItem(const SchemaForm& list, const SchemaForm& item,
                         const std::string& parent) {
    return parent + ", " + std::to_string(int(list.kind)) + " of " +
           std::to_string(int(item.kind)) + " (" + item.title + ")";
}

void collectWanted(const SchemaForm& form, const std::string& path, const std::string& name,
                   std::set<std::string>& wanted) {
    for (const SchemaKey& key : form.keys) {
        const std::string keyPath = path + (path.empty() ? "" : ".") + key.name;
        if (path.empty() &&
            std::find(std::begin(kSections), std::end(kSections), key.name) == std::end(kSections))
            continue;
        if (isElsewhere(keyPath)) continue;
        for (const SchemaForm& child : key.forms) {
            wanted.insert(describe(form, key.name, child));
            collectWanted(child, keyPath, form.title + ", " + key.name, wanted);
        }
    }
    for (const SchemaForm& item : form.items) {
        wanted.insert(describeItem(form, item, name));
        collectWanted(item, path + (form.kind == SchemaForm::Kind::List ? ".0" : ".NAME"), name,
                      wanted);
    }
}

void collectFound(const ModelValue::Node& node, const std::string& name,
                  std::set<std::string>& found) {
    for (const auto& [key, child] : node.entries) {
        const bool isMap = node.form->kind == SchemaForm::Kind::Map;
        found.insert(isMap ? describe(*node.form, key, *child->form)
                           : describeItem(*node.form, *child->form, name));
        collectFound(*child, isMap ? node.form->title + ", " + key : name, found);
    }
    for (const auto& item : node.items) {
        found.insert(describeItem(*node.form, *item->form, name));
        collectFound(*item, name, found);
    }
}

const char* const kPlaced = R"(
parameters: {k: 2e4}
gravity: [0, -g, 0]
parts:
  bar: {file: bar.h5, keep: all}
  stiffened: {file: stiffened.h5, keep: [1, 2, 3]}
  low: {file: bar.h5, keep: {lowest: 5}}
  band: {file: bar.h5, keep: {below: 1e9}}
bodies:
  a: {part: bar, rigid: false, stiffening: false, damping: 0.01, color: red, place: {position: [1, 0, 0], rotation: [0.1, 0, 0]}}
  b: {part: stiffened, damping: [0.01, 0.02, 0.03], color: [0.5, 0.5, 0.5], place: {position: [2, 0, 0], rotation: {axis: z, angle: 30*deg}}}
  c: {part: low, damping: by_frequency, place: {position: [3, 0, 0], rotation: {axis: [0, 0, 1], angle: 0.1}}}
  d: {part: band, damping: {rayleigh: [0.5, 1e-5]}, place: {position: [4, 0, 0], rotation: {quaternion: [1, 0, 0, 0]}}}
  e: {mass: 1, center_of_mass: [0, 0, 0.01], inertia: [0.01, 0.01, 0.01], shape: {box: [0.1, 0.1, 0.1], position: [0, 0, 0.01], rotation: [0, 0.1, 0]}}
  f:
    mass: 1
    inertia: [0.01, 0.01, 0.01, 0, 0, 0]
    shape: {mesh: corner.stl, scale: 1e-3, rotation: {axis: y, angle: 0.1}}
    mobilizer: {type: screw, pitch: 0.001, parent: ground, inboard: {position: [0, 1, 0], rotation: [0, 0, 0.1]}, outboard: {position: [0, 0, 0.1], rotation: {axis: x, angle: 0.1}}}
  g:
    shape: [{box: [0.1, 0.1, 0.1]}, {sphere: 0.05}, {cylinder: [0.05, 0.1], axis: x}]
    density: 1000
    color: '#c04020'
    place: {frame: {on: g, position: [0, 0, 0.1]}, at: {on: ground, position: [0, 2, 0]}}
  h: {mass: 1, inertia: [0.01, 0.01, 0.01], place: {frame: corner, at: ground}}
  i: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: pin, inboard: {rotation: {axis: y, angle: 0.1}}, outboard: {rotation: [0.1, 0, 0]}}}
frames:
  corner: {on: h, position: [0.1, 0, 0], rotation: [0, 0.1, 0]}
  tip: {on: a, node: 3, rotation: {axis: y, angle: 0.1}}
joints:
  p: {type: pin, between: [ground, {on: a.A, position: [0, 0, 0.01]}], axis: z, as_placed: true, friction: {coulomb: 0.1, static: 0.12, viscous: 0.01, radius: 0.02, axial_radius: 0.03}}
  q: {type: pin, between: [ground, b.A], axis: [0, 1, 0]}
  s: {type: screw, between: [ground, c.A], pitch: 0.001}
  r: {type: rod, between: [d.A, e], length: 0.25}
  gears: {type: gear, wheels: [p, {joint: q, coordinate: 0}], teeth: [17, 43], phase: 0.1}
  sum: {type: coupler, terms: [{joint: p, coordinate: 0, coefficient: 1}, {joint: s, coefficient: -2}], constant: 0.1}
motions:
  drive: {joint: p, coordinate: 0, position: 0.1*t}
  shake: {between: [ground, e], axis: y, position: 0.1*t}
  slant: {between: [ground, g], axis: [0, 0, 1], position: 0.1*t}
  turn: {between: [ground, {on: h, position: [0.1, 0, 0]}], angle: 0.1*t}
loads:
  push: {on: tip, force: [0, 1, t], torque: [t, 0, 0], axes: frame}
  pull: {on: {on: e, position: [0, 0, 0.1], rotation: [0.1, 0, 0]}, force: [1, 0, 0]}
  gas: {body: a, nodes: END, pressure: 1e5*t}
  shear: {body: a, nodes: END, traction: [0, 0, 1], scale: sin(t)}
  drag: {body: a, nodes: [1, 2], total_force: [0, 0, 1]}
  modal: {body: a, modes: {2: 1}, scale: t}
connectors:
  strut: {type: spring, between: [ground, b.B], stiffness: k, damping: 1, free_length: 0.1}
  mount: {type: bushing, between: [ground, {on: c.B, rotation: [0.1, 0, 0]}], stiffness: [1, 1, 1, 2, 2, 2], damping: [1, 1, 1, 2, 2, 2]}
  wind: {type: torsion_spring, between: [ground, e], stiffness: 1, free_angle: 0.1}
  bump: {type: stop, between: [ground, e], stiffness: 1e4, dissipation: 0.5}
  ram: {type: actuator, between: [ground, e], law: 100*(0.2 - length)}
  spun: {type: motor, joint: p, law: -0.1*t}
  turner: {type: motor, joint: {joint: q, coordinate: 0}, law: held + followed + shaped}
inputs:
  supplied: 0.5
  steered: {start: 0.1, unit: rad}
states:
  held: {rate: 0.5 - turned, initial: 0.1, scale: 2}
  driven: {rate: 1}
  followed: {pid: {input: turned, proportional: 1, integral: 2, derivative: 3, filter: 1e-3}}
  smooth: {low_pass: {input: turning, time_constant: 0.1}}
  quick: {lead_lag: {input: smooth, lead: 0.1, lag: 0.2}}
  shaped: {transfer_function: {input: quick, numerator: [1], denominator: [1, 2]}}
  limited: {rate_limit: {input: turned, rise: 1, fall: 2, time_constant: 0.1}}
  linear: {state_space: {inputs: [turned, limited], outputs: [out], A: [[-1]], B: [[1, 0]], C: [[2]], D: [[0, 0.1]], initial: [0.5]}}
  sampled: {sample_and_hold: {input: linear.out, period: 0.01}}
  relay: {hysteresis: {input: turned, lower: -1, upper: 1, initial: 1}}
events:
  begun: {when: t > 0.5, once: true, do: [{set: held, to: 2*t}, {release: drive}]}
  ended: {when: turned < 0 && t > 0.6, do: [{engage: drive}, {lock: s}, {unlock: s}, {stop: true}]}
initial:
  bodies:
    a: {velocity: [1, 0, 0], angular_velocity: [0, 0, 1], modes: {1: 1e-4}, modal_speeds: {2: 0.1}}
    f: {coordinates: 0.3, rates: 1}
    i: {coordinates: [0.3], rates: [1]}
  start: as_placed
probes:
  position: {position: tip, component: y, relative_to: {on: e, position: [1, 0, 0]}}
  velocity: {velocity: tip, relative_to: e}
  acceleration: {acceleration: tip}
  orientation: {orientation: tip}
  angular_velocity: {angular_velocity: tip}
  angular_acceleration: {angular_acceleration: tip}
  position_: {position: {on: a, node: 3, position: [0, 0, 1], rotation: {quaternion: [1, 0, 0, 0]}}}
  velocity_: {velocity: {on: e}}
  acceleration_: {acceleration: {on: e}}
  orientation_: {orientation: {on: e}}
  angular_velocity_: {angular_velocity: {on: e}}
  angular_acceleration_: {angular_acceleration: {on: e}}
  bent: {displacement: a.B}
  bent_node: {displacement: {body: a, node: 3}}
  bent_frame: {displacement: {on: a.B, position: [0, 0, 1], rotation: [0, 0, 0]}}
  bent_turned: {displacement: {on: a.B, rotation: {axis: z, angle: 0.1}}}
  most: {largest_displacement: a}
  shapes: {modes: a, select: [1, 2]}
  turned: {coordinate: p}
  angle_: {coordinate: {joint: p, coordinate: 0}}
  own: {coordinate: {body: f}}
  turning: {rate: p}
  rate_: {rate: {joint: p, coordinate: 0}}
  gap: {joint_error: p}
  far: {distance: [ground, {on: a.B, position: [0, 0, 0.1]}]}
  parting: {distance_rate: [ground, {on: a.B, position: [0, 0, 0.1]}]}
  kept: {state: held}
  rubbed: {friction: p, what: power}
  hold: {reaction: p, part: torque, on: F, axes: M}
  motor: {driving: drive}
  energy: {energy: kinetic, body: a}
  momentum: {momentum: angular, body: e}
  center: {center_of_mass: true}
  given: {function: sin(t), unit: N}
  both: {expression: position - 2*center.x}
solver: {method: bdf, accuracy: 1e-6, constraint_tolerance: 1e-10, formulation: index3, block_form: dense, maximum_order: 2, initial_step: 1e-5, maximum_step: 1e-3, minimum_step: 1e-12, threads: 2, maximum_iterations: 8}
)";

const char* const kLed = R"(
bodies:
  a: {mass: 1, inertia: [0.01, 0.01, 0.01]}
  b: {mass: 1, inertia: [0.01, 0.01, 0.01]}
joints:
  p: {type: pin, between: [ground, a]}
  q: {type: pin, between: [ground, b]}
initial: {joints: {p: 0.1, q: [0.2]}, rates: {p: [1], q: 2}}
solver: {method: generalized_alpha, spectral_radius: 0.8, fixed_step: 1e-4}
)";

class Forms : public BuiltModelTest {
protected:
    void SetUp() override {
        BuiltModelTest::SetUp();
        testing::writeText(folder / "corner.stl", R"(solid corner
facet normal 0 0 -1
outer loop
vertex 0 0 0
vertex 0 50 0
vertex 50 0 0
endloop
endfacet
endsolid corner
)");
    }

    /** Builds everything that can be built at once. **/
    std::shared_ptr<const Model> buildAll(const std::string& text) {
        std::shared_ptr<const Model> model = build(text);
        Probes::make(model);
        makeIntegrator(*model);
        return model;
    }
};

TEST_F(Forms, EveryFormOfEveryKeyIsRead) {
    std::set<std::string> wanted, found;
    collectWanted(getModelSchema(), "", "a model", wanted);
    for (const char* text : {kPlaced, kLed}) {
        const auto model = buildAll(text);
        for (const char* section : kSections) {
            const std::vector<ModelValue> unread = model->getFile().get(section).findUnread();
            EXPECT_TRUE(unread.empty()) << unread[0].getPath();
        }
        collectFound(model->getFile().getNode(), "a model", found);
    }
    for (const std::string& form : wanted)
        EXPECT_EQ(found.count(form), 1u) << "no model that is built here has " << form;
}

TEST_F(Forms, KeysWithoutEffectAreRefused) {
    const std::string model = R"(
bodies: {a: {mass: 1, inertia: [0.01, 0.01, 0.01]}}
joints: {p: {type: pin, between: [ground, a]}}
motions: {drive: {joint: p, position: t}}
)";
    const auto messageFor = [&](const std::string& probe) -> std::string {
        try {
            buildAll(model + "probes: {x: {" + probe + "}}\n");
        } catch (const ModelError& error) {
            return error.what();
        }
        return "";
    };
    const std::string place = folder / "model.yaml:7:";
    EXPECT_EQ(messageFor("driving: drive, component: x"),
              place +
                  "30: probes.x.component: 'component' has a meaning only together with "
                  "position or velocity or acceleration or orientation or angular_velocity or "
                  "angular_acceleration or displacement or reaction or momentum or center_of_mass");
    EXPECT_THAT(messageFor("driving: drive, part: torque"),
                HasSubstr("'part' has a meaning only together with reaction"));
    for (const char* kind : {"coordinate: p", "rate: p", "joint_error: p"})
        EXPECT_THAT(messageFor(std::string(kind) + ", component: y"),
                    HasSubstr("'component' has a meaning only together with position"));
}

TEST_F(Forms, WhatNobodyHasReadIsNamedWithItsPlace) {
    ModelText text;
    text.path = "model.yaml";
    text.text = "simflex: 1\nsolver: {accuracy: 1e-5, method: bdf}\ngravity: [0, 1, 2]\n";
    const ModelValue model = readModel(text);
    model.get("solver").get("method").getText();
    model.get("gravity").at(0).getNumber();
    EXPECT_THAT(model.get("solver").findUnread(), ::testing::SizeIs(1));
    try {
        model.get("gravity").checkRead();
        ADD_FAILURE() << "two numbers have not been read";
    } catch (const ModelError& error) {
        EXPECT_STREQ(error.what(),
                     "model.yaml:3:14: gravity.1: nothing reads this here, it has no effect: "
                     "remove it\nmodel.yaml:3:17: gravity.2: nothing reads this here, it has no "
                     "effect: remove it");
    }
    model.get("gravity").getVec3();
    EXPECT_NO_THROW(model.get("gravity").checkRead());
}

TEST_F(Forms, AListOfNodesIsLoadedAsTheSetOfThem) {
    const std::string bodies = "bodies: {a: {part: bar}}\n";
    const auto part = makeBar();
    std::string numbers;
    for (const int node : part->mesh.nodeSets.at("END"))
        numbers +=
            (numbers.empty() ? "" : ", ") + std::to_string(part->mesh.nodeNumbers[size_t(node)]);
    const auto load = [&](const std::string& nodes) {
        return build(bodies + "loads: {pull: {body: a, nodes: " + nodes +
                     ", total_force: [1, 2, 3]}}\n");
    };
    const auto asSet = load("END"), asList = load("[" + numbers + "]");
    EXPECT_EQ(compareAccelerations(asSet->getSystem(), asSet->makeInitialState(),
                                   asList->getSystem(), asList->makeInitialState()),
              0);
    EXPECT_THAT(messageOf(bodies + "loads: {pull: {body: a, nodes: [" + numbers +
                          ", 99999], total_force: [1, 2, 3]}}\n"),
                HasSubstr("loads.pull.nodes.4: "));
}

}  // namespace
}  // namespace simflex::test
