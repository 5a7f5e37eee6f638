#include "simflex/part/PartColumns.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace simflex {

using ::Eigen::Map;
using ::Eigen::MatrixXd;
using ::Eigen::Vector3d;
using ::Eigen::VectorXd;

namespace {

Vector3d getPosition(const ReducedBody::Interface& interface) {
    return Map<const Vector3d>(interface.position.data());
}

Map<const MatrixXd> getPhi(const ReducedBody::Interface& interface, int numModes) {
    return {interface.Phi.data(), 3, numModes};
}

/** Returns the force rows of F per mode, 3k×n_f, see PartColumns.h. **/
MatrixXd calcForces(const ReducedBody& part) {
    // Relative to the largest compliance; stiffer directions count as rigid. Otherwise the effect
    // of other loads on modes would appear as large, nearly cancelling forces.
    constexpr double Resolved = 1e-10, ResolvedOfRest = 1e-6;
    const int n = part.numModes;
    const auto k = ::Eigen::Index(part.interfaces.size());
    const double radius = part.calcRadius();
    MatrixXd B(6 * k, n), rigid = MatrixXd::Zero(6 * k, 6);
    for (::Eigen::Index i = 0; i < k; ++i) {
        const ReducedBody::Interface& interface = part.interfaces[size_t(i)];
        B.middleRows(3 * i, 3) = getPhi(interface, n);
        B.middleRows(3 * (k + i), 3) =
            radius * Map<const MatrixXd>(interface.Psi.data(), 3, n);  // moments divided by the
                                                                       // radius
        rigid.block<3, 3>(3 * i, 0).setIdentity();
        rigid.block<3, 3>(3 * (k + i), 3).setIdentity();
        for (int a = 0; a < 3; ++a)
            rigid.block<3, 1>(3 * i, 3 + a) =
                Vector3d::Unit(a).cross(getPosition(interface)) / radius;
    }
    const VectorXd flexibility = Map<const VectorXd>(part.omegaSquared.data(), n).cwiseInverse();
    const auto solve = [&](const MatrixXd& Z, double resolved) -> MatrixXd {
        const MatrixXd displacements = Z.transpose() * B;
        const ::Eigen::SelfAdjointEigenSolver<MatrixXd> compliance(
            displacements * flexibility.asDiagonal() * displacements.transpose());
        const VectorXd& values = compliance.eigenvalues();
        VectorXd inverse = VectorXd::Zero(values.size());
        for (::Eigen::Index i = 0; i < values.size(); ++i)
            if (values[i] > resolved * values[values.size() - 1]) inverse[i] = 1 / values[i];
        const MatrixXd& vectors = compliance.eigenvectors();
        return Z * (vectors * (inverse.asDiagonal() * (vectors.transpose() * displacements)));
    };
    MatrixXd balanced = MatrixXd::Zero(6 * k, n);
    if (k > 1)
        balanced = solve(
            MatrixXd(::Eigen::HouseholderQR<MatrixXd>(rigid).householderQ()).rightCols(6 * k - 6),
            Resolved);
    const MatrixXd all = solve(MatrixXd::Identity(6 * k, 6 * k), ResolvedOfRest);
    const MatrixXd forces =
        balanced + all - (all * flexibility.asDiagonal()) * (B.transpose() * balanced);
    return forces.topRows(3 * k);
}

}  // namespace

PartColumns::PartColumns(const ReducedBody& part) : m_part(part) {
    constexpr double Nearest = 1e-3;  // relative to the part's radius; closer interfaces count as
                                      // one
    if (part.interfaces.empty() || part.numModes == 0) return;
    const int n = part.numModes;
    const double least = Nearest * part.calcRadius();
    const MatrixXd forces = calcForces(part);
    for (int b = 0; b < int(part.interfaces.size()); ++b)
        for (int a = 0; a < b; ++a) {
            const ReducedBody::Interface& from = part.interfaces[size_t(a)];
            const ReducedBody::Interface& to = part.interfaces[size_t(b)];
            const Vector3d way = getPosition(to) - getPosition(from), d = way.normalized();
            if (!(way.norm() > least)) continue;
            m_columns.push_back(
                {a, b, d, way.norm(), (getPhi(from, n) - getPhi(to, n)).transpose() * d,
                 0.5 * (forces.middleRows(3 * a, 3) - forces.middleRows(3 * b, 3)).transpose() *
                     d});
        }
    if (part.interfaces.size() == 1 && getPosition(part.interfaces[0]).norm() > least)
        addFreeColumn(forces);
}

void PartColumns::addFreeColumn(const MatrixXd& forces) {
    const Vector3d start = getPosition(m_part.interfaces[0]), d = -start.normalized();
    double length = 0;
    for (size_t k = 0; k + 2 < m_part.mesh.positions.size(); k += 3)
        length =
            std::max(length, d.dot(Map<const Vector3d>(m_part.mesh.positions.data() + k) - start));
    const Axis axis = makeAxis(0, -1, d, length);
    if (axis.places.size() < 2) return;
    m_columns.push_back({0, -1, d, length,
                         (axis.displacements.front() - axis.displacements.back()).transpose() * d,
                         forces.transpose() * d});
}

PartColumns::Loads PartColumns::findLargest(const double* xi) {
    constexpr double Noticed = 1e-7;  // relative shortening; no slender part buckles at less
    const Map<const VectorXd> at(xi, m_part.numModes);
    Loads largest;
    for (Column& column : m_columns) {
        const double shortening = column.shortening.dot(at), force = column.force.dot(at);
        if (!(std::abs(shortening) > Noticed * column.length) || !(force * shortening > 0))
            continue;
        if (column.critical < 0) column.critical = calcCriticalLoad(column);
        const double share = std::abs(force) / column.critical;
        Load& load = force > 0 ? largest.compression : largest.tension;
        if (share > load.share) load = {column.from, column.to, std::abs(force), share};
    }
    return largest;
}

PartColumns::Axis PartColumns::makeAxis(int from, int to, const Vector3d& d, double length) const {
    constexpr int NumSlices = 24;
    const int n = m_part.numModes;
    const Vector3d start = getPosition(m_part.interfaces[size_t(from)]);
    // The ends' displacements and the means of the slices between them; a free end is the last
    // slice.
    std::vector<int> slices(m_part.mesh.positions.size() / 3, -1);
    std::vector<double> places(NumSlices, 0.0), counts(NumSlices, 0.0);
    for (size_t k = 0; k < slices.size(); ++k) {
        const double x = d.dot(Map<const Vector3d>(m_part.mesh.positions.data() + 3 * k) - start);
        if (!(x > 0 && (x < length || to < 0))) continue;
        const int slice = std::min(int(NumSlices * x / length), NumSlices - 1);
        slices[k] = slice;
        places[size_t(slice)] += x;
        counts[size_t(slice)] += 1;
    }
    MatrixXd sums = MatrixXd::Zero(3 * NumSlices, n);
    for (int i = 0; i < n; ++i) {
        const double* const phi = m_part.Phi.data() + size_t(i) * 3 * slices.size();
        for (size_t k = 0; k < slices.size(); ++k)
            if (slices[k] >= 0)
                sums.col(i).segment<3>(3 * slices[k]) += Map<const Vector3d>(phi + 3 * k);
    }
    Axis axis{{0}, {getPhi(m_part.interfaces[size_t(from)], n)}};
    for (int s = 0; s < NumSlices; ++s) {
        if (counts[size_t(s)] == 0) continue;
        axis.places.push_back(places[size_t(s)] / counts[size_t(s)]);
        axis.displacements.push_back(sums.middleRows(3 * s, 3) / counts[size_t(s)]);
    }
    if (to >= 0) {
        axis.places.push_back(length);
        axis.displacements.push_back(getPhi(m_part.interfaces[size_t(to)], n));
    }
    return axis;
}

double PartColumns::calcCriticalLoad(const Column& column) const {
    const int n = m_part.numModes;
    const Vector3d& d = column.direction;
    const Axis axis = makeAxis(column.from, column.to, d, column.length);
    MatrixXd chord(3, n);  // slopes of the straight chord
    if (column.to >= 0) {
        chord = (axis.displacements.back() - axis.displacements.front()) / column.length;
    } else {
        const Map<const MatrixXd> rotation(m_part.interfaces[size_t(column.from)].Psi.data(), 3, n);
        for (int i = 0; i < n; ++i) chord.col(i) = Vector3d(rotation.col(i)).cross(d);
    }
    // Slopes relative to the chord, across d, times √(N dx)/Ω.
    const VectorXd flexibility =
        Map<const VectorXd>(m_part.omegaSquared.data(), n).cwiseSqrt().cwiseInverse();
    const ::Eigen::Matrix3d across = ::Eigen::Matrix3d::Identity() - d * d.transpose();
    MatrixXd slopes(3 * ::Eigen::Index(axis.places.size() - 1), n);
    for (size_t k = 1; k < axis.places.size(); ++k) {
        const double dx = axis.places[k] - axis.places[k - 1],
                     middle = 0.5 * (axis.places[k] + axis.places[k - 1]),
                     force = column.to >= 0 ? 1 : std::max(0.0, 1 - middle / column.length);
        slopes.middleRows(3 * ::Eigen::Index(k - 1), 3) =
            std::sqrt(force * dx) * across *
            ((axis.displacements[k] - axis.displacements[k - 1]) / dx - chord) *
            flexibility.asDiagonal();
    }
    const double largest = ::Eigen::SelfAdjointEigenSolver<MatrixXd>(slopes * slopes.transpose(),
                                                                     ::Eigen::EigenvaluesOnly)
                               .eigenvalues()
                               .maxCoeff();
    return largest > 0 ? 1 / largest : std::numeric_limits<double>::infinity();
}

}  // namespace simflex
