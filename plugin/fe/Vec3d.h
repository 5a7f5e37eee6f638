#pragma once
/** @file
Vectors of three numbers, as stored in meshes. Internal to fe. **/

#include <array>
#include <cmath>

namespace simflex {

using Vec3d = std::array<double, 3>;

inline double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline double normOf(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec3d minus(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3d scaled(const Vec3d& a, double factor) {
    return {a[0] * factor, a[1] * factor, a[2] * factor};
}
/** a + factor·b **/
inline Vec3d sumOf(const Vec3d& a, double factor, const Vec3d& b) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

/** Row and column of each component of a symmetric tensor: xx, yy, zz, xy, xz, yz. **/
constexpr int TensorPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

}  // namespace simflex
