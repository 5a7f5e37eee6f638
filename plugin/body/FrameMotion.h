#pragma once
/** @file
Position, velocity and acceleration of a frame measured and expressed in Ground. **/

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"

namespace simflex {

struct FrameMotion {
    SimTK::Transform X;  ///< pose of the frame in Ground
    SimTK::SpatialVec V{SimTK::Vec3(0),
                        SimTK::Vec3(0)};  ///< (ω, v) of the frame's origin [rad/s, m/s]
    SimTK::SpatialVec A{SimTK::Vec3(0),
                        SimTK::Vec3(0)};  ///< (α, a) of the frame's origin [rad/s², m/s²]
};

/** Returns the motion of a frame fixed at X_BF on a rigid body. **/
inline FrameMotion shiftMotion(const FrameMotion& body, const SimTK::Transform& X_BF) {
    using SimTK::Vec3;
    FrameMotion frame;
    frame.X = body.X * X_BF;
    const Vec3 r = frame.X.p() - body.X.p();
    const Vec3 &omega = body.V[0], &alpha = body.A[0];
    frame.V = {omega, body.V[1] + omega % r};
    frame.A = {alpha, body.A[1] + alpha % r + omega % (omega % r)};
    return frame;
}

}  // namespace simflex
