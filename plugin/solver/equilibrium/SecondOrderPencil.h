#pragma once
/** @file
Eigenpairs of small dense pencils λ²M + λD + K (private header), the slowest of which are the most
accurate:

    μ²(M + D + K) + μ(D + 2M) + M = 0,   μ = 1/(ν − 1)

in a unit of λ in which all matrices have entries of order 1, so that 1 is no eigenvalue. O(n³). **/

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace simflex {

struct PencilMode {
    std::complex<double> nu;
    Eigen::VectorXcd y;
};

/** A matrix with eigenvalues μ, and vectors whose rows from `shapeRow` on are y. **/
struct InvertedPencil {
    Eigen::MatrixXd matrix;
    Eigen::Index shapeRow;
};
InvertedPencil invertSecondOrder(const Eigen::MatrixXd& M, const Eigen::MatrixXd& D,
                                 const Eigen::MatrixXd& K);

/** Returns all pairs of nonzero mass, both of each conjugate pair, by ascending |ν|.
@param n  size of y
@throws std::runtime_error if the QR iteration does not converge. **/
std::vector<PencilMode> solveInverted(const InvertedPencil& inverted, Eigen::Index n);

}  // namespace simflex
