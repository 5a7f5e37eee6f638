#pragma once
/** @file
Small motions of flexible bodies and their joints about an assembly at rest: natural modes, static
equilibrium, steady answer to a rotating force. Dense and direct: for models of a few hundred
speeds.

    M v̈ + D v̇ + K v + Gᵀλ = f,   G v = 0

v are small displacements in the directions of Simbody's speeds u (rotation and translation of each
frame, modal coordinates); M and G come from Simbody, K and D are those of the modes. With M = LLᵀ
and the projector P onto the null space of G L⁻ᵀ, natural modes are the eigenvectors of P L⁻¹KL⁻ᵀ P
that P does not remove. Gravity's own stiffness, and that of preloaded joints, is left out.

    LinearModel linear(system, matter, {casing, nozzle}, state);
    linear.getFrequency(0);                        // [Hz]
    Vector v = linear.calcStaticDisplacement(f);   **/

#include <complex>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"

namespace simflex::examples {

class LinearModel {
public:
    /** @param bodies  all that move; the rest of the system is Ground
    @param state  undeformed, assembled, at rest; kept as the state to displace
    @param dampingRatio  of each part's modes, as a part of critical **/
    LinearModel(const SimTK::MultibodySystem& system, const SimTK::SimbodyMatterSubsystem& matter,
                std::vector<FlexibleBody> bodies, const SimTK::State& state, double dampingRatio);

    int getNumModes() const { return int(m_omegaSquared.size()); }
    double getFrequency(int mode) const;     ///< undamped [Hz], ascending
    double getDampingRatio(int mode) const;  ///< from the diagonal of XᵀDX

    /** Generalized forces of gravity, n. **/
    SimTK::Vector calcGravityForce(const SimTK::Vec3& gravity) const;

    /** Displacement v under constant generalized forces f. **/
    SimTK::Vector calcStaticDisplacement(const SimTK::Vector& f) const;

    /** The State displaced by v. **/
    SimTK::State calcDisplacedState(const SimTK::Vector& v) const;

    /** 3×n: translation of an interface's master point in Ground for v. **/
    SimTK::Matrix calcTranslationMap(const FlexibleBody& body, const std::string& interface) const;

    /** Complex amplitude of v under f e^{iωt} by modal superposition; couplings of the modes by D
    are left out. @param omega  [rad/s] **/
    SimTK::Vector_<std::complex<double>> calcResponse(const SimTK::Vector_<std::complex<double>>& f,
                                                      double omega) const;

private:
    std::vector<FlexibleBody> m_bodies;
    SimTK::State m_state;
    std::vector<double> m_omegaSquared, m_dampingRatios;
    SimTK::Matrix m_modes;  // n×modes, M-orthonormal
};

}  // namespace simflex::examples
