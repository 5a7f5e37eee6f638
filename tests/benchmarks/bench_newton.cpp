// Cost of a Newton iteration of the slider-crank and of the stator. Compares its linear solve by
// block elimination with general solvers on the assembled matrix, for the same systems dumped from
// runs of the examples; then times the whole runs and their phases, the reduction of the crank and
// a frame. The last line is a JSON object with the main figures in microseconds.

#include <benchmark/benchmark.h>
#include <klu.h>
#include <umfpack.h>

#include <Eigen/SparseLU>
#include <algorithm>
#include <cstdio>
#include <map>

#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/elimination/NewtonCombination.h"
#include "support/NewtonReference.h"
#include "support/SliderCrankModel.h"
#include "support/StatorModel.h"

namespace simflex {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

std::shared_ptr<const ReducedBody> readPart(const std::string& name) {
    return std::make_shared<const ReducedBody>(
        readReducedBody(std::string(SIMFLEX_PARTS) + "/" + name + ".h5"));
}

const std::shared_ptr<const ReducedBody>& getCrankPart() {
    static const auto part = readPart("crank");
    return part;
}

const std::shared_ptr<const ReducedBody>& getRodPart() {
    static const auto part = readPart("rod");
    return part;
}

/** An example's model and its benchmark settings. **/
struct SliderCrank : examples::SliderCrankModel {
    static constexpr const char* name = "slider_crank";
    static constexpr bool hasDenseBlocks = false;
    static constexpr double runTime = 0.1;     ///< simulated [s]
    static constexpr double accuracy = 1e-6;   ///< the example's own
    static constexpr int systemInterval = 25;  ///< keeps every 25th Newton system

    static void adapt(NewtonSystem&) {}
    SliderCrank() : SliderCrankModel({}, getCrankPart(), getRodPart()) {}
};

struct Stator : examples::StatorModel {
    static constexpr const char* name = "stator";
    static constexpr bool hasDenseBlocks = false;
    static constexpr double runTime = 0.8;  ///< through the first critical speed
    static constexpr double accuracy = 1e-8;
    static constexpr int systemInterval = 250;

    static void adapt(NewtonSystem&) {}
    Stator() : StatorModel({}, getParts()) {}

    static const std::vector<std::shared_ptr<const ReducedBody>>& getParts() {
        static const auto parts = [] {
            std::vector<std::shared_ptr<const ReducedBody>> result;
            for (const char* part : getPartNames()) result.push_back(readPart(part));
            return result;
        }();
        return parts;
    }
};

/** The systems of one run, in the form that each solver needs. **/
struct DumpedSystems {
    std::vector<NewtonSystem> systems;
    std::vector<MatrixXd> dense;
    std::vector<SparseMatrix> sparse;  ///< one pattern: the union of the nonzeros
    std::vector<VectorXd> rightHandSides, solutions;

    /** Runs the model up to `runTime`. **/
    template <class Model>
    void dump(Model& model) {
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(Model::accuracy);
        integrator.setBlockForm(Model::hasDenseBlocks ? BdfIntegrator::BlockForm::Dense
                                                      : BdfIntegrator::BlockForm::Arrow);
        int count = 0;
        integrator.setNewtonSystemObserver([&](const NewtonSystem& system) {
            // A refreshed Newton matrix may have another form, but all must share one pattern.
            if (count++ % Model::systemInterval != 0) return;
            systems.push_back(system);
            Model::adapt(systems.back());
        });
        integrator.initialize(model.makeInitialState());
        integrator.stepTo(Model::runTime);
        assemble();
    }

private:
    void assemble();
};

void DumpedSystems::assemble() {
    MatrixXd pattern;
    for (const NewtonSystem& system : systems) {
        dense.push_back(test::assembleDense(system));
        rightHandSides.push_back(test::assembleRightHandSide(system));
        solutions.push_back(dense.back().partialPivLu().solve(rightHandSides.back()));
        if (pattern.size() == 0) pattern.setZero(dense[0].rows(), dense[0].cols());
        pattern = pattern.cwiseMax(dense.back().cwiseAbs());
    }
    for (const MatrixXd& A : dense) {
        std::vector<Eigen::Triplet<double>> entries;
        for (int j = 0; j < A.cols(); ++j)
            for (int i = 0; i < A.rows(); ++i)
                if (pattern(i, j) != 0) entries.emplace_back(i, j, A(i, j));
        sparse.emplace_back(A.rows(), A.cols());
        sparse.back().setFromTriplets(entries.begin(), entries.end());
    }
}

/** The same run with every flexible block dense, so that J holds all gyroscopic terms. **/
template <class Model>
struct DenseBlocks : Model {
    static inline const std::string name = std::string(Model::name) + "_dense";
    static constexpr bool hasDenseBlocks = true;
};

/** The same systems as if the bodies were stiffened: mode shapes change with the deformation, so
each block has columns of its own. **/
template <class Model>
struct Stiffened : Model {
    static inline const std::string name = std::string(Model::name) + "_stiffened";

    static void adapt(NewtonSystem& system) {
        for (NewtonSystem::Block& block : system.blocks) {
            if (block.columns == NewtonSystem::Block::Columns::Own) continue;
            std::vector<double> Gt(size_t(block.size) * block.rows.size());
            system.expandGt(block, Gt.data());
            block.columns = NewtonSystem::Block::Columns::Own;
            block.sides.clear();
            block.coefficients.clear();
            block.Gt = Gt;
        }
    }
};

/** The stiffened systems as full symmetric matrices, the form used before arrows had columns of
their own. **/
template <class Model>
struct StiffenedFull : Model {
    static inline const std::string name = std::string(Model::name) + "_stiffened_full";

    static void adapt(NewtonSystem& system) {
        for (NewtonSystem::Block& block : system.blocks) {
            if (block.part < 0) continue;
            const MatrixXd J = test::assembleBlock(system, block);
            const MatrixXd Gt = test::assembleGt(system, block);
            NewtonSystem::Block full;
            full.resize(block.size, block.rows);
            full.form = NewtonSystem::Block::Form::Symmetric;
            std::copy_n(J.data(), J.size(), full.matrix.begin());
            std::copy_n(Gt.data(), Gt.size(), full.Gt.begin());
            block = full;
        }
    }
};

template <class Model>
const DumpedSystems& getDumpedSystems() {
    static const DumpedSystems dumped = [] {
        Model model;
        DumpedSystems result;
        result.dump(model);
        return result;
    }();
    return dumped;
}

/** Runs `solve(index, x)` over the systems in turn and reports the largest relative difference from
dense pivoting. **/
template <class Solve>
void runSolves(benchmark::State& state, const DumpedSystems& dumped, Solve solve) {
    VectorXd x(dumped.rightHandSides[0].size());
    double difference = 0;
    for (size_t i = 0; i < dumped.systems.size(); ++i) {
        solve(i, x);
        difference =
            std::max(difference, (x - dumped.solutions[i]).norm() / dumped.solutions[i].norm());
    }
    size_t next = 0;
    for (auto _ : state) {
        solve(next, x);
        benchmark::DoNotOptimize(x.data());
        next = (next + 1) % dumped.systems.size();
    }
    state.counters["unknowns"] = double(x.size());
    state.counters["systems"] = double(dumped.systems.size());
    state.counters["difference"] = difference;
}

template <class Model>
void solveByBlockElimination(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    BlockEliminationSolver solver(dumped.systems[0]);
    solver.setNumThreads(int(state.range(0)));
    runSolves(state, dumped, [&](size_t i, VectorXd& x) {
        const NewtonSystem& system = dumped.systems[i];
        solver.factor(system);
        solver.solve(system);
        x.head(system.numSpeeds()) =
            Eigen::Map<const VectorXd>(solver.getDeltaU().data(), system.numSpeeds());
        x.tail(system.numMultipliers()) =
            Eigen::Map<const VectorXd>(solver.getDeltaLambda(), system.numMultipliers());
    });
}

/** Solves the same systems as the complex matrices of Radau IIA; rows of force elements appear
 * twice. **/
template <class Model>
void solveByComplexElimination(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    const NewtonSystem& first = dumped.systems[0];
    const int firstElementRow =
        int(std::find_if(first.compliance.begin(), first.compliance.end(),
                         [](double compliance) { return compliance != 0; }) -
            first.compliance.begin());
    std::vector<ComplexNewtonSystem> systems;
    for (const NewtonSystem& system : dumped.systems) {
        systems.push_back(makeCombined(
            system, first.compliance.empty() ? first.numMultipliers() : firstElementRow));
        combine(system, system, system, {{0.5, 1}, {0.3, 0.4}, {0.2, -0.6}}, systems.back());
        std::copy(system.r.begin(), system.r.end(), systems.back().r.begin());
    }
    ComplexBlockEliminationSolver solver(systems[0]);
    solver.setNumThreads(int(state.range(0)));
    double difference = 0;
    for (const ComplexNewtonSystem& system : systems) {
        solver.factor(system);
        solver.solve(system);
        const Eigen::VectorXcd x = test::solveDense(system).head(system.numSpeeds());
        const Eigen::Map<const Eigen::VectorXcd> found(solver.getDeltaU().data(), x.size());
        difference = std::max(difference, (found - x).norm() / x.norm());
    }
    size_t next = 0;
    for (auto _ : state) {
        solver.factor(systems[next]);
        solver.solve(systems[next]);
        benchmark::DoNotOptimize(solver.getDeltaU().data());
        next = (next + 1) % systems.size();
    }
    state.counters["unknowns"] = double(systems[0].numSpeeds() + systems[0].numMultipliers());
    state.counters["difference"] = difference;
}

template <class Model>
void solveDense(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    Eigen::PartialPivLU<MatrixXd> lu(dumped.dense[0].rows());
    runSolves(state, dumped, [&](size_t i, VectorXd& x) {
        lu.compute(dumped.dense[i]);
        x = lu.solve(dumped.rightHandSides[i]);
    });
}

template <class Model, class Ordering>
void solveBySparseLU(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    Eigen::SparseLU<SparseMatrix, Ordering> lu;
    lu.analyzePattern(dumped.sparse[0]);
    runSolves(state, dumped, [&](size_t i, VectorXd& x) {
        lu.factorize(dumped.sparse[i]);
        x = lu.solve(dumped.rightHandSides[i]);
    });
    state.counters["nonzeros"] = double(dumped.sparse[0].nonZeros());
}

/** UMFPACK, reusing its analysis. **/
template <class Model>
void solveByUmfpack(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    const SparseMatrix& first = dumped.sparse[0];
    const int n = int(first.rows());
    void *symbolic = nullptr, *numeric = nullptr;
    umfpack_di_symbolic(n, n, first.outerIndexPtr(), first.innerIndexPtr(), first.valuePtr(),
                        &symbolic, nullptr, nullptr);
    runSolves(state, dumped, [&](size_t i, VectorXd& x) {
        const SparseMatrix& A = dumped.sparse[i];
        umfpack_di_numeric(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), symbolic, &numeric,
                           nullptr, nullptr);
        umfpack_di_solve(UMFPACK_A, A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), x.data(),
                         dumped.rightHandSides[i].data(), numeric, nullptr, nullptr);
        umfpack_di_free_numeric(&numeric);
    });
    umfpack_di_free_symbolic(&symbolic);
}

/** KLU, reusing its analysis; `Refactor` also keeps the pivots of the first system. **/
template <class Model, bool Refactor>
void solveByKlu(benchmark::State& state) {
    const DumpedSystems& dumped = getDumpedSystems<Model>();
    klu_common common;
    klu_defaults(&common);
    SparseMatrix first = dumped.sparse[0];
    const int n = int(first.rows());
    klu_symbolic* symbolic = klu_analyze(n, first.outerIndexPtr(), first.innerIndexPtr(), &common);
    klu_numeric* numeric = klu_factor(first.outerIndexPtr(), first.innerIndexPtr(),
                                      first.valuePtr(), symbolic, &common);
    std::vector<SparseMatrix> matrices = dumped.sparse;  // KLU takes no const pointers
    runSolves(state, dumped, [&](size_t i, VectorXd& x) {
        SparseMatrix& A = matrices[i];
        if (Refactor) {
            klu_refactor(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), symbolic, numeric,
                         &common);
        } else {
            klu_free_numeric(&numeric, &common);
            numeric =
                klu_factor(A.outerIndexPtr(), A.innerIndexPtr(), A.valuePtr(), symbolic, &common);
        }
        x = dumped.rightHandSides[i];
        klu_solve(symbolic, numeric, n, 1, x.data(), &common);
    });
    klu_free_numeric(&numeric, &common);
    klu_free_symbolic(&symbolic, &common);
}

/** Runs the example without output and reports the time per run, with phases in milliseconds. **/
template <class Model>
void runExample(benchmark::State& state) {
    IntegratorStatistics sum;
    for (auto _ : state) {
        state.PauseTiming();
        Model model;
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(Model::accuracy);
        integrator.initialize(model.makeInitialState());
        state.ResumeTiming();
        integrator.stepTo(Model::runTime);
        const IntegratorStatistics& s = integrator.getStatistics();
        sum.stepsTaken += s.stepsTaken;
        sum.newtonIterations += s.newtonIterations;
        sum.evaluationSeconds += s.evaluationSeconds;
        sum.factorSeconds += s.factorSeconds;
        sum.schurSeconds += s.schurSeconds;
        sum.backSubstitutionSeconds += s.backSubstitutionSeconds;
        sum.simbodySeconds += s.simbodySeconds;
        sum.totalSeconds += s.totalSeconds;
    }
    const double runs = double(state.iterations());
    state.counters["steps"] = double(sum.stepsTaken) / runs;
    state.counters["iterations"] = double(sum.newtonIterations) / runs;
    state.counters["iteration_us"] = 1e6 * sum.totalSeconds / double(sum.newtonIterations);
    state.counters["evaluation_ms"] = 1e3 * sum.evaluationSeconds / runs;
    state.counters["factor_ms"] = 1e3 * sum.factorSeconds / runs;
    state.counters["schur_ms"] = 1e3 * sum.schurSeconds / runs;
    state.counters["back_ms"] = 1e3 * sum.backSubstitutionSeconds / runs;
    state.counters["simbody_ms"] = 1e3 * sum.simbodySeconds / runs;
}

/** Reduces the crank from deck to part with 50 Craig-Bampton modes; phases in seconds. Reading the
deck includes CalculiX. **/
void reduceCrank(benchmark::State& state) {
    ReductionOptions options;
    options.name = "crank";
    options.interfaces = {{"shaft", "SHAFT"}, {"pin", "PIN"}};
    options.numModes = 50;
    ReductionTimings timings;
    double deckSeconds = 0;
    for (auto _ : state) {
        const auto start = std::chrono::steady_clock::now();
        const FeModel model = readCalculixDeck(std::string(SIMFLEX_PARTS) + "/crank.inp");
        deckSeconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        reduce(model, options, {}, &timings);
    }
    state.counters["deck_s"] = deckSeconds;
    state.counters["factor_s"] = timings.factor;
    state.counters["constraint_s"] = timings.constraintModes;
    state.counters["normal_s"] = timings.normalModes;
    state.counters["orthonormal_s"] = timings.orthonormalize;
    state.counters["invariants_s"] = timings.invariants;
    state.counters["dofs"] = timings.numDofs;
}

/** Draws one 1280×720 frame of the moving mechanism to memory. **/
void drawFrame(benchmark::State& state) {
    SliderCrank model;
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(SliderCrank::accuracy);
    integrator.initialize(model.makeInitialState());
    std::vector<SimTK::State> states;
    for (int i = 1; i <= 8; ++i) {
        integrator.stepTo(0.05 + 0.002 * i);
        states.push_back(integrator.getState());
    }
    OffscreenVisualizer viz(model.system, 1280, 720);
    viz.addFlexibleBody(model.crank).addFlexibleBody(model.rod);
    viz.fitToMotion(states);
    viz.drawFrame(states[0]);
    size_t next = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(viz.drawFrame(states[next]));
        next = (next + 1) % states.size();
    }
}

/** Prints one line per benchmark, with the median of its repetitions, and stores it. **/
class Reporter : public benchmark::BenchmarkReporter {
public:
    std::map<std::string, double> times;      ///< [µs], real time
    std::map<std::string, double> iteration;  ///< counter iteration_us

    bool ReportContext(const Context& context) override {
        std::printf("%d processors, load %.2f\n\n", context.cpu_info.num_cpus,
                    context.cpu_info.load_avg.empty() ? 0.0 : context.cpu_info.load_avg[0]);
        std::printf("%-30s %14s %14s\n", "benchmark", "real time", "CPU time");
        return true;
    }

    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.error_occurred) {
                std::printf("%s: %s\n", run.benchmark_name().c_str(), run.error_message.c_str());
                continue;
            }
            const bool isRepeated = run.repetitions > 1;
            if (isRepeated != (run.run_type == Run::RT_Aggregate)) continue;
            if (isRepeated && run.aggregate_name != "median") continue;
            const std::string name = run.run_name.function_name +
                                     (run.run_name.args.empty() ? "" : "/" + run.run_name.args);
            const char* unit = benchmark::GetTimeUnitString(run.time_unit);
            std::printf("%-30s %11.1f %s %11.1f %s", name.c_str(), run.GetAdjustedRealTime(), unit,
                        run.GetAdjustedCPUTime(), unit);
            for (const auto& counter : run.counters)
                std::printf("  %s %.4g", counter.first.c_str(), double(counter.second));
            std::printf("\n");
            std::fflush(stdout);
            times[name] =
                run.GetAdjustedRealTime() * 1e6 / benchmark::GetTimeUnitMultiplier(run.time_unit);
            const auto counter = run.counters.find("iteration_us");
            if (counter != run.counters.end()) iteration[name] = counter->second;
        }
    }
};

benchmark::internal::Benchmark* addLong(const std::string& name,
                                        void (*function)(benchmark::State&)) {
    return benchmark::RegisterBenchmark(name.c_str(), function)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

/** Registers the benchmarks of an example; their names begin with the model's. **/
template <class Model>
void registerSolves() {
    const std::string prefix = std::string(Model::name) + "_";
    const auto addSolve = [&](const std::string& name, void (*function)(benchmark::State&)) {
        return benchmark::RegisterBenchmark((prefix + name).c_str(), function)
            ->Unit(benchmark::kMicrosecond)
            ->UseRealTime()
            ->MinTime(0.2)
            ->Repetitions(7)
            ->DisplayAggregatesOnly();
    };
    addSolve("block_elimination", solveByBlockElimination<Model>)
        ->ArgName("threads")
        ->Arg(1)
        ->Arg(2);
    addSolve("complex_elimination", solveByComplexElimination<Model>)->ArgName("threads")->Arg(1);
    addSolve("dense_lu", solveDense<Model>);
    addSolve("sparse_lu_colamd", solveBySparseLU<Model, Eigen::COLAMDOrdering<int>>);
    addSolve("sparse_lu_amd", solveBySparseLU<Model, Eigen::AMDOrdering<int>>);
    addSolve("klu_factor", solveByKlu<Model, false>);
    addSolve("klu_refactor", solveByKlu<Model, true>);
    addSolve("umfpack", solveByUmfpack<Model>);
}

void registerBenchmarks() {
    registerSolves<SliderCrank>();
    registerSolves<Stator>();
    registerSolves<DenseBlocks<SliderCrank>>();
    registerSolves<DenseBlocks<Stator>>();
    registerSolves<Stiffened<SliderCrank>>();
    registerSolves<StiffenedFull<SliderCrank>>();
    registerSolves<Stiffened<Stator>>();
    registerSolves<StiffenedFull<Stator>>();
    addLong("slider_crank_run", runExample<SliderCrank>)->Iterations(5);
    addLong("stator_run", runExample<Stator>)->Iterations(2);
    addLong("reduce_crank", reduceCrank)->Iterations(1);
    addLong("frame_1280x720", drawFrame);
}

/** Returns the main figures of a model as a JSON object, with zeros for benchmarks that a filter
excluded. **/
std::string summarize(const Reporter& reporter, const std::string& model) {
    const auto get = [&](const std::map<std::string, double>& figures, const std::string& name) {
        const auto found = figures.find(model + "_" + name);
        return found == figures.end() ? 0.0 : found->second;
    };
    double sparse = 0;
    for (const char* name :
         {"sparse_lu_colamd", "sparse_lu_amd", "klu_factor", "klu_refactor", "umfpack"}) {
        const double time = get(reporter.times, name);
        if (time > 0 && (sparse == 0 || time < sparse)) sparse = time;
    }
    const double real = get(reporter.times, "block_elimination/threads:1");
    const double complex = get(reporter.times, "complex_elimination/threads:1");
    char text[300];
    std::snprintf(text, sizeof text,
                  "\"%s\": {\"bge1_us\": %.2f, \"bge2_us\": %.2f, \"dense_us\": %.2f, "
                  "\"best_sparse_us\": %.2f, \"newton_iteration_us\": %.2f, "
                  "\"complex_over_real\": %.2f}",
                  model.c_str(), real, get(reporter.times, "block_elimination/threads:2"),
                  get(reporter.times, "dense_lu"), sparse, get(reporter.iteration, "run"),
                  real > 0 ? complex / real : 0);
    return text;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    simflex::registerBenchmarks();
    simflex::Reporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
    benchmark::Shutdown();

    std::string json;
    for (const char* model : {"slider_crank", "stator", "slider_crank_dense", "stator_dense"})
        json += (json.empty() ? "" : ", ") + simflex::summarize(reporter, model);
    std::printf("\n{%s}\n", json.c_str());
    return 0;
}
