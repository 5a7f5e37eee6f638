#pragma once
/** @file
The Craig–Bampton basis of a part with tied interfaces, or free-free modes of a part without; and
the full model's own free-free frequencies to compare with. Internal to reduction. **/

#include <Eigen/Dense>
#include <chrono>
#include <memory>

#include "InterfaceTie.h"
#include "RigidMotion.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {

class FixedInterfaces;
struct MeanAxisModes;

/** Shapes on the mesh with the motion of the interface masters in each: constraint modes (the rigid
motions of a part without interfaces), attachment modes, normal modes. **/
struct ModeBasis {
    Shapes Psi;       ///< numDofs×N
    Shapes boundary;  ///< numBoundaryDofs×N: per interface three translations, three rotations
    int numConstraint = 0, numAttachment = 0;
    Eigen::VectorXd normalOmegaSquared;  ///< of the normal modes, ascending
    Eigen::MatrixXd effectiveMasses;     ///< 6×normal modes, see ReductionReport
    /** Why it has fewer normal modes than asked for; empty: it has them all. To be refused once the
    shapes that it has are known to hold together. **/
    std::string lack;
    std::shared_ptr<const FixedInterfaces> held;
    std::shared_ptr<const ModeBasis> finer;  ///< with further normal modes and inertia relief
};

/** The Craig–Bampton basis, N = options.numModes unless options.highestFrequency says otherwise.
@throws std::invalid_argument if K is singular, there are too few or too many modes, or a load point
    is no use. **/
ModeBasis calcCraigBamptonBasis(const FeModel& model, const FeProducts& products,
                                const RigidMotion& rigid, const InterfaceTies& ties,
                                const ReductionOptions& options, const ProgressCallback& progress,
                                ReductionTimings& timings);

/** The lowest free-free frequencies of the full model with its interfaces tied [Hz], the rigid ones
left out, ascending: Rayleigh quotients of converged shapes. **/
std::vector<double> calcFullFrequencies(const FeProducts& products, const RigidMotion& rigid,
                                        const ModeBasis& basis, int count,
                                        const ProgressCallback& progress);

/** See ReductionReport::staticErrors. **/
std::vector<StaticError> calcStaticErrors(const FeModel& model, const FeProducts& products,
                                          const RigidMotion& rigid, const InterfaceTies& ties,
                                          const ReductionOptions& options, const ModeBasis& basis,
                                          const MeanAxisModes& modes);

/** Seconds since `start`, which is set to now. **/
double lapTime(std::chrono::steady_clock::time_point& start);

}  // namespace simflex
