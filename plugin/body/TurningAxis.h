#pragma once
/** @file
Axes of moving frames and their products (private header). **/

#include "simflex/body/FrameMotion.h"

namespace simflex {

/** A vector that rotates with ω, and its first two derivatives. **/
struct TurningVector {
    SimTK::Vec3 value, rate, acceleration;
    TurningVector(const SimTK::Vec3& axis, const FrameMotion& frame)
        : value(axis),
          rate(frame.V[0] % axis),
          acceleration(frame.A[0] % axis + frame.V[0] % rate) {}
};

inline SimTK::Vec3 axisOf(const SimTK::Transform& frame, int axis) {
    return SimTK::Vec3(frame.R().col(axis));
}

inline TurningVector turningAxisOf(const FrameMotion& frame, int axis) {
    return {axisOf(frame.X, axis), frame};
}

/** Returns value, rate and acceleration of f·m. **/
inline SimTK::Vec3 calcDotProduct(const TurningVector& f, const TurningVector& m) {
    return {~f.value * m.value, ~f.rate * m.value + ~f.value * m.rate,
            ~f.acceleration * m.value + 2 * (~f.rate * m.rate) + ~f.value * m.acceleration};
}

}  // namespace simflex
