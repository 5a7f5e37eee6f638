#include "ElasticLaw.h"

#include <cmath>

#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

Vec3d across(const Vec3d& a, const Vec3d& unit) {
    return minus(a, scaled(unit, dot(a, unit)));
}

Axes toAxes(const Vec3d& e1, const Vec3d& e2, const Vec3d& e3) {
    Axes axes;
    for (size_t i = 0; i < 3; ++i) axes[i] = {e1[i], e2[i], e3[i]};
    return axes;
}

}  // namespace

Orientation::Orientation(const Vec3d& e1, const Vec3d& e2, const Vec3d& e3)
    : m_axes(toAxes(e1, e2, e3)) {}

Orientation Orientation::makeCylindrical(const Vec3d& a, const Vec3d& b) {
    Orientation orientation;
    orientation.m_isCylindrical = true;
    orientation.m_a = a;
    orientation.m_b = b;
    return orientation;
}

Axes Orientation::calcAxes(const Vec3d& point) const {
    if (!m_isCylindrical) return m_axes;
    constexpr double OnAxis = 1e-10;
    const Vec3d line = minus(m_b, m_a), e3 = scaled(line, 1 / normOf(line));
    Vec3d radial = across(minus(point, m_a), e3);
    if (normOf(radial) < OnAxis)  // any direction is valid
        radial = across(std::abs(e3[0]) > 0.5 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, e3);
    const Vec3d e1 = scaled(radial, 1 / normOf(radial));
    return toAxes(e1, cross(e3, e1), e3);
}

ElasticMatrix turnElasticLaw(const ElasticMatrix& D, const Axes& axes) {
    double T[6][6];  // transforms strain from the deck's axes to the local ones
    for (size_t k = 0; k < 6; ++k)
        for (size_t l = 0; l < 6; ++l) {
            const auto [a, b] = TensorPairs[k];
            const auto [i, j] = TensorPairs[l];
            const auto entry = [&](int row, int column) {
                return axes[size_t(row)][size_t(column)];
            };
            T[k][l] = entry(i, a) * entry(j, b) + (i != j ? entry(j, a) * entry(i, b) : 0);
            if (k < 3 && l >= 3) T[k][l] /= 2;
            if (k >= 3 && l < 3) T[k][l] *= 2;
        }
    ElasticMatrix DT{}, turned{};
    for (size_t k = 0; k < 6; ++k)
        for (size_t l = 0; l < 6; ++l)
            for (size_t j = 0; j < 6; ++j) DT[k][j] += D[k][l] * T[l][j];
    for (size_t i = 0; i < 6; ++i)
        for (size_t k = 0; k < 6; ++k)
            for (size_t j = 0; j < 6; ++j) turned[i][j] += T[k][i] * DT[k][j];
    return turned;
}

}  // namespace simflex
