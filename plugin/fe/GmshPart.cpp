#include "simflex/fe/GmshPart.h"

#include <sys/wait.h>

#include <cctype>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "CalculixRun.h"
#include "DeckModel.h"
#include "DeckVocabulary.h"
#include "InpCards.h"
#include "ProgramRun.h"
#include "simflex/part/NumberText.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr const char* kMeshName = "mesh.inp";
constexpr const char* kSolids = "SIMFLEX_SOLIDS";
constexpr size_t kMostErrorLines = 12;

std::string number(double value) {
    return writeFortran(value, 13);
}

std::string suffixOf(const std::string& path) {
    std::string suffix = fs::path(path).extension().string();
    for (char& c : suffix) c = char(std::tolower((unsigned char)(c)));
    return suffix;
}

/** Gmsh's error lines, or the end of what it said. **/
std::string errorTextOf(const fs::path& log) {
    std::ifstream in(log);
    std::deque<std::string> errors, tail;
    for (std::string line; std::getline(in, line);) {
        if (line.compare(0, 5, "Error") == 0 && errors.size() < kMostErrorLines)
            errors.push_back("\n    " + line);
        tail.push_back("\n    " + line);
        if (tail.size() > kMostErrorLines) tail.pop_front();
    }
    std::string text;
    for (const std::string& line : errors.empty() ? tail : errors) text += line;
    return text;
}

bool hasErrors(const fs::path& log) {
    std::ifstream in(log);
    for (std::string line; std::getline(in, line);)
        if (line.compare(0, 5, "Error") == 0) return true;
    return false;
}

void runGmsh(const std::string& path, const GmshOptions& options, const fs::path& folder) {
    const std::string suffix = suffixOf(path);
    const bool isMesh = suffix == ".msh", isStep = suffix == ".step" || suffix == ".stp";
    std::vector<std::string> arguments = {fs::absolute(path).string(),
                                          "-3",
                                          "-format",
                                          "inp",
                                          "-o",
                                          kMeshName,
                                          "-setnumber",
                                          "Mesh.SaveGroupsOfNodes",
                                          "1",
                                          "-setnumber",
                                          "Mesh.SecondOrderIncomplete",
                                          "1"};
    const auto add = [&](std::initializer_list<std::string> words) {
        arguments.insert(arguments.end(), words);
    };
    const int order = options.order == 0 && !isMesh ? 2 : options.order;
    if (order) add({"-order", std::to_string(order)});
    if (options.meshSize > 0) add({"-clmax", number(options.meshSize)});
    if (options.lengthUnit > 0) {
        add({"-setnumber", "Mesh.ScalingFactor", number(options.lengthUnit)});
    } else if (isStep) {
        add({"-setstring", "Geometry.OCCTargetUnit", "M"});
    }
    for (const auto& [name, value] : options.settings) add({"-setnumber", name, value});

    const char* fromEnvironment = std::getenv("SIMFLEX_GMSH");
    std::string program = !options.program.empty() ? options.program
                          : fromEnvironment        ? fromEnvironment
                                                   : "gmsh";
    if (program.find('/') != std::string::npos) program = fs::absolute(program).string();
    const fs::path log = folder / "gmsh.log";
    const int status = runProgram(program, arguments, folder, log,
                                  "Install it (Debian: gmsh), or set SIMFLEX_GMSH to its path.",
                                  isMesh ? "Gmsh converts the mesh" : "Gmsh meshes the part",
                                  options.calculix.progress);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || hasErrors(log) ||
        !fs::exists(folder / kMeshName))
        throw std::runtime_error(path + ": Gmsh could not mesh the part:" + errorTextOf(log));
}

/** Element types as ccx should take them: reduced integration, which does not lock in bending. **/
std::string chooseType(const std::string& type) {
    if (type == "C3D8") return "C3D8R";
    if (type == "C3D20") return "C3D20R";
    return type;
}

/** Writes the deck: nodes, solids and node sets of Gmsh's mesh, the material, a section. **/
void writeDeck(const std::string& path, const fs::path& mesh, const Material& material,
               const fs::path& deck) {
    std::ofstream out(deck);
    out.imbue(std::locale::classic());
    std::set<std::string> types;
    for (DeckCard& card : readDeckCards(mesh.string())) {
        if (card.keyword == "ELEMENT") {
            try {
                getSolid(card.get("TYPE"));
            } catch (const std::out_of_range&) {
                continue;
            }
            card.parameters["TYPE"] = chooseType(card.get("TYPE"));
            card.parameters["ELSET"] = kSolids;
            types.insert(card.get("TYPE"));
        } else if (card.keyword != "NODE" && card.keyword != "NSET") {
            continue;
        }
        writeCard(out, card);
    }
    if (types.empty())
        throw std::invalid_argument(
            path +
            ": the mesh has no solid elements; a volume must be meshed (in a script with "
            "physical groups, one must be a Physical Volume)");
    out << "*MATERIAL, NAME=" << material.name << "\n*ELASTIC\n"
        << number(material.E) << "," << number(material.nu) << "\n*DENSITY\n"
        << number(material.rho) << "\n*SOLID SECTION, ELSET=" << kSolids
        << ", MATERIAL=" << material.name << "\n";
    if (!out.flush())
        throw std::runtime_error("cannot write the deck '" + deck.string() +
                                 "'; is the disk full?");
}

}  // namespace

FeModel readGmshPart(const std::string& path, const GmshOptions& options) {
    options.material.validate();
    if (options.order < 0 || options.order > 2)
        throw std::invalid_argument("elements of order " + std::to_string(options.order) +
                                    " are not known; choose 1 or 2");
    if (!fs::is_regular_file(path)) throw std::runtime_error("cannot read part '" + path + "'");
    TemporaryFolder folder;
    runGmsh(path, options, folder.path());
    const fs::path deck =
        options.keepDeck.empty() ? folder.path() / "part.inp" : fs::path(options.keepDeck);
    writeDeck(path, folder.path() / kMeshName, options.material, deck);

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
