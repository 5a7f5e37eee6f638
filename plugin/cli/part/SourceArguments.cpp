#include "simflex/cli/part/SourceArguments.h"
#include "simflex/cli/Options.h"

#include <map>

namespace simflex {
namespace cli {
namespace {

const std::map<std::string, double> kLengthUnits = {{"m", 1},     {"cm", 1e-2},   {"mm", 1e-3},
                                                    {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};

}  // namespace

void SourceArguments::addTo(CLI::App& command) {
    command
        .add_option("SOURCE", _options.path,
                    "CalculiX deck (.inp); stiffness matrix (.mtx: Matrix Market or Abaqus, .pch: "
                    "Nastran DMIG); mesh or geometry (.msh, .geo, .step, .stp, .brep, .iges, .igs)")
        ->required();
    const auto add = [&](const char* group, const char* name, auto& variable,
                         const std::string& help, const char* type) {
        return command.add_option(name, variable, help)->type_name(type)->group(group);
    };
    const char *matrices = "Matrices", *gmsh = "Mesh and geometry";
    add(matrices, "--mass-matrix", _options.massMatrix,
        "mass matrix, of the same kind as the stiffness matrix", "FILE");
    add(matrices, "--nodes,--grids", _options.nodes,
        "nodes of the matrices: table `number x y z`, deck (.inp: elements and node sets too) or "
        "bulk data (.bdf)",
        "FILE");
    add(matrices, "--dofs", _options.dofs,
        "`node direction` of each row, where it is not three a node in their order", "FILE");
    add(matrices, "--stiffness-name", _options.stiffnessName, "DMIG matrix to take as K", "NAME")
        ->capture_default_str();
    add(matrices, "--mass-name", _options.massName, "DMIG matrix to take as M", "NAME")
        ->capture_default_str();
    std::string systems, materials;
    for (const UnitSystem& system : listUnitSystems())
        systems += (systems.empty() ? "" : ", ") + system.name;
    for (const Material& material : listMaterials())
        materials += (materials.empty() ? "" : ", ") + material.name;
    command.add_option("--units", _options.units, "units of deck or matrices: " + systems)
        ->capture_default_str()
        ->type_name("SYSTEM");
    add(gmsh, "--material", _options.material, "E=…,nu=…,rho=… in SI units, or one of " + materials,
        "MATERIAL");
    add(gmsh, "--mesh-size", _options.gmsh.meshSize,
        "largest element, in the unit of the geometry (STEP: metres)", "H")
        ->check(makePositiveCheck());
    add(gmsh, "--order", _options.gmsh.order,
        "1: linear elements, 2: quadratic (default; a .msh keeps its own)", "1|2")
        ->check(CLI::Range(1, 2));
    add(gmsh, "--length-unit", _lengthUnit,
        "unit of the geometry: m (default), cm, mm, um, in, ft; STEP files say their own", "UNIT");
    addRepeated(command, "--gmsh", _settings,
                "constant of the script or option of Gmsh (Mesh.Algorithm3D=10 …)", "NAME=VALUE")
        ->group(gmsh);
    addScriptsFlag(command, _options.gmsh.allowsScripts);
    add(gmsh, "--keep-deck", _options.gmsh.keepDeck,
        "keep the CalculiX deck that is made, to be reduced with --stiffening", "DECK.inp");
}

SourceOptions SourceArguments::parse() const {
    SourceOptions options = _options;
    if (!_lengthUnit.empty()) {
        const auto unit = kLengthUnits.find(_lengthUnit);
        if (unit == kLengthUnits.end())
            throw CLI::ValidationError("--length-unit",
                                       "'" + _lengthUnit + "' is none of m, cm, mm, um, in, ft");
        options.gmsh.lengthUnit = unit->second;
    }
    for (const std::string& text : _settings)
        options.gmsh.settings.push_back(splitAssignment("--gmsh", text));
    return options;
}

}  // namespace cli
}  // namespace simflex
