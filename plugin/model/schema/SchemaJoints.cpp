/** @file
Sections of the schema: joints, motions, loads, connectors, initial values. **/

#include "simflex/model/schema/SchemaForms.h"

namespace simflex {
namespace model {
namespace forms {

namespace {

SchemaKey between(const std::string& meaning) {
    return SchemaKey("between", {list(frame(), {2})}, meaning).such("[ground, crank.shaft]");
}

/** A joint by name, or {joint:, coordinate:}. **/
Forms jointCoordinate() {
    return {name("a joint"),
            map("a joint's coordinate",
                {
                    SchemaKey("joint", {name("a joint")}, "Joint.").required().such("bearing"),
                    SchemaKey("coordinate", {integer(0, 5)}, "Number of the coordinate, from 0.")
                        .orElse("0")
                        .such("1"),
                })};
}

SchemaForm friction() {
    return map(
        "friction",
        {
            SchemaKey("coulomb", {number(0)}, "Coefficient of sliding friction.")
                .orElse("0")
                .such("0.1"),
            SchemaKey("static", {number(0)},
                      "Coefficient of static friction, up to which the joint sticks.")
                .orElseNote("as coulomb")
                .such("0.12"),
            SchemaKey("viscous", {number(0)},
                      "Viscous friction per unit of speed (m/s for slider, cylinder and screw, "
                      "rad/s for pin, ball and universal).")
                .in("N s/m, N m s/rad")
                .orElse("0")
                .such("0.05"),
            SchemaKey("radius", {number(0)},
                      "Radius of the bearing, or mean radius of the thread; not of a slider.")
                .in("m")
                .orElse("0")
                .such("0.01"),
            SchemaKey("axial_radius", {number(0)},
                      "Mean radius of the collar that carries a pin's axial force.")
                .in("m")
                .orElse("0")
                .such("0.015"),
        });
}

SchemaForm joint() {
    const std::vector<std::string> paired{
        "ball",   "pin",   "slider",        "weld",           "cylinder", "universal",
        "planar", "screw", "point_on_line", "point_in_plane", "rod"};
    const std::vector<std::string> laid(paired.begin(), paired.end() - 1);  // all except rods
    std::vector<std::string> types = paired;
    types.insert(types.end(), {"gear", "coupler"});
    return map(
        "a joint",
        {
            SchemaKey("type", {choice(types)}, "Kind of the joint.").required().such("pin"),
            between("The two frames it joins: F, then M.").only(paired).required(),
            SchemaKey("axis", axis(),
                      "Direction in Ground, at the placement, of the joint's axis (z of a pin, "
                      "cylinder or screw, x of a slider) or of the normal of a plane (z).")
                .only({"pin", "slider", "cylinder", "universal", "planar", "screw", "point_on_line",
                       "point_in_plane"})
                .orElseNote("the frames' own")
                .such("z"),
            SchemaKey(
                "as_placed", {boolean()},
                "Makes M coincide with F as the bodies are placed, so that all coordinates begin "
                "at zero and assembly moves nothing: a weld holds the bodies as they are.")
                .only(laid)
                .orElse("false")
                .such("true"),
            SchemaKey("pitch", {number()}, "Advance per radian.")
                .in("m/rad")
                .only({"screw"})
                .required()
                .such("0.002/(2*pi)"),
            SchemaKey("length", {positive()}, "Length of the rod.")
                .in("m")
                .only({"rod"})
                .orElseNote("the distance at the placement")
                .such("0.25"),
            SchemaKey("friction", {friction()},
                      "Dry friction due to the joint's own force: its radial part times radius "
                      "(pin, cylinder), the whole force times radius (ball, universal), its part "
                      "across a slide or along a screw. The joint's moments do not count.")
                .only({"pin", "ball", "slider", "cylinder", "universal", "screw"})
                .such("{coulomb: 0.1, static: 0.12, radius: 0.01}"),
            SchemaKey("wheels", {list(jointCoordinate(), {2})},
                      "The two joints whose angles are coupled.")
                .only({"gear"})
                .required()
                .such("[input, output]"),
            SchemaKey(
                "teeth", {list({integer()}, {2})},
                "Numbers of teeth of the wheels; both rotate in the same sense if one is negative.")
                .only({"gear"})
                .required()
                .such("[17, 43]"),
            SchemaKey("phase", {number()}, "Angle of the mesh at zero coordinates.")
                .in("rad")
                .only({"gear"})
                .orElse("0")
                .such("0.1"),
            SchemaKey(
                "terms",
                {list({map(
                    "a term",
                    {
                        SchemaKey("joint", {name("a joint")}, "Joint.").required().such("bearing"),
                        SchemaKey("coordinate", {integer(0, 5)},
                                  "Number of the coordinate, from 0.")
                            .orElse("0")
                            .such("1"),
                        SchemaKey("coefficient", {number()}, "Factor.").required().such("-2"),
                    })})},
                "Terms of the sum of coordinates that is kept at zero.")
                .only({"coupler"})
                .required()
                .such("[{joint: a, coefficient: 1}, {joint: b, coefficient: -2}]"),
            SchemaKey("constant", {number()}, "Constant of the sum.")
                .only({"coupler"})
                .orElse("0")
                .such("0.1"),
        });
}

SchemaForm motion() {
    return map("a motion",
               {
                   SchemaKey("joint", {name("a joint")}, "Joint whose coordinate is driven.")
                       .with({"position"})
                       .such("main_bearing"),
                   SchemaKey("coordinate", {integer(0, 5)}, "Number of the coordinate, from 0.")
                       .with({"joint"})
                       .orElse("0")
                       .such("1"),
                   between("The two frames that move relative to each other: F, then M.")
                       .without({"joint"}),
                   SchemaKey("axis", axis(), "Axis of F along which M is displaced.")
                       .with({"position"})
                       .without({"joint"})
                       .orElse("x")
                       .such("y"),
                   SchemaKey("position", {function()}, "Coordinate of the joint, or displacement.")
                       .in("rad or m")
                       .with({"joint", "between"})
                       .such("150*t"),
                   SchemaKey("angle", {function()}, "Rotation of M about z of F.")
                       .in("rad")
                       .with({"between"})
                       .such("2*pi*t"),
               },
               {"position", "angle"});
}

SchemaForm load() {
    const std::vector<std::string> point{"force", "torque"},
        nodes{"pressure", "traction", "total_force"};
    return map(
        "a load",
        {
            SchemaKey("on", frame(), "Frame that the force or torque acts on.")
                .with(point)
                .such("tip"),
            SchemaKey("force", {laws3()}, "Force.")
                .in("N")
                .with({"on"})
                .such("[0, -100*sin(20*t), 0]"),
            SchemaKey("torque", {laws3()}, "Torque.")
                .in("N m")
                .with({"on"})
                .such("[0, 0, engine(t)]"),
            SchemaKey("axes", {choice({"ground", "frame"})}, "Axes of force and torque.")
                .with({"on"})
                .orElse("ground")
                .such("frame"),
            SchemaKey("body", {name("a flexible body")}, "Flexible body that the load acts on.")
                .with({"pressure", "traction", "total_force", "modes"})
                .such("casing"),
            SchemaKey("nodes", {text(), list({integer(0)})}, "Node set, or node numbers.")
                .with(nodes)
                .such("SEAT"),
            SchemaKey("pressure", {law()},
                      "Pressure, acting inwards; on whole shells against their normal.")
                .in("Pa")
                .with({"body"})
                .such("1e5*engine(t)"),
            SchemaKey("traction", {vec3()}, "Force per unit area, in the body's axes.")
                .in("Pa")
                .with({"body"})
                .without({"pressure"})
                .such("[0, 0, 1000]"),
            SchemaKey("total_force", {vec3()},
                      "Total force, distributed over the nodes, in the body's axes.")
                .in("N")
                .with({"body"})
                .without({"pressure", "traction"})
                .such("[0, 0, 500]"),
            SchemaKey("modes", {numbered("modes", {number()})},
                      "Modal forces, by mode number from 1.")
                .with({"body"})
                .without({"pressure", "traction", "total_force"})
                .such("{3: 1.0}"),
            SchemaKey("scale", {law()}, "Factor.")
                .with({"traction", "total_force", "modes"})
                .orElse("1")
                .such("sin(100*t)"),
        },
        {"on", "body"});
}

SchemaForm connector() {
    return map(
        "a connector",
        {
            SchemaKey(
                "type",
                {choice({"spring", "bushing", "torsion_spring", "stop", "actuator", "motor"})},
                "Kind of the connector; a stop keeps M's origin at z > 0 of F.")
                .required()
                .such("spring"),
            between("The two frames it connects: F, then M.")
                .only({"spring", "bushing", "torsion_spring", "stop", "actuator"})
                .required(),
            SchemaKey("joint", jointCoordinate(), "Joint whose coordinate the motor drives.")
                .only({"motor"})
                .required()
                .such("shoulder"),
            SchemaKey("stiffness", {number(0), list({number(0)}, {6})},
                      "Stiffness (spring, stop: N/m; torsion_spring: "
                      "N m/rad; bushing: [rx, ry, rz, x, y, z]).")
                .in("N/m, N m/rad")
                .only({"spring", "bushing", "torsion_spring", "stop"})
                .such("1e5"),
            SchemaKey(
                "law", {law({"length", "rate", "angle", "speed"})},
                "Force as a formula, instead of stiffness and damping: the tension of a spring or "
                "the thrust of an actuator as a function of length and rate; the torque of a "
                "torsion spring against the angle, or of a motor along its joint's coordinate (a "
                "force, on a slider), as a function of angle and speed (length and rate).")
                .in("N, N m")
                .only({"spring", "torsion_spring", "actuator", "motor"})
                .without({"stiffness", "damping"})
                .such("\"2e4*max(0, length - 0.3) + 50*rate\""),
            SchemaKey("damping", {number(0), list({number(0)}, {6})},
                      "Damping (spring: N s/m; torsion_spring: N m s/rad; "
                      "bushing: six).")
                .in("N s/m, N m s/rad")
                .only({"spring", "torsion_spring", "bushing"})
                .orElse("0")
                .such("20"),
            SchemaKey("free_length", {number(0)}, "Length at zero force.")
                .in("m")
                .only({"spring"})
                .without({"law"})
                .orElseNote("the distance at the placement")
                .such("0.2"),
            SchemaKey("free_angle", {number()},
                      "Angle at zero torque. A run begins on the revolution nearest to it.")
                .in("rad")
                .only({"torsion_spring"})
                .without({"law"})
                .orElse("0")
                .such("0.1"),
            SchemaKey("dissipation", {number(0)}, "Dissipation coefficient of Hunt and Crossley.")
                .in("s/m")
                .only({"stop"})
                .orElse("0")
                .such("0.5"),
        });
}

SchemaForm input() {
    return map("an input",
               {
                   SchemaKey("start", {number()}, "Value at the start.").orElse("0").such("0.5"),
                   SchemaKey("unit", {text()}, "Unit of the input.").orElse("''").such("N m"),
               });
}

SchemaKey takes(const std::string& example) {
    return SchemaKey("input", {law()}, "Input.").required().such(example);
}

SchemaForm state() {
    const SchemaForm coefficients = list({number()}), matrix = list({coefficients});
    return map(
        "a state",
        {
            SchemaKey("rate", {law()}, "Rate of change: a first-order equation.")
                .in("1/s")
                .such("\"target - angle\""),
            SchemaKey("initial", {number()}, "Value at the start.")
                .with({"rate"})
                .orElse("0")
                .such("0.1"),
            SchemaKey("scale", {positive()},
                      "Change that counts as much as a metre in error control.")
                .orElse("1")
                .such("100"),
            SchemaKey("pid",
                      {map("a controller",
                           {
                               takes("\"target - angle\""),
                               SchemaKey("proportional", {number()}, "Gain on the input.")
                                   .orElse("0")
                                   .such("400"),
                               SchemaKey("integral", {number()}, "Gain on the input's integral.")
                                   .in("1/s")
                                   .orElse("0")
                                   .such("100"),
                               SchemaKey("derivative", {number()}, "Gain on the input's rate.")
                                   .in("s")
                                   .with({"filter"})
                                   .orElse("0")
                                   .such("30"),
                               SchemaKey("filter", {positive()},
                                         "Time constant of the filter of the input's rate.")
                                   .in("s")
                                   .with({"derivative"})
                                   .such("1e-3"),
                           })},
                      "A proportional, integral and derivative controller of its input.")
                .such("{input: \"0.5 - angle\", proportional: 400}"),
            SchemaKey("low_pass",
                      {map("a filter",
                           {
                               takes("speed"),
                               SchemaKey("time_constant", {positive()}, "Time constant.")
                                   .in("s")
                                   .required()
                                   .such("0.01"),
                           })},
                      "First-order low-pass filter of the input; begins at the input's value.")
                .such("{input: speed, time_constant: 0.01}"),
            SchemaKey("lead_lag",
                      {map("a filter",
                           {
                               takes("\"target - angle\""),
                               SchemaKey("lead", {number(0)}, "Time constant of the numerator.")
                                   .in("s")
                                   .required()
                                   .such("0.1"),
                               SchemaKey("lag", {positive()}, "Time constant of the denominator.")
                                   .in("s")
                                   .required()
                                   .such("0.01"),
                           })},
                      "(1 + lead s)/(1 + lag s) of the input; begins at rest.")
                .such("{input: error, lead: 0.1, lag: 0.01}"),
            SchemaKey("transfer_function",
                      {map("a transfer function",
                           {
                               takes("error"),
                               SchemaKey("numerator", {coefficients},
                                         "Coefficients, of the highest power of s first.")
                                   .required()
                                   .such("[1]"),
                               SchemaKey("denominator", {coefficients},
                                         "Coefficients, of the highest power of s first; no fewer "
                                         "than in the numerator.")
                                   .required()
                                   .such("[0.01, 0.2, 1]"),
                           })},
                      "Rational function of s, applied to the input; all of its states begin at "
                      "zero.")
                .such("{input: error, numerator: [1], denominator: [0.01, 0.2, 1]}"),
            SchemaKey(
                "rate_limit",
                {map("a limit",
                     {
                         takes("target"),
                         SchemaKey("rise", {positive()}, "Largest rate of increase.")
                             .in("1/s")
                             .required()
                             .such("0.5"),
                         SchemaKey("fall", {positive()}, "Largest rate of decrease.")
                             .in("1/s")
                             .orElseNote("as rise")
                             .such("2"),
                         SchemaKey(
                             "time_constant", {positive()},
                             "Time constant with which the state follows the input within these "
                             "rates.")
                             .in("s")
                             .required()
                             .such("1e-3"),
                     })},
                "The input with limited rate of change; begins at the input's value.")
                .such("{input: target, rise: 0.5, time_constant: 1e-3}"),
            SchemaKey("state_space",
                      {map("a linear system",
                           {
                               SchemaKey("inputs", {list({law()})}, "Inputs u.")
                                   .required()
                                   .such("[angle, speed]"),
                               SchemaKey("outputs", {list({name("an output")})},
                                         "Names of the outputs y; laws use them as STATE.OUTPUT.")
                                   .required()
                                   .such("[torque]"),
                               SchemaKey("A", {matrix}, "x' = A x + B u: a row for each x.")
                                   .required()
                                   .such("[[0, 1], [-4, -2]]"),
                               SchemaKey("B", {matrix}, "A row for each x, a column for each u.")
                                   .required()
                                   .such("[[0, 0], [1, 0.1]]"),
                               SchemaKey("C", {matrix},
                                         "y = C x + D u: a row for each y, a column for each x.")
                                   .required()
                                   .such("[[5, 0]]"),
                               SchemaKey("D", {matrix}, "A row for each y, a column for each u.")
                                   .orElseNote("0")
                                   .such("[[0, 2]]"),
                               SchemaKey("initial", {list({number()})}, "x at the start.")
                                   .orElseNote("0")
                                   .such("[1, 0]"),
                           })},
                      "A linear system of several inputs and outputs.")
                .such("{inputs: [error], outputs: [u], A: [[-1]], B: [[1]], C: [[3]]}"),
            SchemaKey("sample_and_hold",
                      {map("a sampled value",
                           {
                               takes("angle"),
                               SchemaKey("period", {positive()}, "Time between samples.")
                                   .in("s")
                                   .required()
                                   .such("0.01"),
                           })},
                      "The input at t = 0, period, 2 period …, held in between. It may name "
                      "itself, with its previous value: a discrete controller. Samples at the same "
                      "time all take the values from before it.")
                .such("{input: angle, period: 0.01}"),
            SchemaKey("hysteresis",
                      {map("a relay",
                           {
                               takes("speed"),
                               SchemaKey("lower", {number()},
                                         "Threshold of the input below which the state becomes 0.")
                                   .required()
                                   .such("18"),
                               SchemaKey("upper", {number()},
                                         "Threshold of the input above which the state becomes 1.")
                                   .required()
                                   .such("22"),
                               SchemaKey("initial", {integer(0, 1)},
                                         "Value at the start if the input is between the "
                                         "thresholds.")
                                   .orElse("0")
                                   .such("1"),
                           })},
                      "A relay between two thresholds: 0 or 1.")
                .such("{input: speed, lower: 18, upper: 22}"),
        },
        {"rate", "pid", "low_pass", "lead_lag", "transfer_function", "rate_limit", "state_space",
         "sample_and_hold", "hysteresis"});
}

SchemaForm controller() {
    SchemaForm inputs = entries("inputs", {law()}), start = entries("start values", {number()});
    inputs.hasTexts = start.hasTexts = true;
    return map(
        "a controller",
        {
            SchemaKey(
                "fmu", {file("an FMU")},
                "FMU for co-simulation (FMI 2.0 or 3.0): a program, run only with --allow-fmus.")
                .required()
                .such("controller.fmu"),
            SchemaKey("inputs", {inputs},
                      "Values of the FMU's inputs, by their names in the FMU, such as \"y[1]\".")
                .such("{angle: \"angle - target\"}"),
            SchemaKey("outputs", {list({name("an output")}), entries("outputs", {text()})},
                      "Outputs of the FMU, which laws use as CONTROLLER.OUTPUT; to rename them: "
                      "{OUTPUT: NAME_IN_THE_FMU}.")
                .required()
                .such("[torque]"),
            SchemaKey("period", {positive()}, "Time between two samples.")
                .in("s")
                .required()
                .such("1e-3"),
            SchemaKey("start", {start},
                      "Values of the FMU's parameters, and of inputs before the "
                      "start.")
                .such("{gain: 400}"),
        });
}

SchemaForm event() {
    return map(
        "an event",
        {
            SchemaKey("when", {law()}, "Comparison; the event happens when it becomes true.")
                .required()
                .such("height < 0"),
            SchemaKey("once", {boolean()}, "Happens only the first time.")
                .orElse("false")
                .such("true"),
            SchemaKey("do",
                      {list({map(
                          "an action",
                          {
                              SchemaKey("stop", {boolean()}, "Ends the analysis.").such("true"),
                              SchemaKey("set", {name("a state")},
                                        "State with its own rate equation that is set to a value.")
                                  .with({"to"})
                                  .such("charge"),
                              SchemaKey("to", {law()}, "New value of the state.")
                                  .with({"set"})
                                  .such("charge - 1"),
                              SchemaKey("release", {name("a joint or motion")},
                                        "Joint or motion that is released.")
                                  .such("clamp"),
                              SchemaKey("engage", {name("a joint or motion")},
                                        "Joint or motion that is engaged again where it is closed.")
                                  .such("clamp"),
                              SchemaKey("lock", {name("a joint")},
                                        "Joint that is locked at its present coordinates.")
                                  .such("hinge"),
                              SchemaKey("unlock", {name("a joint")}, "Joint that is unlocked.")
                                  .such("hinge"),
                          },
                          {"stop", "set", "release", "engage", "lock", "unlock"})})},
                      "Actions, in this order.")
                .such("[{release: clamp}]"),
        });
}

SchemaForm initial() {
    const Forms values{number(), list({number()})};
    return map(
        "initial values",
        {
            SchemaKey(
                "bodies",
                {entries(
                    "bodies",
                    {map("initial values of a body",
                         {
                             SchemaKey("velocity", {vec3()},
                                       "Velocity of the body's frame, in Ground.")
                                 .in("m/s")
                                 .orElse("[0, 0, 0]")
                                 .such("[1, 0, 0]"),
                             SchemaKey("angular_velocity", {vec3()}, "Angular velocity, in Ground.")
                                 .in("rad/s")
                                 .orElse("[0, 0, 0]")
                                 .such("[0, 0, 10]"),
                             SchemaKey("modes", {numbered("modes", {number()})},
                                       "Modal coordinates, numbered from 1.")
                                 .in("m kg^0.5")
                                 .such("{1: 1e-4}"),
                             SchemaKey("modal_speeds", {numbered("modes", {number()})},
                                       "Rates of the modal coordinates.")
                                 .in("m kg^0.5/s")
                                 .such("{1: 0.1}"),
                             SchemaKey("coordinates", values,
                                       "Coordinates of a rigid body's mobilizer.")
                                 .in("rad or m")
                                 .such("[0.3]"),
                             SchemaKey("rates", values, "Speeds of a rigid body's mobilizer.")
                                 .in("rad/s or m/s")
                                 .such("[10]"),
                         })})},
                "Initial values of bodies.")
                .such("{rod: {velocity: [1, 0, 0]}}"),
            SchemaKey("joints", {entries("joints", values)},
                      "Coordinates of joints; assembly keeps them as closely as it can.")
                .in("rad or m")
                .such("{main_bearing: [0.3]}"),
            SchemaKey("rates", {entries("rates", values)}, "Rates of the coordinates of joints.")
                .in("rad/s or m/s")
                .such("{main_bearing: 150}"),
            SchemaKey("start", {choice({"as_placed", "static", "steady"})},
                      "State in which analyses begin: as placed and assembled, at static "
                      "equilibrium, or in steady motion.")
                .orElse("as_placed")
                .such("static"),
        });
}

}  // namespace

std::vector<SchemaKey> makeJointKeys() {
    return {
        SchemaKey("joints", {entries("joints", {joint()})}, "Joints between frames.")
            .such("{main_bearing: {type: pin, between: [ground, crank.shaft]}}"),
        SchemaKey("motions", {entries("motions", {motion()})}, "Prescribed motions.")
            .such("{drive: {joint: main_bearing, position: 150*t}}"),
        SchemaKey("loads", {entries("loads", {load()})}, "Forces, torques, pressures.")
            .such("{push: {on: tip, force: [0, 0, 100]}}"),
        SchemaKey("connectors", {entries("connectors", {connector()})},
                  "Springs, bushings, stops, actuators, motors.")
            .such("{strut: {type: spring, between: [ground, rod.tip], stiffness: 1e5}}"),
        SchemaKey("inputs", {entries("inputs", {number(), input()})},
                  "Quantities set from outside while the model moves, by Session::set(), at the "
                  "prompt, from Python or by another simulator, or their values at the start. Laws "
                  "and expressions use them by name.")
            .such("{push: {start: 0, unit: N}}"),
        SchemaKey("states", {entries("states", {state()})},
                  "Equations in addition to those of motion: controllers, filters. Laws and "
                  "expressions use them by name.")
            .such("{integral: {rate: \"target - angle\"}}"),
        SchemaKey("controllers", {entries("controllers", {controller()})},
                  "FMUs that sample the motion and act on it; their outputs are held between "
                  "samples. Laws and expressions use these outputs.")
            .such("{pid: {fmu: controller.fmu, inputs: {angle: angle}, outputs: [torque], period: "
                  "1e-3}}"),
        SchemaKey("events", {entries("events", {event()})},
                  "Actions when a condition becomes true, at a time located within the accuracy. "
                  "In laws the name of an event is the number of times it has happened.")
            .such("{landed: {when: height < 0, do: [stop: true]}}"),
        SchemaKey("initial", {initial()}, "Values at the start.").such("{start: static}"),
    };
}

}  // namespace forms
}  // namespace model
}  // namespace simflex
