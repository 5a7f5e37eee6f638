#include "support/ChainCost.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "simflex/solver/BdfIntegrator.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

using Clock = std::chrono::steady_clock;

constexpr double step = 2e-4;  // [s]

/** Seconds since the last call. **/
class Stopwatch {
public:
    double lap() {
        const auto now = Clock::now();
        const double seconds = std::chrono::duration<double>(now - m_last).count();
        m_last = now;
        return seconds;
    }

private:
    Clock::time_point m_last = Clock::now();
};

/** Bytes in use from the allocator. **/
double countBytesInUse() {
    const struct mallinfo2 info = mallinfo2();
    return double(info.uordblks) + double(info.hblkhd);
}

IntegratorStatistics subtract(IntegratorStatistics a, const IntegratorStatistics& b) {
    a.stepsTaken -= b.stepsTaken;
    a.newtonIterations -= b.newtonIterations;
    a.linearSolves -= b.linearSolves;
    a.factorizations -= b.factorizations;
    a.evaluationSeconds -= b.evaluationSeconds;
    a.factorSeconds -= b.factorSeconds;
    a.schurSeconds -= b.schurSeconds;
    a.backSubstitutionSeconds -= b.backSubstitutionSeconds;
    a.simbodySeconds -= b.simbodySeconds;
    a.totalSeconds -= b.totalSeconds;
    return a;
}

}  // namespace

ChainCost measureChain(const ChainOptions& options, const std::shared_ptr<const ReducedBody>& part,
                       int numThreads) {
    ChainCost cost;
    cost.numLinks = options.numLinks;
    const double before = countBytesInUse();
    Stopwatch watch;
    ChainModel model(options, part);
    cost.modelSeconds = watch.lap();
    State initial = model.makeInitialState();
    cost.topologySeconds = watch.lap();

    BdfIntegrator integrator(model.system);
    integrator.setFixedStep(step);
    if (numThreads > 0) integrator.setNumThreads(numThreads);
    integrator.initialize(initial);
    cost.initializeSeconds = watch.lap();

    const int numSteps = std::clamp(40000 / options.numLinks, 8, 400);
    // In the first steps caches warm up, and the integrator finds whether threads pay.
    constexpr int warmUp = 12;
    integrator.stepTo(warmUp * step);
    const IntegratorStatistics start = integrator.getStatistics();
    integrator.stepTo((warmUp + numSteps) * step);
    cost.statistics = subtract(integrator.getStatistics(), start);
    // Simbody evaluates only the initial State: that time is stateSeconds, not part of a step.
    cost.iterationSeconds = (cost.statistics.totalSeconds - cost.statistics.simbodySeconds) /
                            double(std::max(1L, cost.statistics.newtonIterations));
    watch.lap();
    integrator.getState();
    cost.stateSeconds = watch.lap();
    cost.bytes = countBytesInUse() - before;
    return cost;
}

double fitExponent(const std::vector<double>& x, const std::vector<double>& y) {
    double meanX = 0, meanY = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        meanX += std::log(x[i]) / double(x.size());
        meanY += std::log(y[i]) / double(x.size());
    }
    for (size_t i = 0; i < x.size(); ++i) {
        const double dx = std::log(x[i]) - meanX;
        xx += dx * dx;
        xy += dx * (std::log(y[i]) - meanY);
    }
    return xy / xx;
}

}  // namespace simflex::examples
