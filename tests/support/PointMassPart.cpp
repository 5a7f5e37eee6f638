#include "support/PointMassPart.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <stdexcept>

namespace simflex::test {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double Pi = 3.14159265358979323846;

Mesh makeBrick(const PointMassPartOptions& options, std::mt19937& random) {
    std::uniform_real_distribution<double> shift(-0.5, 0.5);
    const auto& cells = options.cells;
    Mesh mesh;
    const auto at = [&](int i, int j, int k) {
        return i + (cells[0] + 1) * (j + (cells[1] + 1) * k);
    };
    for (int k = 0; k <= cells[2]; ++k)
        for (int j = 0; j <= cells[1]; ++j)
            for (int i = 0; i <= cells[0]; ++i) {
                mesh.nodeNumbers.push_back(1 + int(mesh.nodeNumbers.size()));
                const int index[3] = {i, j, k};
                for (int a = 0; a < 3; ++a)
                    mesh.positions.push_back((index[a] + options.jitter * shift(random)) *
                                             options.size[a] / cells[a]);
            }
    ElementBlock block;
    for (int k = 0; k < cells[2]; ++k)
        for (int j = 0; j < cells[1]; ++j)
            for (int i = 0; i < cells[0]; ++i)
                block.nodes.insert(block.nodes.end(),
                                   {at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k),
                                    at(i, j + 1, k), at(i, j, k + 1), at(i + 1, j, k + 1),
                                    at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
    mesh.elements.push_back(block);
    return mesh;
}

/** Returns smooth random fields at the nodes (rows 3k …) and, in the rows below, half their curls
at the interface nodes. **/
MatrixXd makeSmoothFields(const Matrix3Xd& s, const std::vector<int>& seats, int count,
                          double length, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    const int numNodes = int(s.cols());
    MatrixXd fields = MatrixXd::Zero(3 * (numNodes + seats.size()), count);
    for (int i = 0; i < count; ++i)
        for (int wave = 0; wave < 6; ++wave) {
            const Vector3d amplitude(unit(random), unit(random), unit(random));
            const Vector3d k =
                2.5 * Pi / length * Vector3d(unit(random), unit(random), unit(random));
            const double phase = Pi * unit(random);
            for (int node = 0; node < numNodes; ++node)
                fields.block<3, 1>(3 * node, i) += amplitude * std::sin(k.dot(s.col(node)) + phase);
            for (size_t seat = 0; seat < seats.size(); ++seat)
                fields.block<3, 1>(3 * (numNodes + seat), i) +=
                    0.5 * k.cross(amplitude) * std::cos(k.dot(s.col(seats[seat])) + phase);
        }
    return fields;
}

/** Removes the rigid motions from the fields and makes them mass-orthonormal, by Gram-Schmidt in
two passes. **/
void orthonormalize(const Matrix3Xd& s, const VectorXd& nodalMass, int numSeats, MatrixXd& fields) {
    const int numNodes = int(s.cols()), rows = 3 * numNodes;
    MatrixXd basis = MatrixXd::Zero(fields.rows(), 6 + fields.cols());
    for (int a = 0; a < 3; ++a) {
        for (int node = 0; node < numNodes; ++node) {
            basis(3 * node + a, a) = 1;
            basis.block<3, 1>(3 * node, 3 + a) = Vector3d::Unit(a).cross(s.col(node));
        }
        for (int seat = 0; seat < numSeats; ++seat) basis(3 * (numNodes + seat) + a, 3 + a) = 1;
    }
    basis.rightCols(fields.cols()) = fields;
    for (int i = 0; i < basis.cols(); ++i) {
        for (int pass = 0; pass < 2; ++pass)
            for (int j = 0; j < i; ++j) {
                const double overlap =
                    basis.col(j).head(rows).dot(nodalMass.cwiseProduct(basis.col(i).head(rows)));
                basis.col(i) -= overlap * basis.col(j);
            }
        const double norm =
            std::sqrt(basis.col(i).head(rows).dot(nodalMass.cwiseProduct(basis.col(i).head(rows))));
        basis.col(i) /= norm;
    }
    fields = basis.rightCols(fields.cols());
}

/** Components xx yy zz xy xz yz of Σm(a·b 1 − ½(abᵀ + baᵀ)). **/
Eigen::Matrix<double, 6, 1> sumInertia(const VectorXd& m, const Matrix3Xd& a, const Matrix3Xd& b) {
    Matrix3d sum = Matrix3d::Zero();
    for (int k = 0; k < m.size(); ++k) {
        const Matrix3d product = a.col(k) * b.col(k).transpose();
        sum +=
            m[k] * (product.trace() * Matrix3d::Identity() - 0.5 * (product + product.transpose()));
    }
    Eigen::Matrix<double, 6, 1> components;
    components << sum(0, 0), sum(1, 1), sum(2, 2), sum(0, 1), sum(0, 2), sum(1, 2);
    return components;
}

void sumInvariants(const VectorXd& m, const Matrix3Xd& s, const MatrixXd& Phi, ReducedBody& body) {
    const int n = int(Phi.cols()), numNodes = int(m.size());
    const auto shape = [&](int i) {
        return Matrix3Xd(Map<const Matrix3Xd>(Phi.col(i).data(), 3, numNodes));
    };
    const Eigen::Matrix<double, 6, 1> I0 = sumInertia(m, s, s);
    std::copy(I0.data(), I0.data() + 6, body.inertia.begin());
    body.I1.resize(6 * n);
    for (auto& component : body.I2) component.resize(n * n);
    for (auto& component : body.N) component.resize(n * n);
    for (int i = 0; i < n; ++i) {
        const Eigen::Matrix<double, 6, 1> I1 = 2 * sumInertia(m, s, shape(i));
        std::copy(I1.data(), I1.data() + 6, body.I1.begin() + 6 * i);
        for (int j = 0; j < n; ++j) {
            const Eigen::Matrix<double, 6, 1> I2 = sumInertia(m, shape(i), shape(j));
            Vector3d N = Vector3d::Zero();
            for (int k = 0; k < numNodes; ++k)
                N += m[k] * Vector3d(shape(i).col(k)).cross(shape(j).col(k));
            for (int c = 0; c < 6; ++c) body.I2[c][i + j * n] = I2[c];
            for (int a = 0; a < 3; ++a) body.N[a][i + j * n] = N[a];
        }
    }
}

/** Chooses the nodes of least and greatest x first, then others spread over the mesh. **/
std::vector<int> chooseSeats(const Matrix3Xd& s, int count) {
    std::vector<int> order(s.cols());
    for (int k = 0; k < s.cols(); ++k) order[k] = k;
    std::sort(order.begin(), order.end(), [&](int a, int b) { return s(0, a) < s(0, b); });
    std::vector<int> seats;
    if (count > 0) seats.push_back(order.front());
    if (count > 1) seats.push_back(order.back());
    for (int k = 2; k < count; ++k)
        seats.push_back(order[(k - 1) * int(order.size()) / (count - 1)]);
    return seats;
}

std::vector<int> neighboursOf(const Mesh& mesh, int node) {
    std::set<int> nodes;
    const std::vector<int>& elements = mesh.elements.front().nodes;
    for (auto element = elements.begin(); element != elements.end(); element += 8)
        if (std::find(element, element + 8, node) != element + 8)
            nodes.insert(element, element + 8);
    return {nodes.begin(), nodes.end()};
}

/** Returns six random symmetric matrices. **/
std::array<std::vector<double>, 6> makeRandomStiffness(int n, double size, std::mt19937& random) {
    std::uniform_real_distribution<double> entry(-size, size);
    std::array<std::vector<double>, 6> result;
    for (auto& matrix : result) {
        MatrixXd A(n, n);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i <= j; ++i) A(i, j) = A(j, i) = entry(random);
        matrix.assign(A.data(), A.data() + A.size());
    }
    return result;
}

}  // namespace

PointMassPart makePointMassPart(const PointMassPartOptions& options) {
    std::mt19937 random(options.seed);
    std::uniform_real_distribution<double> unit(0, 1);
    PointMassPart result;
    auto body = std::make_shared<ReducedBody>();
    body->name = "masses" + std::to_string(options.seed);
    body->mesh = makeBrick(options, random);
    const int numNodes = body->mesh.numNodes(), n = options.numModes;
    if (n < 0 || n > 3 * numNodes - 6 || options.numInterfaces > numNodes)
        throw std::invalid_argument(
            "makePointMassPart: too few nodes for the modes or interfaces asked for");

    // Masses, and positions relative to the centre of mass.
    VectorXd m(numNodes);
    for (int k = 0; k < numNodes; ++k) m[k] = 0.5 + unit(random);
    m *= options.mass / m.sum();
    Map<Matrix3Xd> s(body->mesh.positions.data(), 3, numNodes);
    const Vector3d center = s * m / m.sum();
    s.colwise() -= center;
    VectorXd nodalMass(3 * numNodes);
    for (int k = 0; k < numNodes; ++k) nodalMass.segment<3>(3 * k).setConstant(m[k]);

    const std::vector<int> seats = chooseSeats(s, options.numInterfaces);
    const double length = *std::max_element(options.size.begin(), options.size.end());
    MatrixXd fields = makeSmoothFields(s, seats, n, length, random);
    orthonormalize(s, nodalMass, int(seats.size()), fields);
    const MatrixXd Phi = fields.topRows(3 * numNodes);

    body->mass = m.sum();
    body->centerOfMass = {center[0], center[1], center[2]};
    body->numModes = n;
    for (int i = 0; i < n; ++i) {
        const double frequency =
            options.lowestFrequency +
            unit(random) * (options.highestFrequency - options.lowestFrequency);
        body->omegaSquared.push_back(std::pow(2 * Pi * frequency, 2));
    }
    std::sort(body->omegaSquared.begin(), body->omegaSquared.end());
    sumInvariants(m, s, Phi, *body);
    body->Phi.assign(Phi.data(), Phi.data() + Phi.size());
    for (size_t k = 0; k < seats.size(); ++k) {
        ReducedBody::Interface seat;
        seat.name = std::string(1, char('A' + k));
        seat.nodes = neighboursOf(body->mesh, seats[k]);
        for (int a = 0; a < 3; ++a) seat.position[a] = s(a, seats[k]);
        const MatrixXd translation = fields.middleRows(3 * seats[k], 3);
        const MatrixXd rotation = fields.middleRows(3 * (numNodes + k), 3);
        seat.Phi.assign(translation.data(), translation.data() + translation.size());
        seat.Psi.assign(rotation.data(), rotation.data() + rotation.size());
        body->interfaces.push_back(seat);
    }
    if (options.stiffening > 0) {
        body->stiffening.emplace();
        body->stiffening->turning = makeRandomStiffness(n, options.stiffening, random);
        for (size_t k = 0; k < seats.size(); ++k)
            body->stiffening->interfaces.push_back(
                makeRandomStiffness(n, options.stiffening, random));
    }
    body->provenance.source = "point masses";
    result.body = body;
    result.masses.assign(m.data(), m.data() + numNodes);
    return result;
}

}  // namespace simflex::test
