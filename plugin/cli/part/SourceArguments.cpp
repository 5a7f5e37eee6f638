#include "simflex/cli/part/SourceArguments.h"
#include "simflex/cli/NumberCheck.h"

#include <map>

namespace simflex {
namespace cli {
namespace {

const std::map<std::string, double> kLengthUnits = {{"m", 1},     {"cm", 1e-2},   {"mm", 1e-3},
                                                    {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};

}  // namespace

void addScriptsFlag(CLI::App& command, bool& isAllowed) {
    command.add_flag("--allow-scripts", isAllowed,
                     "Let scripts of Gmsh (.geo) do what you may: start programs, read and write "
                     "any file");
}

void SourceArguments::addTo(CLI::App& command) {
    command
        .add_option("SOURCE", _options.path,
                    "CalculiX deck (.inp); stiffness matrix (.mtx: Matrix Market or Abaqus, .pch: "
                    "Nastran DMIG); mesh or geometry (.msh, .geo, .step, .stp, .brep, .iges, .igs)")
        ->required();
    const std::string matrices = "Matrices", gmsh = "Mesh and geometry";
    command
        .add_option("--mass-matrix", _options.massMatrix,
                    "mass matrix, of the same kind as the stiffness matrix")
        ->type_name("FILE")
        ->group(matrices);
    command
        .add_option("--nodes,--grids", _options.nodes,
                    "nodes of the matrices: table `number x y z`, deck (.inp: elements and node "
                    "sets too) or bulk data (.bdf)")
        ->type_name("FILE")
        ->group(matrices);
    command
        .add_option("--dofs", _options.dofs,
                    "`node direction` of each row, where it is not three a node in their order")
        ->type_name("FILE")
        ->group(matrices);
    command.add_option("--stiffness-name", _options.stiffnessName, "DMIG matrix to take as K")
        ->capture_default_str()
        ->type_name("NAME")
        ->group(matrices);
    command.add_option("--mass-name", _options.massName, "DMIG matrix to take as M")
        ->capture_default_str()
        ->type_name("NAME")
        ->group(matrices);
    std::string systems;
    for (const UnitSystem& system : listUnitSystems())
        systems += (systems.empty() ? "" : ", ") + system.name;
    command.add_option("--units", _options.units, "units of deck or matrices: " + systems)
        ->capture_default_str()
        ->type_name("SYSTEM");
    std::string materials;
    for (const Material& material : listMaterials())
        materials += (materials.empty() ? "" : ", ") + material.name;
    command
        .add_option("--material", _options.material,
                    "E=…,nu=…,rho=… in SI units, or one of " + materials)
        ->type_name("MATERIAL")
        ->group(gmsh);
    command
        .add_option("--mesh-size", _options.gmsh.meshSize,
                    "largest element, in the unit of the geometry (STEP: metres)")
        ->check(makePositiveCheck())
        ->type_name("H")
        ->group(gmsh);
    command
        .add_option("--order", _options.gmsh.order,
                    "1: linear elements, 2: quadratic (default; a .msh keeps its own)")
        ->check(CLI::Range(1, 2))
        ->type_name("1|2")
        ->group(gmsh);
    command
        .add_option("--length-unit", _lengthUnit,
                    "unit of the geometry: m (default), cm, mm, um, in, ft; STEP files say their "
                    "own")
        ->type_name("UNIT")
        ->group(gmsh);
    command
        .add_option("--gmsh", _settings,
                    "constant of the script or option of Gmsh (Mesh.Algorithm3D=10 …)")
        ->type_name("NAME=VALUE")
        ->expected(1)
        ->take_all()
        ->group(gmsh);
    addScriptsFlag(command, _options.gmsh.allowsScripts);
    command
        .add_option("--keep-deck", _options.gmsh.keepDeck,
                    "keep the CalculiX deck that is made, to be reduced with --stiffening")
        ->type_name("DECK.inp")
        ->group(gmsh);
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
    for (const std::string& text : _settings) {
        const size_t equals = text.find('=');
        if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
            throw CLI::ValidationError("--gmsh", "'" + text + "' is not of the form NAME=VALUE");
        options.gmsh.settings.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    }
    return options;
}

}  // namespace cli
}  // namespace simflex
