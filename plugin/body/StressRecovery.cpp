#include "simflex/body/StressRecovery.h"

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "simflex/base/ParallelFor.h"
#include "simflex/body/ModalMobilizer.h"

namespace simflex {

using namespace SimTK;

namespace {

constexpr int NodesAtATime = 64;         ///< nodes whose sums fit into the cache
constexpr double WorkOfThread = 200000;  ///< multiplications worth starting a thread for

/** values[Size·k + c] = Σ_i modes[Size·rows[k] + c + i·stride] xi[i], in a fixed order. **/
template <int Size, class Number>
void multiply(const std::vector<Number>& modes, const std::vector<int>& rows, size_t stride,
              const std::vector<double>& xi, std::vector<double>& values) {
    const int count = int(rows.size()), numBlocks = (count + NodesAtATime - 1) / NodesAtATime;
    const double work = double(Size) * count * double(xi.size());
    const int threads =
        std::max(1, int(std::min(double(std::min(omp_get_max_threads(), omp_get_num_procs())),
                                 work / WorkOfThread)));
    values.resize(size_t(Size) * size_t(count));
    const auto multiplyBlock = [&](int block) {
        const int first = block * NodesAtATime, last = std::min(count, first + NodesAtATime);
        double* const sums = values.data() + size_t(Size) * size_t(first);
        const size_t size = size_t(Size) * size_t(last - first);
        std::fill(sums, sums + size, 0.0);
        const bool isDense = rows[size_t(last) - 1] - rows[size_t(first)] == last - 1 - first &&
                             std::is_sorted(rows.begin() + first, rows.begin() + last);
        for (size_t i = 0; i < xi.size(); ++i) {
            const Number* const mode = modes.data() + i * stride;
            const double factor = xi[i];
            if (isDense) {
                const Number* const from = mode + size_t(Size) * size_t(rows[size_t(first)]);
                for (size_t k = 0; k < size; ++k) sums[k] += factor * double(from[k]);
                continue;
            }
            for (int k = first; k < last; ++k) {
                const Number* const from = mode + size_t(Size) * size_t(rows[size_t(k)]);
                for (int c = 0; c < Size; ++c)
                    sums[Size * (k - first) + c] += factor * double(from[c]);
            }
        }
    };
    parallelFor(numBlocks, threads, multiplyBlock);
}

/** Builds a tensor from xx yy zz xy xz yz. **/
SymMat33 toTensor(const double* v) {
    return SymMat33(v[0], v[3], v[1], v[4], v[5], v[2]);
}

Vec3 toVec3(const double* v) {
    return Vec3(v[0], v[1], v[2]);
}

std::vector<int> allOf(int count) {
    std::vector<int> indices(static_cast<size_t>(count));
    std::iota(indices.begin(), indices.end(), 0);
    return indices;
}

std::vector<int> findNodes(const FlexibleBody& body, const std::vector<int>& numbers) {
    const Mesh& mesh = body.getPart().mesh;
    std::vector<int> nodes;
    for (const int number : numbers) try {
            nodes.push_back(mesh.indexOf(number));
        } catch (const std::out_of_range&) {
            throw std::out_of_range("flexible body '" + body.getName() + "' has no node number " +
                                    std::to_string(number));
        }
    return nodes;
}

}  // namespace

Real calcVonMises(const SymMat33& s) {
    return std::sqrt(
        0.5 * (square(s(0, 0) - s(1, 1)) + square(s(1, 1) - s(2, 2)) + square(s(2, 2) - s(0, 0))) +
        3 * (square(s(1, 0)) + square(s(2, 0)) + square(s(2, 1))));
}

Real calcSignedVonMises(const SymMat33& stress) {
    const Vec3 principal = calcPrincipalValues(stress);
    return std::abs(principal[2]) > std::abs(principal[0]) ? -calcVonMises(stress)
                                                           : calcVonMises(stress);
}

Vec3 calcPrincipalValues(const SymMat33& t) {
    ::Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = t(i, j);
    const ::Eigen::SelfAdjointEigenSolver<::Eigen::Matrix3d> solver(A, ::Eigen::EigenvaluesOnly);
    const auto& values = solver.eigenvalues();
    return Vec3(values[2], values[1], values[0]);
}

StressRecovery::StressRecovery(const FlexibleBody& body)
    : StressRecovery(body,
                     body.getPart().modalStress ? body.getPart().modalStress->nodes
                                                : allOf(body.getPart().mesh.numNodes()),
                     nullptr) {}

StressRecovery::StressRecovery(const FlexibleBody& body, const std::vector<int>& nodeNumbers)
    : StressRecovery(body, findNodes(body, nodeNumbers), nullptr) {}

StressRecovery StressRecovery::atAllNodes(const FlexibleBody& body) {
    return StressRecovery(body, allOf(body.getPart().mesh.numNodes()), nullptr);
}

StressRecovery::StressRecovery(const FlexibleBody& body, std::vector<int> nodes, std::nullptr_t)
    : m_body(body), m_nodes(std::move(nodes)) {
    if (const auto& modal = body.getPart().modalStress)
        for (const int node : m_nodes) {
            const auto found = std::lower_bound(modal->nodes.begin(), modal->nodes.end(), node);
            m_rows.push_back(found == modal->nodes.end() || *found != node
                                 ? -1
                                 : int(found - modal->nodes.begin()));
        }
    m_xi.resize(size_t(body.getNumModes()));
}

int StressRecovery::getNodeNumber(int k) const {
    return m_body.getPart().mesh.nodeNumbers[size_t(m_nodes.at(size_t(k)))];
}

Vec3 StressRecovery::getNodePosition(int k) const {
    const ReducedBody& part = m_body.getPart();
    const auto s = part.mesh.position(m_nodes.at(size_t(k)));
    return Vec3(s[0], s[1], s[2]) + toVec3(part.centerOfMass.data());
}

void StressRecovery::takeModalCoordinates(const State& state) {
    for (int i = 0; i < int(m_xi.size()); ++i)
        m_xi[size_t(i)] = m_body.getModalMobilizer(i / ModalMobilizer::MaxModes)
                              .getOneQ(state, i % ModalMobilizer::MaxModes);
}

void StressRecovery::checkStress() const {
    const ReducedBody& part = m_body.getPart();
    if (!part.modalStress)
        throw std::invalid_argument("flexible body '" + m_body.getName() + "': its part '" +
                                    part.name + "' has no modal stress; reduce it with --stress");
    const auto none = std::find(m_rows.begin(), m_rows.end(), -1);
    if (none == m_rows.end()) return;
    throw std::invalid_argument(
        "flexible body '" + m_body.getName() + "': node " +
        std::to_string(getNodeNumber(int(none - m_rows.begin()))) +
        " is none of the nodes that its part '" + part.name + "' has modal stress at (" +
        std::to_string(part.modalStress->nodes.size()) + " of " +
        std::to_string(part.mesh.numNodes()) +
        "); reduce it with --stress=all, or with a node set that holds the node");
}

void StressRecovery::calcTensors(const State& state, const std::vector<float>& modes) {
    takeModalCoordinates(state);
    multiply<6>(modes, m_rows, 6 * m_body.getPart().modalStress->nodes.size(), m_xi, m_values);
}

void StressRecovery::calcTensors(const State& state, const std::vector<float>& modes,
                                 Array_<SymMat33>& tensors, Axes axes) {
    calcTensors(state, modes);
    tensors.resize(unsigned(getNumNodes()));
    for (int k = 0; k < getNumNodes(); ++k)
        tensors[unsigned(k)] = toTensor(&m_values[6 * size_t(k)]);
    if (axes == Axes::Body) return;
    const Rotation R_GB = m_body.getFramePose(state).R();
    for (SymMat33& tensor : tensors) tensor = R_GB.reexpressSymMat33(tensor);
}

void StressRecovery::calcStress(const State& state, Array_<SymMat33>& stress, Axes axes) {
    checkStress();
    calcTensors(state, m_body.getPart().modalStress->stress, stress, axes);
}

void StressRecovery::calcStrain(const State& state, Array_<SymMat33>& strain, Axes axes) {
    checkStress();
    calcTensors(state, m_body.getPart().modalStress->strain, strain, axes);
}

void StressRecovery::calcVonMises(const State& state, Vector& vonMises) {
    checkStress();
    calcTensors(state, m_body.getPart().modalStress->stress);
    vonMises.resize(getNumNodes());
    for (int k = 0; k < getNumNodes(); ++k)
        vonMises[k] = simflex::calcVonMises(toTensor(&m_values[6 * size_t(k)]));
}

void StressRecovery::calcPrincipalStress(const State& state, Array_<Vec3>& principal) {
    constexpr int NodesOfThread = 1000;
    checkStress();
    calcTensors(state, m_body.getPart().modalStress->stress);
    const int count = getNumNodes(),
              threads = std::max(1, std::min(std::min(omp_get_max_threads(), omp_get_num_procs()),
                                             count / NodesOfThread));
    principal.resize(unsigned(count));
    parallelFor(count, threads, [&](int k) {
        principal[unsigned(k)] = calcPrincipalValues(toTensor(&m_values[6 * size_t(k)]));
    });
}

void StressRecovery::calcDisplacements() {
    const ReducedBody& part = m_body.getPart();
    multiply<3>(part.Phi, m_nodes, 3 * size_t(part.mesh.numNodes()), m_xi, m_values);
}

void StressRecovery::calcDisplacement(const State& state, Array_<Vec3>& u_B) {
    takeModalCoordinates(state);
    calcDisplacements();
    u_B.resize(unsigned(getNumNodes()));
    for (int k = 0; k < getNumNodes(); ++k) u_B[unsigned(k)] = toVec3(&m_values[3 * size_t(k)]);
}

void StressRecovery::calcLocation(const State& state, Array_<Vec3>& p_G) {
    calcDisplacement(state, p_G);
    const Transform X_GB = m_body.getFramePose(state);
    const Mesh& mesh = m_body.getPart().mesh;
    for (int k = 0; k < getNumNodes(); ++k) {
        Vec3& p = p_G[unsigned(k)];
        p = X_GB * (toVec3(&mesh.positions[3 * size_t(m_nodes[size_t(k)])]) + p);
    }
}

void StressRecovery::calcVelocity(const State& state, Array_<Vec3>& v_G) {
    calcLocation(state, v_G);
    for (int i = 0; i < int(m_xi.size()); ++i)
        m_xi[size_t(i)] = m_body.getModalMobilizer(i / ModalMobilizer::MaxModes)
                              .getOneU(state, i % ModalMobilizer::MaxModes);
    calcDisplacements();
    const Transform X_GB = m_body.getFramePose(state);
    const SpatialVec V_GB = m_body.getFrameVelocity(state);
    for (int k = 0; k < getNumNodes(); ++k) {
        Vec3& v = v_G[unsigned(k)];
        v = V_GB[1] + V_GB[0] % (v - X_GB.p()) + X_GB.R() * toVec3(&m_values[3 * size_t(k)]);
    }
}

}  // namespace simflex
