#pragma once
/** @file
The Craig–Bampton basis of a part with tied interfaces, and free-free modes of a part without.
Internal to reduction. **/

#include <chrono>
#include <memory>

#include "InterfaceTie.h"
#include "SparseCholesky.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {

/** The finite element matrices in the form that the reduction multiplies with. **/
struct FeProducts {
    explicit FeProducts(const FeModel& model) : K(model.K), m(model.m) {}
    FullRows K;  ///< numDofs
    FullRows m;  ///< numNodes, M = m ⊗ 1₃
};

/** Shapes on the mesh with the motion of the interface masters in each. **/
struct ModeBasis {
    Shapes Psi;       ///< numDofs×N
    Shapes boundary;  ///< numBoundaryDofs×N: per interface three translations, three rotations
    /** K_ii of the nodes of no interface, factored; null where all or none are tied. **/
    std::shared_ptr<const SparseCholesky> fixedInterfaces;
};

/** Constraint modes, then fixed-interface normal modes: N = options.numModes.
@throws std::invalid_argument if K_ii is singular or there are too few or too many modes. **/
ModeBasis calcCraigBamptonBasis(const FeModel& model, const FeProducts& products,
                                const InterfaceTies& ties, const ReductionOptions& options,
                                const ProgressCallback& progress, ReductionTimings& timings);

/** The options.numModes lowest free-free modes, the rigid ones among them; no boundary rows.
@throws std::invalid_argument if there are too few or too many modes. **/
ModeBasis calcFreeBasis(const FeModel& model, const FeProducts& products,
                        const ReductionOptions& options, const ProgressCallback& progress,
                        ReductionTimings& timings);

/** Seconds since `start`, which is set to now. **/
double lapTime(std::chrono::steady_clock::time_point& start);

}  // namespace simflex
