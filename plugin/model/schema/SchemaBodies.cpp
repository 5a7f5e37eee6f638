/** @file
Sections of the schema: parameters, tables, parts, bodies, frames. **/

#include "simflex/model/schema/SchemaForms.h"

namespace simflex {
namespace model {
namespace forms {

namespace {

/** `keep:` selects the reduced modes in use. **/
Forms keep() {
    return {
        choice({"all"}), list({integer(1)}),
        map("a choice of modes",
            {
                SchemaKey("lowest", {integer(0)}, "Number of modes, from the lowest.").such("20"),
                SchemaKey("below", {positive()}, "Modes up to this frequency.")
                    .in("Hz")
                    .such("3000"),
            },
            {"lowest", "below"})};
}

SchemaForm loadPoint() {
    return map("nodes that are loaded",
               {
                   SchemaKey("nodes", {text()}, "Node set.").required().such("SEAT"),
                   SchemaKey("axes", {choice({"x", "y", "z", "xy", "xz", "yz", "xyz"})},
                             "Directions of the loads.")
                       .orElse("xyz")
                       .such("xy"),
               });
}

SchemaForm part() {
    const std::vector<std::string> sources{"deck", "geometry", "matrices"};
    const std::vector<SchemaForm> material{
        text(),
        map("a material",
            {
                SchemaKey("youngs_modulus", {positive()}, "Young's modulus.")
                    .in("Pa")
                    .required()
                    .such("210e9"),
                SchemaKey("poissons_ratio", {number(-1, 0.5)}, "Poisson's ratio.")
                    .required()
                    .such("0.3"),
                SchemaKey("density", {positive()}, "Density.").in("kg/m^3").required().such("7850"),
            })};
    return map(
        "a part",
        {
            SchemaKey("file", {file("a part file")}, "Reduced part, as written by simflex reduce.")
                .such("rod.h5"),
            SchemaKey("deck", {file("a deck")},
                      "Deck of Abaqus or CalculiX (.inp), Nastran bulk data (.bdf, .nas, .dat), "
                      "Ansys model (.cdb), or arrays K, M and nodes (.mat, .npz), to be reduced; "
                      "cached by content.")
                .such("rod.inp"),
            SchemaKey("geometry", {file("a geometry")},
                      "Geometry (.step, .stp, .brep, .iges, .geo) to be meshed by Gmsh, "
                      "or a mesh (.msh, .unv), to be reduced.")
                .such("rod.step"),
            SchemaKey(
                "matrices",
                {map("matrices",
                     {
                         SchemaKey("stiffness", {file("a matrix")}, "File of the stiffness matrix.")
                             .required()
                             .such("rod.mtx"),
                         SchemaKey("mass", {file("a matrix")}, "File of the mass matrix.")
                             .required()
                             .such("rod_mass.mtx"),
                         SchemaKey("nodes", {file("a table of nodes")},
                                   "File of the nodes and their positions.")
                             .required()
                             .such("rod_nodes.csv"),
                         SchemaKey("dofs", {file("a table of degrees of freedom")},
                                   "File of the node and direction of each row, for matrices that "
                                   "do not state them.")
                             .such("rod.dof"),
                         SchemaKey("stiffness_name", {text()}, "Name of the matrix in the file.")
                             .such("KAAX"),
                         SchemaKey("mass_name", {text()}, "Name of the matrix in the file.")
                             .such("MAAX"),
                     })},
                "Matrices of another program to be reduced.")
                .such("{stiffness: k.mtx, mass: m.mtx, nodes: nodes.csv}"),
            SchemaKey("material", material, "Material by name, or its constants.")
                .with({"geometry"})
                .such("aluminium"),
            SchemaKey("materials", {entries("materials", material)},
                      "Materials of the geometry's solids or physical groups, by name; `material` "
                      "applies to all others.")
                .with({"geometry"})
                .such("{HOUSING: aluminium, PIN: steel}"),
            SchemaKey("solids", {text(), list({text()})},
                      "Solids of a STEP file, or physical groups, that make up the part.")
                .with({"geometry"})
                .orElseNote("all")
                .such("[HOUSING, PIN]"),
            SchemaKey(
                "mesh_size", {positive()},
                "Size of the elements, in `length_unit`; without it in metres, even for a STEP "
                "file in millimetres.")
                .with({"geometry"})
                .orElseNote("Gmsh's own choice")
                .such("0.002"),
            SchemaKey("order", {integer(1, 2)}, "Order of the elements.")
                .with({"geometry"})
                .orElse("2")
                .such("1"),
            SchemaKey(
                "thickness", {positive()},
                "Thickness of sheet metal: surfaces of the geometry become mid-surfaces of shells.")
                .in("m")
                .with({"geometry"})
                .orElseNote("its volumes become solids")
                .such("0.002"),
            SchemaKey("length_unit", {positive()},
                      "Length of the geometry's unit. A STEP file states its own.")
                .in("m")
                .with({"geometry"})
                .orElseNote("as the file says, else 1")
                .such("1e-3"),
            SchemaKey("settings", {entries("settings", {number()})}, "Constants of a .geo script.")
                .with({"geometry"})
                .such("{thickness: 0.01}"),
            SchemaKey("units", {text()}, "Units of the deck or geometry: length-mass-time.")
                .with(sources)
                .orElse("m-kg-s")
                .such("mm-t-s"),
            SchemaKey("without_contact", {boolean()},
                      "Ignores contact pairs and gaps of the deck instead of refusing them.")
                .with({"deck"})
                .orElse("false")
                .such("true"),
            SchemaKey(
                "interfaces",
                {entries(
                    "interfaces",
                    {text(),
                     map("an interface",
                         {
                             SchemaKey("nodes", {text()},
                                       "Node set, physical group, or shape such as sphere:x,y,z,r.")
                                 .required()
                                 .such("BIG_END"),
                             SchemaKey("tie", {choice({"rigid", "distributing"})},
                                       "Coupling of the nodes to the interface's frame.")
                                 .orElse("rigid")
                                 .such("distributing"),
                             SchemaKey("master", {vec3()},
                                       "Origin of the frame, in the part's coordinates.")
                                 .in("m")
                                 .orElseNote("the centre of the nodes")
                                 .such("[0, 0, 0.1]"),
                         })})},
                "Attachment frames, by name, and the nodes that each holds.")
                .with(sources)
                .such("{big_end: BIG_END}"),
            SchemaKey(
                "modes", {integer(1, 10000)},
                "Number of Craig-Bampton modes, including 6 for each interface; the part keeps 6 "
                "fewer.")
                .with(sources)
                .without({"up_to"})
                .orElse("50")
                .such("80"),
            SchemaKey("up_to", {positive()}, "Keeps the modes up to this frequency.")
                .in("Hz")
                .with(sources)
                .without({"modes"})
                .such("2000"),
            SchemaKey("load_points", {text(), loadPoint(), list({text(), loadPoint()})},
                      "Loaded node sets, for which the part gets static (attachment) modes.")
                .with(sources)
                .such("[TIP, {nodes: SEAT, axes: xy}]"),
            SchemaKey("inertia_relief", {boolean()},
                      "Gives the part static modes for weight, angular acceleration and "
                      "centrifugal load, 12 of `modes`.")
                .with(sources)
                .orElse("false")
                .such("true"),
            SchemaKey("derivatives", {text(), list({text()})},
                      "Numbers of the deck with respect to which stiffness and mass of the modes "
                      "are differentiated, for `Part.derivatives` in Python; runs do not use "
                      "them.")
                .with({"deck", "geometry"})
                .such("[thickness:SKIN, density:STEEL]"),
            SchemaKey("at_frequency", {positive(), list({positive()})},
                      "Frequencies at which the response of the part to harmonic motion of its "
                      "interfaces and forces at its load points is exact.")
                .in("Hz")
                .with(sources)
                .such("[120, 480]"),
            SchemaKey("stiffening", {boolean()},
                      "Computes the part's geometric stiffness under acceleration, rotation and "
                      "interface loads.")
                .with(sources)
                .orElse("false")
                .such("true"),
            SchemaKey("stress", {choice({"none", "skin", "all"}), text(), list({text()})},
                      "Where stress can be recovered: "
                      "nowhere, on the surface, everywhere, or in node sets.")
                .with(sources)
                .orElse("none")
                .such("skin"),
            SchemaKey("keep", keep(), "Modes of the part that are used.")
                .orElse("all")
                .such("{lowest: 20}"),
        },
        {"file", "deck", "geometry", "matrices"});
}

SchemaForm shape() {
    return map(
        "a shape",
        {
            SchemaKey("box", {list({positive()}, {3})}, "Edges of a box about the body's origin.")
                .in("m")
                .such("[0.1, 0.05, 0.02]"),
            SchemaKey("sphere", {positive()}, "Radius of a sphere about the body's origin.")
                .in("m")
                .such("0.02"),
            SchemaKey("cylinder", {list({positive()}, {2})},
                      "Radius and length of a cylinder about the body's origin.")
                .in("m")
                .such("[0.01, 0.2]"),
            SchemaKey("mesh", {file("a surface")}, "Surface of triangles (.stl, .obj, .vtp).")
                .such("slider.stl"),
            SchemaKey("axis", {choice({"x", "y", "z"})}, "Axis of the cylinder.")
                .with({"cylinder"})
                .orElse("z")
                .such("x"),
            SchemaKey("scale", {positive()}, "Factor from the mesh's unit to metres.")
                .with({"mesh"})
                .orElse("1")
                .such("1e-3"),
            SchemaKey("position", {vec3()}, "Position of the shape in the body's frame.")
                .in("m")
                .orElse("[0, 0, 0]")
                .such("[0, 0, 0.1]"),
            SchemaKey("rotation", rotation(),
                      "Orientation of the shape relative to the body's frame.")
                .in("rad")
                .orElse("[0, 0, 0]")
                .such("[90*deg, 0, 0]"),
        },
        {"box", "sphere", "cylinder", "mesh"});
}

SchemaForm mobilizer() {
    const std::vector<SchemaKey> offset{
        SchemaKey("position", {vec3()}, "Origin.").in("m").orElse("[0, 0, 0]").such("[0, 0, 0.1]"),
        SchemaKey("rotation", rotation(), "Orientation.")
            .in("rad")
            .orElse("[0, 0, 0]")
            .such("[0, 90*deg, 0]"),
    };
    return map(
        "a mobilizer",
        {
            SchemaKey("type",
                      {choice({"free", "pin", "slider", "ball", "weld", "universal", "planar",
                               "cylinder", "screw", "translation"})},
                      "Motion of the body relative to its parent.")
                .orElse("free")
                .such("pin"),
            SchemaKey("parent", {name("a rigid body or ground")},
                      "Rigid body that carries this one.")
                .orElse("ground")
                .such("arm"),
            SchemaKey("inboard", {map("a frame", offset)}, "Mobilizer's frame on the parent.")
                .orElseNote("the parent's frame")
                .such("{position: [0, 0, 0.1]}"),
            SchemaKey("outboard", {map("a frame", offset)}, "Mobilizer's frame on the body.")
                .orElseNote("the body's frame")
                .such("{position: [0, 0, -0.1]}"),
            SchemaKey("pitch", {number()}, "Advance of a screw per radian.")
                .in("m/rad")
                .only({"screw"})
                .required()
                .such("0.002/(2*pi)"),
        });
}

SchemaForm body() {
    const std::vector<std::string> rigid{"part"};
    return map(
        "a body",
        {
            SchemaKey("part", {name("a part")}, "Part that the flexible body is made of.")
                .such("rod"),
            SchemaKey("rigid", {boolean()}, "Holds the flexible body rigid.")
                .with({"part"})
                .orElse("false")
                .such("true"),
            SchemaKey("stiffening", {boolean()},
                      "Uses the part's geometric stiffness, where it has one.")
                .with({"part"})
                .orElse("true")
                .such("false"),
            SchemaKey(
                "damping",
                {number(0, 1), list({number(0)}), choice({"by_frequency"}),
                 map("Rayleigh's damping", {SchemaKey("rayleigh", {list({number(0)}, {2})},
                                                      "Factors of mass [1/s] and stiffness [s].")
                                                .required()
                                                .such("[0.5, 1e-5]")})},
                "Damping ratio of all modes, of each mode, by_frequency (more for higher modes), "
                "or Rayleigh's.")
                .with({"part"})
                .orElse("0")
                .such("0.01"),
            SchemaKey("mass", {positive()}, "Mass of a rigid body.")
                .in("kg")
                .without(rigid)
                .orElseNote("of shape and density")
                .such("0.2"),
            SchemaKey("center_of_mass", {vec3()},
                      "Centre of mass in the body's frame; that of a shape alone follows from "
                      "its position.")
                .in("m")
                .with({"inertia"})
                .orElse("[0, 0, 0]")
                .such("[0, 0, 0.01]"),
            SchemaKey("inertia", {list({number()}, {3, 6})},
                      "Inertia about the centre of mass in the body's axes: "
                      "[xx, yy, zz] or [xx, yy, zz, xy, xz, yz].")
                .in("kg m^2")
                .with({"mass"})
                .orElseNote("of the shape, scaled to the mass")
                .such("[1e-4, 1e-4, 2e-4]"),
            SchemaKey("shape", {shape(), list({shape()})},
                      "Shape of a rigid body in pictures; with density it also gives the mass.")
                .without(rigid)
                .such("{box: [0.1, 0.05, 0.02]}"),
            SchemaKey("density", {positive()}, "Density of the shape.")
                .in("kg/m^3")
                .with({"shape"})
                .without({"mass"})
                .such("7850"),
            SchemaKey("color", {color(), list({number(0, 1)}, {3})},
                      "Color in pictures, of a flexible body where it has no contour: a name, "
                      "'#rrggbb' or [red, green, blue].")
                .orElseNote("neighbours differ")
                .such("'#c04020'"),
            SchemaKey("mobilizer", {mobilizer()},
                      "Motion that a rigid body has relative to a rigid parent.")
                .without(rigid)
                .orElseNote("free on ground")
                .such("{type: pin}"),
            SchemaKey("place", place(), "Pose of the body at the start.")
                .orElseNote("at Ground's origin")
                .such("{position: [0.1, 0, 0]}"),
        });
}

}  // namespace

std::vector<SchemaKey> makePartKeys() {
    SchemaForm parameters = entries("parameters", {number()});
    SchemaForm tables = entries(
        "tables",
        {map("a table",
             {
                 SchemaKey("x", {list({number()})}, "Arguments of the values, increasing.")
                     .with({"y"})
                     .such("[0, 1, 2]"),
                 SchemaKey("y", {list({number()})},
                           "Values; with z, the second arguments, increasing.")
                     .with({"x"})
                     .such("[0, 5, 0]"),
                 SchemaKey("z", {list({list({number()})})},
                           "Values of a function of two variables: one row for each x, with one "
                           "value for each y.")
                     .with({"x"})
                     .such("[[0, 0, 0], [0, 1, 2]]"),
                 SchemaKey("file", {file("a CSV file")}, "CSV file with the points.")
                     .such("road.csv"),
                 SchemaKey("columns", {list({integer(0, 10000)}, {2, 3})},
                           "Columns of x and y, from 0; with a third column, a function of two "
                           "variables, whose points may be in any order, one for every x and every "
                           "y.")
                     .with({"file"})
                     .orElse("[0, 1]")
                     .such("[0, 2]"),
                 SchemaKey("interpolation", {choice({"spline", "linear", "step"})},
                           "Between the points: cubic spline (not-a-knot; bicubic), straight lines "
                           "(bilinear) or, for one variable, the value of the last point passed.")
                     .orElse("spline")
                     .such("linear"),
                 SchemaKey("extrapolation", {choice({"constant", "linear", "refuse"})},
                           "Beyond the points: the value at the end, a straight continuation, or "
                           "an error.")
                     .orElse("constant")
                     .such("linear"),
             },
             {"x", "file"})});
    parameters.hasWords = tables.hasWords = true;
    return {
        SchemaKey("simflex", {integer(1)}, "Version of the file's format.").required().such("1"),
        SchemaKey("title", {text()}, "Name of the model, for pictures and results.")
            .orElseNote("the file's name")
            .such("Slider-crank"),
        SchemaKey("description", {text()}, "Free text.").such("A crank with a flexible rod."),
        SchemaKey("parameters", {parameters},
                  "Constants for formulas. Each may use those above it.")
            .such("{speed: 150, length: 0.18}"),
        SchemaKey(
            "tables", {tables},
            "Functions of one or two variables for formulas: engine(t), torque(speed, throttle).")
            .such("{engine: {x: [0, 1, 2], y: [0, 5, 0]}}"),
        SchemaKey("gravity", {vec3()}, "Acceleration of gravity in Ground.")
            .in("m/s^2")
            .orElse("[0, 0, 0]")
            .such("[0, -g, 0]"),
        SchemaKey("parts", {entries("parts", {part()})},
                  "Reduced finite element parts; any number of bodies may share "
                  "one.")
            .such("{rod: {file: rod.h5}}"),
    };
}

std::vector<SchemaKey> makeBodyKeys() {
    return {
        SchemaKey("bodies", {entries("bodies", {body()})}, "Flexible and rigid bodies.")
            .such("{rod: {part: rod}}"),
        SchemaKey("frames", {entries("frames", {map("a frame", frameKeys())})},
                  "Named frames on bodies or Ground, for joints, loads and probes.")
            .such("{tip: {on: rod, node: 4711}}"),
    };
}

}  // namespace forms
}  // namespace model
}  // namespace simflex
