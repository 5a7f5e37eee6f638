/** @file
Sections of the schema: solver, analyses, output, probes, pictures. **/

#include "simflex/model/schema/SchemaForms.h"

namespace simflex {
namespace model {
namespace forms {

namespace {

SchemaForm solver() {
    return map("the solver's settings",
               {
                   SchemaKey("method", {choice({"bdf", "generalized_alpha", "radau"})},
                             "Integration method.")
                       .orElse("radau")
                       .such("bdf"),
                   SchemaKey("accuracy", {positive()},
                             "Allowed local error of a step, as a displacement anywhere on a "
                             "body.")
                       .in("m")
                       .orElse("1e-6")
                       .such("1e-5"),
                   SchemaKey("constraint_tolerance", {positive()}, "Allowed error in the joints.")
                       .in("m, rad")
                       .orElseNote("1e-10, or a hundredth of the accuracy if that is less")
                       .such("1e-9"),
                   SchemaKey("formulation", {choice({"stabilized_index2", "index3"})},
                             "Form of the equations of motion; index3 only for bdf and "
                             "generalized_alpha.")
                       .orElse("stabilized_index2")
                       .such("index3"),
                   SchemaKey("block_form", {choice({"automatic", "arrow", "dense"})},
                             "Method of solving linear equations.")
                       .orElse("automatic")
                       .such("dense"),
                   SchemaKey("maximum_order", {integer(1, 5)},
                             "Highest order of bdf. Default: 2, or 5 if no part can bend.")
                       .such("2"),
                   SchemaKey("spectral_radius", {number(0, 1)},
                             "Damping of the highest frequencies by generalized_alpha: 1 none, "
                             "0 all.")
                       .such("0.8"),
                   SchemaKey("initial_step", {positive()}, "Size of the first step.")
                       .in("s")
                       .orElseNote("estimated")
                       .such("1e-5"),
                   SchemaKey("maximum_step", {positive()}, "Largest step size.")
                       .in("s")
                       .orElseNote("the analysis' interval")
                       .such("1e-3"),
                   SchemaKey("minimum_step", {positive()},
                             "Smallest step size; the run fails "
                             "below it.")
                       .in("s")
                       .orElseNote("set by rounding")
                       .such("1e-12"),
                   SchemaKey("fixed_step", {positive()},
                             "Constant step size without error control; accuracy then only "
                             "determines when the iteration stops.")
                       .in("s")
                       .without({"initial_step", "maximum_step", "minimum_step"})
                       .such("1e-4"),
                   SchemaKey("threads", {integer(1, 1024)},
                             "Number of threads that evaluate bodies; results do not depend on "
                             "it.")
                       .orElseNote("one for each core, where it pays")
                       .such("4"),
                   SchemaKey("maximum_iterations", {integer(1, 1000)},
                             "Largest number of Newton iterations in a step before it is "
                             "shortened.")
                       .such("8"),
               });
}

SchemaForm analysis() {
    SchemaForm swept = entries("parameters", numbersOrRange());
    swept.hasPaths = true;
    SchemaForm spectra = entries(
        "spectra",
        {number(0), map("a spectrum",
                        {
                            SchemaKey("frequencies", {list({number(0)})}, "Frequencies, ascending.")
                                .in("Hz")
                                .required()
                                .such("[10, 100, 1000]"),
                            SchemaKey("densities", {list({number(0)})},
                                      "Densities at these frequencies, interpolated linearly on "
                                      "logarithmic scales; zero outside.")
                                .in("unit²/Hz")
                                .required()
                                .such("[0.01, 0.1, 0.01]"),
                        })});
    spectra.hasPaths = true;
    return map(
        "an analysis",
        {
            SchemaKey("type",
                      {choice({"transient", "static", "eigen", "campbell", "linear",
                               "frequency_response", "sweep"})},
                      "Kind of the analysis.")
                .required()
                .such("transient"),
            SchemaKey("duration", {positive()}, "Duration of the motion.")
                .in("s")
                .only({"transient"})
                .required()
                .such("0.2"),
            SchemaKey("interval", {positive()}, "Time between rows of results.")
                .in("s")
                .only({"transient"})
                .orElseNote("a 200th of the duration")
                .such("1e-3"),
            SchemaKey("from", {choice({"start"}), name("an analysis")},
                      "State in which it begins: start, or the end of an earlier static or "
                      "transient analysis.")
                .only({"transient", "static"})
                .orElse("start")
                .such("rest"),
            SchemaKey(
                "path",
                {map(
                    "a path",
                    {
                        SchemaKey("step", {positive()},
                                  "Largest step between two points: how far a body turns or bends, "
                                  "relative to its size.")
                            .orElse("0.1")
                            .such("0.05"),
                        SchemaKey("points", {integer(2, 100000)},
                                  "Largest number of points; the last one is the result.")
                            .orElse("1000")
                            .such("200"),
                    })},
                "Follows the equilibria while gravity and all loads grow together from zero "
                "(arc-length method), also through limit points, where they must decrease, as in "
                "an arch that snaps through. Results contain the probes of every point, the load "
                "factor and the stability. Connectors and motions act in full throughout.")
                .only({"static"})
                .such("{step: 0.1}"),
            SchemaKey("about", {choice({"placed", "static"}), name("an analysis")},
                      "State about which the model is linearised: placed, "
                      "static (equilibrium), or the end of an earlier analysis.")
                .only({"eigen", "linear", "frequency_response"})
                .orElse("placed")
                .such("static"),
            SchemaKey("inputs", {list({text()})},
                      "Numbers of the model whose changes are inputs, by path: a load, a motion's "
                      "position, gravity, a parameter. The path of a list or map stands for all of "
                      "its numbers.")
                .only({"linear", "frequency_response"})
                .such("[loads.push.force.y]"),
            SchemaKey("outputs", {list({text()})},
                      "Probes, or their columns, that are observed; for eigen, probes whose shapes "
                      "are stored for each mode, by which simflex compare pairs modes.")
                .only({"linear", "frequency_response", "eigen"})
                .orElseNote("all; for eigen none")
                .such("[tip.x]"),
            SchemaKey("form", {choice({"full", "modal", "minimal"})},
                      "Form of the states: undamped modes, coupled by damping and gyroscopic "
                      "moments (full); uncoupled modes, so that A is block-diagonal (modal); only "
                      "the controllable and observable ones of these (minimal).")
                .only({"linear"})
                .orElse("full")
                .such("modal"),
            SchemaKey("modes", {integer(1, 100000)},
                      "Number of modes that are kept, the slowest; the others respond statically, "
                      "in D.")
                .only({"linear"})
                .with({"form"})
                .orElseNote("all")
                .such("12"),
            SchemaKey("up_to", {positive()}, "Frequency up to which modes are kept.")
                .in("Hz")
                .only({"linear"})
                .with({"form"})
                .orElseNote("all")
                .such("500"),
            SchemaKey("frequencies", numbersOrRange(),
                      "Frequencies at which inputs vary harmonically.")
                .in("Hz")
                .only({"frequency_response"})
                .required()
                .such("{from: 1, to: 1000, count: 50}"),
            SchemaKey("spacing", {choice({"logarithmic", "linear"})},
                      "Spacing of a range of frequencies.")
                .only({"frequency_response"})
                .orElse("logarithmic")
                .such("linear"),
            SchemaKey("adaptive", {boolean()},
                      "Adds frequencies in between where a response changes quickly, as at a "
                      "resonance.")
                .only({"frequency_response"})
                .orElse("true")
                .such("false"),
            SchemaKey(
                "unbalance",
                {map("an unbalance",
                     {
                         SchemaKey("on", frame(), "Frame that carries the unbalance.")
                             .required()
                             .such("rotor.disc"),
                         SchemaKey("moment", {positive()}, "Mass times distance from the axis.")
                             .in("kg m")
                             .required()
                             .such("1e-4"),
                         SchemaKey("axis", {choice({"x", "y", "z"})},
                                   "Axis of Ground about which it rotates, at the frequency of the "
                                   "response.")
                             .required()
                             .such("x"),
                     })},
                "A further input: the force of an unbalance.")
                .only({"frequency_response"})
                .such("{on: rotor.disc, moment: 1e-4, axis: x}"),
            SchemaKey("speed", {name("a parameter")},
                      "Parameter that is the angular velocity of the excitation: for each "
                      "frequency the model is rebuilt with 2π times that frequency, in its steady "
                      "motion.")
                .only({"frequency_response"})
                .without({"about", "shapes"})
                .such("speed"),
            SchemaKey("spectra", {spectra},
                      "One-sided power spectral densities of inputs, which are random and "
                      "independent; the results are densities and effective (RMS) values of the "
                      "outputs.")
                .only({"frequency_response"})
                .such("{loads.push.force.y: 0.01}"),
            SchemaKey("shapes", {list({number(0)})},
                      "Frequencies at which the deflection shapes are drawn, for each input.")
                .in("Hz")
                .only({"frequency_response"})
                .orElseNote("none")
                .such("[12.5]"),
            SchemaKey("count", {integer(1, 100000)}, "Number of frequencies.")
                .only({"eigen", "campbell"})
                .orElseNote("10 (eigen), up to 6 (campbell)")
                .such("10"),
            SchemaKey("participation", {boolean()},
                      "Reports the effective mass of each mode for base excitation along x, y and "
                      "z.")
                .only({"eigen"})
                .orElse("false")
                .such("true"),
            SchemaKey("matrices", {boolean()},
                      "Stores M, D, K and G of M δ̈ + D δ̇ + K δ + Gᵀ δλ = 0, G δ = 0 with the "
                      "modes.")
                .only({"eigen"})
                .orElse("false")
                .such("true"),
            SchemaKey("pictures", {boolean()}, "Draws the modes, or the equilibrium.")
                .only({"eigen", "static"})
                .orElse("false")
                .such("true"),
            SchemaKey("speeds", numbersOrRange(), "Values of the parameter, one after the other.")
                .in("rad/s")
                .only({"campbell"})
                .required()
                .such("{from: 0, to: 200, count: 5}"),
            SchemaKey("parameter", {name("a parameter")},
                      "Parameter of the model that is the rotation speed.")
                .only({"campbell"})
                .orElse("speed")
                .such("speed"),
            SchemaKey("analysis", {name("an analysis")},
                      "Analysis that runs for each choice of parameters.")
                .only({"sweep"})
                .required()
                .such("run"),
            SchemaKey("parameters", {swept},
                      "Values of each parameter, or of another number by its path.")
                .only({"sweep"})
                .required()
                .such("{speed: [50, 100], length: {from: 0.1, to: 0.2, count: 5}}"),
            SchemaKey("combine", {choice({"grid", "list"})},
                      "All combinations of the values (grid), or first with first, second with "
                      "second (list).")
                .only({"sweep"})
                .orElse("grid")
                .such("list"),
            SchemaKey("of", {list({text()})},
                      "Columns of the table: PROBE.maximum, .minimum, .mean, .rms, .final, .range.")
                .only({"sweep"})
                .orElseNote("maximum, minimum and final value of all")
                .such("[tip.maximum]"),
        });
}

SchemaForm resultOutput() {
    return map(
        "outputs",
        {
            SchemaKey("file", {output("a file for results")}, "Result file (HDF5).")
                .orElseNote("MODEL.results.h5 in the current folder")
                .such("crank.results.h5"),
            SchemaKey("csv", {boolean()},
                      "Writes the probes of each analysis to a CSV file as well.")
                .orElse("false")
                .such("true"),
            SchemaKey("states", {choice({"every", "none"})},
                      "Stores states, accelerations and joint forces at the times of output.")
                .orElse("every")
                .such("none"),
            SchemaKey("checkpoint", {number(0)},
                      "Wall-clock time between checkpoints, from which --resume continues; 0: "
                      "none.")
                .in("s")
                .orElse("30")
                .such("10"),
        });
}

/** Quantities that a probe may measure, of which exactly one is given. **/
const std::vector<std::string>& getQuantities() {
    static const std::vector<std::string> names{"position",
                                                "velocity",
                                                "acceleration",
                                                "orientation",
                                                "angular_velocity",
                                                "angular_acceleration",
                                                "displacement",
                                                "largest_displacement",
                                                "modes",
                                                "coordinate",
                                                "rate",
                                                "distance",
                                                "distance_rate",
                                                "state",
                                                "joint_error",
                                                "reaction",
                                                "friction",
                                                "driving",
                                                "stress",
                                                "strain",
                                                "energy",
                                                "momentum",
                                                "center_of_mass",
                                                "function",
                                                "expression"};
    return names;
}

SchemaForm probe() {
    const std::vector<std::string> kinematic{"position",         "velocity",
                                             "acceleration",     "orientation",
                                             "angular_velocity", "angular_acceleration"};
    std::vector<std::string> measured = kinematic;
    measured.push_back("displacement");
    std::vector<std::string> vectors = kinematic;
    vectors.insert(vectors.end(), {"displacement", "reaction", "momentum", "center_of_mass"});
    const Forms coordinate{
        name("a joint"),
        map("a coordinate",
            {
                SchemaKey("joint", {name("a joint")}, "Joint.").such("bearing"),
                SchemaKey("body", {name("a rigid body")},
                          "Rigid body, for a coordinate of its "
                          "mobilizer.")
                    .such("arm"),
                SchemaKey("coordinate", {integer(0, 6)}, "Number of the coordinate, from 0.")
                    .orElseNote("all")
                    .such("1"),
            },
            {"joint", "body"})};
    const auto recovered = [](const std::string& first, const std::string& other) {
        return map(
            "a place of " + first,
            {
                SchemaKey("body", {name("a flexible body")}, "Flexible body, reduced with stress.")
                    .required()
                    .such("rod"),
                SchemaKey("node", {integer(0)}, "Node of its part.").such("4711"),
                SchemaKey(
                    "side", {choice({"top", "bottom", "middle"})},
                    "Of a shell's node: the side that its normal points to, the other, or the "
                    "mean of both.")
                    .such("top"),
                SchemaKey(
                    "worst", {boolean()},
                    "Takes the largest value of all nodes; for components (what: xx) the largest "
                    "in magnitude.")
                    .orElse("false")
                    .such("true"),
                SchemaKey("what",
                          {choice({"von_mises", "signed_von_mises", "principal_1", "principal_2",
                                   "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"})},
                          "Component or " + other + ".")
                    .orElse("von_mises")
                    .such("principal_1"),
            });
    };
    return map(
        "a probe",
        {
            SchemaKey("position", frame(), "Position of a frame.").in("m").such("tip"),
            SchemaKey("velocity", frame(), "Velocity of a frame.").in("m/s").such("tip"),
            SchemaKey("acceleration", frame(), "Acceleration of a frame.").in("m/s^2").such("tip"),
            SchemaKey("orientation", frame(), "Body-fixed x-y-z angles of a frame.")
                .in("rad")
                .such("tip"),
            SchemaKey("angular_velocity", frame(), "Angular velocity of a frame.")
                .in("rad/s")
                .such("tip"),
            SchemaKey("angular_acceleration", frame(), "Angular acceleration of a frame.")
                .in("rad/s^2")
                .such("tip"),
            SchemaKey(
                "displacement",
                {name("a frame"),
                 map("a frame or node",
                     {
                         SchemaKey("on", {name("a frame")}, "Frame to which this one is fixed.")
                             .such("rod.big_end"),
                         SchemaKey("body", {name("a flexible body")}, "Flexible body.")
                             .with({"node"})
                             .such("rod"),
                         SchemaKey("node", {integer(0)}, "Node of its part.").such("4711"),
                         SchemaKey("position", {vec3()},
                                   "Position of the origin in the frame it is fixed to.")
                             .in("m")
                             .with({"on"})
                             .orElse("[0, 0, 0]")
                             .such("[0, 0, 0.1]"),
                         SchemaKey("rotation", rotation(),
                                   "Orientation relative to the frame it is fixed to.")
                             .in("rad")
                             .with({"on"})
                             .orElse("[0, 0, 0]")
                             .such("[0, 0, 30*deg]"),
                     },
                     {"on", "body"})},
                "Elastic displacement of a frame or node, relative to the body's mean-axis frame "
                "(in which its support moves as well) or, with relative_to, to that frame.")
                .in("m")
                .such("{body: rod, node: 4711}"),
            SchemaKey(
                "largest_displacement", {name("a flexible body")},
                "Largest elastic displacement of a body's nodes, relative to its mean-axis frame.")
                .in("m")
                .such("rod"),
            SchemaKey("modes", {name("a flexible body")}, "Modal coordinates of a body.")
                .such("rod"),
            SchemaKey("coordinate", coordinate,
                      "Coordinates of a joint or of a rigid body's mobilizer. In a motion, angles "
                      "count revolutions.")
                .in("rad or m")
                .such("main_bearing"),
            SchemaKey("rate", coordinate, "Rates of those coordinates.")
                .in("rad/s or m/s")
                .such("main_bearing"),
            SchemaKey("distance", {list(frame(), {2})},
                      "Distance between the origins of two frames.")
                .in("m")
                .such("[ground, crane.tip]"),
            SchemaKey("distance_rate", {list(frame(), {2})},
                      "Rate of change of that distance, positive where they move apart.")
                .in("m/s")
                .such("[ground, crane.tip]"),
            SchemaKey("state", {name("a state")}, "Value of a state, or output of a controller.")
                .such("integral"),
            SchemaKey("joint_error", {name("a joint")}, "Constraint error of a joint.")
                .in("m, rad")
                .such("main_bearing"),
            SchemaKey("reaction", {name("a joint")},
                      "Force or torque of a joint, its friction included.")
                .in("N, N m")
                .such("main_bearing"),
            SchemaKey("friction", {name("a joint")}, "Friction of a joint.").such("main_bearing"),
            SchemaKey("what", {choice({"force", "load", "rate", "power"})},
                      "Force or torque on M along the sliding direction, the normal load, the "
                      "sliding speed, or the power of friction, negative where it dissipates.")
                .with({"friction"})
                .orElse("force")
                .such("load"),
            SchemaKey("driving", {name("a motion")},
                      "Force that a motion requires, or torque where it drives an angle.")
                .in("N, N m")
                .such("drive"),
            SchemaKey("stress", {recovered("stress", "invariant of the stress")},
                      "Stress at a node, or the largest of all nodes.")
                .in("Pa")
                .such("{body: rod, worst: true}"),
            SchemaKey("strain", {recovered("strain", "invariant of the strain")},
                      "Strain at a node, or the largest of all nodes.")
                .such("{body: rod, node: 4711, what: xx}"),
            SchemaKey("energy",
                      {choice({"kinetic", "potential", "strain", "total", "work", "balance"})},
                      "Energy of the model or of a body; work of loads and dampers since the "
                      "start; balance: total minus work, which stays at its initial value.")
                .in("J")
                .such("total"),
            SchemaKey("momentum", {choice({"linear", "angular"})},
                      "Linear momentum, or angular momentum about Ground's origin.")
                .in("kg m/s, kg m^2/s")
                .such("linear"),
            SchemaKey("center_of_mass", {boolean()}, "Centre of mass of all bodies.")
                .in("m")
                .such("true"),
            SchemaKey("function", {function()}, "Function of time.").such("engine(t)"),
            SchemaKey("expression", {formula()},
                      "Formula of other probes, states, parameters and t.")
                .such("slider.x - 2*crank.x"),
            SchemaKey("component", {choice({"x", "y", "z", "norm", "all"})},
                      "Component of a vector that is kept.")
                .with(vectors)
                .orElse("all")
                .such("norm"),
            SchemaKey("relative_to", frame(),
                      "Frame relative to which, and in whose axes, it is measured; for a "
                      "displacement another frame of the same body, such as its support.")
                .with(measured)
                .orElseNote("ground; for a displacement the body's mean-axis frame")
                .such("crank"),
            SchemaKey("select", {list({integer(1)})}, "Modes that are recorded, numbered from 1.")
                .with({"modes"})
                .orElseNote("all")
                .such("[1, 2]"),
            SchemaKey("part", {choice({"force", "torque"})}, "Force or torque.")
                .with({"reaction"})
                .orElse("force")
                .such("torque"),
            SchemaKey("on", {choice({"M", "F"})}, "Frame of the joint that the reaction acts on.")
                .with({"reaction"})
                .orElse("M")
                .such("F"),
            SchemaKey("axes", {choice({"ground", "F", "M"})}, "Axes of the reaction.")
                .with({"reaction"})
                .orElse("ground")
                .such("F"),
            SchemaKey("body", {name("a body")}, "Body whose energy or momentum is recorded.")
                .with({"energy", "momentum"})
                .orElseNote("all bodies")
                .such("rod"),
            SchemaKey("unit", {text()}, "Unit of a formula, for plots and tables.")
                .with({"function", "expression", "state"})
                .orElse("''")
                .such("mm"),
        },
        getQuantities());
}

SchemaForm pictures() {
    const Forms direction{choice({"x", "y", "z"}), vec3()};
    SchemaForm camera = map(
        "a camera",
        {
            SchemaKey("name", {text()}, "Name of the camera.").such("side"),
            SchemaKey(
                "view",
                {choice({"front", "back", "left", "right", "side", "top", "bottom", "isometric"})},
                "Direction of view; the model fills the picture.")
                .without({"position"})
                .such("isometric"),
            SchemaKey("position", {vec3()}, "Position of the camera.")
                .in("m")
                .with({"look_at"})
                .such("[1, 1, 1]"),
            SchemaKey("look_at", {vec3()}, "Point that the camera looks at.")
                .with({"position"})
                .in("m")
                .such("[0, 0, 0]"),
            SchemaKey("up", direction, "Direction that is up in the picture.")
                .with({"position"})
                .orElseNote("up of the pictures")
                .such("z"),
            SchemaKey(
                "follow", frame(),
                "Frame that the camera follows; its origin stays at one place in the picture.")
                .such("slider"),
            SchemaKey("height", {positive()}, "Height of the view at the frame followed.")
                .in("m")
                .with({"follow"})
                .without({"position"})
                .orElseNote("the whole model fits")
                .such("0.1"),
            SchemaKey("orbit", {number()},
                      "Angular velocity of the camera about the point it looks at.")
                .in("rad/s of simulated time")
                .orElse("0")
                .such("0.5"),
            SchemaKey("perspective", {number(1e-3, 3.1)},
                      "Perspective, with this vertical field of view.")
                .in("rad")
                .without({"orthographic"})
                .orElseNote("30*deg, with a position 45*deg")
                .such("50*deg"),
            SchemaKey("orthographic", {boolean()}, "Parallel view.").orElse("false").such("true"),
            SchemaKey("inset", {list({number(0, 1)}, {4})},
                      "Place in the picture, on top of the other cameras, with a border: [left, "
                      "top, width, height] as fractions.")
                .orElseNote("the whole picture, shared evenly by the cameras without inset")
                .such("[0.7, 0, 0.3, 0.3]"),
        });
    SchemaForm plot = map(
        "a plot", {
                      SchemaKey("probes", {list({text()})}, "Probes, or their columns as probe.x.")
                          .required()
                          .such("[tip.x]"),
                      SchemaKey("title", {text()}, "Title.").orElse("''").such("Tip"),
                  });
    SchemaForm look = map(
        "how a body is drawn",
        {
            SchemaKey("visible", {boolean()},
                      "Draws the body; its joints and forces are drawn in any case.")
                .orElse("true")
                .such("false"),
            SchemaKey("opacity", {number(0.01, 1)}, "Opacity of the body.").orElse("1").such("0.3"),
            SchemaKey("color", {color(), list({number(0, 1)}, {3})},
                      "Color, instead of the body's own color and the contour.")
                .such("'#c04020'"),
        });
    return map(
        "settings of pictures",
        {
            SchemaKey("size", {list({integer(16, 16384)}, {2})}, "Width and height, without plots.")
                .in("pixels")
                .orElse("[1280, 720]")
                .such("[1920, 1080]"),
            SchemaKey("rate", {positive()}, "Frames per second of the video.")
                .in("1/s")
                .orElse("30")
                .such("25"),
            SchemaKey("slow_motion", {positive()}, "Seconds of video for one simulated second.")
                .orElse("1")
                .such("100"),
            SchemaKey("folder", {output("a folder for pictures")}, "Folder for single pictures.")
                .orElseNote("MODEL.frames in the current folder; none if there is a video")
                .such("frames"),
            SchemaKey("video", {output("a video file"), list({output("a video file")})},
                      "Videos: .mp4, .gif or .webp.")
                .such("run.mp4"),
            SchemaKey("contour",
                      {choice({"none", "displacement", "displacement_x", "displacement_y",
                               "displacement_z", "speed", "strain_energy", "von_mises",
                               "signed_von_mises", "principal_1", "principal_3"})},
                      "Quantity that colors flexible bodies.")
                .orElse("displacement")
                .such("von_mises"),
            SchemaKey("range", {choice({"run", "frame"}), list({number()}, {2})},
                      "Range of the colors: over all pictures of the run, over each picture, or "
                      "[lowest, highest].")
                .orElse("run")
                .such("[0, 1e8]"),
            SchemaKey("exaggeration", {choice({"auto"}), positive()},
                      "Exaggeration of the elastic displacement drawn, except in pictures of "
                      "modes; auto: large enough to be seen, 1000 at most. Joints stay closed.")
                .orElse("auto")
                .such("50"),
            SchemaKey("relative_to",
                      {choice({"joints", "mean"}), name("a frame"), map("a frame", frameKeys()),
                       list(frame())},
                      "Reference of displacements in pictures: each body's first joint with "
                      "ground, or else its first joint; its mean position; or frames on flexible "
                      "bodies, one for each body.")
                .orElse("joints")
                .such("rod.big_end"),
            SchemaKey("bodies", {entries("bodies", {look})},
                      "Appearance of bodies, by name. Bodies that are hidden or have their own "
                      "color do not count in the range of the contour.")
                .such("{rod: {opacity: 0.3}}"),
            SchemaKey("ghost", {boolean()}, "Draws the undeformed shape as well.")
                .orElse("true")
                .such("false"),
            SchemaKey("joints", {boolean()}, "Draws joints.").orElse("false").such("true"),
            SchemaKey("connectors", {boolean()}, "Draws springs, dampers, bushings and stops.")
                .orElse("true")
                .such("false"),
            SchemaKey("loads", {boolean()},
                      "Draws forces and torques as arrows, the longest for the largest of the run.")
                .orElse("true")
                .such("false"),
            SchemaKey("reactions", {boolean()}, "Draws reactions as arrows.")
                .orElse("false")
                .such("true"),
            SchemaKey("wireframe", {boolean()}, "Draws the edges of elements.")
                .orElse("false")
                .such("true"),
            SchemaKey("axes", {boolean()}, "Draws Ground's axes.").orElse("true").such("false"),
            SchemaKey("ground", {choice({"auto", "none"}), number()},
                      "A ground plane: below the model, none, or at a height "
                      "in metres.")
                .in("m")
                .orElse("auto")
                .such("none"),
            SchemaKey("shadows", {boolean()}, "Draws shadows.").orElse("true").such("false"),
            SchemaKey("ambient_occlusion", {boolean()},
                      "Darkens corners and gaps, where other surfaces block the light.")
                .orElse("false")
                .such("true"),
            SchemaKey("theme", {choice({"light", "dark"})}, "Colors of the background and text.")
                .orElse("light")
                .such("dark"),
            SchemaKey("transparent", {boolean()}, "No background.").orElse("false").such("true"),
            SchemaKey("up", direction, "Direction that is up.").orElse("y").such("z"),
            SchemaKey(
                "cameras", {list({camera})},
                "Views: one fills the picture, several share it, and those with an inset lie on "
                "top.")
                .orElseNote("one isometric view")
                .such("[{view: isometric}]"),
            SchemaKey("plots", {list({plot})},
                      "Plots of probes below the picture; each adds 42 % to its height.")
                .such("[{probes: [tip.x]}]"),
        });
}

}  // namespace

std::vector<SchemaKey> makeRunKeys() {
    return {
        SchemaKey("solver", {solver()}, "Settings of the integrator.").such("{accuracy: 1e-6}"),
        SchemaKey("analyses", {entries("analyses", {analysis()})},
                  "Analyses that simflex run performs, in this order.")
            .such("{run: {type: transient, duration: 0.2}}"),
        SchemaKey("output", {resultOutput()}, "Files that a run writes.").such("{csv: true}"),
    };
}

std::vector<SchemaKey> makeProbeKeys() {
    return {SchemaKey("probes", {entries("probes", {probe()})},
                      "Quantities that are recorded; each is of one kind.")
                .orElseNote("coordinates of joints, largest displacements, energies")
                .such("{tip: {position: rod.tip, component: y}}")};
}

std::vector<SchemaKey> makePictureKeys() {
    return {SchemaKey("pictures", {pictures()}, "Pictures and videos.").such("{video: run.mp4}")};
}

}  // namespace forms
}  // namespace model
}  // namespace simflex
