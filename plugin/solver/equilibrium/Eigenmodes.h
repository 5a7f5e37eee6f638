#pragma once
/** @file
Eigenmodes of a linearised system,

    (λ²M + λD + K) x + Gᵀμ = 0,   G x = 0

in the null space of G (redundant rows are allowed). States z of the model's own add the equations
λz = (C + λE) x + F z and their modes. Without damping, gyroscopic terms and follower forces the
problem is symmetric and λ = ±iω; otherwise λ is complex.

    const Linearization linear = calcLinearization(system, state);
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    for (const State& now : calcModeStates(system, linear, modes[2], 0.01, 24)) frames.report(now);

Tested relative errors of frequencies are below 1e-9 undamped, 1e-8 complex; very slow complex modes
beside very stiff parts are less accurate. Dense: O(n³) for n speeds. The slowest modes of many
bodies are found by block elimination in O(n), at rest and about steady motions. **/

#include <cmath>
#include <stdexcept>
#include <vector>

#include "simflex/solver/Linearization.h"

namespace simflex {

struct Eigenmode {
    /** λ [1/s]; for a conjugate pair, the one with positive imaginary part. **/
    SimTK::Complex eigenvalue;
    SimTK::Real frequency;  ///< |λ|/2π [Hz]
    /** −Re λ/|λ|: 1 if the motion decays without oscillating, negative if it grows. **/
    SimTK::Real dampingRatio;
    /** n: x in Simbody's numbering of u, axes as in Linearization; normalised to xᴴMx = 1 with the
    largest displacement real and positive. **/
    SimTK::Vector_<SimTK::Complex> shape;
    SimTK::Vector_<SimTK::Complex> momentum;  ///< n: M x
    /** About a steady motion: whether the motion rotates the shape, so that the frequency is that
    seen by a co-rotating observer. **/
    bool isSeenTurning = false;
    /** Frequency at or below which a mode may be a free motion plus the round-off of the stiffest
    mode or of the rotation; the same for all modes [Hz]. **/
    SimTK::Real resolution = 0;

    /** True for a free motion: λ = 0. **/
    bool isRigidMotion() const { return frequency == 0; }
    /** True if the mode cannot be distinguished from a free motion. **/
    bool isUncertain() const { return frequency <= resolution; }
    /** False if the motion decays or grows monotonically. **/
    bool oscillates() const { return std::abs(dampingRatio) < Aperiodic; }
    static constexpr SimTK::Real Aperiodic = 1 - 1e-9;
};

/** Computes all modes: rigid motions first, then by ascending frequency. A motion that does not
oscillate has two eigenvalues and two modes.
@throws std::invalid_argument with the reason if the matrices hold at an instant only
    (Linearization::unsteady). **/
std::vector<Eigenmode> calcEigenmodes(const Linearization& linearization);

/** Modes were requested about a State at rest that is not an equilibrium. **/
class NoEquilibrium : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};
/** @throws NoEquilibrium naming the body that leaves a State at rest, and how far it moves. **/
void requireEquilibrium(const SimTK::MultibodySystem& system, const Linearization& linearization);

enum class EigenMethod {
    Automatic,  ///< block elimination where it is possible and faster
    Dense,      ///< computes all modes, returns the slowest
    /** K + σM is factored body by body and spans a Krylov space that holds as many of the slowest
    modes as the inertia of K (Sylvester's law) predicts. Gyroscopic forces and damping are
    projected onto these, and the space is extended by residuals until the modes satisfy the
    equations; in steady rotation, modes are counted with the Hermitian K − ω²M + iωD. **/
    Blocks
};

/** Computes all rigid motions and the `count` slowest other modes, ordered as by calcEigenmodes().
@param observer  as in calcLinearization()
@throws NoEquilibrium as requireEquilibrium()
@throws std::invalid_argument as calcLinearization() and calcEigenmodes(); with EigenMethod::Blocks
    also for systems with friction or states of their own. **/
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
