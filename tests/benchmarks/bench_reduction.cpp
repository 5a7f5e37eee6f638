/** @file
Reduction of boxes of hexahedra with two interfaces: time and peak memory by phase, next to a lower
bound and to SciPy's eigsh with the same matrices.

    bench_reduction [--dof N ...] [--shape brick|bar|plate] [--modes 50] [--rival SECONDS]

The lower bound ("floor") is the work that any reduction with one factorization needs: ordering and
factoring K_ii (CHOLMOD), the solves for the constraint modes, and one L and one Lᵀ solve for each
block of the Lanczos run. Both wall and processor times are given. On a shared machine only the
ratio of processor times is meaningful, and only with OMP_NUM_THREADS=1 (threads that wait for each
other count as busy). --rival is the time limit of eigsh; 0 skips it. The last line is a JSON object
for the last size. **/

#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "simflex/base/Memory.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"
#include "simflex/reduction/SparseCholesky.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
constexpr double kGibibyte = 1073741824;

/** Wall and processor seconds. **/
struct Spent {
    double wall = 0, processor = 0;

    Spent operator+(const Spent& other) const {
        return {wall + other.wall, processor + other.processor};
    }
    Spent operator*(double factor) const { return {wall * factor, processor * factor}; }
};

class Stopwatch {
public:
    Spent read() const {
        return {std::chrono::duration<double>(Clock::now() - m_start).count(),
                readProcessor() - m_processor};
    }

private:
    static double readProcessor() {
        timespec now{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
        return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
    }

    Clock::time_point m_start = Clock::now();
    double m_processor = readProcessor();
};

struct Arguments {
    std::vector<long> dofs;
    std::string shape = "brick";
    int numModes = 50;
    double rivalSeconds = 300;
};

/** Aluminium cubes (plates: flat square bricks) along x, with the end faces as interfaces. **/
struct Box {
    int n[3];
    double h = 0.002;  ///< edge of an element [m]

    Box(const std::string& shape, long dofs) {
        const double nodes = double(dofs) / 3;
        if (shape == "brick") {  // 2:1:1
            const double side = std::cbrt(nodes / 2);
            n[1] = n[2] = std::max(2, int(std::lround(side)) - 1);
        } else if (shape == "bar") {  // 14 elements thick
            n[1] = n[2] = 14;
        } else if (shape == "plate") {  // 4 elements thick, twice as long as wide
            n[1] = std::max(2, int(std::lround(std::sqrt(nodes / 10))) - 1);
            n[2] = 4;
        } else {
            throw std::invalid_argument("--shape " + shape + ": must be brick, bar or plate");
        }
        n[0] = std::max(2, int(std::lround(nodes / ((n[1] + 1) * (n[2] + 1)))) - 1);
    }

    int indexOf(int i, int j, int k) const { return (i * (n[1] + 1) + j) * (n[2] + 1) + k; }
    int numNodes() const { return (n[0] + 1) * (n[1] + 1) * (n[2] + 1); }

    void write(std::ostream& out) const {
        out.precision(12);
        out << "*NODE\n";
        for (int i = 0; i <= n[0]; ++i)
            for (int j = 0; j <= n[1]; ++j)
                for (int k = 0; k <= n[2]; ++k)
                    out << indexOf(i, j, k) + 1 << ", " << h * i << ", " << h * j << ", " << h * k
                        << '\n';
        out << "*ELEMENT, TYPE=C3D8, ELSET=BODY\n";
        int element = 0;
        for (int i = 0; i < n[0]; ++i)
            for (int j = 0; j < n[1]; ++j)
                for (int k = 0; k < n[2]; ++k) {
                    out << ++element;
                    for (const auto& c : kCorners)
                        out << ", " << indexOf(i + c[0], j + c[1], k + c[2]) + 1;
                    out << '\n';
                }
        for (const auto& [name, i] : {std::pair("LEFT", 0), std::pair("RIGHT", n[0])}) {
            out << "*NSET, NSET=" << name << '\n';
            for (int j = 0; j <= n[1]; ++j)
                for (int k = 0; k <= n[2]; ++k) out << indexOf(i, j, k) + 1 << ",\n";
        }
        out << "*MATERIAL, NAME=ALUMINIUM\n*ELASTIC\n70E9, 0.3\n*DENSITY\n2700\n"
               "*SOLID SECTION, ELSET=BODY, MATERIAL=ALUMINIUM\n";
    }

    static constexpr int kCorners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                           {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
};

constexpr int Box::kCorners[8][3];

/** Extracts the rows and columns of the nodes outside all interfaces from a matrix with
`rowsPerNode` rows per node. **/
SymmetricMatrix takeFree(const SymmetricMatrix& A, const Mesh& mesh, int rowsPerNode) {
    std::vector<int> place(size_t(mesh.numNodes()), 0);
    for (const char* set : {"LEFT", "RIGHT"})
        for (const int node : mesh.nodeSets.at(set)) place[size_t(node)] = -1;
    int count = 0;
    for (int& at : place)
        if (at == 0) at = count++;
    SymmetricMatrix result;
    result.size = rowsPerNode * count;
    for (int column = 0; column < A.size; ++column) {
        if (place[size_t(column / rowsPerNode)] < 0) continue;
        result.columnStarts.push_back(result.numEntries());
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k) {
            const int row = A.rows[size_t(k)], at = place[size_t(row / rowsPerNode)];
            if (at < 0) continue;
            result.rows.push_back(rowsPerNode * at + row % rowsPerNode);
            result.values.push_back(A.values[size_t(k)]);
        }
    }
    result.columnStarts.push_back(result.numEntries());
    return result;
}

double readStatus(const char* key) {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);)
        if (line.rfind(key, 0) == 0) return 1024 * std::atof(line.c_str() + std::strlen(key));
    return 0;
}

/** Time and peak memory of each phase, from the progress reports. **/
class PhaseTable {
public:
    void enter(const std::string& phase) {
        if (!_rows.empty() && _rows.back().name == phase) return;
        leave();
        _rows.push_back({phase, {}, 0});
        _watch = Stopwatch();
        std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
    }
    void leave() {
        if (_rows.empty() || _rows.back().spent.wall > 0) return;
        _rows.back().spent = _watch.read();
        _rows.back().peak = readStatus("VmHWM:");
        _peak = std::max(_peak, _rows.back().peak);
    }
    void print() const {
        for (const Row& row : _rows)
            std::printf("  %-30s %9.2f s %9.2f s  %8s\n", row.name.c_str(), row.spent.wall,
                        row.spent.processor, formatMemory(row.peak).c_str());
    }
    double peak() const { return _peak; }
    Spent sum() const {
        Spent all;
        for (const Row& row : _rows) all = all + row.spent;
        return all;
    }

private:
    struct Row {
        std::string name;
        Spent spent;
        double peak;
    };
    std::vector<Row> _rows;
    Stopwatch _watch;
    double _peak = 0;
};

/** Times ordering, factorization and solves alone. **/
Spent calcFloor(const SymmetricMatrix& K, const ReductionTimings& timings, int numConstraint) {
    SparseCholesky cholesky;
    Stopwatch watch;
    const auto& prediction = cholesky.analyze(K);
    const Spent ordering = watch.read();
    watch = Stopwatch();
    cholesky.factor(K);
    const Spent factoring = watch.read();
    const Vectors X = Vectors::Ones(K.size, 8);
    watch = Stopwatch();
    int pairs = 0;
    while (pairs < 3 || (watch.read().wall < 2 && pairs < 20)) {
        cholesky.solve(X);
        ++pairs;
    }
    const int numSolves = timings.numLanczosBlocks + (numConstraint + 7) / 8;
    const Spent solves = watch.read() * (double(numSolves) / pairs);
    std::printf(
        "floor: ordering (%s) %.2f s (%.2f of processors), factoring %.2f s (%.2f; %.1f M entries, "
        "%.1f Gflop/s), %d block solves %.2f s (%.2f)\n",
        prediction.order, ordering.wall, ordering.processor, factoring.wall, factoring.processor,
        1e-6 * double(prediction.numEntries), 1e-9 * prediction.flops / factoring.wall, numSolves,
        solves.wall, solves.processor);
    return ordering + factoring + solves;
}

template <class T>
void dump(const fs::path& path, const std::vector<T>& values) {
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(values.data()),
              std::streamsize(values.size() * sizeof(T)));
}

void dump(const fs::path& folder, const std::string& name, const SymmetricMatrix& A) {
    dump(folder / (name + "p"), A.columnStarts);
    dump(folder / (name + "i"), A.rows);
    dump(folder / (name + "x"), A.values);
}

/** Runs SciPy's shift-invert Lanczos on K_ii and M_ii in a separate process. **/
void runRival(const fs::path& folder, const SymmetricMatrix& K, const SymmetricMatrix& m,
              int numNormal, double seconds) {
    dump(folder, "K", K);
    dump(folder, "m", m);
    std::ofstream(folder / "rival.py") << R"(
import resource, sys, time
import numpy as np, scipy, scipy.sparse as sp
from scipy.sparse.linalg import eigsh
def load(name):
    p, i, x = (np.fromfile(name + c, t) for c, t in (('p', np.int64), ('i', np.int32), ('x', float)))
    n = len(p) - 1
    A = sp.csc_matrix((x, i, p.astype(np.int32)), shape=(n, n))
    return (A + sp.tril(A, -1).T).tocsc()
K, M = load('K'), sp.kron(load('m'), sp.identity(3)).tocsc()
start = time.time()
w = eigsh(K, k=int(sys.argv[1]), M=M, sigma=0, which='LM', return_eigenvectors=True)[0]
print('%.2f s, lowest %.6g Hz, peak %.2f GiB (SciPy %s)' % (time.time() - start, min(w) ** 0.5 / 6.283185307179586,
      resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1048576, scipy.__version__))
)";
    std::printf("rival, scipy.sparse.linalg.eigsh(K_ii, %d, M_ii, sigma=0): ", numNormal);
    std::fflush(stdout);
    const std::string command = "cd '" + folder.string() + "' && timeout " +
                                std::to_string(int(seconds)) + " /usr/bin/python3 rival.py " +
                                std::to_string(numNormal) + " 2> rival.log";
    const int status = std::system(command.c_str());
    if (WIFEXITED(status) && WEXITSTATUS(status) == 124)
        std::printf("not done after %.0f s\n", seconds);
    else if (status != 0)
        std::printf("failed (see SciPy, memory)\n");
    std::fflush(stdout);
}

std::string runSize(const Arguments& arguments, long dofs) {
    const Box box(arguments.shape, dofs);
    std::string pattern =
        std::string(std::getenv("TMPDIR") ? std::getenv("TMPDIR") : "/tmp") + "/bench-XXXXXX";
    if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make " + pattern);
    const fs::path folder = pattern;
    struct Remover {
        fs::path path;
        ~Remover() { fs::remove_all(path); }
    } remover{folder};

    std::printf("\n%s of %d×%d×%d hexahedra, %d DOF, 2 interfaces, %d modes\n",
                arguments.shape.c_str(), box.n[0], box.n[1], box.n[2], 3 * box.numNodes(),
                arguments.numModes);
    PhaseTable assembly, phases;
    const auto show = [](PhaseTable& table) {
        return [&table](const std::string& phase, double) {
            table.enter(phase);
            return true;
        };
    };
    {
        std::ofstream deck(folder / "box.inp");
        box.write(deck);
    }
    CalculixOptions reading;
    reading.progress = show(assembly);
    FeModel model = readCalculixDeck((folder / "box.inp").string(), reading);
    fs::remove(folder / "box.inp");
    assembly.leave();
    assembly.print();

    ReductionOptions options;
    options.name = arguments.shape;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    options.numModes = arguments.numModes;
    ReductionTimings timings;
    phases.enter("checking and tying");
    const fs::path partFile = folder / "box.part";
    {
        const ReducedBody body = reduce(model, options, show(phases), &timings);
        phases.enter("writing the part");
        writeReducedBody(partFile.string(), body);
        phases.leave();
        phases.print();
        const Spent all = assembly.sum() + phases.sum();
        std::printf("  %-30s %9.2f s %9.2f s  %8s   lowest frequency %.6g Hz\n",
                    "from deck to part, all of it", all.wall, all.processor,
                    formatMemory(std::max(phases.peak(), assembly.peak())).c_str(),
                    std::sqrt(body.omegaSquared[0]) / (2 * M_PI));
    }
    const Spent all = assembly.sum() + phases.sum();
    const double peak = std::max(phases.peak(), assembly.peak());
    const int numDofs = 3 * box.numNodes();
    SymmetricMatrix K = takeFree(model.K, model.mesh, 3), m = takeFree(model.m, model.mesh, 1);
    model = FeModel();
    const Spent floor = calcFloor(K, timings, 12);
    std::printf("deck to part over floor: %.2f; of processors: %.2f\n", all.wall / floor.wall,
                all.processor / floor.processor);
    if (arguments.rivalSeconds > 0)
        runRival(folder, K, m, arguments.numModes - 12, arguments.rivalSeconds);
    char json[300];
    std::snprintf(json, sizeof json,
                  "{\"dof\": %d, \"seconds\": %.3f, \"floor_seconds\": %.3f, "
                  "\"processor_seconds\": %.3f, \"floor_processor_seconds\": %.3f, "
                  "\"peak_gib\": %.3f}",
                  numDofs, all.wall, floor.wall, all.processor, floor.processor, peak / kGibibyte);
    return json;
}

Arguments parse(int argc, char** argv) {
    Arguments arguments;
    for (int k = 1; k < argc; ++k) {
        const std::string option = argv[k];
        const auto next = [&] {
            if (k + 1 >= argc) throw std::invalid_argument(option + " needs a value");
            return std::string(argv[++k]);
        };
        if (option == "--dof") {
            while (k + 1 < argc && argv[k + 1][0] != '-')
                arguments.dofs.push_back(long(std::stod(argv[++k])));
        } else if (option == "--shape") {
            arguments.shape = next();
        } else if (option == "--modes") {
            arguments.numModes = std::stoi(next());
        } else if (option == "--rival") {
            arguments.rivalSeconds = std::stod(next());
        } else {
            throw std::invalid_argument("unknown option " + option +
                                        "; there are --dof, --shape, --modes, --rival");
        }
    }
    if (arguments.dofs.empty()) arguments.dofs = {100000};
    return arguments;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    try {
        std::setvbuf(stdout, nullptr, _IOLBF, 0);
        const simflex::Arguments arguments = simflex::parse(argc, argv);
        std::string json;
        for (const long dofs : arguments.dofs) json = simflex::runSize(arguments, dofs);
        std::printf("\n%s\n", json.c_str());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench_reduction: %s\n", error.what());
        return 1;
    }
}
