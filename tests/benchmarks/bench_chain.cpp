// Chains of flexible links with 54 modes each, by number of links. Compares the cost and memory of
// a Newton iteration with Simbody's own accelerations of the same chain, two and four threads with
// one, and measures threads while all processors are busy. The last line is a JSON object:
// - milliseconds per iteration of 10 000 links with one thread and with four,
// - exponent of the cost from 100 to 10 000 links,
// - ratio of Simbody's time to ours for one evaluation of the accelerations of 200 links (with
// Simbody's Constraint::Ball between body frames, and with joints that see the modes),
// - speed-up by threads,
// - time of two threads relative to one while every processor is busy (goal: at most 1.3).
//
//   bench_chain [LARGEST NUMBER OF LINKS]     default 10000

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <thread>

#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "support/ChainCost.h"

namespace simflex {
namespace {

using examples::ChainCost;
using examples::ChainModel;
using examples::ChainOptions;
using SimTK::Stage;
using SimTK::State;

using Part = std::shared_ptr<const ReducedBody>;

const std::string partsFolder = SIMFLEX_PARTS;

double measureSeconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double medianOf(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + long(values.size() / 2), values.end());
    return values[values.size() / 2];
}

ChainOptions optionsFor(int numLinks, ChainOptions::Joints joints = ChainOptions::Joints::Ball) {
    ChainOptions options;
    options.numLinks = numLinks;
    options.joints = joints;
    return options;
}

/** Reduces the link to 100 modes. **/
Part reduceLinkTo100Modes() {
    ReductionOptions options;
    options.name = "link";
    options.interfaces = {{"fork", "FORK"}, {"eye", "EYE"}};
    options.numModes = 106;
    return std::make_shared<const ReducedBody>(
        reduce(readCalculixDeck(partsFolder + "/link.inp"), options));
}

//------------------------------------------------------------------------------------------------
// growth

struct Growth {
    double time, memory, setUp;      ///< exponents with respect to the number of links
    double largestMilliseconds = 0;  ///< per iteration of the longest chain
    double byFourThreads = 0;        ///< the same with four threads [ms]
};

/** Returns the fastest of several runs: other load on the machine can only slow a run down. **/
ChainCost measureQuickest(const ChainOptions& options, const Part& part, int threads,
                          int repetitions) {
    ChainCost best = measureChain(options, part, threads);
    while (--repetitions > 0) {
        const ChainCost cost = measureChain(options, part, threads);
        if (cost.iterationSeconds < best.iterationSeconds) best = cost;
    }
    return best;
}

Growth measureGrowth(const Part& part, int largest) {
    std::printf("%8s %14s %14s %10s %10s %12s %12s %10s\n", "links", "ms/iteration", "us/it./link",
                "model s", "topology s", "initialize s", "getState ms", "kB/link");
    std::vector<double> links, times, bytes, setUps;
    for (int numLinks : {10, 100, 1000, 3000, 10000}) {
        if (numLinks > largest) break;
        const ChainCost cost = measureQuickest(optionsFor(numLinks), part, 1, 3);
        std::printf("%8d %14.4g %14.4g %10.3f %10.3f %12.3f %12.3f %10.1f\n", numLinks,
                    1e3 * cost.iterationSeconds, 1e6 * cost.iterationSeconds / numLinks,
                    cost.modelSeconds, cost.topologySeconds, cost.initializeSeconds,
                    1e3 * cost.stateSeconds, 1e-3 * cost.bytes / numLinks);
        if (numLinks < 100 && largest > 100) continue;
        links.push_back(numLinks);
        times.push_back(cost.iterationSeconds);
        bytes.push_back(cost.bytes);
        setUps.push_back(cost.setUpSeconds());
    }
    if (links.size() < 2) return {0, 0, 0};
    const double byFour =
        measureQuickest(optionsFor(int(links.back())), part, 4, 3).iterationSeconds;
    const Growth growth{examples::fitExponent(links, times), examples::fitExponent(links, bytes),
                        examples::fitExponent(links, setUps), 1e3 * times.back(), 1e3 * byFour};
    std::printf("exponents: Newton iteration %.3f, memory %.3f, set-up %.3f\n", growth.time,
                growth.memory, growth.setUp);
    std::printf("%8.0f links by 4 threads: %.4g ms an iteration\n\n", links.back(),
                growth.byFourThreads);
    return growth;
}

//------------------------------------------------------------------------------------------------
// against Simbody

/** Returns the seconds of one evaluation of u̇ and λ from q and u by Simbody alone; stores u̇ in
`uDot`. **/
double measureSimbody(const Part& part, int numLinks, ChainOptions::Joints joints, int repetitions,
                      SimTK::Vector* uDot = nullptr) {
    ChainModel model(optionsFor(numLinks, joints), part);
    State state = model.makeInitialState();
    // Exclude our modal forces, which are not Simbody's cost.
    model.flexible.getGuts().setNativeForcesEnabled(state, false);
    model.system.realize(state, Stage::Instance);
    std::vector<double> seconds;
    for (int k = 0; k < repetitions; ++k) {
        state.updQ();
        seconds.push_back(
            measureSeconds([&] { model.system.realize(state, Stage::Acceleration); }));
    }
    if (uDot) *uDot = state.getUDot();
    return medianOf(seconds);
}

/** The same by block elimination (residuals, mass matrix and joints, factorization, solve) on one
thread. **/
double measureElimination(const Part& part, int numLinks, SimTK::Vector* uDot) {
    ChainModel model(optionsFor(numLinks), part);
    const State state = model.makeInitialState();
    model.system.realize(state, Stage::Velocity);
    Evaluation equations(model.system, state);
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    step.setNumThreads(1);
    std::vector<double> q(size_t(equations.getTopology().numQ)),
        u(size_t(equations.getTopology().numU)), a(u.size()),
        lambda(size_t(equations.getTopology().numMultipliers));
    equations.getBlocks().getFromState(state, q.data(), u.data());
    std::vector<double> seconds;
    for (int k = 0; k < 31; ++k)
        seconds.push_back(measureSeconds([&] { step.calcAccelerations(0, q, u, a, lambda); }));
    *uDot = equations.getBlocks().calcSimbodyUDot(q.data(), a.data());
    return medianOf(seconds);
}

struct SimbodyRatios {
    double frameBalls, flexibleJoints;
};

SimbodyRatios measureAgainstSimbody(const Part& part, int numLinks) {
    SimTK::Vector own, simbody;
    const double elimination = measureElimination(part, numLinks, &own);
    const double frameBalls = measureSimbody(part, numLinks, ChainOptions::Joints::FrameBall, 5);
    const double flexible = measureSimbody(part, numLinks, ChainOptions::Joints::Ball, 2, &simbody);
    // The straight undeformed chain has no coupling terms beyond Simbody's mass matrix.
    const double difference = (own - simbody).normRMS() / simbody.normRMS();
    std::printf("accelerations and multipliers of %d links, one thread\n", numLinks);
    std::printf("  block elimination                    %10.3f ms\n", 1e3 * elimination);
    std::printf("  Simbody, Constraint::Ball on frames  %10.1f ms  %8.0f times\n", 1e3 * frameBalls,
                frameBalls / elimination);
    std::printf("  Simbody, joints that see the modes   %10.1f ms  %8.0f times\n", 1e3 * flexible,
                flexible / elimination);
    std::printf("  relative difference of accelerations, joints that see the modes: %.1e\n\n",
                difference);
    return {frameBalls / elimination, flexible / elimination};
}

//------------------------------------------------------------------------------------------------
// threads

/** Returns the speed-up of a Newton iteration with `threads` threads over one: the fastest of each,
run alternately. **/
double measureSpeedUp(const char* name, const Part& part, int numLinks, int threads,
                      int repetitions) {
    double one = SimTK::Infinity, many = SimTK::Infinity;
    for (int k = 0; k < repetitions; ++k) {
        one = std::min(one, measureChain(optionsFor(numLinks), part, 1).iterationSeconds);
        many = std::min(many, measureChain(optionsFor(numLinks), part, threads).iterationSeconds);
    }
    std::printf("  %-24s %d threads %10.3f ms %10.3f ms %8.2f times\n", name, threads, 1e3 * one,
                1e3 * many, one / many);
    return one / many;
}

/** Keeps every processor busy with one thread each. **/
class OtherWork {
public:
    OtherWork() {
        for (unsigned k = 0; k < std::thread::hardware_concurrency(); ++k)
            m_threads.emplace_back([this] {
                while (!m_isOver) {
                }
            });
    }
    ~OtherWork() {
        m_isOver = true;
        for (std::thread& thread : m_threads) thread.join();
    }

private:
    std::atomic<bool> m_isOver{false};
    std::vector<std::thread> m_threads;
};

/** Returns the time of two threads relative to one under background load: medians of alternating
runs, long enough to include the scheduler's effect. **/
double measureBusyRatio(const Part& part, int numLinks) {
    constexpr double Step = 2e-4, Seconds = 1;
    constexpr int WarmUp = 20, Repetitions = 5;
    ChainModel model(optionsFor(numLinks), part);
    const State initial = model.makeInitialState();
    const auto measure = [&](int threads, int steps) {
        BdfIntegrator integrator(model.system);
        integrator.setFixedStep(Step);
        integrator.setNumThreads(threads);
        integrator.initialize(initial);
        integrator.stepTo(WarmUp * Step);
        return measureSeconds([&] { integrator.stepTo((WarmUp + steps) * Step); });
    };
    const int steps = std::max(1, int(Seconds * WarmUp / measure(1, WarmUp)));
    std::vector<double> one, two;
    const OtherWork otherWork;
    for (int k = 0; k < Repetitions; ++k) {
        one.push_back(measure(1, steps));
        two.push_back(measure(2, steps));
    }
    const double ratio = medianOf(two) / medianOf(one);
    std::printf("  %4d links, %4d steps      %10.3f s  %10.3f s  %8.2f times\n", numLinks, steps,
                medianOf(one), medianOf(two), ratio);
    return ratio;
}

int run(int largest) {
    const Part part =
        std::make_shared<const ReducedBody>(readReducedBody(partsFolder + "/link.h5"));
    std::printf("link: %d modes; %d processors\n\n", part->numModes,
                int(std::thread::hardware_concurrency()));
    const Growth growth = measureGrowth(part, largest);
    const SimbodyRatios ratios = measureAgainstSimbody(part, 200);
    std::printf("Newton iteration %34s %13s\n", "1 thread", "many");
    const Part link100 = reduceLinkTo100Modes();
    double speedUps[2][3];
    for (const int threads : {2, 4}) {
        double* speedUp = speedUps[threads == 4];
        speedUp[0] = measureSpeedUp("200 links, 54 modes", part, 200, threads, 7);
        speedUp[1] = measureSpeedUp("2000 links, 54 modes", part, 2000, threads, 5);
        speedUp[2] = measureSpeedUp("16 links, 100 modes", link100, 16, threads, 7);
    }
    std::printf("\nbeside other work on all processors %15s %12s\n", "1 thread", "2 threads");
    const double busy32 = measureBusyRatio(part, 32), busy200 = measureBusyRatio(part, 200);
    std::printf(
        "\n{\"ms_%d\": %.3f, \"ms_%d_threads4\": %.3f, \"exponent\": %.3f, \"threads2_200\": %.2f, "
        "\"threads2_2000\": %.2f, "
        "\"threads2_16x100\": %.2f, \"threads4_200\": %.2f, \"threads4_2000\": %.2f, "
        "\"threads4_16x100\": %.2f, \"busy_ratio\": %.2f, \"memory_exponent\": %.3f, "
        "\"simbody_ratio_200\": %.0f, \"simbody_ratio_200_flexible_joints\": %.0f}\n",
        largest, growth.largestMilliseconds, largest, growth.byFourThreads, growth.time,
        speedUps[0][0], speedUps[0][1], speedUps[0][2], speedUps[1][0], speedUps[1][1],
        speedUps[1][2], std::max(busy32, busy200), growth.memory, ratios.frameBalls,
        ratios.flexibleJoints);
    return 0;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        return simflex::run(argc > 1 ? std::max(10, std::atoi(argv[1])) : 10000);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench_chain: %s\n", error.what());
        return 1;
    }
}
