#include "simflex/solver/equilibrium/TangentElimination.h"

#include <algorithm>
#include <array>
#include <map>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** Of rows of G in scaled equations. **/
constexpr double Compliance = 1e-10;
constexpr double GmresTolerance = 1e-11;

}  // namespace

template <class Scalar>
TangentElimination<Scalar>::TangentElimination(const BlockGraph& graph, const BlockMass& mass)
    : m_graph(graph),
      m_mass(mass),
      m_numSpeeds(graph.sizes.empty() ? 0 : graph.firstU.back() + graph.sizes.back()),
      m_fronts(makePattern()) {}

template <class Scalar>
CliquePattern TangentElimination<Scalar>::makePattern() {
    CliquePattern pattern;
    pattern.numUnknowns = m_numSpeeds + m_mass.numMultipliers;
    pattern.firstMultiplier = m_numSpeeds;
    const auto appendSpeeds = [&](std::vector<int>& clique, int b) {
        for (int i = 0; i < m_graph.sizes[size_t(b)]; ++i)
            clique.push_back(m_graph.firstU[size_t(b)] + i);
    };
    for (int b = 0; b < int(m_graph.sizes.size()); ++b)
        for (int k = 0; k < int(m_graph.neighbours[size_t(b)].size()); ++k) {
            const int row = m_graph.neighbours[size_t(b)][size_t(k)];
            if (row > b) continue;
            m_pairs.push_back({b, k, row});
            pattern.cliques.emplace_back();
            appendSpeeds(pattern.cliques.back(), b);
            if (row != b) appendSpeeds(pattern.cliques.back(), row);
        }
    std::vector<std::vector<int>> blocksOfRow(size_t(m_mass.numMultipliers));
    for (size_t b = 0; b < m_mass.rows.size(); ++b)
        for (const int row : m_mass.rows[b]) blocksOfRow[size_t(row)].push_back(int(b));
    for (size_t b = 0; b < m_mass.rows.size(); ++b) {
        std::map<std::vector<int>, std::vector<int>> together;
        for (size_t k = 0; k < m_mass.rows[b].size(); ++k)
            together[blocksOfRow[size_t(m_mass.rows[b][k])]].push_back(int(k));
        for (const auto& entry : together) {
            m_sides.push_back({int(b), entry.second});
            pattern.cliques.emplace_back();
            appendSpeeds(pattern.cliques.back(), int(b));
            for (const int k : entry.second)
                pattern.cliques.back().push_back(m_numSpeeds + m_mass.rows[b][size_t(k)]);
        }
    }
    std::map<std::vector<int>, std::vector<int>> together;
    for (int row = 0; row < m_mass.numMultipliers; ++row)
        together[blocksOfRow[size_t(row)]].push_back(m_numSpeeds + row);
    for (const auto& entry : together) pattern.cliques.push_back(entry.second);
    m_values.resize(pattern.cliques.size());
    for (size_t k = m_pairs.size() + m_sides.size(); k < m_values.size(); ++k) {
        const Eigen::Index size = Eigen::Index(pattern.cliques[k].size());
        m_values[k] = -Compliance * Matrix::Identity(size, size);
    }
    return pattern;
}

template <class Scalar>
void TangentElimination<Scalar>::factor(const BlockMatrix<Scalar>& A, const VectorXd& scale,
                                        Symmetry symmetry) {
    m_scale = scale;
    VectorXd norms = VectorXd::Zero(m_mass.numMultipliers);
    for (size_t b = 0; b < m_mass.rows.size(); ++b) {
        const auto own = scale.segment(m_graph.firstU[b], m_graph.sizes[b]);
        for (size_t k = 0; k < m_mass.rows[b].size(); ++k)
            norms[m_mass.rows[b][k]] +=
                own.cwiseProduct(m_mass.Gt[b].col(Eigen::Index(k))).squaredNorm();
    }
    m_rowScale = norms.unaryExpr([](double norm) { return norm > 0 ? 1 / std::sqrt(norm) : 0.0; });

    std::vector<const Scalar*> pointers;
    size_t clique = 0;
    for (const auto& [b, k, row] : m_pairs) {
        const auto own = scale.segment(m_graph.firstU[size_t(b)], m_graph.sizes[size_t(b)]);
        const auto other = scale.segment(m_graph.firstU[size_t(row)], m_graph.sizes[size_t(row)]);
        const Matrix above =
            other.asDiagonal() * A.columns[size_t(b)][size_t(k)] * own.asDiagonal();
        Matrix& values = m_values[clique++];
        const Eigen::Index n = own.size();
        if (row == b) {
            values =
                symmetry == Symmetry::General ? above : Matrix(0.5 * (above + above.transpose()));
            for (Eigen::Index i = 0; i < n; ++i)
                if (own[i] == 0) values(i, i) = 1;
            continue;
        }
        const std::vector<int>& list = m_graph.neighbours[size_t(row)];
        const size_t mirrored =
            size_t(std::lower_bound(list.begin(), list.end(), b) - list.begin());
        Matrix below = own.asDiagonal() * A.columns[size_t(row)][mirrored] * other.asDiagonal();
        if (symmetry == Symmetry::Symmetric) below = (0.5 * (below + above.transpose())).eval();
        values.setZero(n + other.size(), n + other.size());
        values.topRightCorner(n, other.size()) = below;
        values.bottomLeftCorner(other.size(), n) =
            symmetry == Symmetry::Symmetric ? Matrix(below.transpose()) : above;
    }
    for (const Side& side : m_sides) {
        const size_t b = size_t(side.block);
        const Eigen::Index n = m_graph.sizes[b], count = Eigen::Index(side.columns.size());
        Matrix& values = m_values[clique++];
        values.setZero(n + count, n + count);
        for (Eigen::Index k = 0; k < count; ++k) {
            const int column = side.columns[size_t(k)];
            values.col(n + k).head(n) =
                (m_rowScale[m_mass.rows[b][size_t(column)]] *
                 scale.segment(m_graph.firstU[b], n).cwiseProduct(m_mass.Gt[b].col(column)))
                    .template cast<Scalar>();
        }
        values.bottomLeftCorner(count, n) = values.topRightCorner(n, count).transpose();
    }
    for (const Matrix& values : m_values) pointers.push_back(values.data());
    m_fronts.setSymmetric(symmetry == Symmetry::Symmetric);
    if (m_numSpeeds > 0) m_fronts.factor(pointers, 1);
}

template <class Scalar>
void TangentElimination<Scalar>::solveScaled(Vector& y) {
    if (m_numSpeeds > 0) m_fronts.solve(y.data(), 1);
}

template <class Scalar>
void TangentElimination<Scalar>::solve(Vector& f, Vector& g) {
    Vector x(f.size() + g.size());
    x << m_scale.cwiseProduct(f), m_rowScale.cwiseProduct(g);
    solveScaled(x);
    f = m_scale.cwiseProduct(x.head(f.size()));
    g = m_rowScale.cwiseProduct(x.tail(g.size()));
}

template <>
int TangentElimination<double>::countNegative() const {
    return m_fronts.countNegativePivots() - m_mass.numMultipliers;
}

template class TangentElimination<double>;
template class TangentElimination<std::complex<double>>;

VectorXd solveByGmres(const std::function<VectorXd(const VectorXd&)>& multiply,
                      const std::function<VectorXd(const VectorXd&)>& precondition,
                      const VectorXd& b, int maxSteps) {
    const double size = b.norm();
    if (!(size > 0)) return precondition(b);  // or too small to be squared
    MatrixXd V(b.size(), maxSteps + 1), H = MatrixXd::Zero(maxSteps + 1, maxSteps);
    V.col(0) = b / size;
    VectorXd y;
    int count = 0;
    for (double left = 1; count < maxSteps && left > GmresTolerance; ++count) {
        VectorXd w = multiply(precondition(V.col(count)));
        for (int pass = 0; pass < 2; ++pass) {
            const VectorXd part = V.leftCols(count + 1).transpose() * w;
            w -= V.leftCols(count + 1) * part;
            H.col(count).head(count + 1) += part;
        }
        H(count + 1, count) = w.norm();
        const VectorXd first = size * VectorXd::Unit(count + 2, 0);
        const MatrixXd own = H.topLeftCorner(count + 2, count + 1);
        y = solveLeastSquares(own, first);
        left = (own * y - first).norm() / size;
        if (!(H(count + 1, count) > 1e-14 * H.col(count).norm())) {
            ++count;
            break;
        }
        V.col(count + 1) = w / H(count + 1, count);
    }
    return precondition(V.leftCols(count) * y);
}

}  // namespace simflex
