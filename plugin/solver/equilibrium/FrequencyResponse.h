#pragma once
/** @file
Harmonic response about an equilibrium at rest,

    (−ω²M + iωD + K) x + Gᵀλ = f,   G x = g

solved at each frequency by block elimination, in complex arithmetic: O(N) for a chain of N bodies.

    const FrequencyResponse response(system, equilibrium.getState());
    for (const Real frequency : {1.0, 2.0, 5.0})
        std::cout << response.calcTransfers({2 * Pi * frequency}, inputs, outputs)[0];

For systems that move, or have states of their own (StateEquation), use StateSpace. **/

#include <memory>

#include "simflex/solver/StateSpace.h"

namespace simflex {

class FrequencyResponse {
public:
    /** Linearises about the State.
    @param observer  called before every evaluation of forces, as by calcLinearization()
    @throws std::invalid_argument as calcLinearization(), and if the State has speeds or the system
        states of its own. **/
    FrequencyResponse(const SimTK::MultibodySystem& system, const SimTK::State& state,
                      const std::function<void()>& observer = {});
    ~FrequencyResponse();
    FrequencyResponse(FrequencyResponse&&) noexcept;

    const OperatingPoint& getPoint() const;
    /** See describeImbalance(). **/
    std::string describeImbalance() const;
    /** Number of independent unstable motions of the State, driven by negative stiffness. **/
    int countUnstable() const;

    using Amplitudes = SimTK::Matrix_<SimTK::Complex>;
    /** n×p: x in Simbody's numbering of u, for each of p inputs. **/
    Amplitudes calcMotions(SimTK::Real omega, const LinearInputs& inputs) const;
    /** Transfer matrices, o×p at each ω [rad/s], computed in parallel; results do not depend on the
    number of threads.
    @param threads  0: OpenMP's number (OMP_NUM_THREADS), by default one per core
    @param observer  called after each frequency, from the calling thread; an exception that it
        throws ends the calculation
    @throws std::runtime_error if the equations are singular at a frequency, as at the resonance of
        an undamped system. **/
    std::vector<Amplitudes> calcTransfers(
        const std::vector<SimTK::Real>& omegas, const LinearInputs& inputs,
        const LinearOutputs& outputs, int threads = 0,
        const std::function<void(size_t done)>& observer = {}) const;

private:
    struct Contents;
    std::unique_ptr<Contents> m_contents;
};

}  // namespace simflex
