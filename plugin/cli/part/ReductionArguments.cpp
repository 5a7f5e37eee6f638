#include "simflex/cli/part/ReductionArguments.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/cli/Options.h"
#include "simflex/part/TextLines.h"

#include <map>

namespace simflex {
namespace cli {
namespace {

const std::map<std::string, double> LengthUnits = {{"m", 1},     {"cm", 1e-2},   {"mm", 1e-3},
                                                   {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};

StressOptions parseStress(const std::string& text) {
    StressOptions options;
    if (text == "skin") return options;
    options.nodes = StressOptions::Nodes::All;
    if (text == "all") return options;
    options.nodes = StressOptions::Nodes::Sets;
    if (text.find(':') != std::string::npos) {  // a shape, whose numbers contain commas
        options.sets = {text};
        return options;
    }
    options.sets = splitAt(text, ',');
    for (const std::string& set : options.sets)
        if (set.empty())
            throw CLI::ValidationError("--stress", "'" + text + "' is not all, skin or SET,SET…");
    return options;
}

}  // namespace

void SourceArguments::addTo(CLI::App& command) {
    command
        .add_option("SOURCE", m_options.path,
                    "Deck of CalculiX or Abaqus (.inp); Nastran bulk data (.bdf, .nas, .dat); "
                    "Ansys model (.cdb); stiffness matrix (.mtx: Matrix Market or Abaqus, .pch: "
                    "Nastran DMIG); arrays K, M and nodes (.mat, .npz); mesh or geometry (.msh, "
                    ".unv, .geo, .step, .stp, .brep, .iges, .igs)")
        ->required();
    const auto add = [&](const char* group, const char* name, auto& variable,
                         const std::string& help, const char* type) {
        return command.add_option(name, variable, help)->type_name(type)->group(group);
    };
    const char *matrices = "Matrices", *gmsh = "Mesh and geometry";
    add(matrices, "--mass-matrix", m_options.massMatrix,
        "Mass matrix, of the same file type as the stiffness matrix", "FILE");
    add(matrices, "--nodes,--grids", m_options.nodes,
        "Nodes of the matrices: table `number x y z`, deck (.inp: elements and node sets too) or "
        "bulk data (.bdf)",
        "FILE");
    add(matrices, "--dofs", m_options.dofs,
        "Table `node direction` of each row (default: three for each node, in the order of nodes)",
        "FILE");
    add(matrices, "--stiffness-name", m_options.stiffnessName, "DMIG matrix that is K", "NAME")
        ->capture_default_str();
    add(matrices, "--mass-name", m_options.massName, "DMIG matrix that is M", "NAME")
        ->capture_default_str();
    std::string systems, materials;
    for (const UnitSystem& system : listUnitSystems())
        systems += (systems.empty() ? "" : ", ") + system.name;
    for (const Material& material : listMaterials())
        materials += (materials.empty() ? "" : ", ") + material.name;
    command.add_option("--units", m_options.units, "Units of the deck or matrices: " + systems)
        ->capture_default_str()
        ->type_name("SYSTEM");
    addRepeated(command, "--derivative", m_options.calculix.derivatives,
                "Keep how stiffness and mass of the modes change with a number of the deck: "
                "youngs_modulus:MATERIAL, stiffness:MATERIAL (a factor), density:MATERIAL, "
                "thickness:SET, thickness:SET:LAYER (1 lies lowest), section:SET:LETTER (of a "
                "beam, as Abaqus names it), area:SET",
                "NAME");
    command.add_flag("--calculix-shells", m_options.calculix.hasCalculixShells,
                     "Take S3, S4, S4R and beams for the solids that CalculiX makes of them, which "
                     "lock");
    command.add_flag("--without-contact", m_options.calculix.leavesContactOut,
                     "Leave contact pairs and gaps of a deck out: surfaces in contact there can "
                     "penetrate each other");
    addRepeated(command, "--material", m_materials,
                "Material: E=…,nu=…,rho=… in SI units, or one of " + materials +
                    "; NAME=MATERIAL for the solids or physical groups of that name",
                "[NAME=]MATERIAL")
        ->group(gmsh);
    addRepeated(command, "--solid", m_options.gmsh.solids,
                "Take only the solids of a STEP file, or physical groups, of these names", "NAME")
        ->group(gmsh);
    add(gmsh, "--mesh-size", m_options.gmsh.meshSize,
        "Largest element size, in the --length-unit; without that in metres, of STEP and IGES, too",
        "H")
        ->check(makePositiveCheck());
    add(gmsh, "--order", m_options.gmsh.order,
        "Order of the elements, 1 or 2 (default: 2; a mesh keeps its own)", "1|2")
        ->check(CLI::Range(1, 2));
    add(gmsh, "--thickness", m_options.gmsh.thickness,
        "Thickness of sheet metal [m]: the surfaces of the geometry become mid-surfaces of shells",
        "T")
        ->check(makePositiveCheck());
    add(gmsh, "--length-unit", m_lengthUnit,
        "Unit of the geometry: m, cm, mm, um, in, ft, or its length in metres, such as 1e-3\n"
        "(default: m; STEP files state their own, leave it out there)",
        "UNIT");
    addRepeated(command, "--gmsh", m_settings,
                "Constant of the script or option of Gmsh, for example Mesh.Algorithm3D=10",
                "NAME=VALUE")
        ->group(gmsh);
    addScriptsFlag(command, m_options.gmsh.allowsScripts);
    add(gmsh, "--keep-deck", m_options.gmsh.keepDeck, "Keep the deck that is made of the mesh",
        "DECK.inp");
}

SourceOptions SourceArguments::parse() const {
    SourceOptions options = m_options;
    if (!m_lengthUnit.empty()) {
        const auto unit = LengthUnits.find(m_lengthUnit);
        double& length = options.gmsh.lengthUnit;
        if (unit != LengthUnits.end())
            length = unit->second;
        else if (!readNumber(m_lengthUnit, length) || !(length > 0))
            throw CLI::ValidationError("--length-unit", "'" + m_lengthUnit +
                                                            "' is none of m, cm, mm, um, in, ft, "
                                                            "nor a length in metres, such as 1e-3");
    }
    for (const std::string& text : m_materials)
        options.material += (options.material.empty() ? "" : ";") + text;
    for (const std::string& text : m_settings) {
        const auto [name, number] = splitAssignment("--gmsh", text);
        double value = 0;
        if (!readNumber(trimBlanks(number), value))
            throw CLI::ValidationError("--gmsh", "'" + number + "' of '" + text +
                                                     "' is not a number (formulas have their place "
                                                     "in a model's settings)");
        options.gmsh.settings.emplace_back(name, value);
    }
    return options;
}

void ReductionArguments::addTo(CLI::App& command) {
    addRepeated(command, "-i,--interface", m_rigid,
                "Joint seat tied rigidly to its master point; NODES: a node set or surface, or "
                "sphere:x,y,z,r, cylinder:x,y,z,ax,ay,az,r[,length], plane:x,y,z,nx,ny,nz [m]",
                "NAME=NODES");
    addRepeated(command, "--distributing", m_distributing,
                "Joint seat whose master point follows the mean of its nodes and adds no stiffness",
                "NAME=NODES");
    addRepeated(command, "--master", m_masters,
                "Master point of an interface [m] (default: middle of its surface or volume; of a "
                "cylinder, on its axis)",
                "NAME=X,Y,Z");
    addRepeated(command, "--load-point", m_loadPoints,
                "Static (attachment) modes for forces on NODES (also node:NUMBER), along x, y and "
                "z or the AXES given",
                "NODES[=AXES]");
    command.add_flag("--inertia-relief", m_options.hasInertiaRelief,
                     "Static modes for weight, angular acceleration and centrifugal load: twelve "
                     "of the modes, or six of a part without interfaces");
    command
        .add_option("--at-frequency", m_options.frequencies,
                    "Modes that make the response of the part to harmonic motion of its interfaces "
                    "and forces at its load points exact at these frequencies [Hz]: HZ,HZ")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->type_name("HZ")
        ->check(makePositiveCheck());
    command
        .add_option("--further-modes", m_options.numFurtherModes,
                    "Keep a finer twin with this many further normal modes and inertia relief, for "
                    "`simflex run --error-bar`; 24 suffice")
        ->type_name("COUNT")
        ->check(makePositiveCheck());
    CLI::Option* modes = command.add_option(
        "-m,--modes", m_options.numModes,
        "Number of Craig-Bampton modes, including 6 for each interface; the part keeps 6 fewer");
    modes->capture_default_str()->check(makePositiveCheck());
    command
        .add_option("--up-to", m_options.highestFrequency,
                    "Keep all normal modes up to this frequency [Hz], instead of --modes")
        ->type_name("HZ")
        ->check(makePositiveCheck())
        ->excludes(modes);
    command
        .add_option("--check", m_options.numCheckedModes,
                    "Compare this many frequencies of the part with those of the full model, and "
                    "its deflection under static loads")
        ->type_name("COUNT")
        ->check(makePositiveCheck());
    command.add_flag("--stress{skin}", m_stress,
                     "Compute stress and strain of the modes at the nodes of the part's skin, at "
                     "`all`, or at NODES (--stress=SET,SET or =sphere:x,y,z,r)");
    command
        .add_option("--memory", m_memory,
                    "Memory the reduction may use [GiB]; a larger need is refused before K is "
                    "factored (default: what is free)")
        ->type_name("GIB")
        ->check(makePositiveCheck());
}

ReductionOptions ReductionArguments::parse() const {
    ReductionOptions options = m_options;
    for (const std::string& text : m_rigid) {
        const auto [name, nodes] = splitAssignment("--interface", text);
        options.interfaces.emplace_back(name, nodes);
    }
    for (const std::string& text : m_distributing) {
        const auto [name, nodes] = splitAssignment("--distributing", text);
        options.interfaces.emplace_back(name, nodes, TieType::Distributing);
    }
    for (const std::string& text : m_masters) {
        const auto [name, point] = splitAssignment("--master", text);
        std::array<double, 3> x{};
        const std::vector<std::string> numbers = splitAt(point, ',');
        bool isPoint = numbers.size() == 3;
        for (size_t k = 0; isPoint && k < 3; ++k)
            isPoint = readNumber(trimBlanks(numbers[k]), x[k]);
        if (!isPoint)
            throw CLI::ValidationError("--master", "'" + text + "' is not of the form NAME=X,Y,Z");
        bool found = false;
        for (InterfaceOptions& interface : options.interfaces)
            if (interface.name == name) interface.master = x, found = true;
        if (!found) throw CLI::ValidationError("--master", "there is no interface '" + name + "'");
    }
    for (const std::string& text : m_loadPoints) {
        const size_t equals = text.find('=');
        LoadPoint point{text.substr(0, equals)};
        if (equals != std::string::npos) point.axes = text.substr(equals + 1);
        if (point.nodes.empty())
            throw CLI::ValidationError("--load-point", "'" + text + "' names no nodes");
        options.loadPoints.push_back(point);
    }
    if (!m_stress.empty()) options.stress = parseStress(m_stress);
    if (m_memory > 0) options.memoryLimit = m_memory * 1073741824;
    return options;
}

}  // namespace cli
}  // namespace simflex
