#pragma once
/** @file
J⁻¹ of a tree of rigid bodies in O(n) (private header), by elimination from the tips to the root as
for articulated bodies (R. Featherstone, Rigid Body Dynamics Algorithms, 7), but for unsymmetric
matrices. With Q and b of a body and of everything eliminated outboard of it,

    D = Sᵀ Q X + E,   W = Q X + C,   K = D⁻¹ Sᵀ Q,   e = D⁻¹ (r − Sᵀ b),
    Q_P += Q − W K,   b_P += b + W e,   x = e − K z_P

Pivoting is within a body only; factor() checks the result on a known solution. **/

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "simflex/solver/TreeMatrix.h"

namespace simflex {

template <class Scalar>
class TreeFactors {
public:
    /** @returns false if it fails, or loses more than half the digits: the caller has to pivot. **/
    bool factor(const BasicTreeMatrix<Scalar>& J);
    /** The same for symmetric positive definite J, such as M, without the check. **/
    bool eliminate(const BasicTreeMatrix<Scalar>& J);
    /** x ← J⁻¹x. **/
    void solveInPlace(Scalar* x);

private:
    static constexpr int Most = 6;  ///< speeds of a body
    using Force = Eigen::Matrix<Scalar, 6, 1>;
    using Motion = Eigen::Matrix<Scalar, 12, 1>;
    /** Columns of fixed heights, one per speed of the body. **/
    struct Node {
        int parent, firstSpeed, numSpeeds;
        std::array<Force, Most> S, W;
        std::array<Motion, Most> X, K;  ///< K by rows
        Eigen::Matrix<Scalar, Most, Most> inverse;
    };

    std::vector<Node> m_nodes;
    std::vector<Scalar> m_x, m_r, m_again, m_workspace;  ///< for the check
    std::vector<Eigen::Matrix<Scalar, 6, 12>> m_Q;
    std::vector<Force> m_b;
    std::vector<Motion> m_z;
};

}  // namespace simflex
