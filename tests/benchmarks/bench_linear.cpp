// Equilibria and linear analyses of chains of flexible links, 54 modes each, by number of links:
// one on pins that lies level comes to hang; its 50 slowest modes there, damped; one that is welded
// together bends by half its length under a force at its end; the same, turning about one end twice
// as fast as it swings at rest, and modes about that; the frequency response of the last link's end
// to a force on it; in brackets seconds of processor time. The last line is a JSON object: seconds
// of the equilibrium of up to 1000 links (goal: 2) and its iterations, seconds of the modes;
// iterations and seconds of 32 welded links (goals: 30 and 0.1); seconds of modes of what turns;
// seconds that 10 000 links and 100 frequencies take on all processors, linearised and
// differentiated and all, and processor time.
//
//   bench_linear [LARGEST NUMBER OF LINKS]     default 10000

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Signal.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/FrequencyResponse.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/ChainModel.h"

namespace simflex {
namespace {

using SimTK::State;
using SimTK::Vector;
using Clock = std::chrono::steady_clock;

constexpr int NumFrequencies = 100, NumModes = 50;
constexpr double LowestFrequency = 1, HighestFrequency = 1e4;  // [Hz]

struct Seconds {
    double wall, processor;
};

Seconds now() {
    static const Clock::time_point start = Clock::now();
    return {std::chrono::duration<double>(Clock::now() - start).count(),
            double(std::clock()) / CLOCKS_PER_SEC};
}

Seconds operator-(const Seconds& a, const Seconds& b) {
    return {a.wall - b.wall, a.processor - b.processor};
}

Seconds measureResponse(const std::shared_ptr<const ReducedBody>& part, int numLinks) {
    examples::ChainOptions options;
    options.numLinks = numLinks;
    options.gravity = 0;
    examples::ChainModel model(options, part);
    const State state = model.makeInitialState();
    const Seconds start = now();
    const FrequencyResponse response(model.system, state);
    const Seconds linearised = now();
    const int n = state.getNU(), m = response.getPoint().multipliers.size();

    const int first = model.links.back().getFrame().getFirstUIndex(state);
    LinearInputs inputs{SimTK::Matrix(n, 1, 0.0), SimTK::Matrix(m, 1, 0.0),
                        SimTK::Matrix(1, 1, 0.0)};
    inputs.forces(first + 4, 0) = 1;
    const Signal tip =
        Signal::displacement(Attachment(model.matter.Ground()),
                             Attachment::onInterface(model.links.back(), "eye"), SimTK::YAxis);
    const Signal::Slopes slopes = tip.calcSlopes(model.flexible, response.getPoint().state).value();
    LinearOutputs outputs{SimTK::Matrix(1, n), SimTK::Matrix(1, n), SimTK::Matrix(1, n, 0.0),
                          SimTK::Matrix(1, m, 0.0), SimTK::Matrix(1, 0)};
    outputs.byQ[0] = ~slopes.byQ;
    outputs.byU[0] = ~slopes.byU;
    const Seconds differentiated = now();
    std::vector<SimTK::Real> omegas;
    for (int k = 0; k < NumFrequencies; ++k)
        omegas.push_back(
            2 * SimTK::Pi * LowestFrequency *
            std::pow(HighestFrequency / LowestFrequency, double(k) / (NumFrequencies - 1)));
    response.calcTransfers(omegas, inputs, outputs);
    const Seconds done = now();
    std::printf("%8d %8d", numLinks, n);
    for (const Seconds& phase :
         {linearised - start, differentiated - linearised, done - differentiated, done - start})
        std::printf(" %9.2f (%7.2f)", phase.wall, phase.processor);
    std::printf("\n");
    return done - start;
}

struct StaticsCost {
    Seconds statics{0, 0}, modes{0, 0};
    int links = 0, iterations = 0;
};

StaticsCost measureStatics(const std::shared_ptr<const ReducedBody>& part, int numLinks) {
    examples::ChainOptions options;
    options.numLinks = numLinks;
    options.joints = examples::ChainOptions::Joints::Pin;
    examples::ChainModel model(options, part);
    const State level = model.makeInitialState();
    StaticEquilibrium equilibrium(model.system);
    StaticsCost cost;
    cost.links = numLinks;
    const Seconds start = now();
    equilibrium.solve(level);
    const Seconds atRest = now();
    cost.statics = atRest - start;
    cost.iterations = equilibrium.getNumIterations();
    const std::vector<Eigenmode> modes =
        calcSlowestEigenmodes(model.system, equilibrium.getState(), NumModes);
    cost.modes = now() - atRest;
    std::printf("%8d %10d %9.2f (%7.2f) %14.3g %9.2f (%7.2f) %12.5g\n", numLinks, cost.iterations,
                cost.statics.wall, cost.statics.processor,
                -model.calcTip(equilibrium.getState())[1] / model.getLength() - 1, cost.modes.wall,
                cost.modes.processor, modes.back().frequency);
    return cost;
}

/** @param load  PL²/EI of a force on the last link's end in its most flexible direction; in the
other direction so long a chain buckles sideways **/
StaticsCost measureWelded(const std::shared_ptr<const ReducedBody>& part, int numLinks,
                          double load) {
    examples::ChainOptions options;
    options.numLinks = numLinks;
    options.joints = examples::ChainOptions::Joints::Weld;
    options.gravity = 0;
    // The first pass measures the stiffness with a small force.
    double stiffness = 1e-3, bent = 0;
    StaticsCost cost;
    for (int pass = 0; pass < 2; ++pass) {
        examples::ChainModel model(options, part);
        const double force = pass == 0 ? stiffness : load / 3 * model.getLength() * stiffness;
        AttachmentForce(model.flexible, model.links.back().interface("eye"),
                        SimTK::SpatialVec(SimTK::Vec3(0), SimTK::Vec3(0, 0, force)));
        const State level = model.makeInitialState();
        StaticEquilibrium equilibrium(model.system);
        const Seconds start = now();
        equilibrium.solve(level);
        cost.statics = now() - start;
        cost.iterations = equilibrium.getNumIterations();
        cost.links = numLinks;
        bent = model.calcTip(equilibrium.getState())[2];
        stiffness = force / bent;
        bent /= model.getLength();
    }
    std::printf("%8d %10d %9.3f (%7.3f) %14.4g\n", numLinks, cost.iterations, cost.statics.wall,
                cost.statics.processor, bent);
    return cost;
}

/** Welded links rotating about one end at twice their swing frequency at rest: the steady motion,
in which they stretch, and modes about it. **/
StaticsCost measureTurning(const std::shared_ptr<const ReducedBody>& part, int numLinks) {
    examples::ChainOptions options;
    options.numLinks = numLinks;
    options.joints = examples::ChainOptions::Joints::Weld;
    options.gravity = 0;
    {
        examples::ChainModel resting(options, part);
        options.speed =
            4 * SimTK::Pi *
            calcSlowestEigenmodes(resting.system, resting.makeInitialState(), 1).at(0).frequency;
    }
    examples::ChainModel model(options, part);
    State state = model.makeInitialState();
    model.system.realize(state, SimTK::Stage::Position);
    setSteadyRotation(model.system, state, SimTK::Vec3(0, 0, options.speed));
    StaticEquilibrium equilibrium(model.system);
    StaticsCost cost;
    cost.links = numLinks;
    const Seconds start = now();
    equilibrium.solveSteadyMotion(state);
    const Seconds steady = now();
    cost.statics = steady - start;
    cost.iterations = equilibrium.getNumIterations();
    const std::vector<Eigenmode> modes =
        calcSlowestEigenmodes(model.system, equilibrium.getState(), NumModes, EigenMethod::Blocks);
    cost.modes = now() - steady;
    std::printf("%8d %10d %9.2f (%7.2f) %14.3g %9.2f (%7.2f) %12.5g\n", numLinks, cost.iterations,
                cost.statics.wall, cost.statics.processor,
                model.calcTip(equilibrium.getState()).norm() / model.getLength() - 1,
                cost.modes.wall, cost.modes.processor, modes.back().frequency);
    return cost;
}

int run(int largest) {
    const auto part = std::make_shared<const ReducedBody>(
        readReducedBody(std::string(SIMFLEX_PARTS) + "/link.h5"));
    StaticsCost statics;
    std::printf("%8s %10s %19s %14s %19s %12s\n", "links", "iterations", "statics s",
                "stretched by", "50 modes s", "the last Hz");
    for (const int numLinks : {10, 100, 1000})
        if (numLinks <= largest) statics = measureStatics(part, numLinks);
    std::printf("\n%8s %10s %19s %14s\n", "welded", "iterations", "statics s", "bent, of length");
    StaticsCost welded;
    for (const int numLinks : {8, 16, 32, 64}) {
        const StaticsCost own = measureWelded(part, numLinks, 2);
        if (numLinks == 32) welded = own;
    }
    std::printf("\n%8s %10s %19s %14s %19s %12s\n", "turning", "iterations", "steady motion s",
                "stretched by", "50 modes s", "the last Hz");
    StaticsCost turning;
    for (const int numLinks : {10, 100, 1000})
        if (numLinks <= largest) turning = measureTurning(part, numLinks);
    std::printf("\n%8s %8s %19s %19s %19s %19s\n", "links", "speeds", "linearise s", "output s",
                "100 frequencies s", "all s");
    Seconds seconds{0, 0};
    for (const int numLinks : {10, 100, 1000, 10000})
        if (numLinks <= largest) seconds = measureResponse(part, numLinks);
    std::printf(
        "\n{\"statics_%d_links_seconds\": %.3f, \"statics_%d_links_iterations\": %d, "
        "\"statics_iterations_%d\": %d, \"statics_%d_welded_seconds\": %.3f, "
        "\"eigen_%d_links_seconds\": %.3f, \"eigen_%d_turning_links_seconds\": %.3f, "
        "\"frf_%d_links_100_seconds\": %.2f, \"processor_seconds\": %.2f}\n",
        statics.links, statics.statics.wall, statics.links, statics.iterations, welded.links,
        welded.iterations, welded.links, welded.statics.wall, statics.links, statics.modes.wall,
        turning.links, turning.modes.wall, largest, seconds.wall, seconds.processor);
    return 0;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        return simflex::run(argc > 1 ? std::max(10, std::atoi(argv[1])) : 10000);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench_linear: %s\n", error.what());
        return 1;
    }
}
