#pragma once
/** @file
What a chain of N links costs: set-up, Newton iterations, memory.

    for (int N : {10, 100, 1000}) {
        ChainOptions options;
        options.numLinks = N;
        const ChainCost cost = measureChain(options, part, 0);
        std::printf("%d %g\n", N, cost.iterationSeconds);
    }
**/

#include <vector>

#include "simflex/solver/IntegratorStatistics.h"
#include "support/ChainModel.h"

namespace simflex::examples {

struct ChainCost {
    int numLinks = 0;
    double modelSeconds = 0;       ///< bodies, joints and damping added
    double topologySeconds = 0;    ///< Simbody's realizeTopology(), realizeModel(), initial State
    double initializeSeconds = 0;  ///< BdfIntegrator::initialize()
    double iterationSeconds = 0;   ///< a Newton iteration, with its share of everything in a step
    double stateSeconds = 0;       ///< BdfIntegrator::getState() after a step
    double bytes = 0;              ///< memory in use: model, States and integrator
    IntegratorStatistics statistics;  ///< of the steps alone

    double setUpSeconds() const { return modelSeconds + topologySeconds + initializeSeconds; }
};

/** Lets go of a straight chain and takes a few short steps of fixed size, more of them for a short
chain.
@param numThreads  0 leaves it to the library **/
ChainCost measureChain(const ChainOptions& options, const std::shared_ptr<const ReducedBody>& part,
                       int numThreads);

/** Slope of log(y) over log(x) by least squares. @pre two different x, all positive. **/
double fitExponent(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace simflex::examples
