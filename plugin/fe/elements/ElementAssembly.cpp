#include "ElementAssembly.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "simflex/base/ParallelFor.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

constexpr int ChunkSize = 64;

/** Index of a tensor component in xx yy zz xy xz yz. **/
constexpr int ComponentOf[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

/** K_ij[a,b] = Σ C[a,c,b,d] W_ij[c,d]: entry (a + 3b, c + 3d). **/
Eigen::Matrix<double, 9, 9> unfoldLaw(const ElasticMatrix& D) {
    Eigen::Matrix<double, 9, 9> C;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
            for (int c = 0; c < 3; ++c)
                for (int d = 0; d < 3; ++d)
                    C(a + 3 * b, c + 3 * d) =
                        D[size_t(ComponentOf[a][c])][size_t(ComponentOf[b][d])];
    return C;
}

/** For a uniform law, W = Σ v g gᵀ is independent of it. **/
void integrateByPairs(ElementWork& work) {
    const auto& points = work.points.points;
    const Eigen::Index n = points[0].G.cols();
    work.A.resize(3 * n, Eigen::Index(points.size()));
    for (size_t p = 0; p < points.size(); ++p)
        work.A.col(Eigen::Index(p)) = std::sqrt(points[p].volume) *
                                      Eigen::Map<const Eigen::VectorXd>(points[p].G.data(), 3 * n);
    work.W.setZero(3 * n, 3 * n);
    work.W.selfadjointView<Eigen::Lower>().rankUpdate(work.A);
    const Eigen::Matrix<double, 9, 9> C = unfoldLaw(points[0].D);
    for (Eigen::Index j = 0; j < n; ++j) {
        auto own = work.W.block<3, 3>(3 * j, 3 * j);
        own.triangularView<Eigen::StrictlyUpper>() = own.transpose();
        for (Eigen::Index i = j; i < n; ++i) {
            const Eigen::Matrix3d W = work.W.block<3, 3>(3 * i, 3 * j);
            const Eigen::Matrix<double, 9, 1> entries =
                C * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(W.data());
            work.K.block<3, 3>(3 * i, 3 * j) = Eigen::Map<const Eigen::Matrix3d>(entries.data());
        }
    }
}

void integrateByPoints(ElementWork& work) {
    work.K.setZero();
    for (const ElementPoint& point : work.points.points) {
        const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(point.D[0].data());
        point.calcStrainMatrix(work.B);
        work.DB.noalias() = point.volume * (D * work.B);
        work.K.noalias() += work.B.transpose() * work.DB;
    }
}

/** Removes exact zeros, except on the diagonal. **/
void dropZeros(SymmetricMatrix& A) {
    size_t to = 0;
    for (int column = 0; column < A.size; ++column) {
        const auto first = size_t(A.columnStarts[size_t(column)]),
                   end = size_t(A.columnStarts[size_t(column) + 1]);
        A.columnStarts[size_t(column)] = std::int64_t(to);
        for (size_t k = first; k < end; ++k) {
            if (A.values[k] == 0 && A.rows[k] != column) continue;
            A.rows[to] = A.rows[k];
            A.values[to++] = A.values[k];
        }
    }
    A.columnStarts[size_t(A.size)] = std::int64_t(to);
    A.rows.resize(to);
    A.values.resize(to);
}

}  // namespace

ElementAssembly::ElementAssembly(const FeElements& elements, int numNodes) : m_elements(elements) {
    findNeighbours(numNodes);
    colorChunks(numNodes);
}

/** Finds for each node those of common elements with an index not smaller, ascending. **/
void ElementAssembly::findNeighbours(int numNodes) {
    std::vector<std::int64_t> starts(size_t(numNodes) + 1, 0);
    for (int e = 0; e < m_elements.size(); ++e)
        for (int k = 0; k < m_elements.numNodesOf(e); ++k)
            ++starts[size_t(m_elements.nodesOf(e)[k]) + 1];
    std::partial_sum(starts.begin(), starts.end(), starts.begin());
    std::vector<std::int64_t> next(starts.begin(), starts.end() - 1);
    std::vector<int> elementsOf(size_t(starts.back()));
    for (int e = 0; e < m_elements.size(); ++e)
        for (int k = 0; k < m_elements.numNodesOf(e); ++k)
            elementsOf[size_t(next[size_t(m_elements.nodesOf(e)[k])]++)] = e;

    constexpr int Block = 1024;
    const int numBlocks = (numNodes + Block - 1) / Block;
    std::vector<std::vector<std::int32_t>> rows{size_t(numBlocks)};
    m_starts.assign(size_t(numNodes) + 1, 0);
    parallelFor(numBlocks, omp_get_max_threads(), [&](int block) {
        auto& own = rows[size_t(block)];
        const int end = std::min(numNodes, (block + 1) * Block);
        for (int node = block * Block; node < end; ++node) {
            const size_t first = own.size();
            own.push_back(node);  // a diagonal entry, also for nodes without elements
            for (auto k = starts[size_t(node)]; k < starts[size_t(node) + 1]; ++k) {
                const int e = elementsOf[size_t(k)];
                const int* nodes = m_elements.nodesOf(e);
                std::copy_if(nodes, nodes + m_elements.numNodesOf(e), std::back_inserter(own),
                             [&](int other) { return other > node; });
            }
            std::sort(own.begin() + std::ptrdiff_t(first), own.end());
            own.erase(std::unique(own.begin() + std::ptrdiff_t(first), own.end()), own.end());
            m_starts[size_t(node) + 1] = std::int64_t(own.size() - first);
        }
    });
    std::partial_sum(m_starts.begin(), m_starts.end(), m_starts.begin());
    m_rows.reserve(size_t(m_starts.back()));
    for (const auto& own : rows) m_rows.insert(m_rows.end(), own.begin(), own.end());
}

void ElementAssembly::colorChunks(int numNodes) {
    constexpr int NumShared = 64;  // colours with several chunks
    std::vector<std::uint64_t> usedAt(size_t(numNodes), 0);
    const int numChunks = (m_elements.size() + ChunkSize - 1) / ChunkSize;
    std::vector<std::vector<int>> alone;
    for (int chunk = 0; chunk < numChunks; ++chunk) {
        const auto forNodes = [&](const auto& visit) {
            const int end = std::min(m_elements.size(), (chunk + 1) * ChunkSize);
            for (int e = chunk * ChunkSize; e < end; ++e)
                for (int k = 0; k < m_elements.numNodesOf(e); ++k)
                    visit(usedAt[size_t(m_elements.nodesOf(e)[k])]);
        };
        std::uint64_t used = 0;
        forNodes([&](std::uint64_t at) { used |= at; });
        size_t color = 0;
        while (color < NumShared && (used >> color) & 1) ++color;
        if (color == NumShared) {
            alone.push_back({chunk});
            continue;
        }
        if (color >= m_colors.size()) m_colors.emplace_back();
        m_colors[color].push_back(chunk);
        forNodes([&](std::uint64_t& at) { at |= std::uint64_t(1) << color; });
    }
    m_colors.insert(m_colors.end(), alone.begin(), alone.end());
}

void ElementAssembly::addElement(int element, const ElementWork& work, SymmetricMatrix* K,
                                 SymmetricMatrix* m) const {
    const int n = m_elements.numNodesOf(element), *nodes = m_elements.nodesOf(element);
    for (int j = 0; j < n; ++j)
        for (int i = j; i < n; ++i) {
            const int column = std::min(nodes[i], nodes[j]), row = std::max(nodes[i], nodes[j]);
            const auto first = m_rows.begin() + m_starts[size_t(column)],
                       end = m_rows.begin() + m_starts[size_t(column) + 1];
            const auto at = std::lower_bound(first, end, row);
            const bool isTwice = row == column && i != j;  // the element contains the node twice
            if (m) m->values[size_t(at - m_rows.begin())] += (isTwice ? 2 : 1) * work.m(i, j);
            if (!K) continue;
            const std::int64_t below = 3 * (at - first);  // rows of preceding nodes
            for (int b = 0; b < 3; ++b)
                for (int a = row == column ? b : 0; a < 3; ++a) {
                    double& to =
                        K->values[size_t(K->columnStarts[size_t(3 * column + b)] + below + a - b)];
                    if (nodes[i] == row) to += work.K(3 * i + a, 3 * j + b);
                    if (nodes[i] != row || isTwice) to += work.K(3 * i + b, 3 * j + a);
                }
        }
}

void ElementAssembly::assemble(const Calc& calc, SymmetricMatrix* K, SymmetricMatrix* m,
                               const ProgressCallback& progress) const {
    const size_t numNodes = m_starts.size() - 1;
    if (m) {
        m->size = int(numNodes);
        m->columnStarts = m_starts;
        m->rows = m_rows;
        m->values.assign(m_rows.size(), 0);
    }
    if (K) {
        K->size = int(3 * numNodes);
        K->columnStarts.assign(1, 0);
        K->columnStarts.reserve(3 * numNodes + 1);
        K->rows.clear();
        K->rows.reserve(9 * m_rows.size() - 3 * numNodes);
        for (size_t node = 0; node < numNodes; ++node)
            for (int b = 0; b < 3; ++b) {
                for (auto k = m_starts[node]; k < m_starts[node + 1]; ++k)
                    for (int a = k == m_starts[node] ? b : 0; a < 3; ++a)
                        K->rows.push_back(3 * m_rows[size_t(k)] + a);
                K->columnStarts.push_back(std::int64_t(K->rows.size()));
            }
        K->values.assign(K->rows.size(), 0);
    }
    double done = 0;
    const int numChunks = (m_elements.size() + ChunkSize - 1) / ChunkSize;
    for (const std::vector<int>& chunks : m_colors) {
        reportProgress(progress, "K and M", done / numChunks);
        done += double(chunks.size());
        parallelFor(chunks.size(), omp_get_max_threads(), Schedule::WhoeverIsFree, [&](size_t k) {
            ElementWork work;
            const int end = std::min(m_elements.size(), (chunks[k] + 1) * ChunkSize);
            for (int e = chunks[k] * ChunkSize; e < end; ++e) {
                calc(e, work);
                addElement(e, work, K, m);
            }
        });
    }
    for (SymmetricMatrix* A : {K, m})
        if (A) dropZeros(*A);
}

void integrateStiffness(ElementWork& work) {
    const Eigen::Index n = work.points.points[0].N.size();
    work.K.resize(3 * n, 3 * n);
    if (work.points.hasOneLaw)
        integrateByPairs(work);
    else
        integrateByPoints(work);
    for (Eigen::Index j = 0; j < work.points.hourglass.cols(); ++j)
        for (Eigen::Index i = 0; i < work.points.hourglass.rows(); ++i)
            work.K.block<3, 3>(3 * i, 3 * j).diagonal().array() += work.points.hourglass(i, j);
}

void integrateElement(const FeElements& elements, const Mesh& mesh, int element,
                      ElementWork& work) {
    elements.calcPoints(element, mesh, work.points);
    integrateStiffness(work);
    const Eigen::Index n = elements.numNodesOf(element);
    work.m.setZero(n, n);
    for (const ElementPoint& point : work.points.points)
        work.m.selfadjointView<Eigen::Lower>().rankUpdate(point.N, point.density * point.volume);
}

void assembleElements(const FeElements& elements, const Mesh& mesh, SymmetricMatrix& K,
                      SymmetricMatrix& m, const ProgressCallback& progress) {
    ElementAssembly(elements, mesh.numNodes())
        .assemble([&](int e, ElementWork& work) { integrateElement(elements, mesh, e, work); }, &K,
                  &m, progress);
}

}  // namespace simflex
