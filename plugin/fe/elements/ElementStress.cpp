#include "ElementStress.h"

#include <algorithm>
#include <stdexcept>

#include "simflex/base/ParallelFor.h"

namespace simflex {
namespace {

constexpr int Group = 8;  // fields processed together
using Lanes = std::array<double, Group>;

const FeElements& takeElements(const FeModel& model) {
    if (model.elements) return *model.elements;
    throw std::invalid_argument(model.source +
                                ": stress needs the elements of the part, not its matrices alone; "
                                "reduce it from a deck or a mesh, or without stress");
}

}  // namespace

ElementStress::ElementStress(const FeModel& model)
    : m_model(model), m_elements(takeElements(model)) {
    try {
        for (int e = 0; e < m_elements.size(); ++e) m_elements.getExtrapolation(e);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(model.source + ": " + error.what());
    }
    if (m_elements.beside.hasHinged)
        throw std::invalid_argument(model.source +
                                    ": stress of a part with trusses or membranes is not known; "
                                    "reduce without stress, or use beams and shells");
}

void ElementStress::calcGroup(const std::vector<int>& rowOf, const std::vector<int>& touched,
                              size_t numRows, const double* fields, int count, float* stress,
                              float* strain) const {
    const size_t numDofs = 3 * size_t(m_model.mesh.numNodes());
    std::vector<Lanes> sums(12 * numRows, Lanes{});  // strain, stress
    std::vector<int> numElements(numRows, 0);
    ElementPoints places;
    Eigen::Matrix<double, 6, Eigen::Dynamic> B;
    std::vector<Lanes> u, atPoints;
    for (const int element : touched) {
        const size_t n = size_t(m_elements.numNodesOf(element));
        const int* nodes = m_elements.nodesOf(element);
        m_elements.calcStressPoints(element, m_model.mesh, places);
        const size_t numPoints = places.points.size();
        u.resize(3 * n);
        for (size_t k = 0; k < n; ++k)
            for (size_t a = 0; a < 3; ++a) {
                const double* from = fields + 3 * size_t(nodes[k]) + a;
                for (int f = 0; f < Group; ++f)
                    u[3 * k + a][size_t(f)] = f < count ? from[size_t(f) * numDofs] : 0;
            }
        atPoints.assign(12 * numPoints, Lanes{});
        for (size_t p = 0; p < numPoints; ++p) {
            const ElementPoint& place = places.points[p];
            place.calcStrainMatrix(B);
            Lanes *epsilon = &atPoints[12 * p], *sigma = epsilon + 6;
            for (size_t k = 0; k < 3 * n; ++k)
                for (size_t c = 0; c < 6; ++c) {
                    const double b = (c < 3 ? 1 : 0.5) * B(Eigen::Index(c), Eigen::Index(k));
                    for (size_t f = 0; f < Group; ++f) epsilon[c][f] += b * u[k][f];
                }
            for (size_t c = 0; c < 6; ++c)
                for (size_t d = 0; d < 6; ++d) {
                    const double stiffness = (d < 3 ? 1 : 2) * place.D[c][d];
                    for (size_t f = 0; f < Group; ++f) sigma[c][f] += stiffness * epsilon[d][f];
                }
        }
        const auto& extrapolation = m_elements.getExtrapolation(element);
        for (size_t k = 0; k < extrapolation.size() / numPoints; ++k) {
            const int row = rowOf[size_t(nodes[k])];
            if (row < 0) continue;
            ++numElements[size_t(row)];
            for (size_t p = 0; p < numPoints; ++p) {
                const double share = extrapolation[k * numPoints + p];
                for (size_t c = 0; c < 12; ++c)
                    for (size_t f = 0; f < Group; ++f)
                        sums[12 * size_t(row) + c][f] += share * atPoints[12 * p + c][f];
            }
        }
    }
    for (int f = 0; f < count; ++f)
        for (size_t row = 0; row < numRows; ++row)
            for (size_t c = 0; c < 6; ++c) {
                const size_t at = 6 * (numRows * size_t(f) + row) + c;
                strain[at] = float(sums[12 * row + c][size_t(f)] / numElements[row]);
                stress[at] = float(sums[12 * row + 6 + c][size_t(f)] / numElements[row]);
            }
}

void ElementStress::calcAtNodes(const std::vector<int>& nodes, const double* fields, int count,
                                float* stress, float* strain,
                                const ProgressCallback& progress) const {
    std::vector<int> rowOf(size_t(m_model.mesh.numNodes()), -1);
    for (size_t k = 0; k < nodes.size(); ++k) rowOf.at(size_t(nodes[k])) = int(k);
    std::vector<int> touched;
    for (int e = 0; e < m_elements.size(); ++e) {
        const int* own = m_elements.nodesOf(e);
        if (std::any_of(own, own + m_elements.numNodesOf(e),
                        [&](int node) { return rowOf[size_t(node)] >= 0; }))
            touched.push_back(e);
    }
    const size_t numDofs = 3 * size_t(m_model.mesh.numNodes()), numRows = nodes.size();
    const int numGroups = (count + Group - 1) / Group;
    const double mostRoom = 1 << 30,
                 room = double(12 * sizeof(Lanes) * numRows);  // bytes per thread
    const int threads =
        std::max(1, std::min(omp_get_max_threads(), int(std::min(1e3, mostRoom / (1 + room)))));
    for (int first = 0; first < numGroups; first += threads) {
        reportProgress(progress, "modal stress", double(first) / numGroups);
        const int last = std::min(numGroups, first + threads);
        parallelFor(last - first, threads, [&](int k) {
            const size_t field = size_t(first + k) * Group;
            calcGroup(rowOf, touched, numRows, fields + field * numDofs,
                      std::min(Group, count - int(field)), stress + 6 * numRows * field,
                      strain + 6 * numRows * field);
        });
    }
}

std::vector<ElementStress::PointStress> ElementStress::calcAtPoints(const double* field) const {
    std::vector<PointStress> result;
    ElementPoints places;
    Eigen::Matrix<double, 6, Eigen::Dynamic> B;
    for (int e = 0; e < m_elements.size(); ++e) {
        const Eigen::Index n = m_elements.numNodesOf(e);
        Eigen::VectorXd u(3 * n);
        for (Eigen::Index k = 0; k < n; ++k)
            u.segment<3>(3 * k) =
                Eigen::Map<const Eigen::Vector3d>(field + 3 * size_t(m_elements.nodesOf(e)[k]));
        m_elements.calcStressPoints(e, m_model.mesh, places);
        for (size_t p = 0; p < places.points.size(); ++p) {
            PointStress at;
            at.element = m_elements.numberOf(e);
            at.point = int(p) + 1;
            places.points[p].calcStrainMatrix(B);
            const Eigen::Matrix<double, 6, 1> strain = B * u;
            for (size_t c = 0; c < 6; ++c) {
                at.strain[c] = (c < 3 ? 1 : 0.5) * strain[Eigen::Index(c)];
                for (size_t d = 0; d < 6; ++d)
                    at.stress[c] += places.points[p].D[c][d] * strain[Eigen::Index(d)];
            }
            result.push_back(at);
        }
    }
    return result;
}

}  // namespace simflex
