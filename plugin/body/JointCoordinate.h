#pragma once
/** @file
One coordinate of a frame M in a frame F that joints leave free or couple:

- Displacement: `f·(p_M − p_F)` with axis `sine[0]` of F [m];
- Angle: `atan2(f·m, f'·m')` with axes (F, M) `sine` and `cosine`, in (−π, π] [rad];
- ScrewAngle: an Angle on the turn nearest to z/pitch, z along F's z axis, and thus unbounded. **/

#include "simflex/body/FrameMotion.h"

namespace simflex {

struct JointCoordinate {
    enum class Kind { Displacement, Angle, ScrewAngle };

    Kind kind = Kind::Displacement;
    int sine[2] = {0, 0}, cosine[2] = {0, 0};
    SimTK::Real pitch = 0;  ///< [m/rad]

    static constexpr JointCoordinate makeDisplacement(int axis) {
        return {Kind::Displacement, {axis, axis}};
    }
    /** Angle of M's x axis about F's z axis. **/
    static constexpr JointCoordinate makeAngleAboutZ() { return {Kind::Angle, {1, 0}, {0, 0}}; }

    bool isAngle() const { return kind != Kind::Displacement; }
    /** Returns whether the value repeats after a turn. **/
    bool isPeriodic() const { return kind == Kind::Angle; }

    bool operator==(const JointCoordinate& other) const {
        return kind == other.kind && sine[0] == other.sine[0] && sine[1] == other.sine[1] &&
               cosine[0] == other.cosine[0] && cosine[1] == other.cosine[1] && pitch == other.pitch;
    }

    SimTK::Real calcValue(const SimTK::Transform& F, const SimTK::Transform& M) const;
    /** Returns value, rate and acceleration. **/
    SimTK::Vec3 calcMotion(const FrameMotion& F, const FrameMotion& M) const;
    /** Computes the coefficients of the frames' (ω, v) in the coordinate's rate, in Ground. **/
    void calcGradient(const SimTK::Transform& F, const SimTK::Transform& M, SimTK::SpatialVec& D_F,
                      SimTK::SpatialVec& D_M) const;
};

}  // namespace simflex
