#include "simflex/solver/equations/Block.h"

#include <cmath>

namespace simflex {

using Eigen::Vector3d;
using Eigen::Vector4d;

Vector4d multiplyQuaternion(const Vector4d& q, const Vector3d& omega, bool inBody) {
    const Vector3d v = q.tail<3>();
    Vector4d product;
    product[0] = -v.dot(omega);
    product.tail<3>() =
        q[0] * omega + (inBody ? Vector3d(v.cross(omega)) : Vector3d(omega.cross(v)));
    return product;
}

Vector4d integrateQuaternion(const Vector4d& qHist, double gamma, const Vector3d& omega,
                             bool inBody) {
    const double a = 0.5 * gamma;
    return (qHist + a * multiplyQuaternion(qHist, omega, inBody)) /
           (1 + a * a * omega.squaredNorm());
}

Vector4d displaceQuaternion(const Vector4d& q, const Vector3d& delta, bool inBody) {
    const double angle = delta.norm();
    const double half = 0.5 * angle;
    const double factor = angle > 1e-8 ? std::sin(half) / angle : 0.5;
    return (std::cos(half) * q + factor * multiplyQuaternion(q, delta, inBody)).normalized();
}

void alignQuaternion(const double* reference, double* q) {
    Eigen::Map<Vector4d> quaternion(q);
    if (quaternion.dot(Eigen::Map<const Vector4d>(reference)) < 0) quaternion = -quaternion;
}

SimTK::Rotation rotationOf(const double* q) {
    return SimTK::Rotation(SimTK::Quaternion(SimTK::Vec4(q[0], q[1], q[2], q[3])));
}

}  // namespace simflex
