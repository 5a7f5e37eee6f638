#include "simflex/solver/equilibrium/TangentElimination.h"

#include <algorithm>
#include <array>
#include <map>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/ParallelFor.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** Compliance of rows of G, in scaled equations; and the factor of GᵀG added to A. With it, a
weakly held block that is eliminated alone leaves round-off in redundant rows below their
compliance. **/
constexpr double Compliance = 1e-10, Penalty = 1e-4;
constexpr double GmresTolerance = 1e-11;

/** Number of negative eigenvalues of Λ on the orthogonal complement of U.
@param inverse  Λ⁻¹
@param compliance  UᵀΛ⁻¹U **/
int countNegativeParts(const VectorXd& inverse, const MatrixXd& compliance) {
    const auto isNegative = [](double value) { return value < 0; };
    const int count = int(std::count_if(inverse.begin(), inverse.end(), isNegative));
    if (count == 0) return 0;
    const SymmetricEigen eigen =
        calcSymmetricEigen(compliance, MatrixXd::Identity(compliance.rows(), compliance.rows()));
    return count - int(std::count_if(eigen.values.begin(), eigen.values.end(), isNegative));
}
int countNegativeParts(const Eigen::VectorXcd&, const Eigen::MatrixXcd&) {
    return 0;
}

}  // namespace

template <class Scalar>
TangentElimination<Scalar>::TangentElimination(const BlockGraph& graph, const BlockMass& mass)
    : m_graph(graph),
      m_mass(mass),
      m_numSpeeds(graph.sizes.empty() ? 0 : graph.firstU.back() + graph.sizes.back()) {}

template <class Scalar>
CliquePattern TangentElimination<Scalar>::makePattern() {
    m_pairs.clear();
    m_firstKept.assign(1, 0);
    for (const int count : m_kept) m_firstKept.push_back(m_firstKept.back() + count);
    CliquePattern pattern;
    const int numKept = m_firstKept.back();
    pattern.numUnknowns = numKept + m_mass.numMultipliers;
    pattern.firstMultiplier = numKept;
    const auto appendSpeeds = [&](std::vector<int>& clique, int b) {
        for (int i = 0; i < m_kept[size_t(b)]; ++i) clique.push_back(m_firstKept[size_t(b)] + i);
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
    std::map<std::vector<int>, std::vector<int>> together;
    for (int row = 0; row < m_mass.numMultipliers; ++row)
        together[blocksOfRow[size_t(row)]].push_back(row);
    std::vector<int> place(size_t(m_mass.numMultipliers));
    m_bonds.clear();
    for (const auto& [blocks, rows] : together) {
        for (size_t i = 0; i < rows.size(); ++i) place[size_t(rows[i])] = int(i);
        Bond bond{blocks, int(rows.size()), {}};
        // A row that acts on a block twice lists it twice.
        bond.blocks.erase(std::unique(bond.blocks.begin(), bond.blocks.end()), bond.blocks.end());
        pattern.cliques.emplace_back();
        for (const int b : bond.blocks) {
            appendSpeeds(pattern.cliques.back(), b);
            const std::vector<int>& own = m_mass.rows[size_t(b)];
            for (size_t k = 0; k < own.size(); ++k)
                if (blocksOfRow[size_t(own[k])] == blocks)
                    bond.columns.push_back({b, int(k), place[size_t(own[k])]});
        }
        for (const int row : rows) pattern.cliques.back().push_back(numKept + row);
        m_bonds.push_back(std::move(bond));
    }
    m_values.resize(pattern.cliques.size());
    return pattern;
}

template <class Scalar>
void TangentElimination<Scalar>::condense(const BlockMatrix<Scalar>& A, size_t b) {
    Condensed& condensed = m_condensed[b];
    const int numFirst = A.countFirst(b);
    const VectorXd scale = m_scale.segment(m_graph.firstU[b], m_graph.sizes[b]);
    condensed.scale = scale.head(numFirst);
    if (!A.hasShapes(b)) return;
    const BlockModes<Scalar>& modes = A.modes[b];
    const Eigen::Index n = modes.diagonal.size(), count = modes.shapes.cols();
    const auto ofModes = scale.tail(n);
    MatrixXd shapes = ofModes.asDiagonal() * modes.shapes;
    // A new shift leaves them unchanged.
    if (condensed.shapes.rows() != n || condensed.shapes.cols() != count ||
        condensed.shapes != shapes) {
        condensed.shapes = std::move(shapes);
        ThinQr qr = calcThinQr(condensed.shapes);
        condensed.U = std::move(qr.Q);
        condensed.R = std::move(qr.R);
    }
    condensed.inverse = (ofModes.cwiseAbs2().cwiseProduct(modes.diagonal)).cwiseInverse();
    condensed.inverseU = condensed.inverse.asDiagonal() * condensed.U;
    const Matrix compliance = condensed.U.transpose() * condensed.inverseU;
    condensed.weights = calcInverse(compliance);
    condensed.numNegative = countNegativeParts(condensed.inverse, compliance);
}

template <class Scalar>
auto TangentElimination<Scalar>::keep(const Matrix& values, size_t row, size_t column) const
    -> Matrix {
    const Condensed &left = m_condensed[row], &right = m_condensed[column];
    const Eigen::Index above = left.scale.size(), before = right.scale.size();
    Matrix kept = values;
    kept.leftCols(before) *= right.scale.asDiagonal();
    if (right.R.size() > 0) kept.rightCols(values.cols() - before) *= right.R.transpose();
    kept.topRows(above).applyOnTheLeft(left.scale.asDiagonal());
    if (left.R.size() > 0)
        kept.bottomRows(values.rows() - above) = left.R * kept.bottomRows(values.rows() - above);
    return kept;
}

template <class Scalar>
void TangentElimination<Scalar>::factor(const BlockMatrix<Scalar>& A, const VectorXd& scale,
                                        Symmetry symmetry) {
    m_scale = scale;
    std::vector<int> kept;
    for (size_t b = 0; b < m_graph.sizes.size(); ++b) kept.push_back(A.countCoordinates(b));
    if (!m_fronts || kept != m_kept) {
        m_kept = kept;
        m_fronts.emplace(makePattern());
        m_condensed.assign(kept.size(), {});
    }
    VectorXd norms = VectorXd::Zero(m_mass.numMultipliers);
    for (size_t b = 0; b < m_mass.rows.size(); ++b) {
        const auto own = scale.segment(m_graph.firstU[b], m_graph.sizes[b]);
        for (size_t k = 0; k < m_mass.rows[b].size(); ++k)
            norms[m_mass.rows[b][k]] +=
                own.cwiseProduct(m_mass.Gt[b].col(Eigen::Index(k))).squaredNorm();
    }
    m_rowScale = norms.unaryExpr([](double norm) { return norm > 0 ? 1 / std::sqrt(norm) : 0.0; });
    parallelFor(int(kept.size()), m_numThreads, [&](int b) { condense(A, size_t(b)); });

    const auto formPair = [&](int pair) {
        const auto& [b, k, row] = m_pairs[size_t(pair)];
        Matrix above = keep(A.columns[size_t(b)][size_t(k)], size_t(row), size_t(b));
        Matrix& values = m_values[size_t(pair)];
        if (row == b) {
            values = symmetry == Symmetry::Symmetric ? Matrix(0.5 * (above + above.transpose()))
                                                     : std::move(above);
            const Condensed& condensed = m_condensed[size_t(b)];
            for (Eigen::Index i = 0; i < condensed.scale.size(); ++i)
                if (condensed.scale[i] == 0) values(i, i) = 1;
            if (condensed.U.size() > 0)
                values.bottomRightCorner(condensed.U.cols(), condensed.U.cols()) +=
                    condensed.weights;
            return;
        }
        const std::vector<int>& list = m_graph.neighbours[size_t(row)];
        const size_t mirrored =
            size_t(std::lower_bound(list.begin(), list.end(), b) - list.begin());
        Matrix below = keep(A.columns[size_t(row)][mirrored], size_t(b), size_t(row));
        if (symmetry == Symmetry::Symmetric) {
            below = (0.5 * (below + above.transpose())).eval();
            above = below.transpose();
        }
        const Eigen::Index n = m_kept[size_t(b)], m = m_kept[size_t(row)];
        values.setZero(n + m, n + m);
        values.topRightCorner(n, m) = below;
        values.bottomLeftCorner(m, n) = above;
    };
    parallelFor(int(m_pairs.size()), m_numThreads, formPair);
    const auto formBond = [&](int i) {
        const Bond& bond = m_bonds[size_t(i)];
        Matrix& values = m_values[m_pairs.size() + size_t(i)];
        Eigen::Index n = 0, first = 0;
        for (const int b : bond.blocks) n += m_kept[size_t(b)];
        MatrixXd G = MatrixXd::Zero(bond.numRows, n);
        auto next = bond.columns.begin();
        for (const int block : bond.blocks) {
            const size_t b = size_t(block);
            const Eigen::Index numModes = m_condensed[b].U.rows(),
                               rest = m_graph.sizes[b] - numModes;
            for (; next != bond.columns.end() && (*next)[0] == block; ++next) {
                const auto [of, column, row] = *next;
                const VectorXd full = m_rowScale[m_mass.rows[b][size_t(column)]] *
                                      scale.segment(m_graph.firstU[b], m_graph.sizes[b])
                                          .cwiseProduct(m_mass.Gt[b].col(column));
                auto own = G.row(row).segment(first, m_kept[b]);
                own.head(rest) += full.head(rest).transpose();
                own.tail(m_condensed[b].U.cols()) +=
                    full.tail(numModes).transpose() * m_condensed[b].U;
            }
            first += m_kept[b];
        }
        values.setZero(n + bond.numRows, n + bond.numRows);
        const MatrixXd penalty = Penalty * (G.transpose() * G);
        values.topLeftCorner(n, n) = penalty.template cast<Scalar>();
        values.bottomLeftCorner(bond.numRows, n) = G.template cast<Scalar>();
        values.topRightCorner(n, bond.numRows) = G.transpose().template cast<Scalar>();
        values.bottomRightCorner(bond.numRows, bond.numRows).diagonal().setConstant(-Compliance);
    };
    parallelFor(int(m_bonds.size()), m_numThreads, formBond);
    std::vector<const Scalar*> pointers;
    for (const Matrix& values : m_values) pointers.push_back(values.data());
    m_fronts->setSymmetric(symmetry == Symmetry::Symmetric);
    if (m_numSpeeds > 0) m_fronts->factor(pointers, m_numThreads);
}

template <class Scalar>
void TangentElimination<Scalar>::solveScaled(Scalar* columns, int count) {
    if (m_numSpeeds == 0) return;
    const Eigen::Index numKept = m_firstKept.back();
    Eigen::Map<Matrix> Y(columns, m_numSpeeds + m_mass.numMultipliers, count);
    Matrix kept(numKept + m_mass.numMultipliers, count);
    kept.bottomRows(m_mass.numMultipliers) = Y.bottomRows(m_mass.numMultipliers);
    const int numBlocks = int(m_kept.size());
    parallelFor(numBlocks, m_numThreads, [&](int i) {
        const size_t b = size_t(i);
        const Condensed& condensed = m_condensed[b];
        const Eigen::Index numModes = condensed.U.rows(), rest = m_graph.sizes[b] - numModes,
                           first = m_graph.firstU[b];
        kept.middleRows(m_firstKept[b], rest) = Y.middleRows(first, rest);
        if (numModes == 0) return;
        kept.middleRows(m_firstKept[b] + rest, condensed.U.cols()).noalias() =
            condensed.weights *
            (condensed.inverseU.transpose() * Y.middleRows(first + rest, numModes));
    });
    m_fronts->solve(kept.data(), count, m_numThreads);
    // The multipliers include the penalty's part, Penalty·g.
    Y.bottomRows(m_mass.numMultipliers) *= Penalty;
    Y.bottomRows(m_mass.numMultipliers) += kept.bottomRows(m_mass.numMultipliers);
    parallelFor(numBlocks, m_numThreads, [&](int i) {
        const size_t b = size_t(i);
        const Condensed& condensed = m_condensed[b];
        const Eigen::Index numModes = condensed.U.rows(), rest = m_graph.sizes[b] - numModes,
                           first = m_graph.firstU[b];
        Y.middleRows(first, rest) = kept.middleRows(m_firstKept[b], rest);
        if (numModes == 0) return;
        auto xi = Y.middleRows(first + rest, numModes);
        const Matrix more = kept.middleRows(m_firstKept[b] + rest, condensed.U.cols()) -
                            condensed.inverseU.transpose() * xi;
        xi.array().colwise() *= condensed.inverse.array();
        xi.noalias() += condensed.inverseU * (condensed.weights * more);
    });
}

template <class Scalar>
void TangentElimination<Scalar>::solveEach(Matrix& F) {
    Matrix Y = Matrix::Zero(F.rows() + m_mass.numMultipliers, F.cols());
    Y.topRows(F.rows()) = m_scale.asDiagonal() * F;
    solveScaled(Y.data(), int(Y.cols()));
    F.noalias() = m_scale.asDiagonal() * Y.topRows(F.rows());
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
void TangentElimination<double>::close(MatrixXd& X) {
    MatrixXd Y = MatrixXd::Zero(X.rows() + m_mass.numMultipliers, X.cols());
    parallelFor(int(X.cols()), m_numThreads, [&](int j) {
        Y.col(j).tail(m_mass.numMultipliers) = -m_rowScale.cwiseProduct(m_mass.multiplyG(X.col(j)));
    });
    solveScaled(Y.data(), int(Y.cols()));
    X.noalias() += m_scale.asDiagonal() * Y.topRows(X.rows());
}

template <>
int TangentElimination<double>::countNegative() const {
    int count = m_fronts ? m_fronts->countNegativePivots() - m_mass.numMultipliers : 0;
    for (const Condensed& condensed : m_condensed)
        if (condensed.U.size() > 0) count += condensed.numNegative;
    return count;
}

template class TangentElimination<double>;
template class TangentElimination<std::complex<double>>;

VectorXd solveByGmres(const std::function<VectorXd(const VectorXd&)>& multiply,
                      const std::function<VectorXd(const VectorXd&)>& precondition,
                      const VectorXd& b, int maxSteps) {
    const double size = b.norm();
    if (!(size > 0)) return precondition(b);  // also if b underflows when squared
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
