#include "Camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simflex {

using SimTK::Rotation;
using SimTK::UnitVec3;
using SimTK::Vec3;

double Camera::calcPixelSize(double distance, int height) const {
    return (isOrthographic ? viewHeight : 2 * std::tan(fieldOfView / 2) * distance) / height;
}

Vec3 Camera::calcPixel(const Vec3& p_G, int width, int height) const {
    const Vec3 p = toCamera(p_G);
    const double size = calcPixelSize(-p[2], height);
    return Vec3(0.5 * width + p[0] / size, 0.5 * height - p[1] / size, -p[2]);
}

std::array<float, 16> Camera::calcProjection(double aspect) const {
    const double depth = nearPlane - farPlane;
    std::array<float, 16> P{};
    if (isOrthographic) {
        P[0] = float(2 / (viewHeight * aspect));
        P[5] = float(2 / viewHeight);
        P[10] = float(2 / depth);
        P[14] = float((farPlane + nearPlane) / depth);
        P[15] = 1;
        return P;
    }
    const double f = 1 / std::tan(fieldOfView / 2);
    P[0] = float(f / aspect);
    P[5] = float(f);
    P[10] = float((farPlane + nearPlane) / depth);
    P[11] = -1;
    P[14] = float(2 * farPlane * nearPlane / depth);
    return P;
}

void Camera::fit(const std::vector<Vec3>& points_G, double aspect, const Margins& margins,
                 double zoom) {
    if (points_G.empty()) return;
    const double none = -SimTK::Infinity;
    Vec3 lower(SimTK::Infinity), upper(none);  // in the camera's axes
    for (const Vec3& point : points_G) {
        const Vec3 p = ~X_GC.R() * point;
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k]);
            upper[k] = std::max(upper[k], p[k]);
        }
    }
    const Vec3 extent = upper - lower;
    if (isOrthographic) {
        viewHeight = std::max(extent[0] / (aspect * (1 - margins.left - margins.right)),
                              extent[1] / (1 - margins.top - margins.bottom));
        if (!(viewHeight > 0)) viewHeight = std::max(1.0, extent[2]);  // a single point
        // Centre the points between the margins.
        const double x = 0.5 * (lower[0] + upper[0]) +
                         0.5 * (margins.right - margins.left) * viewHeight * aspect;
        const double y =
            0.5 * (lower[1] + upper[1]) + 0.5 * (margins.top - margins.bottom) * viewHeight;
        const double distance = 2 * (viewHeight + extent[2]);
        viewHeight /= zoom;
        X_GC.updP() = X_GC.R() * Vec3(x, y, upper[2] + distance);
        return;
    }

    // Tangents of the free half angles on each side.
    const double tanV = std::tan(fieldOfView / 2), tanH = tanV * aspect;
    const double left = tanH * (1 - 2 * margins.left), right = tanH * (1 - 2 * margins.right);
    const double bottom = tanV * (1 - 2 * margins.bottom), top = tanV * (1 - 2 * margins.top);

    // A point p is inside if p_x − c_x ≤ right (c_z − p_z), and likewise for each side.
    double a = none, b = none, c = none, d = none;
    for (const Vec3& point : points_G) {
        const Vec3 p = ~X_GC.R() * point;
        a = std::max(a, p[0] + right * p[2]);
        b = std::max(b, -p[0] + left * p[2]);
        c = std::max(c, p[1] + top * p[2]);
        d = std::max(d, -p[1] + bottom * p[2]);
    }
    double z = std::max((a + b) / (left + right), (c + d) / (top + bottom));
    const double nearest = upper[2], size = extent.norm();
    if (z - nearest < 1e-6 * size || !(size > 0)) z = nearest + (size > 0 ? size : 1);
    const double x = 0.5 * ((a - right * z) + (left * z - b));
    const double y = 0.5 * ((c - top * z) + (bottom * z - d));
    const double middle = 0.5 * (lower[2] + upper[2]);
    X_GC.updP() = X_GC.R() * Vec3(x, y, middle + (z - middle) / zoom);
}

void Camera::fitClippingPlanes(const std::vector<Vec3>& points_G) {
    double nearest = SimTK::Infinity, farthest = 0;
    for (const Vec3& point : points_G) {
        const double distance = -toCamera(point)[2];
        nearest = std::min(nearest, distance);
        farthest = std::max(farthest, distance);
    }
    if (!(farthest > 0)) {
        nearest = 0.1;
        farthest = 10;
    }
    farPlane = 1.05 * farthest;
    nearPlane = std::max(0.9 * nearest, 2e-4 * farPlane);
}

void Camera::pointAt(const Vec3& point_G, const Vec3& up_G) {
    const Vec3 back = X_GC.p() - point_G;
    if (!(back.norm() > 0))
        throw std::invalid_argument("pointCameraAt: the point is where the camera is");
    const UnitVec3 z(back);
    Vec3 up = up_G - SimTK::dot(up_G, Vec3(z)) * Vec3(z);
    if (!(up.norm() > 1e-9 * up_G.norm())) up = Vec3(z.perp());
    X_GC.updR() = Rotation(z, SimTK::ZAxis, up, SimTK::YAxis);
}

Rotation calcViewRotation(const UnitVec3& up, const UnitVec3& front, double azimuth,
                          double elevation) {
    const Vec3 upward(up), forward(front), right = SimTK::cross(upward, forward);
    const Vec3 level = std::cos(azimuth) * forward + std::sin(azimuth) * right;
    const Vec3 back = std::cos(elevation) * level + std::sin(elevation) * upward;
    const Vec3 top = std::cos(elevation) * upward - std::sin(elevation) * level;
    return Rotation(UnitVec3(back), SimTK::ZAxis, top, SimTK::YAxis);
}

}  // namespace simflex
