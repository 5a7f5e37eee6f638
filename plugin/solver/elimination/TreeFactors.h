#pragma once
/** @file
J⁻¹ of a tree of rigid bodies in O(n) (private header), as articulated bodies are eliminated from
the tips to the root (R. Featherstone, Rigid Body Dynamics Algorithms, 7), but for matrices that are
not symmetric. With Q and b of a body and of what is eliminated outboard of it,

    D = Sᵀ Q X + E,   W = Q X + C,   K = D⁻¹ Sᵀ Q,   e = D⁻¹ (r − Sᵀ b),
    Q_P += Q − W K,   b_P += b + W e,   x = e − K z_P

Pivots are exchanged within a body only; factor() tries the result on a known solution. **/

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "simflex/solver/TreeMatrix.h"

namespace simflex {

template <class Scalar>
class TreeFactors {
public:
    /** @returns false if that fails, or loses more than half the digits: the caller has to pivot.
     * **/
    bool factor(const BasicTreeMatrix<Scalar>& J);
    /** The same of a J that is symmetric and positive definite, M for one: there is nothing to try.
     * **/
    bool eliminate(const BasicTreeMatrix<Scalar>& J);
    /** x ← J⁻¹x. **/
    void solveInPlace(Scalar* x);

private:
    static constexpr int Most = 6;  ///< speeds of a body
    using Force = Eigen::Matrix<Scalar, 6, 1>;
    using Motion = Eigen::Matrix<Scalar, 12, 1>;
    /** By columns of fixed heights, as many as the body has speeds. **/
    struct Node {
        int parent, firstSpeed, numSpeeds;
        std::array<Force, Most> S, W;
        std::array<Motion, Most> X, K;  ///< K by rows
        Eigen::Matrix<Scalar, Most, Most> inverse;
    };

    std::vector<Node> m_nodes;
    std::vector<Scalar> m_x, m_r, m_again, m_workspace;  ///< of the trial
    std::vector<Eigen::Matrix<Scalar, 6, 12>> m_Q;
    std::vector<Force> m_b;
    std::vector<Motion> m_z;
};

}  // namespace simflex
