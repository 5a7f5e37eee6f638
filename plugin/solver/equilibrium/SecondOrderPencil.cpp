#include "simflex/solver/equilibrium/SecondOrderPencil.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {

using Eigen::MatrixXd;

namespace {

/** |μ| below which a pair has no mass, so that ν is infinite. **/
constexpr double NoMass = 1e-14;

}  // namespace

InvertedPencil invertSecondOrder(const MatrixXd& M, const MatrixXd& D, const MatrixXd& K) {
    const Eigen::Index n = M.rows();
    const SquareSystem shifted(M + D + K);
    MatrixXd companion = MatrixXd::Zero(2 * n, 2 * n);
    companion.topLeftCorner(n, n) = -shifted.solveEach(D + 2 * M);
    companion.topRightCorner(n, n) = -shifted.solveEach(M);
    companion.bottomLeftCorner(n, n).setIdentity();
    return {std::move(companion), n};
}

std::vector<PencilMode> solveInverted(const InvertedPencil& inverted, Eigen::Index n) {
    const Eigen::Index count = inverted.matrix.rows();
    const GeneralEigen eigen = calcGeneralEigen(inverted.matrix);
    if (!eigen.hasConverged)
        throw std::runtime_error("calcEigenmodes(): the QR iteration for " + std::to_string(count) +
                                 " eigenvalues does not converge");
    std::vector<PencilMode> modes;
    for (Eigen::Index k = 0; k < count; ++k) {
        const std::complex<double> mu = eigen.values[k];
        if (std::abs(mu) < NoMass) continue;
        modes.push_back({1.0 + 1.0 / mu, eigen.vectors.col(k).segment(inverted.shapeRow, n)});
    }
    std::stable_sort(modes.begin(), modes.end(), [](const PencilMode& a, const PencilMode& b) {
        return std::abs(a.nu) < std::abs(b.nu);
    });
    return modes;
}

}  // namespace simflex
