#include "ShapeSeries.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace simflex {

ShapeSeries findShapes(const std::vector<float>& fields, std::size_t rows,
                       const std::vector<std::vector<double>>& coefficients, double tolerance) {
    using Eigen::Index;
    using Eigen::MatrixXd;
    constexpr double dependent = 1e-13;  // relative to the largest eigenvalue of BᵀB
    ShapeSeries series;
    series.weights.resize(coefficients.size());
    const Index m = coefficients.empty() ? 0 : Index(coefficients[0].size());
    if (m == 0 || rows == 0) return series;
    const Eigen::Map<const Eigen::MatrixXf> B(fields.data(), Index(rows), m);
    MatrixXd C(m, Index(coefficients.size()));
    for (Index t = 0; t < C.cols(); ++t)
        C.col(t) = Eigen::Map<const Eigen::VectorXd>(coefficients[std::size_t(t)].data(), m);

    // Scale columns of different units.
    MatrixXd gram = MatrixXd::Zero(m, m);
    constexpr Index chunk = 1024;
    for (Index first = 0; first < B.rows(); first += chunk) {
        const MatrixXd part = B.middleRows(first, std::min(chunk, B.rows() - first)).cast<double>();
        gram.selfadjointView<Eigen::Lower>().rankUpdate(part.transpose());
    }
    Eigen::VectorXd length = gram.diagonal().cwiseSqrt();
    for (Index i = 0; i < m; ++i)
        if (length[i] == 0) length[i] = 1;
    const MatrixXd alike = length.cwiseInverse().asDiagonal() *
                           MatrixXd(gram.selfadjointView<Eigen::Lower>()) *
                           length.cwiseInverse().asDiagonal();
    const MatrixXd scaled = length.asDiagonal() * C;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> ofFields(alike);
    const Eigen::VectorXd& lambda = ofFields.eigenvalues();
    Index rank = 0;
    while (rank < m && lambda[m - 1 - rank] > dependent * lambda[m - 1]) ++rank;
    if (rank == 0) return series;
    const MatrixXd V = ofFields.eigenvectors().rightCols(rank);
    const Eigen::VectorXd root = lambda.tail(rank).cwiseSqrt();
    const MatrixXd X = root.asDiagonal() * (V.transpose() * scaled);  // coordinates of d(t)

    const Eigen::SelfAdjointEigenSolver<MatrixXd> ofMotion(X * X.transpose());
    const MatrixXd U = ofMotion.eigenvectors().rowwise().reverse();
    const MatrixXd W = U.transpose() * X;
    Index kept = 0;
    Eigen::VectorXd left = W.colwise().squaredNorm().transpose();
    while (kept < rank && std::sqrt(std::max(0.0, left.maxCoeff())) > tolerance) {
        left = W.bottomRows(rank - kept - 1).colwise().squaredNorm().transpose();
        ++kept;
    }
    series.error = std::sqrt(std::max(0.0, left.maxCoeff()));
    const MatrixXd combine = length.cwiseInverse().asDiagonal() *
                             (V * (root.cwiseInverse().asDiagonal() * U.leftCols(kept)));
    for (Index k = 0; k < kept; ++k) {
        const double largest = W.row(k).cwiseAbs().maxCoeff();
        const Eigen::VectorXf shape = B * (largest * combine.col(k)).cast<float>();
        series.shapes.emplace_back(shape.data(), shape.data() + shape.size());
        for (Index t = 0; t < W.cols(); ++t)
            series.weights[std::size_t(t)].push_back(float(W(k, t) / largest));
    }
    return series;
}

}  // namespace simflex
