#include "simflex/fe/GmshPart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "StepSolids.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NameDistance.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Sandbox.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/fe/ProgramRun.h"
#include "simflex/fe/decks/DeckModel.h"
#include "simflex/fe/decks/DeckVocabulary.h"
#include "simflex/fe/decks/ElementShapes.h"
#include "simflex/fe/decks/InpCards.h"
#include "simflex/fe/decks/ThinElements.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr const char* MeshName = "mesh.inp";
const std::string SolidsSet = "SIMFLEX_SOLIDS";
constexpr size_t MostGmshLines = 12;
constexpr int MostElements = 20000000;
constexpr size_t MostVolumes = 100000;
constexpr size_t MostScripts = 1000;  ///< scripts included at most
constexpr double Millimetre = 1e-3;
// Elastic analogy, then optimization.
constexpr const char* Untangling = "Mesh.HighOrderOptimize";
constexpr double Untangled = 3;

std::string number(double value) {
    return writeFortran(value, 13);
}

std::string suffixOf(const std::string& path) {
    return lowerCase(fs::path(path).extension().string());
}

/** Returns quoted names in statements and options that read files. **/
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

/** Returns the lines in which Gmsh reports errors. **/
std::string readErrors(const fs::path& log) {
    std::ifstream in(log);
    std::string errors;
    size_t count = 0;
    for (std::string line; std::getline(in, line) && count < MostGmshLines;)
        if (line.compare(0, 5, "Error") == 0) errors += "\n    " + line, ++count;
    return errors;
}

/** Gmsh runs a file as a script unless it begins like a mesh: it compares the first bytes
literally, without skipping blanks or empty lines. **/
void checkIsMesh(const std::string& path) {
    std::string first(16, '\0');
    openInputFile(path).read(first.data(), std::streamsize(first.size()));
    for (const char* known : {"$MeshFormat", "$Comments", "$NOD", "$NOE", "$PARA", "$ELM"})
        if (first.rfind(known, 0) == 0) return;
    throw std::invalid_argument("'" + path + "' is not a mesh of Gmsh: it does not begin with " +
                                "$MeshFormat");
}

/** Returns whether a file is in a folder or its subfolders, after resolving links. **/
bool isInside(const fs::path& file, const fs::path& folder) {
    std::error_code unknown;  // for invalid names
    const fs::path relative =
        fs::weakly_canonical(file, unknown).lexically_relative(fs::canonical(folder, unknown));
    return !unknown && !relative.empty() && *relative.begin() != "..";
}

/** Returns the resources that Gmsh needs to read a file. @param file  a script, or data **/
Sandbox makeSandbox(const std::string& program, const std::string& file,
                    const std::string& libraryPath, const fs::path& folder) {
    Sandbox sandbox;
    sandbox.program = findProgram(program);
    sandbox.readable = listSystemFolders();
    // Gmsh's own installation.
    sandbox.readable.push_back((fs::path(sandbox.program).parent_path() / "../lib").string());
    std::istringstream libraries(libraryPath);
    for (std::string place; std::getline(libraries, place, ':');) sandbox.readable.push_back(place);
    if (isGmshScript(file)) {
        for (const std::string& read : listScriptFiles(file))
            if (isInputFile(read) && isInside(read, fs::path(file).parent_path()))
                sandbox.readable.push_back(read);
    } else {
        sandbox.readable.push_back(file);
    }
    sandbox.writable = folder.string();
    return sandbox;
}

/** Returns whether Gmsh runs in a sandbox: for data, too, since Gmsh decides by a file's content
whether it is a script. @throws std::runtime_error if a sandbox is required but not available. **/
bool needsSandbox(const std::string& path, const GmshOptions& options) {
    if (options.allowsScripts) return false;
    const std::string obstacle = findSandboxObstacle();
    if (obstacle.empty()) return true;
    const char* wish = std::getenv("SIMFLEX_SANDBOX");
    if (wish && std::string(wish) == "optional") return false;
    if (!isGmshScript(path))
        throw std::runtime_error(
            path + ": Gmsh reads files in a sandbox, and this system has none: " + obstacle +
            "; if you trust the file, give --allow-scripts");
    throw std::runtime_error(
        path + ": a script of Gmsh is a program, and this system cannot keep it in a sandbox: " +
        obstacle + "; if you trust it, give --allow-scripts");
}

std::string chooseGmshProgram(const std::string& wish) {
    const char* fromEnvironment = std::getenv("SIMFLEX_GMSH");
    const std::string program = !wish.empty() ? wish : fromEnvironment ? fromEnvironment : "gmsh";
    // Gmsh will run in another folder.
    return program.find('/') == std::string::npos ? program : fs::absolute(program).string();
}

/** Writes a script that stops Gmsh before it meshes CAD geometry with more elements than any
machine could hold. @return the script's name in the folder **/
std::string writeSizeCheck(double meshSize, const fs::path& folder) {
    // Number of tetrahedra with edges h in a volume V: 6 √2 V/h³.
    std::ofstream out(folder / "size_check.geo");
    out << "SetFactory(\"OpenCASCADE\");\nvolumes() = Volume{:};\ntotal = 0;\n"
           "For k In {0 : #volumes() - 1}\n  total += Mass Volume{volumes(k)};\nEndFor\n"
           "millions = 8.5e-6 * total / Mesh.CharacteristicLengthMax^3;\n"
        << "If (millions > " << MostElements / 1000000
        << ")\n  Error(\"elements of %g would be about %g million; choose a larger size\", "
        << number(meshSize) << ", millions);\n  Exit;\nEndIf\n";
    return "size_check.geo";
}

/** Runs Gmsh in the folder, where it must write `output`. **/
void callGmsh(const std::string& path, const GmshOptions& options, const fs::path& folder,
              std::vector<std::string> arguments, const std::string& output) {
    const bool isInSandbox = needsSandbox(path, options);
    ProgramRun run;
    run.program = chooseGmshProgram(options.program);
    run.arguments = std::move(arguments);
    run.folder = folder;
    run.log = folder / "gmsh.log";
    run.cure = "Install it (Debian: gmsh), or set SIMFLEX_GMSH to its path.";

    // The user's own options would change the mesh.
    run.environment["GMSH_HOME"] = folder.string();
    Sandbox sandbox;
    if (isInSandbox) {
        const std::string libraries = run.environment["LD_LIBRARY_PATH"];
        sandbox = makeSandbox(run.program, fs::absolute(path).string(), libraries, folder);
        if (!sandbox.program.empty()) run.program = sandbox.program;
        run.sandbox = &sandbox;
        run.environment = {{"GMSH_HOME", folder.string()},
                           {"HOME", folder.string()},
                           {"LC_ALL", "C"},
                           {"LD_LIBRARY_PATH", libraries},
                           {"OMP_NUM_THREADS", "1"}};
    }
    ChildProcess process = startProgram(run);
    const std::string suffix = suffixOf(path);
    const ChildEnd& end = waitForProgram(
        process,
        suffix == ".msh" || suffix == ".unv" ? "Gmsh converts the mesh" : "Gmsh meshes the part",
        options.calculix.progress);
    checkSpace(folder, "Gmsh cannot write the mesh");  // Gmsh continues on a full disk and
                                                       // truncates the mesh
    const std::string errors = readErrors(run.log);
    if (end.isSuccess() && errors.empty() &&
        fs::is_regular_file(fs::symlink_status(folder / output)))
        return;
    std::string message =
        path + ": Gmsh could not mesh the part:" + (end.signal ? " it " + end.describe() : "") +
        (errors.empty() ? readLastLines(run.log, MostGmshLines) : errors);
    const auto says = [&](const char* words) { return errors.find(words) != std::string::npos; };
    if (isInSandbox && isGmshScript(path) &&
        (says("Unable to open file") || says("/bin/sh") || says("socket")))
        message +=
            "\n  (A script reads only files of its own folder that it names plainly, Include "
            "\"NAME\"; and writes none. --allow-scripts lets it do anything.)";
    if (suffix == ".msh" && says("No elements in volume"))
        message +=
            "\n  (The mesh has volumes without elements: those that are in no physical group are "
            "not written. Put them in one, Physical Volume, or take them out of the geometry.)";
    throw std::runtime_error(message);
}

/** Converts a name as Gmsh does when it writes a deck, to upper case. **/
std::string groupName(const std::string& name) {
    std::string group;
    for (const char c : name)
        group += isLetter(c) || isDigit(c) || c == '-' || c == '.' ? toUpper(c) : '_';
    return group;
}

std::string joined(const std::set<std::string>& names) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    return list;
}

/** Decides which solids and groups belong to the part, and their materials. **/
class Choice {
public:
    Choice(const std::string& path, const GmshOptions& options) : m_path(path) {
        for (const std::string& solid : options.solids) m_solids.insert(groupName(solid));
        for (size_t k = 0; k < options.materials.size(); ++k)
            m_materials[groupName(options.materials[k].name)] = int(k);
        m_hasOthers = !options.material.name.empty();
    }

    bool isNeeded() const { return !m_solids.empty() || !m_materials.empty(); }

    bool isOfPart(const std::set<std::string>& groups) const {
        return m_solids.empty() || std::any_of(groups.begin(), groups.end(), [&](const auto& name) {
                   return m_solids.count(name) > 0;
               });
    }

    /** Returns the index of the material of elements in these groups, −1: the common one. **/
    int findMaterial(const std::set<std::string>& groups) const {
        const std::string* first = nullptr;
        int material = -1;
        for (const std::string& group : groups) {
            const auto found = m_materials.find(group);
            if (found == m_materials.end()) continue;
            if (first && material != found->second)
                throw std::invalid_argument(m_path + ": one solid is " + *first + " and " + group +
                                            ", which have different materials");
            first = &group;
            material = found->second;
        }
        if (!first && !m_hasOthers)
            throw std::invalid_argument(
                m_path + ": no material is given to " +
                (groups.empty() ? "a solid of no name" : "the solid " + joined(groups)) +
                "; give that of all others, too");
        return material;
    }

    /** @throws std::invalid_argument for a name that does not occur in the file. **/
    void checkNames(const std::set<std::string>& known) const {
        const auto check = [&](const std::string& name) {
            if (known.count(name)) return;
            throw std::invalid_argument(
                m_path + ": it has no solid or physical group " + name +
                (known.empty() ? ", for it names none" : "; there are " + joined(known)));
        };
        for (const std::string& solid : m_solids) check(solid);
        for (const auto& material : m_materials) check(material.first);
    }

private:
    const std::string m_path;
    std::set<std::string> m_solids;
    std::map<std::string, int> m_materials;
    bool m_hasOthers = false;
};

/** Returns the corners [m] of Gmsh's volumes in geometry.step, in order. **/
std::vector<std::vector<Vec3d>> listCorners(const std::string& path, const GmshOptions& options,
                                            const fs::path& folder, const std::string& geometry) {
    const std::string script = "corners.geo", output = "corners.txt";
    std::ofstream(folder / script)
        << "SetFactory(\"OpenCASCADE\");\nGeometry.OCCTargetUnit = \"M\";\n"
        << "v() = ShapeFromFile(\"" << geometry << "\");\n"
        << "Printf(\"%g\", #v()) > \"" << output << "\";\n"
        << "For i In {0 : #v() - 1}\n  p() = PointsOf{ Volume{v(i)}; };\n"
           "  For k In {0 : #p() - 1}\n    c() = Point{p(k)};\n"
           "    Printf(\"%g %.16g %.16g %.16g\", i, c(0), c(1), c(2)) >> \""
        << output << "\";\n  EndFor\nEndFor\n";
    callGmsh(path, options, folder, {script, "-0"}, output);
    std::ifstream in(folder / output);
    in.imbue(std::locale::classic());
    size_t count = 0, volume = 0;
    in >> count;
    std::vector<std::vector<Vec3d>> corners(std::min(count, MostVolumes));
    for (Vec3d x; in >> volume >> x[0] >> x[1] >> x[2];)
        if (volume < corners.size()) corners[volume].push_back(x);
    return corners;
}

/** Writes a script that makes Gmsh read the selected solids of an assembly, join those that touch,
and name them. @return the script's name in the folder; empty: there is only one solid **/
std::string writeAssembly(const std::string& path, const GmshOptions& options,
                          const fs::path& folder, const std::string& geometry) {
    const Choice choice(path, options);
    const std::vector<StepSolid> solids = readStepSolids(path);
    if (solids.size() < 2 && !choice.isNeeded()) return "";
    std::set<std::string> known;
    for (const StepSolid& solid : solids)
        for (const std::string& name : solid.names) known.insert(groupName(name));
    choice.checkNames(known);
    const auto corners = listCorners(path, options, folder, geometry);
    std::vector<std::set<std::string>> groupsOf(corners.size());
    const std::vector<int> volumeOf = matchSolids(solids, corners);
    for (size_t k = 0; k < solids.size(); ++k) {
        std::set<std::string> groups;
        for (const std::string& name : solids[k].names) groups.insert(groupName(name));
        if (volumeOf[k] >= 0) groupsOf[size_t(volumeOf[k])] = groups;
    }
    std::vector<size_t> kept, left;
    for (size_t k = 0; k < corners.size(); ++k) {
        if (choice.isNeeded() && groupsOf[k].empty())
            throw std::invalid_argument(path + ": Gmsh's volume " + std::to_string(k + 1) +
                                        " has the corners of no solid of the file, so that simflex "
                                        "cannot tell its name; export the solids one by one");
        (choice.isOfPart(groupsOf[k]) ? kept : left).push_back(k);
        for (size_t other = 0; other < k; ++other)
            if (choice.isNeeded() && groupsOf[other] != groupsOf[k] &&
                haveSameCorners(corners[other], corners[k]) &&
                (choice.isOfPart(groupsOf[other]) != choice.isOfPart(groupsOf[k]) ||
                 choice.findMaterial(groupsOf[other]) != choice.findMaterial(groupsOf[k])))
                throw std::invalid_argument(path + ": the solids " + joined(groupsOf[other]) +
                                            " and " + joined(groupsOf[k]) +
                                            " have the same corners, by which simflex tells them; "
                                            "export them one by one");
    }
    std::map<std::string, std::string> volumesOf;
    std::ofstream out(folder / "assembly.geo");
    const auto list = [](const std::vector<size_t>& indices) {
        std::string text;
        for (const size_t k : indices)
            text += (text.empty() ? "v(" : ", v(") + std::to_string(k) + ")";
        return text;
    };
    out << "SetFactory(\"OpenCASCADE\");\n";
    if (options.lengthUnit == 0) out << "Geometry.OCCTargetUnit = \"M\";\n";
    out << "v() = ShapeFromFile(\"" << geometry << "\");\n";
    if (!left.empty()) out << "Recursive Delete { Volume{" << list(left) << "}; }\n";
    out << "k() = {" << list(kept) << "};\n";
    if (kept.size() > 1)
        out << "m() = {};\nFor i In {0 : #k() - 1}\n  n = Mass Volume{k(i)};\n  m(i) = n;\nEndFor\n"
               "w() = BooleanFragments{ Volume{k(0)}; Delete; }"
               "{ Volume{k({1 : #k() - 1})}; Delete; };\n"
               "If (#w() != #k())\n"
               "  Error(\"its solids overlap: %g of them make %g pieces; they may touch\", #k(), "
               "#w());\n  Exit;\nEndIf\n"
               "For i In {0 : #k() - 1}\n  n = Mass Volume{k(i)};\n"
               "  If (Fabs(n - m(i)) > 1e-6 * m(i))\n"
               "    Error(\"solids change when those that touch are joined\");\n    Exit;\n"
               "  EndIf\nEndFor\n";
    for (const size_t k : kept)
        for (const std::string& group :
             groupsOf[k].empty() ? std::set<std::string>{"SOLID_" + std::to_string(k + 1)}
                                 : groupsOf[k])
            volumesOf[group] +=
                (volumesOf[group].empty() ? "v(" : ", v(") + std::to_string(k) + ")";
    for (const auto& [group, volumes] : volumesOf)
        out << "Physical Volume(\"" << group << "\") = {" << volumes << "};\n";
    return "assembly.geo";
}

/** @returns whether it is an assembly, whose names have been checked **/
bool runGmsh(const std::string& path, const GmshOptions& options, const fs::path& folder) {
    const std::string suffix = suffixOf(path);
    const bool isMesh = suffix == ".msh" || suffix == ".unv",
               isStep = suffix == ".step" || suffix == ".stp",
               isIges = suffix == ".iges" || suffix == ".igs";
    // Gmsh assumes millimetres for IGES, whatever its unit; IGES files often contain surfaces only.
    const bool isMillimetres = isIges && options.lengthUnit == 0;
    const bool isScript = isGmshScript(path);
    if (suffix == ".msh") checkIsMesh(path);

    // With NAME.step Gmsh would also run NAME.step.opt, so data is linked in an empty folder.
    const std::string given = fs::absolute(path).string(), geometry = "geometry" + suffix;
    if (!isScript) fs::create_symlink(given, folder / geometry);
    const std::string assembly =
        isStep && options.thickness == 0 ? writeAssembly(path, options, folder, geometry) : "";
    std::vector<std::string> arguments = {isScript           ? given
                                          : assembly.empty() ? geometry
                                                             : assembly,
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
        arguments.insert(arguments.end(), words);
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
    for (const auto& [name, value] : options.settings) add({"-setnumber", name, number(value)});
    callGmsh(path, options, folder, arguments, MeshName);
    return !assembly.empty();
}

/** Returns the element type used: with reduced integration, which does not lock in bending. **/
std::string chooseType(const std::string& type) {
    if (type == "C3D8") return "C3D8R";
    if (type == "C3D20") return "C3D20R";
    return type;
}

/** Returns the shell type for a surface element, null for others. **/
const char* findShell(const std::string& type) {
    if (type == "CPS3") return "S3";
    if (type == "CPS4") return "S4";
    if (type == "CPS6") return "S6";
    return type == "CPS8" ? "S8R" : nullptr;
}

/** Returns the elements of the part, by number, with the index of their material, −1: the common
one. **/
std::map<int, int> findElements(const std::vector<DeckCard>& cards, const Choice& choice,
                                bool areNamesToCheck) {
    std::map<int, std::set<std::string>> groupsOf;
    std::set<std::string> known;
    for (const DeckCard& card : cards)
        if (card.keyword == "ELSET") {
            known.insert(groupName(card.get("ELSET")));
            for (const DeckLine& data : card.data)
                for (const std::string& field : data.fields)
                    if (!field.empty())
                        groupsOf[parseDeckInteger(field, card, data)].insert(
                            groupName(card.get("ELSET")));
        }
    if (areNamesToCheck) choice.checkNames(known);
    std::map<std::set<std::string>, int> materialOf;  // few combinations, but many elements
    std::map<int, int> result;
    for (const auto& [element, groups] : groupsOf) {
        if (!choice.isOfPart(groups)) continue;
        const auto found = materialOf.find(groups);
        result[element] = found != materialOf.end()
                              ? found->second
                              : (materialOf[groups] = choice.findMaterial(groups));
    }
    return result;
}

/** Divides the elements of a card by material and drops those outside the part. **/
std::map<int, DeckCard> divideElements(const DeckCard& card, size_t numNodes,
                                       const std::map<int, int>& materialOf) {
    std::map<int, DeckCard> result;
    size_t numNumbers = 0;
    DeckCard* part = nullptr;
    for (const DeckLine& data : card.data) {
        if (numNumbers == 0) {
            const auto found = materialOf.find(parseDeckInteger(data.fields[0], card, data));
            part = found == materialOf.end() ? nullptr : &result[found->second];
            if (part && part->data.empty()) {
                *part = card;
                part->data.clear();
            }
        }
        for (const std::string& field : data.fields) numNumbers += !field.empty();
        if (part) part->data.push_back(data);
        if (numNumbers > numNodes) numNumbers = 0;
    }
    return result;
}

/** Describes the volumes of a mesh (format 4, text) without physical group if others have one: Gmsh
omits their elements. **/
std::vector<std::string> listVolumesLeftOut(const std::string& path) {
    std::ifstream in(path);
    std::string line;
    while (std::getline(in, line) && line.rfind("$Entities", 0) != 0) {
        if (line.rfind("$Nodes", 0) == 0) return {};
    }
    std::array<size_t, 4> counts{};  // points, curves, surfaces, volumes
    if (!std::getline(in, line)) return {};
    std::istringstream numbers(line);
    numbers.imbue(std::locale::classic());
    if (!(numbers >> counts[0] >> counts[1] >> counts[2] >> counts[3])) return {};
    for (size_t k = counts[0] + counts[1] + counts[2]; k > 0; --k)
        if (!std::getline(in, line)) return {};
    std::vector<std::string> leftOut;
    for (size_t k = 0; k < counts[3] && std::getline(in, line); ++k) {
        std::istringstream volume(line);
        volume.imbue(std::locale::classic());
        int tag = 0, numGroups = 0;
        std::array<double, 6> box{};
        volume >> tag;
        for (double& side : box) volume >> side;
        if (!(volume >> numGroups)) return {};
        if (numGroups > 0) continue;
        char text[200];
        std::snprintf(text, sizeof text, "%d (from %.4g, %.4g, %.4g to %.4g, %.4g, %.4g)", tag,
                      box[0], box[1], box[2], box[3], box[4], box[5]);
        leftOut.push_back(text);
    }
    if (leftOut.size() == counts[3]) return {};  // without groups Gmsh keeps all
    return leftOut;
}

/** Writes the deck: nodes, solids (or shells) and node sets of Gmsh's mesh, materials and sections.
@param areNamesToCheck  checks names against those of the mesh
@return the materials used, as notes **/
std::vector<std::string> writeDeck(const std::string& path, const fs::path& mesh,
                                   const GmshOptions& options, bool areNamesToCheck,
                                   const fs::path& deck) {
    const bool isSheet = options.thickness > 0;
    const Choice choice(path, options);
    std::ofstream out(deck);
    out.imbue(std::locale::classic());
    const std::vector<DeckCard> cards =
        readDeckCards(mesh.string(), options.calculix.progress, DeckIncludes::Refused);
    std::map<int, int> materialOf;
    if (choice.isNeeded()) materialOf = findElements(cards, choice, areNamesToCheck);
    std::set<int> materials;
    const auto setOf = [&](int material) {
        return SolidsSet + (material < 0 ? "" : "_" + std::to_string(material + 1));
    };
    for (const DeckCard& card : cards) {
        if (card.keyword == "ELEMENT") {
            const std::string& type = card.get("TYPE");
            const char* shell = findShell(type);
            const ElementType* solid = findSolid(type);
            if (isSheet ? !shell : !solid) continue;
            std::map<int, DeckCard> parts;
            if (!choice.isNeeded())
                parts[-1] = card;
            else
                parts = divideElements(
                    card, size_t(isSheet ? findThinType(shell)->numNodes : numNodesOf(*solid)),
                    materialOf);
            for (auto& [material, part] : parts) {
                part.parameters["TYPE"] = isSheet ? shell : chooseType(type);
                part.parameters["ELSET"] = setOf(material);
                materials.insert(material);
                writeCard(out, part);
            }
        } else if (card.keyword == "NODE" || card.keyword == "NSET") {
            writeCard(out, card);
        }
    }
    if (materials.empty() && isSheet)
        throw std::invalid_argument(path +
                                    ": the mesh has no surface elements that a thickness could be "
                                    "given; a surface must be meshed (in a script with physical "
                                    "groups, one must be a Physical Surface)");
    if (materials.empty())
        throw std::invalid_argument(
            path +
            ": the mesh has no solid elements; a volume must be meshed (in a script with "
            "physical groups, one must be a Physical Volume); of sheets, give the thickness");
    std::vector<std::string> notes;
    for (const int k : materials) {
        const Material& material = k < 0 ? options.material : options.materials[size_t(k)].material;
        const std::string of = k < 0 ? "" : groupName(options.materials[size_t(k)].name),
                          name = material.name + (k < 0 ? "" : "_" + std::to_string(k + 1));
        out << "*MATERIAL, NAME=" << name << "\n*ELASTIC\n"
            << number(material.E) << "," << number(material.nu) << "\n*DENSITY\n"
            << number(material.rho) << (isSheet ? "\n*SHELL" : "\n*SOLID")
            << " SECTION, ELSET=" << setOf(k) << ", MATERIAL=" << name << "\n";
        if (isSheet) out << number(options.thickness) << "\n";
        char text[160];
        std::snprintf(text, sizeof text, "material %s: E %.4g Pa, nu %.3g, rho %.4g kg/m³",
                      material.name.c_str(), material.E, material.nu, material.rho);
        notes.push_back((of.empty() ? "" : of + ": ") + text);
    }
    if (!out.flush())
        throw std::runtime_error("cannot write the deck '" + deck.string() +
                                 "'; is the disk full?");
    return notes;
}

/** Checks constants: Gmsh silently ignores names that the script does not contain. **/
void checkSettings(const std::string& path, const GmshOptions& options) {
    const auto isPart = [](char c) { return isLetter(c) || isDigit(c) || c == '_'; };
    std::vector<std::string> known;
    std::string texts;
    if (isGmshScript(path))
        for (const std::string& file : listScriptFiles(path)) {
            std::ifstream in = openInputFile(file);
            texts += std::string(std::istreambuf_iterator<char>(in), {}) + '\n';
        }
    for (size_t i = 0; i < texts.size();) {
        const size_t begin = i;
        while (i < texts.size() && isPart(texts[i])) ++i;
        if (i > begin && !isDigit(texts[begin])) known.push_back(texts.substr(begin, i - begin));
        if (i == begin) ++i;
    }
    for (const auto& [name, value] : options.settings) {
        if (!std::isfinite(value))
            throw std::invalid_argument("the setting '" + name + "' of " + path + " is not finite");
        if (name.find('.') != std::string::npos) continue;  // one of Gmsh's options
        bool isKnown = false;                               // ONELAB names may be paths
        for (size_t at = texts.find(name); at != std::string::npos && !isKnown;
             at = texts.find(name, at + 1))
            isKnown = !(at > 0 && isPart(texts[at - 1])) &&
                      !(at + name.size() < texts.size() && isPart(texts[at + name.size()]));
        if (isKnown && !name.empty()) continue;
        const std::string nearest = findNearestName(name, known);
        throw std::invalid_argument(
            isGmshScript(path) ? "the script " + path + " has no constant '" + name + "'" +
                                     (nearest.empty() ? "" : "; did you mean '" + nearest + "'?")
                               : path + " is no script (.geo) and has no constant '" + name + "'");
    }
}

/** Meshes and reads the part.
@throws BadElementShape for inverted elements **/
FeModel meshPart(const std::string& path, const GmshOptions& options) {
    TemporaryFolder folder;
    const bool isAssembly = runGmsh(path, options, folder.path());
    const fs::path deck =
        options.keepDeck.empty() ? folder.path() / "part.inp" : fs::path(options.keepDeck);
    const std::vector<std::string> materials =
        writeDeck(path, folder.path() / MeshName, options, !isAssembly, deck);

    // Remove positions in a deck that no longer exists.
    const auto withoutPlace = [&](std::string text) {
        const std::string name = deck.string() + ":";
        for (size_t at; options.keepDeck.empty() && (at = text.find(name)) != std::string::npos;) {
            size_t end = at + name.size();
            while (end < text.size() && (isDigit(text[end]) || text[end] == ':')) ++end;
            if (end < text.size() && text[end] == ' ') ++end;
            text.erase(at, end - at);
        }
        return text;
    };
    CalculixOptions calculix = options.calculix;
    calculix.refusesIncludes = true;
    for (auto member : {&CalculixOptions::note, &CalculixOptions::warn})
        if (options.calculix.*member)
            calculix.*member = [&options, member, withoutPlace](const std::string& text) {
                (options.calculix.*member)(withoutPlace(text));
            };
    FeModel model;
    try {
        model = readCalculixDeck(deck.string(), calculix);
    } catch (const BadElementShape& error) {
        throw BadElementShape(path + ": the mesh cannot be reduced: " + withoutPlace(error.what()));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path +
                                    ": the mesh cannot be reduced: " + withoutPlace(error.what()));
    }
    for (auto* texts : {&model.notes, &model.warnings})
        for (std::string& text : *texts) text = withoutPlace(text);
    if (options.keepDeck.empty()) model.source = path;
    for (const std::string& text : materials) {
        model.notes.push_back(text);
        if (options.calculix.note) options.calculix.note(text);
    }
    if (suffixOf(path) == ".msh" && !(options.thickness > 0))
        for (const std::string& volume : listVolumesLeftOut(path)) {
            const std::string warning = "volume " + volume +
                                        " is in no physical group, and left out of the part: put "
                                        "it in one (Physical Volume) where it was meshed";
            model.warnings.push_back(warning);
            if (options.calculix.warn) options.calculix.warn(warning);
        }
    return model;
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
        // Any file that is no geometry or mesh is a script, whatever its suffix.
        if (suffix == ".step" || suffix == ".stp" || suffix == ".brep" || suffix == ".iges" ||
            suffix == ".igs")
            continue;
        std::ifstream in = openInputFile(file);
        const std::string text(std::istreambuf_iterator<char>(in), {});
        if (text.compare(0, 1, "$") == 0) continue;
        for (const std::string& name : findIncludes(text))
            add((fs::path(file).parent_path() / name).string());
    }
    return files;
}

FeModel readGmshPart(const std::string& path, const GmshOptions& options) {
    if (!options.material.name.empty() || options.materials.empty()) options.material.validate();
    for (const NamedMaterial& named : options.materials) named.material.validate();
    if (options.order < 0 || options.order > 2)
        throw std::invalid_argument("elements of order " + std::to_string(options.order) +
                                    " are not known; choose 1 or 2");
    if (!(options.thickness >= 0) || !std::isfinite(options.thickness))
        throw std::invalid_argument("the thickness is " + writeGeneral(options.thickness, 6) +
                                    "; it must be positive");
    if (!isInputFile(path)) throw std::runtime_error("cannot read part '" + path + "'");
    checkSettings(path, options);
    try {
        return meshPart(path, options);
    } catch (const BadElementShape&) {
        // Curving edges onto the geometry can invert thin elements.
        const bool isCurved =
                       options.order != 1 && suffixOf(path) != ".msh" && suffixOf(path) != ".unv",
                   isOptimized =
                       std::any_of(options.settings.begin(), options.settings.end(),
                                   [](const auto&one) { return one.first == Untangling; });
        if (!isCurved || isOptimized) throw;
    }
    GmshOptions again = options;
    again.settings.emplace_back(Untangling, Untangled);
    const std::string note =
        "curved elements of the first mesh were turned inside out: Gmsh has "
        "untangled them (" +
        std::string(Untangling) + " = " + number(Untangled) + ")";
    FeModel model;
    try {
        model = meshPart(path, again);
    } catch (const BadElementShape& error) {
        throw BadElementShape(std::string(error.what()) +
                              " Gmsh cannot untangle it: try another --mesh-size, or order 1");
    }
    model.notes.push_back(note);
    if (options.calculix.note) options.calculix.note(note);
    return model;
}

}  // namespace simflex
