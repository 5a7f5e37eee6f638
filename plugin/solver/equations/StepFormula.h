#pragma once
/** @file
One implicit step in the form given by an integration scheme (private header):

    u̇ = (u − u_hist)/mass
    q = q_hist + stiffness N(q) u                  (QRule::Linear)
    q = q_hist moved by δ_hist + stiffness u       (QRule::Exponential: quaternions along exp)
    z = z_hist + quadrature ż,    work = work_hist + quadrature·power **/

#include <cstddef>
#include <vector>

#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

struct StepFormula {
    enum class QRule { Linear, Exponential };

    double t = 0, h = 0;  ///< end and length of the step [s]
    NewtonFactors factors;
    QRule rule = QRule::Linear;
    std::vector<double> qHist, deltaHist, uHist, zHist;
    double quadrature = 0, workHist = 0;

    void resize(int numQ, int numU, int numZ) {
        qHist.assign(std::size_t(numQ), 0);
        deltaHist.assign(std::size_t(numU), 0);
        uHist.assign(std::size_t(numU), 0);
        zHist.assign(std::size_t(numZ), 0);
    }
};

}  // namespace simflex
