#pragma once
/** @file
Harmonic motions about an equilibrium at rest,

    (−ω²M + iωD + K) x + Gᵀλ = f,   G x = g

solved at each frequency by block elimination, in complex arithmetic: O(N) for a chain of N bodies.

    const FrequencyResponse response(system, equilibrium.getState());
    for (const Real frequency : {1.0, 2.0, 5.0})
        std::cout << response.calcTransfers({2 * Pi * frequency}, inputs, outputs)[0];

Systems with states of their own (StateEquation) and those that move have StateSpace. **/

#include <memory>

#include "simflex/solver/StateSpace.h"

namespace simflex {

class FrequencyResponse {
public:
    /** Linearises. @param observer  called before every evaluation of forces, as by
    calcLinearization()
    @throws std::invalid_argument as calcLinearization(), and if the State has speeds or the system
        states of its own. **/
    FrequencyResponse(const SimTK::MultibodySystem& system, const SimTK::State& state,
                      const std::function<void()>& observer = {});
    ~FrequencyResponse();
    FrequencyResponse(FrequencyResponse&&) noexcept;

    const OperatingPoint& getPoint() const;
    /** See describeImbalance(). **/
    std::string describeImbalance() const;
    /** Independent motions that fall away from the State, since stiffness drives them on. **/
    int countUnstable() const;

    using Amplitudes = SimTK::Matrix_<SimTK::Complex>;
    /** n×p: x in Simbody's numbering of u, for each of p inputs. **/
    Amplitudes calcMotions(SimTK::Real omega, const LinearInputs& inputs) const;
    /** o×p at each ω [rad/s]; several at once, with the same bits for any number of threads.
    @param threads  0: one for each core
    @param observer  called after each of them, from this thread; an exception that it throws ends
        all
    @throws std::runtime_error if the equations are singular at a frequency, as undamped ones are in
        resonance. **/
    std::vector<Amplitudes> calcTransfers(
        const std::vector<SimTK::Real>& omegas, const LinearInputs& inputs,
        const LinearOutputs& outputs, int threads = 0,
        const std::function<void(size_t done)>& observer = {}) const;

private:
    struct Contents;
    std::unique_ptr<Contents> m_contents;
};

}  // namespace simflex
