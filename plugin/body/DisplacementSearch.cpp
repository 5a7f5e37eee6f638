#include "simflex/body/DisplacementSearch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>

#include "simflex/base/Chunk.h"
#include "simflex/base/DenseAlgebra.h"

namespace simflex {

using ::Eigen::Matrix3d;
using ::Eigen::Vector3d;

namespace {

constexpr double SumRoundOff = 1e-12;  // relative, a generous bound for sums

Vector3d getPosition(const ReducedBody& part, int node) {
    return Vector3d::Map(part.mesh.positions.data() + 3 * size_t(node));
}

Vector3d getShape(const ReducedBody& part, int node, int mode) {
    return Vector3d::Map(part.Phi.data() + 3 * size_t(node) +
                         3 * size_t(part.mesh.numNodes()) * size_t(mode));
}

float roundUp(double value) {
    return std::nextafter(float(value), std::numeric_limits<float>::infinity());
}

}  // namespace

Vector3d calcDisplacement(const ReducedBody& part, int node, const double* xi) {
    const ::Eigen::Map<const ::Eigen::MatrixXd> Phi(part.Phi.data(), 3 * part.mesh.numNodes(),
                                                    part.numModes);
    return Phi.middleRows<3>(3 * node) * ::Eigen::Map<const ::Eigen::VectorXd>(xi, part.numModes);
}

DisplacementSearch::DisplacementSearch(const ReducedBody& part)
    : m_part(part), m_nodes(size_t(part.mesh.numNodes())) {
    std::iota(m_nodes.begin(), m_nodes.end(), 0);
    if (!m_nodes.empty()) divide(0, int(m_nodes.size()));
    for (const Tile& tile : m_tiles)
        if (tile.children < 0) std::sort(m_nodes.begin() + tile.first, m_nodes.begin() + tile.last);
    m_coefficients.resize(m_tiles.size() * size_t(part.numModes) * NumCoefficients);
    for (int tile = 0; tile < int(m_tiles.size()); ++tile) fit(tile);
}

int DisplacementSearch::halve(int first, int last) {
    Vector3d low = getPosition(m_part, m_nodes[size_t(first)]), high = low;
    for (int k = first; k < last; ++k) {
        const Vector3d position = getPosition(m_part, m_nodes[size_t(k)]);
        low = low.cwiseMin(position);
        high = high.cwiseMax(position);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const auto isBefore = [&](int a, int b) {
        const double x = getPosition(m_part, a)[axis], y = getPosition(m_part, b)[axis];
        return x != y ? x < y : a < b;
    };
    const int middle = first + (last - first) / 2;
    std::nth_element(m_nodes.begin() + first, m_nodes.begin() + middle, m_nodes.begin() + last,
                     isBefore);
    return middle;
}

void DisplacementSearch::divide(int first, int last) {
    if (last - first <= RootSize) {
        m_roots.push_back(int(m_tiles.size()));
        m_tiles.push_back({first, last});
        divideTile(m_roots.back());
        return;
    }
    const int middle = halve(first, last);
    divide(first, middle);
    divide(middle, last);
}

void DisplacementSearch::divideTile(int tile) {
    const int first = m_tiles[size_t(tile)].first, last = m_tiles[size_t(tile)].last;
    if (last - first <= LeafSize) return;
    std::vector<int> ends{first, last};
    for (int halving = 0; (1 << halving) < NumChildren; ++halving) {
        std::vector<int> finer{first};
        for (size_t k = 0; k + 1 < ends.size(); ++k) {
            finer.push_back(halve(ends[k], ends[k + 1]));
            finer.push_back(ends[k + 1]);
        }
        ends = finer;
    }
    const int children = int(m_tiles.size());
    m_tiles[size_t(tile)].children = children;
    for (int k = 0; k < NumChildren; ++k) m_tiles.push_back({ends[size_t(k)], ends[size_t(k) + 1]});
    for (int k = 0; k < NumChildren; ++k) divideTile(children + k);
}

void DisplacementSearch::fit(int index) {
    Tile& tile = m_tiles[size_t(index)];
    const int count = tile.last - tile.first, numModes = m_part.numModes;
    const int* const nodes = m_nodes.data() + tile.first;
    ::Eigen::Matrix3Xd x(3, count);
    for (int k = 0; k < count; ++k) x.col(k) = getPosition(m_part, nodes[k]);
    tile.center = x.rowwise().mean();
    x.colwise() -= tile.center;
    tile.low = x.rowwise().minCoeff();
    tile.high = x.rowwise().maxCoeff();
    // The pseudoinverse handles nodes in a plane or on a line, which do not determine slopes across
    // it.
    const Matrix3d moments = x * x.transpose();
    const Matrix3d inverse = calcColumnSpace(moments).pseudoInverse;
    float* own = m_coefficients.data() + size_t(index) * size_t(numModes) * NumCoefficients;
    for (int i = 0; i < numModes; ++i, own += NumCoefficients) {
        Vector3d sum = Vector3d::Zero();
        Matrix3d slopes = Matrix3d::Zero();
        double largest = 0, rest = 0;
        for (int k = 0; k < count; ++k) {
            const Vector3d shape = getShape(m_part, nodes[k], i);
            sum += shape;
            slopes += shape * x.col(k).transpose();
            largest = std::max(largest, shape.squaredNorm());
        }
        ::Eigen::Matrix<float, 3, 4> fitted;
        fitted << (sum / count).cast<float>(), (slopes * inverse).cast<float>();
        // Remainder of the fit as stored in single precision.
        const Vector3d c = fitted.col(0).cast<double>();
        const Matrix3d A = fitted.rightCols<3>().cast<double>();
        for (int k = 0; k < count; ++k)
            rest = std::max(rest, (getShape(m_part, nodes[k], i) - c - A * x.col(k)).squaredNorm());
        std::copy_n(fitted.data(), 12, own);
        own[12] = roundUp(std::sqrt(rest) + SumRoundOff * std::sqrt(largest));
    }
}

DisplacementSearch::Field DisplacementSearch::calcField(int index, const double* xi) const {
    const int numModes = m_part.numModes;
    const float* const own =
        m_coefficients.data() + size_t(index) * size_t(numModes) * NumCoefficients;
    Chunk sums[4] = {};
    Field field;
    const auto add = [&](int i, Chunk& low, Chunk& high) {
        const float* const mode = own + size_t(i) * NumCoefficients;
        low += loadChunk(mode) * xi[i];
        high += loadChunk(mode + ChunkSize) * xi[i];
        field.rest += double(mode[12]) * std::abs(xi[i]);
    };
    for (int i = 0; i + 1 < numModes; i += 2) {
        add(i, sums[0], sums[1]);
        add(i + 1, sums[2], sums[3]);
    }
    if (numModes % 2) add(numModes - 1, sums[0], sums[1]);
    storeChunk(sums[0] + sums[2], field.linear);
    storeChunk(sums[1] + sums[3], field.linear + ChunkSize);
    return field;
}

double DisplacementSearch::calcBound(int index, const double* xi) const {
    const Tile& tile = m_tiles[size_t(index)];
    const Field field = calcField(index, xi);
    const double* const c = field.linear;
    // All eight corners at once.
    const Vector3d &l = tile.low, &h = tile.high;
    const Chunk x = makeChunk(l[0], h[0], l[0], h[0], l[0], h[0], l[0], h[0]);
    const Chunk y = makeChunk(l[1], l[1], h[1], h[1], l[1], l[1], h[1], h[1]);
    const Chunk z = makeChunk(l[2], l[2], l[2], l[2], h[2], h[2], h[2], h[2]);
    Chunk squared{};
    for (int axis = 0; axis < 3; ++axis) {
        const Chunk u = c[axis] + c[3 + axis] * x + c[6 + axis] * y + c[9 + axis] * z;
        squared += u * u;
    }
    double largest = 0;
    for (int corner = 0; corner < ChunkSize; ++corner) largest = std::max(largest, squared[corner]);
    return (1 + SumRoundOff) * (std::sqrt(largest) + field.rest);
}

void DisplacementSearch::searchLeaf(int index, const double* xi, double& squared,
                                    int& worst) const {
    const Tile& tile = m_tiles[size_t(index)];
    const Field field = calcField(index, xi);
    const auto c = Vector3d::Map(field.linear);
    const auto A = Matrix3d::Map(field.linear + 3);
    for (int k = tile.first; k < tile.last; ++k) {
        const int node = m_nodes[size_t(k)];
        const Vector3d x = getPosition(m_part, node) - tile.center;
        const double bound = (1 + SumRoundOff) * ((c + A * x).norm() + field.rest);
        if (bound * bound < squared) continue;
        const double found = calcDisplacement(m_part, node, xi).squaredNorm();
        if (found < squared || (found == squared && node > worst)) continue;
        squared = found;
        worst = node;
    }
}

DisplacementSearch::Largest DisplacementSearch::findAmongAll(const ReducedBody& part,
                                                             const double* xi) {
    const int nodes = part.mesh.numNodes();
    const auto modes = ::Eigen::Map<const ::Eigen::VectorXd>(xi, part.numModes);
    if (!modes.allFinite()) return {std::numeric_limits<double>::quiet_NaN(), 0};
    if (modes.isZero(0) || nodes == 0) return {};
    const ::Eigen::VectorXd all =
        ::Eigen::Map<const ::Eigen::MatrixXd>(part.Phi.data(), 3 * nodes, part.numModes) * modes;
    const ::Eigen::VectorXd squared =
        ::Eigen::Map<const ::Eigen::Matrix3Xd>(all.data(), 3, nodes).colwise().squaredNorm();
    // Round-off of the matrix product may depend on its size; recheck nodes near the maximum.
    const double least = (1 - SumRoundOff) * squared.maxCoeff();
    double largest = 0;
    int worst = 0;
    for (int node = 0; node < nodes; ++node) {
        if (squared[node] < least) continue;
        const double found = calcDisplacement(part, node, xi).squaredNorm();
        if (!(found > largest)) continue;
        largest = found;
        worst = node;
    }
    return {std::sqrt(largest), worst};
}

DisplacementSearch::Largest DisplacementSearch::find(const double* xi) const {
    double size = 0;
    for (int i = 0; i < m_part.numModes; ++i) size += std::abs(xi[i]);
    if (!std::isfinite(size)) return {std::numeric_limits<double>::quiet_NaN(), 0};
    if (size == 0 || m_nodes.empty()) return {};
    using Candidate = std::pair<double, int>;  // bound, tile
    std::priority_queue<Candidate> candidates;
    for (const int root : m_roots) candidates.emplace(calcBound(root, xi), root);
    double squared = 0;
    int node = m_part.mesh.numNodes();
    while (!candidates.empty()) {
        const auto [bound, index] = candidates.top();
        if (bound * bound < squared) break;
        candidates.pop();
        const int children = m_tiles[size_t(index)].children;
        if (children < 0) {
            searchLeaf(index, xi, squared, node);
            continue;
        }
        for (int child = children; child < children + NumChildren; ++child) {
            const double own = calcBound(child, xi);
            if (own * own >= squared) candidates.emplace(own, child);
        }
    }
    return {std::sqrt(squared), node};
}

}  // namespace simflex
