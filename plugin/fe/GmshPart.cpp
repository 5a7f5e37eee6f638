#include "simflex/fe/GmshPart.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Sandbox.h"
#include "simflex/fe/calculix/CalculixRun.h"
#include "simflex/fe/calculix/ProgramRun.h"
#include "simflex/fe/decks/DeckModel.h"
#include "simflex/fe/decks/DeckVocabulary.h"
#include "simflex/fe/decks/InpCards.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr const char* MeshName = "mesh.inp";
constexpr const char* SolidsSet = "SIMFLEX_SOLIDS";
constexpr size_t MostGmshLines = 12;
constexpr int MostElements = 20000000;
constexpr size_t MostScripts = 1000;  ///< that one includes
constexpr double Millimetre = 1e-3;

std::string number(double value) {
    return writeFortran(value, 13);
}

std::string suffixOf(const std::string& path) {
    return lowerCase(fs::path(path).extension().string());
}

/** Names in quotes of the statements and options that read files. **/
std::vector<std::string> findIncludes(const std::string& text) {
    std::vector<std::string> names;
    for (const char* statement : {"Include", "Merge", "ShapeFromFile", "FileName"})
        for (size_t at = text.find(statement); at != std::string::npos;
             at = text.find(statement, at + 1)) {
            const size_t open = text.find('"', at), end = text.find(';', at);
            if (open == std::string::npos || open > end) continue;
            const size_t close = text.find('"', open + 1);
            if (close != std::string::npos)
                names.push_back(text.substr(open + 1, close - open - 1));
        }
    return names;
}

/** The lines where Gmsh speaks of errors. **/
std::string readErrors(const fs::path& log) {
    std::ifstream in(log);
    std::string errors;
    size_t count = 0;
    for (std::string line; std::getline(in, line) && count < MostGmshLines;)
        if (line.compare(0, 5, "Error") == 0) errors += "\n    " + line, ++count;
    return errors;
}

/** Gmsh takes for a script what does not begin like a mesh. **/
void checkIsMesh(const std::string& path) {
    std::ifstream in(path);
    std::string first;
    in >> first;
    for (const char* known : {"$MeshFormat", "$Comments", "$NOD", "$NOE", "$PARA", "$ELM"})
        if (first == known) return;
    throw std::invalid_argument("'" + path + "' is no mesh of Gmsh: it does not begin with " +
                                "$MeshFormat");
}

/** Whether a file is in a folder, or in one of its folders, wherever links lead. **/
bool isInside(const fs::path& file, const fs::path& folder) {
    std::error_code unknown;  // of names that cannot be
    const fs::path relative =
        fs::weakly_canonical(file, unknown).lexically_relative(fs::canonical(folder, unknown));
    return !unknown && !relative.empty() && *relative.begin() != "..";
}

/** What a script may use. **/
Sandbox makeSandbox(const std::string& program, const std::string& script,
                    const std::string& libraryPath, const fs::path& folder) {
    Sandbox sandbox;
    sandbox.program = findProgram(program);
    sandbox.readable = listSystemFolders();
    // Where Gmsh is installed by itself.
    sandbox.readable.push_back((fs::path(sandbox.program).parent_path() / "../lib").string());
    std::istringstream libraries(libraryPath);
    for (std::string place; std::getline(libraries, place, ':');) sandbox.readable.push_back(place);
    for (const std::string& file : listScriptFiles(script))
        if (isInside(file, fs::path(script).parent_path())) sandbox.readable.push_back(file);
    sandbox.writable = folder.string();
    return sandbox;
}

/** Whether a script runs in a sandbox. @throws std::runtime_error if it should and cannot. **/
bool needsSandbox(const std::string& path, const GmshOptions& options) {
    if (!isGmshScript(path) || options.allowsScripts) return false;
    const std::string obstacle = findSandboxObstacle();
    if (obstacle.empty()) return true;
    const char* wish = std::getenv("SIMFLEX_SANDBOX");
    if (wish && std::string(wish) == "optional") return false;
    throw std::runtime_error(
        path + ": a script of Gmsh is a program, and this system cannot keep it in a sandbox: " +
        obstacle + "; if you trust it, give --allow-scripts, or mesh it yourself: gmsh -3 " +
        fs::path(path).filename().string() + " -o " + fs::path(path).stem().string() + ".msh");
}

std::string chooseGmshProgram(const std::string& wish) {
    const char* fromEnvironment = std::getenv("SIMFLEX_GMSH");
    const std::string program = !wish.empty() ? wish : fromEnvironment ? fromEnvironment : "gmsh";
    // It will run in another folder.
    return program.find('/') == std::string::npos ? program : fs::absolute(program).string();
}

/** Writes what makes Gmsh stop before it meshes CAD with elements so small that no machine would
hold them. @return the script's name in the folder **/
std::string writeSizeCheck(double meshSize, const fs::path& folder) {
    // Tetrahedra whose edges are h, in a volume V: 6 √2 V/h³.
    std::ofstream out(folder / "size_check.geo");
    out << "SetFactory(\"OpenCASCADE\");\nvolumes() = Volume{:};\ntotal = 0;\n"
           "For k In {0 : #volumes() - 1}\n  total += Mass Volume{volumes(k)};\nEndFor\n"
           "millions = 8.5e-6 * total / Mesh.CharacteristicLengthMax^3;\n"
        << "If (millions > " << MostElements / 1000000
        << ")\n  Error(\"elements of %g would be about %g million; choose a larger size\", "
        << number(meshSize) << ", millions);\n  Exit;\nEndIf\n";
    return "size_check.geo";
}

void runGmsh(const std::string& path, const GmshOptions& options, const fs::path& folder) {
    const std::string suffix = suffixOf(path);
    const bool isMesh = suffix == ".msh" || suffix == ".unv",
               isStep = suffix == ".step" || suffix == ".stp",
               isIges = suffix == ".iges" || suffix == ".igs";
    // Of IGES, whatever its unit, Gmsh takes millimetres; often it holds but surfaces.
    const bool isMillimetres = isIges && options.lengthUnit == 0;
    const bool isScript = isGmshScript(path), isInSandbox = needsSandbox(path, options);
    if (suffix == ".msh") checkIsMesh(path);

    // Of NAME.step Gmsh would also run NAME.step.opt: data are read where they are alone.
    const std::string given = fs::absolute(path).string();
    if (!isScript) fs::create_symlink(given, folder / ("geometry" + suffix));
    ProgramRun run;
    run.program = chooseGmshProgram(options.program);
    run.arguments = {isScript ? given : "geometry" + suffix,
                     options.thickness > 0 ? "-2" : "-3",
                     "-format",
                     "inp",
                     "-o",
                     MeshName,
                     "-setnumber",
                     "Mesh.SaveGroupsOfNodes",
                     "1",
                     "-setnumber",
                     "Mesh.SecondOrderIncomplete",
                     "1"};
    const auto add = [&](std::initializer_list<std::string> words) {
        run.arguments.insert(run.arguments.end(), words);
    };
    const int order = options.order == 0 && !isMesh ? 2 : options.order;
    if (order) add({"-order", std::to_string(order)});
    if (options.meshSize > 0)
        add({"-clmax", number(isMillimetres ? options.meshSize / Millimetre : options.meshSize)});
    if (options.meshSize > 0 && !isMesh && !isScript)
        add({writeSizeCheck(options.meshSize, folder)});
    if (isIges)
        add({"-setnumber", "Geometry.OCCSewFaces", "1", "-setnumber", "Geometry.OCCMakeSolids",
             "1"});
    if (options.lengthUnit > 0) {
        add({"-setnumber", "Mesh.ScalingFactor", number(options.lengthUnit)});
    } else if (isMillimetres) {
        add({"-setnumber", "Mesh.ScalingFactor", number(Millimetre)});
    } else if (isStep) {
        add({"-setstring", "Geometry.OCCTargetUnit", "M"});
    }
    for (const auto& [name, value] : options.settings) add({"-setnumber", name, value});
    run.folder = folder;
    run.log = folder / "gmsh.log";
    run.cure = "Install it (Debian: gmsh), or set SIMFLEX_GMSH to its path.";

    // Options that a user keeps at home would change the mesh.
    run.environment["GMSH_HOME"] = folder.string();
    Sandbox sandbox;
    if (isInSandbox) {
        const std::string libraries = run.environment["LD_LIBRARY_PATH"];
        sandbox = makeSandbox(run.program, given, libraries, folder);
        if (!sandbox.program.empty()) run.program = sandbox.program;
        run.sandbox = &sandbox;
        run.environment = {{"GMSH_HOME", folder.string()},
                           {"HOME", folder.string()},
                           {"LC_ALL", "C"},
                           {"LD_LIBRARY_PATH", libraries},
                           {"OMP_NUM_THREADS", "1"}};
    }
    ChildProcess process = startProgram(run);
    const ChildEnd& end =
        waitForProgram(process, isMesh ? "Gmsh converts the mesh" : "Gmsh meshes the part",
                       options.calculix.progress);
    const std::string errors = readErrors(run.log);
    if (end.isSuccess() && errors.empty() && fs::exists(folder / MeshName)) return;
    std::string message =
        path + ": Gmsh could not mesh the part:" + (end.signal ? " it " + end.describe() : "") +
        (errors.empty() ? readLastLines(run.log, MostGmshLines) : errors);
    const auto says = [&](const char* words) { return errors.find(words) != std::string::npos; };
    if (isInSandbox && (says("Unable to open file") || says("/bin/sh") || says("socket")))
        message +=
            "\n  (A script reads only files of its own folder that it names plainly, Include "
            "\"NAME\"; and writes none. --allow-scripts lets it do anything.)";
    throw std::runtime_error(message);
}

/** Element types as ccx should take them: reduced integration, which does not lock in bending. **/
std::string chooseType(const std::string& type) {
    if (type == "C3D8") return "C3D8R";
    if (type == "C3D20") return "C3D20R";
    return type;
}

/** The shell that a surface element is, null for others. **/
const char* findShell(const std::string& type) {
    if (type == "CPS3") return "S3";
    if (type == "CPS4") return "S4";
    if (type == "CPS6") return "S6";
    return type == "CPS8" ? "S8R" : nullptr;
}

/** Writes the deck: nodes, solids (or shells) and node sets of Gmsh's mesh, the material, a
 *section.
 **/
void writeDeck(const std::string& path, const fs::path& mesh, const GmshOptions& options,
               const fs::path& deck) {
    const Material& material = options.material;
    const bool isSheet = options.thickness > 0;
    std::ofstream out(deck);
    out.imbue(std::locale::classic());
    std::set<std::string> types;
    for (DeckCard& card : readDeckCards(mesh.string())) {
        if (card.keyword == "ELEMENT") {
            const char* shell = findShell(card.get("TYPE"));
            if (isSheet ? !shell : !findSolid(card.get("TYPE"))) continue;
            card.parameters["TYPE"] = isSheet ? shell : chooseType(card.get("TYPE"));
            card.parameters["ELSET"] = SolidsSet;
            types.insert(card.get("TYPE"));
        } else if (card.keyword != "NODE" && card.keyword != "NSET") {
            continue;
        }
        writeCard(out, card);
    }
    if (types.empty() && isSheet)
        throw std::invalid_argument(path +
                                    ": the mesh has no surface elements that a thickness could be "
                                    "given; a surface must be meshed (in a script with physical "
                                    "groups, one must be a Physical Surface)");
    if (types.empty())
        throw std::invalid_argument(
            path +
            ": the mesh has no solid elements; a volume must be meshed (in a script with "
            "physical groups, one must be a Physical Volume); of sheets, give the thickness");
    out << "*MATERIAL, NAME=" << material.name << "\n*ELASTIC\n"
        << number(material.E) << "," << number(material.nu) << "\n*DENSITY\n"
        << number(material.rho) << (isSheet ? "\n*SHELL" : "\n*SOLID")
        << " SECTION, ELSET=" << SolidsSet << ", MATERIAL=" << material.name << "\n";
    if (isSheet) out << number(options.thickness) << "\n";
    if (!out.flush())
        throw std::runtime_error("cannot write the deck '" + deck.string() +
                                 "'; is the disk full?");
}

}  // namespace

bool isGmshScript(const std::string& path) {
    return suffixOf(path) == ".geo";
}

std::vector<std::string> listScriptFiles(const std::string& path) {
    std::vector<std::string> files = {path, path + ".opt"};
    for (size_t k = 0; k < files.size() && k < MostScripts; ++k) {
        const std::string file = files[k], suffix = suffixOf(file);
        const auto add = [&](const std::string& name) {
            if (std::find(files.begin(), files.end(), name) == files.end()) files.push_back(name);
        };
        // Whatever is no geometry or mesh is a script, with any ending.
        if (suffix == ".step" || suffix == ".stp" || suffix == ".brep" || suffix == ".iges" ||
            suffix == ".igs")
            continue;
        if (!fs::is_regular_file(file)) continue;
        std::ifstream in(file, std::ios::binary);
        const std::string text(std::istreambuf_iterator<char>(in), {});
        if (text.compare(0, 1, "$") == 0) continue;
        for (const std::string& name : findIncludes(text))
            add((fs::path(file).parent_path() / name).string());
    }
    return files;
}

FeModel readGmshPart(const std::string& path, const GmshOptions& options) {
    options.material.validate();
    if (options.order < 0 || options.order > 2)
        throw std::invalid_argument("elements of order " + std::to_string(options.order) +
                                    " are not known; choose 1 or 2");
    if (!(options.thickness >= 0) || !std::isfinite(options.thickness))
        throw std::invalid_argument("the thickness is " + writeGeneral(options.thickness, 6) +
                                    ", must be positive");
    if (!fs::is_regular_file(path)) throw std::runtime_error("cannot read part '" + path + "'");
    TemporaryFolder folder;
    runGmsh(path, options, folder.path());
    const fs::path deck =
        options.keepDeck.empty() ? folder.path() / "part.inp" : fs::path(options.keepDeck);
    writeDeck(path, folder.path() / MeshName, options, deck);

    FeModel model;
    try {
        model = readCalculixDeck(deck.string(), options.calculix);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path + ": the mesh cannot be reduced: " + error.what());
    }
    if (options.keepDeck.empty()) model.source = path;
    const double E = options.material.E, nu = options.material.nu, rho = options.material.rho;
    char text[160];
    std::snprintf(text, sizeof text, "material %s: E %.4g Pa, nu %.3g, rho %.4g kg/m³",
                  options.material.name.c_str(), E, nu, rho);
    model.notes.push_back(text);
    if (options.calculix.note) options.calculix.note(text);
    for (const ElementBlock& block : model.mesh.elements)
        if (block.type == ElementType::Tet4 || block.type == ElementType::Wedge6) {
            const std::string warning =
                "linear tetrahedra and wedges are far too stiff in bending: use order 2";
            model.warnings.push_back(warning);
            if (options.calculix.warn) options.calculix.warn(warning);
        }
    return model;
}

}  // namespace simflex
