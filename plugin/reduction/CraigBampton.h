#pragma once
/** @file
Craig–Bampton basis of a part with tied interfaces, or free-free modes of a part without, and the
full model's free-free frequencies for comparison. Internal to reduction. **/

#include <Eigen/Dense>
#include <chrono>
#include <memory>

#include "InterfaceTie.h"
#include "RigidMotion.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {

class FixedInterfaces;
struct MeanAxisModes;

/** Shapes on the mesh and their motion of the interface masters: constraint modes (rigid motions of
a part without interfaces), attachment modes, normal modes. **/
struct ModeBasis {
    Shapes Psi;       ///< numDofs×N
    Shapes boundary;  ///< numBoundaryDofs×N: three translations, then three rotations per interface
    int numConstraint = 0, numAttachment = 0;
    Eigen::VectorXd normalOmegaSquared;  ///< of the normal modes, ascending
    Eigen::MatrixXd effectiveMasses;     ///< 6×normal modes, see ReductionReport
    /** Why there are fewer normal modes than requested; empty otherwise. Reported only after the
    existing shapes have proved that the mesh holds together. **/
    std::string lack;
    std::string group;  ///< which modes more than those asked for are taken, and why; or empty
    std::shared_ptr<const FixedInterfaces> held;
    std::shared_ptr<const ModeBasis> finer;  ///< with further normal modes and inertia relief
};

/** Computes the Craig–Bampton basis, N = options.numModes unless options.highestFrequency is set.
@throws std::invalid_argument if K is singular, there are too few or too many modes, or a load point
is unusable. **/
ModeBasis calcCraigBamptonBasis(const FeModel& model, const FeProducts& products,
                                const RigidMotion& rigid, const InterfaceTies& ties,
                                const ReductionOptions& options, const ProgressCallback& progress,
                                ReductionTimings& timings);

/** Computes the lowest free-free frequencies of the full model with tied interfaces [Hz], without
the rigid ones, ascending: Rayleigh quotients of converged shapes. **/
std::vector<double> calcFullFrequencies(const FeProducts& products, const RigidMotion& rigid,
                                        const ModeBasis& basis, int count,
                                        const ProgressCallback& progress);

/** Computes ReductionReport::staticErrors. **/
std::vector<StaticError> calcStaticErrors(const FeModel& model, const FeProducts& products,
                                          const RigidMotion& rigid, const InterfaceTies& ties,
                                          const ReductionOptions& options, const ModeBasis& basis,
                                          const MeanAxisModes& modes);

/** Returns the seconds since `start` and sets `start` to now. **/
double lapTime(std::chrono::steady_clock::time_point& start);

}  // namespace simflex
