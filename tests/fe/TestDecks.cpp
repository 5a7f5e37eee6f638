#include "fe/TestDecks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace testing {
namespace {

namespace fs = std::filesystem;
constexpr int kTieNode = 100001;  // beyond every mesh; ccx reserves room for all numbers

/** Returns the nodes REF and ROT of tie `index` and the *RIGID BODY card. **/
std::string tieText(int index, const std::string& set, const std::array<double, 3>& point) {
    std::ostringstream text;
    text << std::setprecision(12);
    const int ref = kTieNode + 2 * index;
    for (int k = 0; k < 2; ++k)
        text << "*NODE, NSET=TIE" << index << "\n"
             << ref + k << "," << point[0] << "," << point[1] << "," << point[2] << "\n";
    text << "*RIGID BODY, NSET=" << set << ", REF NODE=" << ref << ", ROT NODE=" << ref + 1 << "\n";
    return text.str();
}

/** CalculiX itself takes Gmsh's skin elements for a plane model. Writes MESH_solid.inp without them
and DECK_solid.inp that includes it. @returns the name of that deck. **/
std::string withoutSkin(const TestFolder& folder, const std::string& deck) {
    const std::string stem = fs::path(deck).stem().string(), mesh = stem + "_mesh.inp";
    if (!fs::exists(folder / mesh)) return fs::path(deck).filename().string();
    std::istringstream lines(readText(folder / mesh));
    std::string solid;
    bool inSkin = false;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] == '*') inSkin = line.find("type=CPS") != std::string::npos;
        if (!inSkin) solid += line + "\n";
    }
    writeText(folder / (stem + "_solid_mesh.inp"), solid.substr(solid.find("*NODE")));
    std::string text = readText(deck);
    text.replace(text.find(mesh), mesh.size(), stem + "_solid_mesh.inp");
    writeText(folder / (stem + "_solid.inp"), text);
    return stem + "_solid.inp";
}

}  // namespace

bool hasCalculix() {
    static const bool isThere = std::system("command -v ccx >/dev/null") == 0;
    return isThere;
}

void runOrThrow(const std::string& command, const std::string& log) {
    if (std::system((command + " >'" + log + "' 2>&1").c_str()) != 0)
        throw std::runtime_error(command + " failed:\n" + readText(log));
}

std::string Brick::meshText(int firstNode, int firstElement) const {
    const bool quadratic = type.compare(0, 5, "C3D20") == 0;
    const int step = quadratic ? 2 : 1;
    const int n[3] = {step * elements[0], step * elements[1], step * elements[2]};
    auto number = [&](int i, int j, int k) {
        return firstNode + i + (n[0] + 1) * (j + (n[1] + 1) * k);
    };
    std::ostringstream text;
    text << std::setprecision(14) << "*NODE\n";
    std::map<std::string, std::vector<int>> sets;
    for (int k = 0; k <= n[2]; ++k)
        for (int j = 0; j <= n[1]; ++j)
            for (int i = 0; i <= n[0]; ++i) {
                if (quadratic && i % 2 + j % 2 + k % 2 > 1) continue;
                const int node = number(i, j, k);
                text << node << "," << size[0] * i / n[0] << ","
                     << size[1] * (double(j) / n[1] - 0.5) << ","
                     << size[2] * (double(k) / n[2] - 0.5) << "\n";
                sets["ALL"].push_back(node);
                if (i == 0) sets["LEFT"].push_back(node);
                if (i == n[0]) sets["RIGHT"].push_back(node);
                if (j == 0 && k == 0) sets["LINE"].push_back(node);
                if (i % n[0] == 0 && j % n[1] == 0 && k % n[2] == 0)
                    sets["CORNERS"].push_back(node);
            }
    sets["ONE"] = {sets["LINE"].front()};
    sets["TWO"] = {sets["LINE"].front(), sets["LINE"].back()};
    text << "*ELEMENT, TYPE=" << type << ", ELSET=BODY\n";
    static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const int edge[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    int element = firstElement;
    for (int k = 0; k < n[2]; k += step)
        for (int j = 0; j < n[1]; j += step)
            for (int i = 0; i < n[0]; i += step) {
                text << element++;
                for (const auto& c : corner)
                    text << "," << number(i + step * c[0], j + step * c[1], k + step * c[2]);
                if (quadratic) text << ",\n";
                for (int e = 0; quadratic && e < 12; ++e) {
                    const int *a = corner[edge[e][0]], *b = corner[edge[e][1]];
                    text << (e ? "," : "")
                         << number(i + a[0] + b[0], j + a[1] + b[1], k + a[2] + b[2]);
                }
                text << "\n";
            }
    for (const auto& [name, nodes] : sets) {
        text << "*NSET, NSET=" << name << "\n";
        for (const int node : nodes) text << node << ",\n";
    }
    return text.str();
}

std::string Brick::materialText() const {
    std::ostringstream text;
    text << "*MATERIAL, NAME=METAL\n*ELASTIC\n"
         << E << "," << nu << "\n*DENSITY\n"
         << rho << "\n*SOLID SECTION, ELSET=BODY, MATERIAL=METAL\n";
    return text.str();
}

DistortedCube::DistortedCube(const std::string& type)
    : nodes{{0, 0, 0},     {1, 0.1, 0}, {1.2, 1, 0.1}, {-0.1, 0.9, 0},
            {0, 0.1, 0.8}, {1.1, 0, 1}, {1, 1.1, 1.2}, {0.1, 1, 0.9}},
      _type(type) {
    const std::vector<std::pair<int, int>> hex{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                               {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
        wedge{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
        tet{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
    if (type.compare(0, 4, "C3D8") == 0 || type.compare(0, 5, "C3D20") == 0) {
        nodes.insert(nodes.end(), {{2, 0.1, 0.1}, {2.1, 0.8, 0.2}, {2.2, 0.1, 1}, {1.9, 1.2, 1.1}});
        elements = {{0, 1, 2, 3, 4, 5, 6, 7}, {1, 8, 9, 2, 5, 10, 11, 6}};
        if (type.compare(0, 4, "C3D8") != 0) addMiddles(hex);
    } else if (type == "C3D6" || type == "C3D15") {
        elements = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
        if (type == "C3D15") addMiddles(wedge);
    } else {
        elements = {{0, 1, 3, 4}, {1, 2, 3, 6}, {1, 6, 4, 5}, {3, 4, 6, 7}, {1, 3, 4, 6}};
        if (type != "C3D4") addMiddles(tet);
    }
}

void DistortedCube::addMiddles(const std::vector<std::pair<int, int>>& edges) {
    constexpr double kOff = 0.03;
    std::map<std::pair<int, int>, int> middles;
    for (auto& element : elements)
        for (const auto& edge : edges) {
            const int a = element[size_t(edge.first)], b = element[size_t(edge.second)];
            const auto [found, isNew] = middles.emplace(std::minmax(a, b), int(nodes.size()));
            element.push_back(found->second);
            if (!isNew) continue;
            std::array<double, 3> middle{};
            for (size_t k = 0; k < 3; ++k)
                middle[k] = 0.5 * (nodes[size_t(a)][k] + nodes[size_t(b)][k]) +
                            kOff * std::sin(double(nodes.size() + 2 * k));
            nodes.push_back(middle);
        }
}

std::string DistortedCube::meshText() const {
    std::ostringstream out;
    out << std::setprecision(12) << "*NODE\n";
    for (size_t k = 0; k < nodes.size(); ++k)
        out << k + 1 << "," << nodes[k][0] << "," << nodes[k][1] << "," << nodes[k][2] << "\n";
    out << "*ELEMENT, TYPE=" << _type << ", ELSET=BODY\n";
    for (size_t e = 0; e < elements.size(); ++e) {
        out << e + 1;
        for (size_t k = 0; k < elements[e].size(); ++k)
            out << (k == 12 ? ",\n" : ",") << elements[e][k] + 1;
        out << "\n";
    }
    return out.str() + "*ELSET, ELSET=ONE\n1,\n";
}

std::string meshExamplePart(const TestFolder& folder, const std::string& name,
                            const std::string& elementType, double h) {
    const std::string parts = std::string(SIMFLEX_SOURCE_DIR) + "/examples/parts/";
    const std::string deck = folder / (name + ".inp");
    runOrThrow("'" + parts + "make_deck.sh' '" + parts + name + ".geo' '" + deck + "' " +
                   elementType + " -setnumber h " + std::to_string(h) +
                   (elementType.compare(0, 5, "C3D20") == 0
                        ? " -order 2 -setnumber Mesh.SecondOrderIncomplete 1"
                        : ""),
               folder / "gmsh.log");
    return deck;
}

std::vector<double> calcCalculixFrequencies(
    const TestFolder& folder, const std::string& deck,
    const std::vector<std::pair<std::string, std::array<double, 3>>>& ties, int numModes,
    int numHeld) {
    std::string text = "*INCLUDE, INPUT=" + withoutSkin(folder, deck) + "\n";
    for (size_t k = 0; k < ties.size(); ++k) text += tieText(int(k), ties[k].first, ties[k].second);
    for (int k = 0; k < numHeld; ++k) text += "*BOUNDARY\nTIE" + std::to_string(k) + ", 1, 3, 0\n";
    text += "*STEP\n*FREQUENCY\n" + std::to_string(numModes) + "\n*END STEP\n";
    writeText(folder / "frequency.inp", text);
    runOrThrow("cd '" + folder.path() + "' && ccx frequency", folder / "ccx.log");

    std::ifstream in(folder / "frequency.dat");
    std::vector<double> hertz;
    std::string line;
    while (std::getline(in, line) && line.find("MODE NO") == std::string::npos) {
    }
    while (std::getline(in, line) && line.find("P A R T") == std::string::npos) {
        std::istringstream numbers(line);
        int mode;
        double eigenvalue, radians, cycles;
        if (numbers >> mode >> eigenvalue >> radians >> cycles) hertz.push_back(cycles);
    }
    if (int(hertz.size()) < numModes) throw std::runtime_error(readText(folder / "ccx.log"));
    return hertz;
}

namespace {

using Tie = std::pair<std::string, std::array<double, 3>>;

/** Returns the displacements of the nodes of `set` in a *STATIC step with the loads given as cards;
the first tie is held. **/
std::map<int, std::array<double, 3>> calcStaticDisplacements(const TestFolder& folder,
                                                             const std::string& deck,
                                                             const Tie& held, const Tie& other,
                                                             const std::string& set,
                                                             const std::string& loads) {
    std::ostringstream text;
    text << "*INCLUDE, INPUT=" << withoutSkin(folder, deck) << "\n"
         << tieText(0, held.first, held.second) << tieText(1, other.first, other.second)
         << "*BOUNDARY\nTIE0, 1, 3, 0\n*STEP\n*STATIC\n"
         << loads << "*NODE PRINT, NSET=" << set << "\nU\n*END STEP\n";
    writeText(folder / "static.inp", text.str());
    runOrThrow("cd '" + folder.path() + "' && ccx static", folder / "ccx.log");

    std::ifstream in(folder / "static.dat");
    std::map<int, std::array<double, 3>> u;
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        int node;
        std::array<double, 3> x;
        if (numbers >> node >> x[0] >> x[1] >> x[2]) u[node] = x;
    }
    if (u.empty()) throw std::runtime_error(readText(folder / "ccx.log"));
    return u;
}

/** Returns displacement and rotation of the second tie. **/
std::array<double, 6> calcStaticMotion(const TestFolder& folder, const std::string& deck,
                                       const Tie& held, const Tie& watched,
                                       const std::string& loads) {
    const auto u = calcStaticDisplacements(folder, deck, held, watched, "TIE1", loads);
    const auto shift = u.at(kTieNode + 2), turn = u.at(kTieNode + 3);
    return {shift[0], shift[1], shift[2], turn[0], turn[1], turn[2]};
}

std::string gravityText(double gravity, const std::array<double, 3>& direction) {
    std::ostringstream cards;
    cards << "*DLOAD\nBODY, GRAV, " << gravity;
    for (const double component : direction) cards << ", " << component;
    cards << "\n";
    return cards.str();
}

}  // namespace

std::array<double, 6> calcCalculixDeflection(
    const TestFolder& folder, const std::string& deck,
    const std::pair<std::string, std::array<double, 3>>& held,
    const std::pair<std::string, std::array<double, 3>>& loaded,
    const std::array<double, 6>& load) {
    std::ostringstream cards;
    cards << "*CLOAD\n";
    for (int k = 0; k < 6; ++k)
        if (load[k] != 0)
            cards << kTieNode + 2 + k / 3 << "," << k % 3 + 1 << "," << load[k] << "\n";
    return calcStaticMotion(folder, deck, held, loaded, cards.str());
}

std::array<double, 6> calcCalculixSag(const TestFolder& folder, const std::string& deck,
                                      const std::pair<std::string, std::array<double, 3>>& held,
                                      const std::pair<std::string, std::array<double, 3>>& watched,
                                      double gravity, const std::array<double, 3>& direction) {
    return calcStaticMotion(folder, deck, held, watched, gravityText(gravity, direction));
}

std::map<int, std::array<double, 3>> calcCalculixDisplacements(
    const TestFolder& folder, const std::string& deck,
    const std::pair<std::string, std::array<double, 3>>& held,
    const std::pair<std::string, std::array<double, 3>>& tied, const std::string& set,
    const std::string& stepCards) {
    return calcStaticDisplacements(folder, deck, held, tied, set, stepCards);
}

std::string makeTieCards(int index, const std::string& set, const std::array<double, 3>& point) {
    return tieText(index, set, point);
}

int getTieNode(int index) {
    return kTieNode + 2 * index;
}

namespace {

/** Reads the blocks of a .frd file by name, with values by node number. **/
std::map<std::string, std::map<int, std::vector<double>>> readFrd(const std::string& path) {
    constexpr size_t kFirst = 13, kWidth = 12;
    std::map<std::string, std::map<int, std::vector<double>>> blocks;
    std::string name;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
        const std::string key = line.substr(0, 3);
        if (key == " -4") std::istringstream(line.substr(3)) >> name;
        if (key == " -3") name.clear();
        if (key != " -1" || name.empty()) continue;
        auto& values = blocks[name][std::stoi(line.substr(3, 10))];
        for (size_t at = kFirst; at + kWidth <= line.size(); at += kWidth)
            values.push_back(std::stod(line.substr(at, kWidth)));
    }
    return blocks;
}

}  // namespace

CalculixStress calcCalculixStress(const TestFolder& folder, const std::string& deck,
                                  const std::string& modelCards, const std::string& stepCards) {
    writeText(folder / "stress.inp",
              "*INCLUDE, INPUT=" + withoutSkin(folder, deck) + "\n" + modelCards +
                  "*STEP\n*STATIC\n" + stepCards +
                  "*EL FILE\nS, E\n*EL PRINT, ELSET=BODY, GLOBAL=YES\nS\n*END STEP\n");
    runOrThrow("cd '" + folder.path() + "' && ccx stress", folder / "ccx.log");
    CalculixStress result;
    const auto blocks = readFrd(folder / "stress.frd");
    const auto take = [&](const char* name, std::map<int, CalculixStress::Tensor>& to) {
        const auto block = blocks.find(name);
        if (block == blocks.end()) throw std::runtime_error(readText(folder / "ccx.log"));
        for (const auto& [node, v] : block->second)
            to[node] = {v[0], v[1], v[2], v[3], v[5], v[4]};  // file order xy yz zx
    };
    take("STRESS", result.stress);
    take("TOSTRAIN", result.strain);
    std::ifstream in(folder / "stress.dat");
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        int element, point;
        CalculixStress::Tensor s;
        if (numbers >> element >> point >> s[0] >> s[1] >> s[2] >> s[3] >> s[4] >> s[5])
            result.atPoints[{element, point}] = s;
    }
    return result;
}

}  // namespace testing
}  // namespace simflex
