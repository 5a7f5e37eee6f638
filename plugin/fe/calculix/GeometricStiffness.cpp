#include "GeometricStiffness.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <list>
#include <map>
#include <stdexcept>
#include <thread>

#include "CalculixRun.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/SolidElements.h"
#include "simflex/fe/Vec3d.h"
#include "simflex/fe/decks/DeckBuilder.h"
#include "simflex/fe/decks/DeckVocabulary.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

constexpr auto SolverPollInterval = std::chrono::milliseconds(20);
constexpr const char *Job = "load", *ElementSet = "SIMFLEX-PRESTRESSED";

int largestEntry(const Vec3d& a) {
    int axis = 0;
    for (int b = 1; b < 3; ++b)
        if (std::abs(a[b]) > std::abs(a[axis])) axis = b;
    return axis;
}

/** The node at which `measure` is largest. **/
template <class Measure>
int findNode(const Mesh& mesh, const Measure& measure) {
    int best = 0;
    for (int node = 1; node < mesh.numNodes(); ++node)
        if (measure(mesh.position(node)) > measure(mesh.position(best))) best = node;
    return best;
}

/** Six supports that take the rigid motions and nothing else: node A in all directions, B across
the line AB, C across the plane ABC. The *BOUNDARY lines. **/
std::string makeSupports(const Mesh& mesh) {
    const int a =
        findNode(mesh, [&](const Vec3d& x) { return normOf(minus(x, mesh.position(0))); });
    const Vec3d A = mesh.position(a);
    const int b = findNode(mesh, [&](const Vec3d& x) { return normOf(minus(x, A)); });
    const Vec3d line = minus(mesh.position(b), A);
    const int c = findNode(mesh, [&](const Vec3d& x) { return normOf(cross(line, minus(x, A))); });
    const Vec3d normal = cross(line, minus(mesh.position(c), A));

    const auto support = [&](int node, int axis) {
        return std::to_string(mesh.nodeNumbers[size_t(node)]) + "," + std::to_string(axis + 1) +
               "," + std::to_string(axis + 1) + "\n";
    };
    std::string text;
    for (int axis = 0; axis < 3; ++axis) text += support(a, axis);
    // C turns about AB: held along the plane's normal. B: across AB, in the plane and along the
    // normal; of the axes but the one nearest to AB both together do that.
    for (int axis = 0; axis < 3; ++axis)
        if (axis != largestEntry(line)) text += support(b, axis);
    return text + support(c, largestEntry(normal));
}

/** Numbers as ccx reads them, at most 20 characters each. **/
void writeLoads(std::ostream& out, const Mesh& mesh, const PrestressLoad& load) {
    for (int node = 0; node < mesh.numNodes(); ++node)
        for (int axis = 0; axis < 3; ++axis) {
            const double force = load.force[3 * size_t(node) + size_t(axis)];
            if (force == 0) continue;
            out << mesh.nodeNumbers[size_t(node)] << ',' << axis + 1 << ','
                << writeFortran(force, 12) << '\n';
        }
}

/** One run of CalculiX in a folder of its own. **/
struct Run {
    int load = 0;
    TemporaryFolder folder;
    CalculixProcess process;
};

/** The solid elements of a deck with mesh indices, and their integration points by type. **/
struct Elements {
    struct Element {
        int number;
        const std::vector<IntegrationPoint>* points;
        std::vector<int> nodes;
        size_t firstPoint;
    };

    Elements(const DeckModel& deck) {
        // Blocks of the mesh follow the deck's types, several types may share a block.
        std::map<ElementType, size_t> next;
        for (const auto& [type, solids] : deck.solids)
            for (const auto& block : deck.mesh.elements) {
                if (solids.empty() || getSolid(type) != block.type) continue;
                const auto& points = m_points[type] = makeIntegrationPoints(type, block.type);
                const size_t size = size_t(numNodesOf(block.type));
                for (const auto& solid : solids) {
                    const auto first = block.nodes.begin() + std::ptrdiff_t(next[block.type]);
                    elements.push_back(
                        {solid.number, &points, {first, first + std::ptrdiff_t(size)}, numPoints});
                    next[block.type] += size;
                    numPoints += points.size();
                }
            }
        std::sort(elements.begin(), elements.end(),
                  [](const Element& a, const Element& b) { return a.number < b.number; });
    }

    /** @throws std::runtime_error if there is none. **/
    const Element& find(int number) const {
        const auto found =
            std::lower_bound(elements.begin(), elements.end(), number,
                             [](const Element& e, int wanted) { return e.number < wanted; });
        if (found == elements.end() || found->number != number)
            throw std::runtime_error("CalculiX gave stresses of element " + std::to_string(number) +
                                     ", which the deck does not have");
        return *found;
    }

    std::vector<Element> elements;
    size_t numPoints = 0;

private:
    std::map<std::string, std::vector<IntegrationPoint>> m_points;
};

/** xx yy zz xy xz yz. **/
using Stress = std::array<double, 6>;

/** One of CalculiX's numbers of 14 characters; below 1e-99 it leaves out the E. **/
double readField(const std::string& line, size_t at) {
    const std::string field = line.substr(at, 14);
    double value = 0;
    const size_t sign = field.rfind('-');
    if (sign != std::string::npos && sign > 0 && isDigit(field[sign - 1])) return 0;
    if (!readNumber(trimBlanks(field), value))
        throw std::runtime_error("CalculiX wrote the stress '" + field + "', which is no number");
    return value;
}

/** The stresses of all integration points. **/
std::vector<Stress> readStresses(const std::filesystem::path& path, const Elements& elements) {
    constexpr size_t FirstColumn = 14, Width = 14;  // after the element and the point
    std::vector<Stress> stresses(elements.numPoints);
    std::vector<bool> isGiven(elements.numPoints, false);
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
        if (line.size() < FirstColumn + 6 * Width || line.find('(') != std::string::npos) continue;
        const auto& element = elements.find(std::atoi(line.substr(0, 10).c_str()));
        const size_t point = size_t(std::atoi(line.substr(10, 4).c_str())) - 1;
        if (point >= element.points->size())
            throw std::runtime_error("CalculiX gave stresses at more points of element " +
                                     std::to_string(element.number) + " than expected");
        for (size_t c = 0; c < 6; ++c)
            stresses[element.firstPoint + point][c] = readField(line, FirstColumn + c * Width);
        isGiven[element.firstPoint + point] = true;
    }
    const auto count = size_t(std::count(isGiven.begin(), isGiven.end(), true));
    if (count != elements.numPoints)
        throw std::runtime_error("CalculiX gave stresses at " + std::to_string(count) +
                                 " integration points, expected " +
                                 std::to_string(elements.numPoints));
    return stresses;
}

SymmetricMatrix assemble(const Mesh& mesh, const Elements& elements,
                         const std::vector<Stress>& stresses) {
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values, own;
    std::vector<Vec3d> positions, gradients;
    for (const auto& element : elements.elements) {
        const size_t n = element.nodes.size();
        own.assign(n * n, 0);
        positions.clear();
        for (const int node : element.nodes) positions.push_back(mesh.position(node));
        for (size_t p = 0; p < element.points->size(); ++p) {
            const double volume = calcGradients(positions, (*element.points)[p], gradients);
            const Stress& s = stresses[element.firstPoint + p];
            for (size_t j = 0; j < n; ++j) {
                const Vec3d& g = gradients[j];
                const Vec3d flux = {s[0] * g[0] + s[3] * g[1] + s[4] * g[2],
                                    s[3] * g[0] + s[1] * g[1] + s[5] * g[2],
                                    s[4] * g[0] + s[5] * g[1] + s[2] * g[2]};
                for (size_t i = j; i < n; ++i)
                    own[i + n * j] +=
                        volume * (gradients[i][0] * flux[0] + gradients[i][1] * flux[1] +
                                  gradients[i][2] * flux[2]);
            }
        }
        for (size_t j = 0; j < n; ++j)
            for (size_t i = j; i < n; ++i) {
                rows.push_back(element.nodes[i]);
                columns.push_back(element.nodes[j]);
                values.push_back(own[i + n * j]);
            }
    }
    return SymmetricMatrix::fromEntries(mesh.numNodes(), rows, columns, values);
}

}  // namespace

void calcGeometricStiffness(const FeModel& model, const std::vector<PrestressLoad>& loads,
                            const PrestressOptions& options,
                            const std::function<void(int, const SymmetricMatrix&)>& take) {
    const char* phase = "geometric stiffness";
    reportProgress(options.progress, phase, 0);
    const DeckModel deck = buildDeckModel(model.source, readModelCards(model.source));
    if (deck.mesh.nodeNumbers != model.mesh.nodeNumbers ||
        deck.mesh.positions != model.mesh.positions)
        throw std::runtime_error(model.source +
                                 ": the deck's nodes are not those that K and M were assembled "
                                 "for; the file has changed in between. Reduce it again.");
    if (!deck.springs.empty() || !deck.hinged.empty())
        throw std::invalid_argument(model.source +
                                    ": geometric stiffness of a part with springs, trusses or "
                                    "membranes is not possible: CalculiX would load it without "
                                    "them. Put them into the multibody model, or leave "
                                    "--stiffening out.");
    const Elements elements(deck);
    const std::string program = chooseCalculixProgram(options.program);
    const std::string supports = makeSupports(model.mesh);
    const unsigned most = options.numProcesses > 0
                              ? unsigned(options.numProcesses)
                              : std::max(1u, std::thread::hardware_concurrency());
    const auto start = [&](Run& run, int index) {
        run.load = index;
        std::ofstream out(run.folder.path() / (std::string(Job) + ".inp"));
        out.imbue(std::locale::classic());
        deck.writeModel(out);
        out << "*ELSET, ELSET=" << ElementSet << "\n";
        for (const auto& element : elements.elements) out << element.number << ",\n";
        out << "*BOUNDARY\n" << supports << "*STEP\n*STATIC\n*CLOAD\n";
        writeLoads(out, model.mesh, loads[size_t(index)]);
        out << "*EL PRINT, ELSET=" << ElementSet << ", GLOBAL=YES\nS\n*END STEP\n";
        if (!out.flush())
            throw std::runtime_error("cannot write to " + run.folder.path().string() +
                                     "; is the disk full?");
        out.close();
        run.process.start(program, run.folder.path(), Job);
    };

    std::list<Run> running;
    int next = 0, done = 0;
    const int count = int(loads.size());
    while (done < count) {
        while (next < count && running.size() < most) {
            running.emplace_back();
            start(running.back(), next++);
        }
        const auto finished = std::find_if(running.begin(), running.end(),
                                           [](Run& run) { return run.process.poll(); });
        reportProgress(options.progress, phase, double(done) / count);
        if (finished == running.end()) {
            std::this_thread::sleep_for(SolverPollInterval);
            continue;
        }
        const PrestressLoad& load = loads[size_t(finished->load)];
        try {
            finished->process.checkResult();
            const auto stresses =
                readStresses(finished->folder.path() / (std::string(Job) + ".dat"), elements);
            take(finished->load, assemble(model.mesh, elements, stresses));
        } catch (const std::exception& error) {
            throw std::runtime_error(model.source + ": geometric stiffness under the load '" +
                                     load.name + "': " + error.what());
        }
        running.erase(finished);
        ++done;
    }
}

}  // namespace simflex
