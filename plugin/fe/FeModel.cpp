#include "simflex/fe/FeModel.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

/** Largest |K R| relative to Σ|K||R| of a free matrix, since programs write matrices as text. **/
constexpr double RigidTolerance = 1e-8;

void checkFinite(const std::string& source, const char* quantity, const SymmetricMatrix& A) {
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            if (!std::isfinite(A.values[k]))
                throw std::invalid_argument(
                    source + ": the " + quantity + " matrix has " + std::to_string(A.values[k]) +
                    " in row " + std::to_string(A.rows[k] + 1) + ", column " +
                    std::to_string(column + 1) + "; it must be a finite number");
}

void checkShape(const std::string& source, const char* quantity, const SymmetricMatrix& A,
                int expected) {
    if (A.size == expected && A.columnStarts.size() == size_t(expected) + 1 &&
        A.rows.size() == A.values.size() && A.columnStarts.back() == A.numEntries())
        return;
    throw std::invalid_argument(source + ": the " + quantity + " matrix has " +
                                std::to_string(A.size) + " rows, expected " +
                                std::to_string(expected));
}

void checkShape(const FeModel& model) {
    const NodalConstraints& T = model.constraints;
    if (T.empty()) return;
    const size_t numRows = 3 * size_t(model.mesh.numNodes());
    bool isGood = T.rowStarts.size() == numRows + 1 && T.columns.size() == T.coefficients.size() &&
                  T.rowStarts.front() == 0 && T.rowStarts.back() == std::int64_t(T.columns.size());
    for (size_t row = 0; isGood && row < numRows; ++row)
        isGood = T.rowStarts[row] <= T.rowStarts[row + 1];
    for (size_t k = 0; isGood && k < T.columns.size(); ++k)
        isGood = T.columns[k] >= 0 && T.columns[k] < T.numCoordinates &&
                 std::isfinite(T.coefficients[k]);
    if (!isGood)
        throw std::invalid_argument(
            model.source +
            ": the constraints do not fit the mesh, or a coefficient is no finite "
            "number: expected " +
            std::to_string(numRows) + " rows and " + std::to_string(T.numCoordinates) + " columns");
}

/** Checks that the mesh is connected by its elements (without elements: by K) and constraints. **/
void checkConnected(const FeModel& model) {
    const std::string& source = model.source;
    const Mesh& mesh = model.mesh;
    const NodalConstraints& T = model.constraints;
    std::vector<int> parent(mesh.numNodes());
    std::iota(parent.begin(), parent.end(), 0);
    auto root = [&](int node) {
        while (parent[node] != node) node = parent[node] = parent[parent[node]];
        return node;
    };
    const auto join = [&](int first, int second) {
        const int a = root(first), b = root(second);
        parent[std::max(a, b)] = std::min(a, b);
    };
    std::vector<char> used(mesh.numNodes(), mesh.elements.empty());
    for (const ElementBlock& block : mesh.elements) {
        const int size = numNodesOf(block.type);
        for (size_t first = 0; first + size <= block.nodes.size(); first += size)
            for (int k = 0; k < size; ++k) {
                used[block.nodes[first + k]] = 1;
                join(block.nodes[first], block.nodes[first + k]);
            }
    }
    const SymmetricMatrix& K = model.K;
    const int firstInternal = mesh.numNodes() - mesh.numInternalNodes;
    std::fill(used.begin() + firstInternal, used.end(), 1);
    // K connects nodes without elements, and remaining pieces, for instance by springs.
    const auto joinThroughK = [&](const auto& isAsked) {
        for (int column = 0; column < K.size; ++column)
            for (auto k = K.columnStarts[column]; k < K.columnStarts[column + 1]; ++k)
                if (K.values[k] != 0 && isAsked(column / 3, K.rows[k] / 3))
                    join(column / 3, K.rows[k] / 3);
    };
    std::vector<char> isLoose(used.size());
    std::transform(used.begin(), used.end(), isLoose.begin(), [](char isUsed) { return !isUsed; });
    const bool needsK = mesh.elements.empty() || mesh.numInternalNodes > 0 ||
                        std::find(isLoose.begin(), isLoose.end(), 1) != isLoose.end();
    if (needsK)
        joinThroughK([&](int first, int second) {
            if (isLoose[first]) used[first] = 1;
            if (isLoose[second]) used[second] = 1;
            return mesh.elements.empty() || second >= firstInternal || isLoose[first] ||
                   isLoose[second];
        });
    // A coordinate connects the nodes it moves, one of which must belong to an element.
    std::vector<int> nodeOf(size_t(T.numCoordinates), -1);
    for (const bool pass : {true, false})
        for (int node = 0; !T.empty() && node < mesh.numNodes(); ++node) {
            if (bool(used[node]) != pass) continue;
            for (auto k = T.rowStarts[3 * node]; k < T.rowStarts[3 * node + 3]; ++k) {
                int& other = nodeOf[size_t(T.columns[size_t(k)])];
                if (other < 0 && !pass)
                    throw std::invalid_argument(source + ": node " +
                                                std::to_string(mesh.nodeNumbers[node]) +
                                                " belongs to no element, and what it is tied to "
                                                "leaves it free");
                if (other < 0) other = node;
                join(other, node);
            }
        }
    for (int node = 0; node < mesh.numNodes(); ++node)
        if (!used[node] && T.empty())
            throw std::invalid_argument(source + ": node " +
                                        std::to_string(mesh.nodeNumbers[node]) +
                                        " belongs to no element");
    std::vector<int> roots;
    const auto findRoots = [&] {
        roots.clear();
        for (int node = 0; node < mesh.numNodes(); ++node)
            if (root(node) == node) roots.push_back(node);
    };
    findRoots();
    if (roots.size() > 1) {
        joinThroughK([](int, int) { return true; });
        findRoots();
    }
    if (roots.size() == 1) return;
    std::ostringstream text;
    text << source << ": the mesh is in " << roots.size() << " pieces that share no node"
         << (T.empty() ? "" : " and that nothing ties together")
         << ", so that K has more than six rigid modes; the pieces begin at nodes";
    for (size_t i = 0; i < std::min<size_t>(roots.size(), 5); ++i)
        text << (i ? ", " : " ") << mesh.nodeNumbers[roots[i]];
    text << (roots.size() > 5 ? ", …" : "")
         << ". Merge coincident nodes, or reduce the pieces as parts of their own.";
    throw std::invalid_argument(text.str());
}

/** Rows of the six rigid motions about the centre of mass; rotations are scaled by 1/radius of the
part. **/
std::vector<std::array<double, 6>> calcRigidMotions(const FeModel& model) {
    const auto center = model.calcCenterOfMass();
    double radius = 0;
    for (int node = 0; node < model.mesh.numNodes(); ++node) {
        const auto x = model.mesh.position(node);
        for (int a = 0; a < 3; ++a) radius = std::max(radius, std::abs(x[a] - center[a]));
    }
    std::vector<std::array<double, 6>> R(3 * size_t(model.mesh.numNodes()));
    for (int node = 0; node < model.mesh.numNodes(); ++node) {
        auto s = model.mesh.position(node);
        for (int a = 0; a < 3; ++a) s[a] = (s[a] - center[a]) / radius;
        R[3 * node] = {1, 0, 0, 0, s[2], -s[1]};
        R[3 * node + 1] = {0, 1, 0, -s[2], 0, s[0]};
        R[3 * node + 2] = {0, 0, 1, s[1], -s[0], 0};
    }
    return R;
}

/** Checks that the constraints permit the rigid motions: min |T q − R| = 0. **/
void checkConstraintsFree(const FeModel& model) {
    constexpr double Tolerance = 1e-9;
    const NodalConstraints& T = model.constraints;
    if (T.empty()) return;
    const auto R = calcRigidMotions(model);
    Eigen::SparseMatrix<double> matrix(Eigen::Index(R.size()), T.numCoordinates);
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixXd right(Eigen::Index(R.size()), 6);
    for (size_t row = 0; row < R.size(); ++row) {
        for (auto k = size_t(T.rowStarts[row]); k < size_t(T.rowStarts[row + 1]); ++k)
            entries.emplace_back(int(row), T.columns[k], T.coefficients[k]);
        for (size_t j = 0; j < 6; ++j) right(Eigen::Index(row), Eigen::Index(j)) = R[row][j];
    }
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SparseMatrix<double> normal = matrix.transpose() * matrix;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    Eigen::MatrixXd left = right;
    if (solver.info() == Eigen::Success)
        left -= matrix * solver.solve(matrix.transpose() * right).eval();
    Eigen::Index row = 0, motion = 0;
    const double worst = left.cwiseAbs().maxCoeff(&row, &motion);
    if (worst <= Tolerance) return;
    std::ostringstream text;
    text << model.source << ": the constraints are not free: rigid "
         << (motion < 3 ? "translation along " : "rotation about ") << "xyz"[motion % 3]
         << " cannot move node " << model.mesh.nodeNumbers[size_t(row) / 3] << ", which lags by "
         << worst << " of the motion, allowed " << Tolerance
         << ". Take what ties nodes to the ground out of the model.";
    throw std::invalid_argument(text.str());
}

/** Checks that K R vanishes for the six rigid motions R about the centre of mass. **/
void checkFree(const FeModel& model) {
    const int n = model.K.size;
    const auto R = calcRigidMotions(model);
    std::vector<std::array<double, 6>> product(n);
    std::vector<double> scale(n, 0.0);
    for (int column = 0; column < n; ++column)
        for (auto k = model.K.columnStarts[column]; k < model.K.columnStarts[column + 1]; ++k) {
            const int row = model.K.rows[k];
            const double value = model.K.values[k];
            for (int j = 0; j < 6; ++j) product[row][j] += value * R[column][j];
            scale[row] += std::abs(value);
            if (row == column) continue;
            for (int j = 0; j < 6; ++j) product[column][j] += value * R[row][j];
            scale[column] += std::abs(value);
        }
    const double largest = *std::max_element(scale.begin(), scale.end());
    for (int row = 0; row < n; ++row)
        for (int j = 0; j < 6; ++j) {
            if (std::abs(product[row][j]) <= RigidTolerance * largest) continue;
            std::ostringstream text;
            text << model.source << ": the stiffness matrix is not free: rigid "
                 << (j < 3 ? "translation along " : "rotation about ") << "xyz"[j % 3]
                 << " loads node " << model.mesh.nodeNumbers[row / 3] << " by "
                 << std::abs(product[row][j]) / largest << " of its stiffness, allowed "
                 << RigidTolerance
                 << ". Take supports, springs and ties to ground out of the model.";
            throw std::invalid_argument(text.str());
        }
}

}  // namespace

SymmetricMatrix SymmetricMatrix::fromEntries(int size, const std::vector<std::int32_t>& rows,
                                             const std::vector<std::int32_t>& columns,
                                             const std::vector<double>& values) {
    const size_t numGiven = values.size();
    // Sort by row, then stably by column: two counting sorts.
    std::vector<std::int64_t> starts(size + 1, 0);
    for (size_t k = 0; k < numGiven; ++k) {
        if (std::min(rows[k], columns[k]) < 0 || std::max(rows[k], columns[k]) >= size)
            throw std::invalid_argument("matrix entry outside the matrix of size " +
                                        std::to_string(size));
        ++starts[std::max(rows[k], columns[k]) + 1];
    }
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<std::int64_t> byRow(numGiven);
    for (size_t k = 0; k < numGiven; ++k) byRow[starts[std::max(rows[k], columns[k])]++] = k;

    std::fill(starts.begin(), starts.end(), 0);
    for (size_t k = 0; k < numGiven; ++k) ++starts[std::min(rows[k], columns[k]) + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<std::int64_t> next(starts.begin(), starts.end() - 1), order(numGiven);
    for (const std::int64_t k : byRow) order[next[std::min(rows[k], columns[k])]++] = k;

    SymmetricMatrix A;
    A.size = size;
    A.columnStarts.reserve(size + 1);
    A.rows.reserve(numGiven);
    A.values.reserve(numGiven);
    for (int column = 0; column < size; ++column) {
        A.columnStarts.push_back(A.numEntries());
        for (auto p = starts[column]; p < starts[column + 1]; ++p) {
            const std::int64_t k = order[p];
            const std::int32_t row = std::max(rows[k], columns[k]);
            if (A.numEntries() > A.columnStarts.back() && A.rows.back() == row) {
                A.values.back() += values[k];
            } else if (values[k] != 0 || row == column) {
                A.rows.push_back(row);
                A.values.push_back(values[k]);
            }
        }
    }
    A.columnStarts.push_back(A.numEntries());
    return A;
}

double FeModel::calcMass() const {
    double sum = 0;
    for (int column = 0; column < m.size; ++column)
        for (auto k = m.columnStarts[column]; k < m.columnStarts[column + 1]; ++k)
            sum += (m.rows[k] == column ? 1 : 2) * m.values[k];
    return sum;
}

std::array<double, 3> FeModel::calcCenterOfMass() const {
    // Relative to the nodes' middle, to avoid cancellation far from the origin.
    std::array<double, 3> middle{}, moment{};
    for (int node = 0; node < mesh.numNodes(); ++node)
        for (int a = 0; a < 3; ++a) middle[a] += mesh.positions[3 * node + a] / mesh.numNodes();
    for (int column = 0; column < m.size; ++column)
        for (auto k = m.columnStarts[column]; k < m.columnStarts[column + 1]; ++k)
            for (int a = 0; a < 3; ++a) {
                moment[a] += m.values[k] * (mesh.positions[3 * column + a] - middle[a]);
                if (m.rows[k] != column)
                    moment[a] += m.values[k] * (mesh.positions[3 * m.rows[k] + a] - middle[a]);
            }
    const double mass = calcMass();
    std::array<double, 3> center;
    for (int a = 0; a < 3; ++a) center[a] = middle[a] + moment[a] / mass;
    return center;
}

void FeModel::validate() const {
    if (mesh.numNodes() == 0) throw std::invalid_argument(source + ": the mesh has no nodes");
    checkShape(source, "stiffness", K, 3 * mesh.numNodes());
    checkShape(source, "mass", m, mesh.numNodes());
    for (const double x : mesh.positions)
        if (!std::isfinite(x))
            throw std::invalid_argument(source + ": a node position is not a finite number");
    checkFinite(source, "stiffness", K);
    checkFinite(source, "mass", m);
    const double mass = calcMass();
    if (!(mass > 0))
        throw std::invalid_argument(source + ": the mass is " + std::to_string(mass) +
                                    "; it must be positive. Is *DENSITY given?");
    checkShape(*this);
    checkConnected(*this);
    checkFree(*this);
    checkConstraintsFree(*this);
}

}  // namespace simflex
