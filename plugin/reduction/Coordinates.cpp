#include "Coordinates.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "SparseCholesky.h"

namespace simflex {
namespace {

/** Relative error allowed when T q represents a rigid motion. **/
constexpr double NoRigidMotion = 1e-9;

/** Index of each coordinate in the list, −1 if it is not listed. **/
std::vector<int> invertList(const std::vector<int>& listed, int size) {
    std::vector<int> place(size_t(size), -1);
    for (size_t k = 0; k < listed.size(); ++k) place[size_t(listed[k])] = int(k);
    return place;
}

NodalConstraints makeIdentity(int size) {
    NodalConstraints T;
    T.numCoordinates = size;
    for (int k = 0; k <= size; ++k) T.rowStarts.push_back(k);
    T.columns.resize(size_t(size));
    std::iota(T.columns.begin(), T.columns.end(), 0);
    T.coefficients.assign(size_t(size), 1);
    return T;
}

/** Appends a row of unordered entries; duplicates are added. **/
void addRow(std::vector<std::pair<int, double>>& entries, NodalConstraints& T) {
    std::sort(entries.begin(), entries.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    for (size_t k = 0; k < entries.size();) {
        const int column = entries[k].first;
        double sum = 0;
        for (; k < entries.size() && entries[k].first == column; ++k) sum += entries[k].second;
        if (sum == 0) continue;
        T.columns.push_back(column);
        T.coefficients.push_back(sum);
    }
    T.rowStarts.push_back(std::int64_t(T.columns.size()));
    entries.clear();
}

/** Returns TᵀAT. **/
SymmetricMatrix transform(const SymmetricMatrix& A, const NodalConstraints& T) {
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    rows.reserve(A.values.size());
    columns.reserve(A.values.size());
    values.reserve(A.values.size());
    const auto add = [&](std::int32_t row, std::int32_t column, double value) {
        rows.push_back(row);
        columns.push_back(column);
        values.push_back(value);
    };
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k) {
            const int row = A.rows[k];
            for (auto a = T.rowStarts[row]; a < T.rowStarts[row + 1]; ++a)
                for (auto b = T.rowStarts[column]; b < T.rowStarts[column + 1]; ++b) {
                    const double value = T.coefficients[a] * A.values[k] * T.coefficients[b];
                    // A stored off-diagonal entry represents its mirror image, too.
                    if (row != column)
                        add(T.columns[a], T.columns[b],
                            T.columns[a] == T.columns[b] ? 2 * value : value);
                    else if (T.columns[a] <= T.columns[b])
                        add(T.columns[a], T.columns[b], value);
                }
        }
    return SymmetricMatrix::fromEntries(T.numCoordinates, rows, columns, values);
}

}  // namespace

Coordinates::Coordinates(const FeModel& model) : m_model(model), m_T(model.constraints) {}

Coordinates::Coordinates(const FeModel& model, const Stiffness& stiffness,
                         const std::vector<int>& tieOf)
    : m_model(model), m_stiffness(&stiffness), m_T(model.constraints) {
    if (!stiffness.unknowns().empty()) countFromBases(tieOf);
}

/** Measures coordinates that are displacements of a node relative to those of its base, unless an
interface holds only one of them. **/
void Coordinates::countFromBases(const std::vector<int>& tieOf) {
    const NodalConstraints T = m_T.empty() ? makeIdentity(m_model.K.size) : std::move(m_T);
    const auto findOwn = [&](int row) {
        const auto first = size_t(T.rowStarts[size_t(row)]);
        const bool isOwn =
            T.rowStarts[size_t(row) + 1] == std::int64_t(first) + 1 && T.coefficients[first] == 1;
        return isOwn ? T.columns[first] : -1;
    };
    std::vector<int> tieOfCoordinate(size_t(T.numCoordinates), -1);
    for (int row = 0; row < m_model.K.size; ++row)
        if (const int tie = tieOf[size_t(row / 3)]; tie >= 0)
            for (auto k = T.rowStarts[size_t(row)]; k < T.rowStarts[size_t(row) + 1]; ++k)
                tieOfCoordinate[size_t(T.columns[size_t(k)])] = tie;
    std::vector<int> baseOf(size_t(T.numCoordinates), -1);
    std::vector<char> isBase(size_t(T.numCoordinates), 0);
    const SectionUnknowns& unknowns = m_stiffness->unknowns();
    for (int row = 0; row < m_model.K.size; ++row) {
        const int node = unknowns.baseOf(row / 3);
        if (node < 0) continue;
        const int own = findOwn(row), base = findOwn(3 * node + row % 3);
        if (own < 0 || base < 0 || own == base || isBase[size_t(own)] || baseOf[size_t(base)] >= 0)
            continue;
        const int tie = tieOfCoordinate[size_t(own)];
        if (tie >= 0 && tie != tieOfCoordinate[size_t(base)]) continue;
        baseOf[size_t(own)] = base;
        isBase[size_t(base)] = 1;
    }
    m_T = NodalConstraints();
    m_T.numCoordinates = T.numCoordinates;
    m_T.rowStarts.push_back(0);
    std::vector<std::pair<int, double>> entries;
    for (int row = 0; row < m_model.K.size; ++row) {
        const auto add = [&](int of, double factor) {
            for (auto k = T.rowStarts[size_t(of)]; k < T.rowStarts[size_t(of) + 1]; ++k) {
                entries.emplace_back(T.columns[size_t(k)], factor * T.coefficients[size_t(k)]);
                if (const int base = baseOf[size_t(T.columns[size_t(k)])]; base >= 0)
                    entries.emplace_back(base, factor * T.coefficients[size_t(k)]);
            }
        };
        add(row, 1);
        if (unknowns.isInternal(row / 3))
            unknowns.forOrigins(row / 3,
                                [&](int node, double weight) { add(3 * node + row % 3, weight); });
        addRow(entries, m_T);
    }
}

int Coordinates::size() const {
    return isIdentity() ? m_model.K.size : m_T.numCoordinates;
}

SymmetricMatrix Coordinates::assemble(const SymmetricMatrix& A) const {
    return isIdentity() ? A : transform(A, m_T);
}

SymmetricMatrix Coordinates::assembleStiffness() const {
    const SectionUnknowns& unknowns = m_stiffness->unknowns();
    if (unknowns.empty()) return assemble(m_stiffness->matrix());
    NodalConstraints ofUnknowns;  // rows of T for the section unknowns: those of u minus those of
                                  // the bases
    ofUnknowns.numCoordinates = m_T.numCoordinates;
    ofUnknowns.rowStarts.push_back(0);
    std::vector<std::pair<int, double>> entries;
    for (int row = 0; row < m_model.K.size; ++row) {
        const auto add = [&](int of, double factor) {
            for (auto k = m_T.rowStarts[size_t(of)]; k < m_T.rowStarts[size_t(of) + 1]; ++k)
                entries.emplace_back(m_T.columns[size_t(k)], factor * m_T.coefficients[size_t(k)]);
        };
        add(row, 1);
        unknowns.forOrigins(row / 3,
                            [&](int node, double weight) { add(3 * node + row % 3, -weight); });
        addRow(entries, ofUnknowns);
    }
    return transform(m_stiffness->matrix(), ofUnknowns);
}

Shapes Coordinates::expand(const std::vector<int>& listed, const Vectors& q) const {
    Shapes u = Shapes::Zero(m_model.K.size, q.cols());
    if (isIdentity()) {
#pragma omp parallel for schedule(static)
        for (size_t k = 0; k < listed.size(); ++k) u.row(listed[k]) = q.row(Eigen::Index(k));
        return u;
    }
    const NodalConstraints& T = m_T;
    const std::vector<int> place = invertList(listed, size());
#pragma omp parallel for schedule(static)
    for (int row = 0; row < m_model.K.size; ++row)
        for (auto k = T.rowStarts[row]; k < T.rowStarts[row + 1]; ++k) {
            const int at = place[size_t(T.columns[k])];
            if (at >= 0) u.row(row) += T.coefficients[k] * q.row(at);
        }
    return u;
}

Vectors Coordinates::contract(const std::vector<int>& listed, const Shapes& f) const {
    Vectors g(Eigen::Index(listed.size()), f.cols());
    if (isIdentity()) {
#pragma omp parallel for schedule(static)
        for (size_t k = 0; k < listed.size(); ++k) g.row(Eigen::Index(k)) = f.row(listed[k]);
        return g;
    }
    const NodalConstraints& T = m_T;
    const std::vector<int> place = invertList(listed, size());
    g.setZero();
    for (int row = 0; row < m_model.K.size; ++row)
        for (auto k = T.rowStarts[row]; k < T.rowStarts[row + 1]; ++k) {
            const int at = place[size_t(T.columns[k])];
            if (at >= 0) g.row(at) += T.coefficients[k] * f.row(row);
        }
    return g;
}

std::vector<int> Coordinates::listAll() const {
    std::vector<int> all(static_cast<size_t>(size()));
    std::iota(all.begin(), all.end(), 0);
    return all;
}

Vectors Coordinates::solve(const Shapes& u) const {
    if (isIdentity()) return u;
    SymmetricMatrix identity;
    identity.size = m_model.K.size;
    for (int dof = 0; dof <= identity.size; ++dof) identity.columnStarts.push_back(dof);
    for (int dof = 0; dof < identity.size; ++dof) {
        identity.rows.push_back(dof);
        identity.values.push_back(1);
    }
    const std::vector<int> all = listAll();
    SparseCholesky normal;
    try {
        normal.factor(assemble(identity));
    } catch (const SparseCholesky::SingularMatrix& singular) {
        throw std::invalid_argument(
            m_model.source + ": the constraints have a coordinate that moves no node" +
            (singular.row >= 0 ? " (number " + std::to_string(singular.row) + ")" : std::string()));
    }
    Vectors q = normal.solve(contract(all, u));
    for (int pass = 0; pass < 2; ++pass)  // iterative refinement
        q += normal.solve(contract(all, u - expand(all, q)));
    return q;
}

Shapes Coordinates::solveRigid(const Shapes& R) const {
    if (isIdentity()) return R;
    Vectors q = solve(R);
    const Shapes missed = R - expand(listAll(), q);
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
    if (isIdentity()) {
        for (int a = 0; a < 3; ++a) result.push_back(3 * node + a);
        return result;
    }
    const NodalConstraints& T = m_T;
    for (auto k = T.rowStarts[3 * node]; k < T.rowStarts[3 * node + 3]; ++k)
        result.push_back(T.columns[k]);
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
}

int Coordinates::nodeNumberOf(int coordinate) const {
    int row = coordinate;
    if (!isIdentity()) {
        const auto found = std::find(m_T.columns.begin(), m_T.columns.end(), coordinate);
        const auto at = found - m_T.columns.begin();
        row = int(std::upper_bound(m_T.rowStarts.begin(), m_T.rowStarts.end(), at) -
                  m_T.rowStarts.begin()) -
              1;
    }
    return m_model.mesh.nodeNumbers[size_t(row / 3)];
}

}  // namespace simflex
