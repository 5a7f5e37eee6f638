#include "simflex/solver/elimination/TreeFactors.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace simflex {

using Eigen::Map;

namespace {

/** Within √2 of |x|, which takes longer. **/
double sizeOf(double x) {
    return std::abs(x);
}
double sizeOf(const std::complex<double>& x) {
    return std::abs(x.real()) + std::abs(x.imag());
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
        if (count > 0) {
            node.S = Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(
                         J.screws.data() + 6 * first, 6, count)
                         .template cast<Scalar>();
            node.X = Map<const Eigen::Matrix<Scalar, 12, Eigen::Dynamic>>(
                J.motions.data() + 12 * first, 12, count);
            const Forces QX = m_Q[b].lazyProduct(node.X);
            const Gain SQ = node.S.transpose().lazyProduct(m_Q[b]);
            const Map<const Eigen::Matrix<Scalar, 6, Eigen::Dynamic>> E(J.own.data() + 6 * first, 6,
                                                                        count);
            const Square D = node.S.transpose().lazyProduct(QX) + E.topRows(count);
            const Eigen::PartialPivLU<Square> lu(D);
            if (!(lu.matrixLU().diagonal().cwiseAbs().minCoeff() > 0)) return false;
            node.inverse = lu.inverse();
            node.W = QX + Map<const Eigen::Matrix<Scalar, 6, Eigen::Dynamic>>(
                              J.turned.data() + 6 * first, 6, count);
            node.K = node.inverse.lazyProduct(SQ);
            if (node.parent >= 0) m_Q[b] -= node.W.lazyProduct(node.K);
        }
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
        if (node.numSpeeds > 0) {
            Map<Eigen::Matrix<Scalar, Eigen::Dynamic, 1>> own(x + node.firstSpeed, node.numSpeeds);
            const Eigen::Matrix<Scalar, Eigen::Dynamic, 1, Eigen::ColMajor, Most, 1> rest =
                own - node.S.transpose().lazyProduct(m_b[k]);
            own = node.inverse.lazyProduct(rest);
            if (node.parent >= 0) m_b[k] += node.W.lazyProduct(own);
        }
        if (node.parent >= 0) m_b[size_t(node.parent)] += m_b[k];
    }
    for (size_t k = 0; k < m_nodes.size(); ++k) {
        const Node& node = m_nodes[k];
        if (node.parent < 0)
            m_z[k].setZero();
        else
            m_z[k] = m_z[size_t(node.parent)];
        if (node.numSpeeds == 0) continue;
        Map<Eigen::Matrix<Scalar, Eigen::Dynamic, 1>> own(x + node.firstSpeed, node.numSpeeds);
        if (node.parent >= 0) own -= node.K.lazyProduct(m_z[k]);
        m_z[k] += node.X.lazyProduct(own);
    }
}

template class TreeFactors<double>;
template class TreeFactors<std::complex<double>>;

}  // namespace simflex
