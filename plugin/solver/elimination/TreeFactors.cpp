#include "simflex/solver/elimination/TreeFactors.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace simflex {

using Eigen::Map;

namespace {

/** |x| within a factor √2, which is faster. **/
double sizeOf(double x) {
    return std::abs(x);
}
double sizeOf(const std::complex<double>& x) {
    return std::abs(x.real()) + std::abs(x.imag());
}

/** inverse ← A⁻¹ of the leading n rows and columns, by Gauss–Jordan elimination; overwrites A.
@returns false if a pivot is zero or not a number. **/
template <class Square>
bool invert(int n, Square& A, Square& inverse) {
    using Scalar = typename Square::Scalar;
    inverse.setIdentity();
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k + 1; i < n; ++i)
            if (sizeOf(A(i, k)) > sizeOf(A(pivot, k))) pivot = i;
        if (!(sizeOf(A(pivot, k)) > 0)) return false;
        for (int j = 0; pivot != k && j < n; ++j) {
            std::swap(A(k, j), A(pivot, j));
            std::swap(inverse(k, j), inverse(pivot, j));
        }
        const Scalar scale = Scalar(1) / A(k, k);
        for (int j = 0; j < n; ++j) {
            A(k, j) *= scale;
            inverse(k, j) *= scale;
        }
        for (int i = 0; i < n; ++i) {
            const Scalar factor = A(i, k);
            for (int j = 0; i != k && j < n; ++j) {
                A(i, j) -= factor * A(k, j);
                inverse(i, j) -= factor * inverse(k, j);
            }
        }
    }
    return true;
}

/** aᵀb without conjugates. **/
template <class Column>
typename Column::Scalar multiply(const Column& a, const Column& b) {
    return a.cwiseProduct(b).sum();
}

}  // namespace

template <class Scalar>
bool TreeFactors<Scalar>::eliminate(const BasicTreeMatrix<Scalar>& J) {
    const size_t numNodes = J.nodes.size();
    m_nodes.resize(numNodes);
    m_Q.resize(numNodes);
    m_b.resize(numNodes);
    m_z.resize(numNodes);
    for (size_t b = 0; b < numNodes; ++b)
        m_Q[b] = Map<const Eigen::Matrix<double, 6, 12>>(J.inertia.data() + 72 * b)
                     .template cast<Scalar>();
    for (size_t b = numNodes; b-- > 0;) {
        const int first = J.nodes[b].firstSpeed, count = J.nodes[b].numSpeeds;
        Node& node = m_nodes[b];
        node.parent = J.nodes[b].parent;
        node.firstSpeed = first;
        node.numSpeeds = count;
        auto& Q = m_Q[b];
        std::array<Motion, Most> QtS;
        Eigen::Matrix<Scalar, Most, Most> D;
        for (int k = 0; k < count; ++k) {
            const int speed = first + k;
            node.S[k] = Map<const Eigen::Matrix<double, 6, 1>>(J.screws.data() + 6 * speed)
                            .template cast<Scalar>();
            node.X[k] = Map<const Motion>(J.motions.data() + 12 * speed);
            node.W[k].noalias() = Q * node.X[k];
            QtS[k].noalias() = Q.transpose() * node.S[k];
        }
        for (int k = 0; k < count; ++k)
            for (int i = 0; i < count; ++i)
                D(i, k) = multiply(node.S[i], node.W[k]) + J.own[size_t(6 * (first + k) + i)];
        if (!invert(count, D, node.inverse)) return false;
        for (int k = 0; k < count; ++k) {
            node.W[k] += Map<const Force>(J.turned.data() + 6 * (first + k));
            node.K[k] = node.inverse(k, 0) * QtS[0];
            for (int i = 1; i < count; ++i) node.K[k] += node.inverse(k, i) * QtS[i];
        }
        if (node.parent >= 0)
            for (int k = 0; k < count; ++k) Q.noalias() -= node.W[k] * node.K[k].transpose();
        if (node.parent >= 0) m_Q[size_t(node.parent)] += m_Q[b];
    }
    return true;
}

template <class Scalar>
bool TreeFactors<Scalar>::factor(const BasicTreeMatrix<Scalar>& J) {
    if (!eliminate(J)) return false;
    // Is J J⁻¹ r = r?
    constexpr double LargestLoss = 1e-8;
    size_t n = 0;
    for (const Node& node : m_nodes) n += size_t(node.numSpeeds);
    m_x.assign(n, Scalar(1));
    m_r.resize(n);
    J.multiply(m_x.data(), m_r.data(), m_workspace);
    m_x = m_r;
    solveInPlace(m_x.data());
    m_again.resize(n);
    J.multiply(m_x.data(), m_again.data(), m_workspace);
    double largest = 0, loss = 0;
    for (size_t i = 0; i < n; ++i) {
        largest = std::max(largest, sizeOf(m_r[i]));
        const double difference = sizeOf(m_again[i] - m_r[i]);
        loss = difference <= loss ? loss : difference;  // NaN stays
        if (std::isnan(loss)) return false;
    }
    return loss <= LargestLoss * largest;
}

template <class Scalar>
void TreeFactors<Scalar>::solveInPlace(Scalar* x) {
    for (auto& b : m_b) b.setZero();
    for (size_t k = m_nodes.size(); k-- > 0;) {
        const Node& node = m_nodes[k];
        Scalar* own = x + node.firstSpeed;
        std::array<Scalar, Most> rest;
        for (int i = 0; i < node.numSpeeds; ++i) rest[i] = own[i] - multiply(node.S[i], m_b[k]);
        for (int i = 0; i < node.numSpeeds; ++i) {
            own[i] = Scalar(0);
            for (int j = 0; j < node.numSpeeds; ++j) own[i] += node.inverse(i, j) * rest[j];
            if (node.parent >= 0) m_b[k] += own[i] * node.W[i];
        }
        if (node.parent >= 0) m_b[size_t(node.parent)] += m_b[k];
    }
    for (size_t k = 0; k < m_nodes.size(); ++k) {
        const Node& node = m_nodes[k];
        Scalar* own = x + node.firstSpeed;
        if (node.parent < 0) {
            m_z[k].setZero();
        } else {
            m_z[k] = m_z[size_t(node.parent)];
            for (int i = 0; i < node.numSpeeds; ++i) own[i] -= multiply(node.K[i], m_z[k]);
        }
        for (int i = 0; i < node.numSpeeds; ++i) m_z[k] += own[i] * node.X[i];
    }
}

template class TreeFactors<double>;
template class TreeFactors<std::complex<double>>;

}  // namespace simflex
