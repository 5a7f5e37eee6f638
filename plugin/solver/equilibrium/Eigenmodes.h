#pragma once
/** @file
Natural motions of a linearised system,

    (λ²M + λD + K) x + Gᵀμ = 0,   G x = 0

in the null space of G (redundant rows are allowed); with states z of the model's own, whose
equations have modes too, λz = (C + λE) x + F z. Without damping, gyroscopic terms and follower
forces the problem is symmetric and λ = ±iω; else λ is complex.

    const Linearization linear = calcLinearization(system, state);
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    for (const State& now : calcModeStates(system, linear, modes[2], 0.01, 24)) frames.report(now);

Tests hold undamped frequencies to 1e-9 of themselves, complex ones to 1e-8; very slow complex ones
beside very stiff parts are less sharp. Dense: O(n³) for n speeds. The slowest modes of many bodies
are found by block elimination, in time proportional to n, at rest and about steady motions. **/

#include <cmath>
#include <stdexcept>
#include <vector>

#include "simflex/solver/Linearization.h"

namespace simflex {

struct Eigenmode {
    /** λ [1/s]; of a conjugate pair the one with positive imaginary part. **/
    SimTK::Complex eigenvalue;
    SimTK::Real frequency;  ///< |λ|/2π [Hz]
    /** −Re λ/|λ|: 1 if it dies down without oscillating, negative if it grows. **/
    SimTK::Real dampingRatio;
    /** n: x in Simbody's numbering of u, axes as in Linearization; xᴴMx = 1, largest displacement
    real and positive. **/
    SimTK::Vector_<SimTK::Complex> shape;
    SimTK::Vector_<SimTK::Complex> momentum;  ///< n: M x
    /** About a steady motion: whether that turns the shape, so that it has this frequency for an
    observer who turns along. **/
    bool isSeenTurning = false;
    /** What is this slow or slower may be a free motion with the round-off of the stiffest one, or
    of what turns; the same for all modes [Hz]. **/
    SimTK::Real resolution = 0;

    /** True if nothing restores this motion: λ = 0. **/
    bool isRigidMotion() const { return frequency == 0; }
    /** True if it cannot be told from one. **/
    bool isUncertain() const { return frequency <= resolution; }
    /** False of a motion that dies away or grows without turning back. **/
    bool oscillates() const { return std::abs(dampingRatio) < Aperiodic; }
    static constexpr SimTK::Real Aperiodic = 1 - 1e-9;
};

/** All modes: rigid motions first, then by ascending frequency. A motion that does not oscillate
has two eigenvalues and two modes.
@throws std::invalid_argument that says why, if the matrices are those of an instant only
    (Linearization::unsteady). **/
std::vector<Eigenmode> calcEigenmodes(const Linearization& linearization);

/** Modes about a State at rest that is no equilibrium say nothing. **/
class NoEquilibrium : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};
/** @throws NoEquilibrium that names the body that leaves a State at rest, and how far. **/
void requireEquilibrium(const SimTK::MultibodySystem& system, const Linearization& linearization);

enum class EigenMethod {
    Automatic,  ///< block elimination where it is possible and quicker
    Dense,      ///< all modes, of which the slowest are given
    /** K + σM is eliminated body by body and spans a Krylov space, of as many slowest modes as a
    count of K's eigenvalues (Sylvester's law of inertia) finds. Gyroscopic forces and damping are
    projected onto these, and onto what their residuals lack, until they fulfil the equations; of
    what turns, the count is that of the Hermitian K − ω²M + iωD. **/
    Blocks
};

/** All rigid motions and the `count` slowest modes besides, as calcEigenmodes() has them.
@param observer  as in calcLinearization()
@throws NoEquilibrium as requireEquilibrium()
@throws std::invalid_argument as calcLinearization() and calcEigenmodes(); with EigenMethod::Blocks
    also where something rubs or has states of its own. **/
std::vector<Eigenmode> calcSlowestEigenmodes(const SimTK::MultibodySystem& system,
                                             const SimTK::State& state, int count,
                                             EigenMethod method = EigenMethod::Automatic,
                                             const std::function<void()>& observer = {});

/** Modes about a State that grow by themselves, whether they oscillate or not: among all modes of
up to 500 speeds, among the 30 slowest of more (none of those are looked for in a system with states
of its own).
@throws as calcSlowestEigenmodes(). **/
std::vector<Eigenmode> calcGrowingModes(const SimTK::MultibodySystem& system,
                                        const SimTK::State& state,
                                        const std::function<void()>& observer = {});

/** One period of a mode in `numFrames` States, at equal intervals from its largest displacement on:
the operating point moved by Re(x e^{2πik/numFrames}), damping left out. Joints are met to first
order in the amplitude.
@param amplitude  largest displacement of any body in the first frame or later [m]
@throws std::invalid_argument if the amplitude is not positive or the mode is another system's. **/
std::vector<SimTK::State> calcModeStates(const SimTK::MultibodySystem& system,
                                         const OperatingPoint& about, const Eigenmode& mode,
                                         SimTK::Real amplitude, int numFrames);

}  // namespace simflex
