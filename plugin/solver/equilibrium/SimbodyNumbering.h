#pragma once
/** @file
From the solver's speeds to Simbody's (private header): u_S = T u, T orthogonal. Flexible frames
have ω in B in the solver and in Ground in Simbody; the rest is another order. **/

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

}  // namespace simflex
