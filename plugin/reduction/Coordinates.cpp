#include "Coordinates.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "SparseCholesky.h"

namespace simflex {
namespace {

/** Of a rigid motion of unit size: by how much T q may miss it. **/
constexpr double NoRigidMotion = 1e-9;

/** Place of each coordinate in the list, −1 if it is not listed. **/
std::vector<int> invertList(const std::vector<int>& listed, int size) {
    std::vector<int> place(size_t(size), -1);
    for (size_t k = 0; k < listed.size(); ++k) place[size_t(listed[k])] = int(k);
    return place;
}

}  // namespace

int Coordinates::size() const {
    return constraints().empty() ? m_model.K.size : constraints().numCoordinates;
}

SymmetricMatrix Coordinates::assemble(const SymmetricMatrix& K) const {
    if (constraints().empty()) return K;
    const NodalConstraints& T = constraints();
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    rows.reserve(K.values.size());
    columns.reserve(K.values.size());
    values.reserve(K.values.size());
    const auto add = [&](std::int32_t row, std::int32_t column, double value) {
        rows.push_back(row);
        columns.push_back(column);
        values.push_back(value);
    };
    for (int column = 0; column < K.size; ++column)
        for (auto k = K.columnStarts[column]; k < K.columnStarts[column + 1]; ++k) {
            const int row = K.rows[k];
            for (auto a = T.rowStarts[row]; a < T.rowStarts[row + 1]; ++a)
                for (auto b = T.rowStarts[column]; b < T.rowStarts[column + 1]; ++b) {
                    const double value = T.coefficients[a] * K.values[k] * T.coefficients[b];
                    // A stored entry off the diagonal stands for its mirror image too.
                    if (row != column)
                        add(T.columns[a], T.columns[b],
                            T.columns[a] == T.columns[b] ? 2 * value : value);
                    else if (T.columns[a] <= T.columns[b])
                        add(T.columns[a], T.columns[b], value);
                }
        }
    return SymmetricMatrix::fromEntries(T.numCoordinates, rows, columns, values);
}

Shapes Coordinates::expand(const std::vector<int>& listed, const Eigen::MatrixXd& q) const {
    Shapes u = Shapes::Zero(m_model.K.size, q.cols());
    const Eigen::Index count = q.cols();
    if (constraints().empty()) {
#pragma omp parallel for schedule(static)
        for (size_t k = 0; k < listed.size(); ++k)
            for (Eigen::Index j = 0; j < count; ++j) u(listed[k], j) = q(Eigen::Index(k), j);
        return u;
    }
    const NodalConstraints& T = constraints();
    const std::vector<int> place = invertList(listed, size());
#pragma omp parallel for schedule(static)
    for (int row = 0; row < m_model.K.size; ++row)
        for (auto k = T.rowStarts[row]; k < T.rowStarts[row + 1]; ++k) {
            const int at = place[size_t(T.columns[k])];
            if (at >= 0) u.row(row) += T.coefficients[k] * q.row(at);
        }
    return u;
}

Eigen::MatrixXd Coordinates::contract(const std::vector<int>& listed, const Shapes& f) const {
    const Eigen::Index count = f.cols();
    Eigen::MatrixXd g(Eigen::Index(listed.size()), count);
    if (constraints().empty()) {
#pragma omp parallel for schedule(static)
        for (size_t k = 0; k < listed.size(); ++k)
            for (Eigen::Index j = 0; j < count; ++j) g(Eigen::Index(k), j) = f(listed[k], j);
        return g;
    }
    const NodalConstraints& T = constraints();
    const std::vector<int> place = invertList(listed, size());
    g.setZero();
    for (int row = 0; row < m_model.K.size; ++row)
        for (auto k = T.rowStarts[row]; k < T.rowStarts[row + 1]; ++k) {
            const int at = place[size_t(T.columns[k])];
            if (at >= 0) g.row(at) += T.coefficients[k] * f.row(row);
        }
    return g;
}

Shapes Coordinates::solveRigid(const Shapes& R) const {
    if (constraints().empty()) return R;
    SymmetricMatrix identity;
    identity.size = m_model.K.size;
    for (int dof = 0; dof <= identity.size; ++dof) identity.columnStarts.push_back(dof);
    for (int dof = 0; dof < identity.size; ++dof) {
        identity.rows.push_back(dof);
        identity.values.push_back(1);
    }
    std::vector<int> all;
    for (int k = 0; k < size(); ++k) all.push_back(k);
    SparseCholesky normal;
    try {
        normal.factor(assemble(identity));
    } catch (const SparseCholesky::SingularMatrix& singular) {
        throw std::invalid_argument(
            m_model.source + ": the constraints have a coordinate that moves no node" +
            (singular.row >= 0 ? " (number " + std::to_string(singular.row) + ")" : std::string()));
    }
    Eigen::MatrixXd q = normal.solve(contract(all, R));
    for (int pass = 0; pass < 2; ++pass)  // for round-off
        q += normal.solve(contract(all, R - expand(all, q)));
    const Shapes missed = R - expand(all, q);
    for (Eigen::Index j = 0; j < 6; ++j) {
        Eigen::Index row = 0;
        const double largest = missed.col(j).cwiseAbs().maxCoeff(&row);
        if (largest <= NoRigidMotion * R.col(j).cwiseAbs().maxCoeff()) continue;
        std::ostringstream text;
        text << m_model.source << ": the constraints resist rigid "
             << (j < 3 ? "translation along " : "rotation about ") << "xyz"[j % 3] << " at node "
             << m_model.mesh.nodeNumbers[size_t(row / 3)]
             << "; a part must be free: take constraints to ground out of the model";
        throw std::invalid_argument(text.str());
    }
    return q;
}

std::vector<int> Coordinates::coordinatesOf(int node) const {
    std::vector<int> result;
    if (constraints().empty()) {
        for (int a = 0; a < 3; ++a) result.push_back(3 * node + a);
        return result;
    }
    const NodalConstraints& T = constraints();
    for (auto k = T.rowStarts[3 * node]; k < T.rowStarts[3 * node + 3]; ++k)
        result.push_back(T.columns[k]);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

int Coordinates::nodeNumberOf(int coordinate) const {
    int row = coordinate;
    if (!constraints().empty()) {
        const auto found =
            std::find(constraints().columns.begin(), constraints().columns.end(), coordinate);
        const auto at = found - constraints().columns.begin();
        row = int(std::upper_bound(constraints().rowStarts.begin(), constraints().rowStarts.end(),
                                   at) -
                  constraints().rowStarts.begin()) -
              1;
    }
    return m_model.mesh.nodeNumbers[size_t(row / 3)];
}

}  // namespace simflex
