#pragma once
/** @file
Conversion of the solver's speeds to Simbody's (private header): u_S = T u, T orthogonal. ω of
flexible frames is in B in the solver and in Ground in Simbody; the rest is a permutation. **/

#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

/** T at a position. **/
inline Eigen::MatrixXd calcSimbodyNumbering(const Evaluation& equations, const double* q) {
    const int n = equations.getTopology().numU;
    Eigen::MatrixXd T(n, n);
    std::vector<double> unit(size_t(n), 0);
    for (int i = 0; i < n; ++i) {
        unit[size_t(i)] = 1;
        const SimTK::Vector column = equations.getBlocks().calcSimbodyUDot(q, unit.data());
        for (int k = 0; k < n; ++k) T(k, i) = column[k];
        unit[size_t(i)] = 0;
    }
    return T;
}

/** Converts Simbody's speeds or their rates to the solver's: Tᵀu, in O(n).
@param state  gives the position; its speeds are changed **/
inline Eigen::VectorXd takeFromSimbody(const Evaluation& equations, SimTK::State& state,
                                       const SimTK::Vector& u) {
    std::vector<double> q(size_t(equations.getTopology().numQ));
    Eigen::VectorXd own = Eigen::VectorXd::Zero(equations.getTopology().numU);
    state.updU() = u;
    equations.getTopology().system->realize(state, SimTK::Stage::Velocity);
    equations.getBlocks().getFromState(state, q.data(), own.data());
    return own;
}

}  // namespace simflex
