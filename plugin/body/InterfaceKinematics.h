#pragma once
/** @file
Motion of a frame A on a flexible body, from the motion of the body frame B and the modal
coordinates ξ:

    translation  r = s + Φξ + ρ,  ρ = exp(Ψξ) p_IA       R_BA = exp(Ψξ) R_IA
    velocity     ω_A = R(ω + EΨξ̇),   v_A = v + R(ω×r + Φξ̇ + (EΨξ̇)×ρ)

with E the left Jacobian of the exponential, `d/dt exp(θ) = [Eθ̇]× exp(θ)`. ω is expressed in B, v
in Ground.

On interfaces of a body with geometric stiffening, displacement and rotation vector are of second
order, Φξ + ½ξᵀHξ and likewise for Ψ. Rates and forces then use the tangent shapes Φ + Hξ, and
accelerations have the additional term ξ̇ᵀHξ̇: see calcTangentShapes().

A `FlexibleFrame` is constant; `FlexibleFramePose` is the result of one evaluation. **/

#include <memory>
#include <vector>

#include "simflex/body/FrameMotion.h"

namespace simflex {

/** Shapes of an interface or node of a part, shared by all frames on it. **/
struct FrameShapes {
    SimTK::Vec3 s{0};             ///< undeformed position from the centre of mass, in B [m]
    std::vector<double> columns;  ///< n_f×6: translations x, y, z, then rotations, by mode
    /** H of the six columns one after another, each n_f×n_f and symmetric, for geometric
    stiffening. Empty: no data. **/
    std::vector<double> curvature;

    /** @param Phi, Psi  3×n_f translation and rotation shapes, column-major **/
    static std::shared_ptr<const FrameShapes> make(const SimTK::Vec3& s,
                                                   const std::vector<double>& Phi,
                                                   const std::vector<double>& Psi,
                                                   std::vector<double> curvature = {});
    int numModes() const { return int(columns.size() / 6); }
};

/** Displacement Φξ and rotation Ψξ of a frame's seat, or their rates. **/
struct FrameSums {
    SimTK::Vec3 translation{0}, rotation{0};
};

/** Constant data of a frame on a flexible part. **/
struct FlexibleFrame {
    std::shared_ptr<const FrameShapes> shapes;
    SimTK::Transform X_IA;  ///< pose of frame A in the interface frame
    int numModes() const { return shapes->numModes(); }
};

/** Pose of B in Ground and its speeds (in the solver's convention: ω in B). **/
struct BodyFrame {
    SimTK::Rotation R_GB;
    SimTK::Vec3 p_GB{0}, omega_B{0}, v_G{0};
};

/** Position-level quantities of a frame on a flexible body, all in B. **/
struct FlexibleFramePose {
    SimTK::Vec3 r{0}, rho{0};  ///< from B's origin to A; from the interface to A
    SimTK::Vec3 theta{0};      ///< rotation vector Ψξ of the interface
    SimTK::Mat33 E;            ///< left Jacobian of the exponential at θ
    SimTK::Rotation R_BA;
};

/** Left Jacobian of the exponential map: E(θ) = 1 + b[θ]× + c[θ]×² with b = (1−cos θ)/θ² and c =
(θ−sin θ)/θ³. **/
SimTK::Mat33 calcLeftJacobian(const SimTK::Vec3& theta);

/** Returns the derivative of E along θ̇, applied to θ̇: Ė(θ, θ̇) θ̇. **/
SimTK::Vec3 calcLeftJacobianDotTimes(const SimTK::Vec3& theta, const SimTK::Vec3& thetaDot);

/** Returns the rotation exp([θ]×). **/
SimTK::Rotation calcExponential(const SimTK::Vec3& theta);

/** Returns Φ·coordinates and Ψ·coordinates. **/
FrameSums multiplyShapes(const FrameShapes& shapes, const double* coordinates);

/** Computes the tangent shapes of the frame at ξ, columns + Hξ. O(n_f²).
@param[in,out] tangent  already has the size of the columns
@returns the second-order displacement and rotation of the seat, Φξ + ½ξᵀHξ and Ψξ + ½ξᵀHξ. **/
FrameSums calcTangentShapes(const FrameShapes& shapes, const double* xi, FrameShapes& tangent);

/** Returns ξ̇ᵀHξ̇: the acceleration of the seat beyond tangent shapes times ξ̈. O(n_f²). **/
FrameSums calcCurvatureSums(const FrameShapes& shapes, const double* xiDot);

/** @param atXi  Φξ and Ψξ of the frame **/
FlexibleFramePose calcFramePose(const FlexibleFrame& frame, const FrameSums& atXi);
FlexibleFramePose calcFramePose(const FlexibleFrame& frame, const double* xi);

/** Returns pose and velocity of A in Ground; the acceleration is zero.
@param atXiDot  Φξ̇ and Ψξ̇ of the frame **/
FrameMotion calcFrameMotion(const FlexibleFramePose& pose, const BodyFrame& body,
                            const FrameSums& atXiDot);
FrameMotion calcFrameMotion(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                            const BodyFrame& body, const double* xiDot);

/** Returns the acceleration (α, a) of A in Ground for body accelerations ω̇ (in B), v̇ (in Ground)
and ξ̈. Zero accelerations give the bias. **/
SimTK::SpatialVec calcFrameAcceleration(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                                        const BodyFrame& body, const double* xiDot,
                                        const SimTK::Vec3& omegaDot_B, const SimTK::Vec3& vDot_G,
                                        const double* xiDotDot);

SimTK::SpatialVec calcFrameAcceleration(const FlexibleFramePose& pose, const BodyFrame& body,
                                        const FrameSums& atXiDot, const SimTK::Vec3& omegaDot_B,
                                        const SimTK::Vec3& vDot_G, const FrameSums& atXiDotDot);

/** Adds the generalized forces of a spatial force F_G = (torque, force) at A's origin:
@param[out] torque_B  added: torque on B about its origin, expressed in B
@param[out] force_G   added: force on B
@param[out] modal     added: n_f modal forces **/
void addInFrameForce(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                     const SimTK::Rotation& R_GB, const SimTK::SpatialVec& F_G,
                     SimTK::Vec3& torque_B, SimTK::Vec3& force_G, double* modal);

/** As addInFrameForce(), with the modal forces as coefficients of the frame's shapes: Φᵀtranslation
+ Ψᵀrotation.
@param[out] torque_B, force_G, translation, rotation  overwritten **/
void calcFrameForce(const FlexibleFramePose& pose, const SimTK::Rotation& R_GB,
                    const SimTK::SpatialVec& F_G, SimTK::Vec3& torque_B, SimTK::Vec3& force_G,
                    SimTK::Vec3& translation, SimTK::Vec3& rotation);

/** A frame of a flexible body at ξ, with displacements of either order. **/
class FrameAtXi {
public:
    enum class Order {
        First,  ///< Φξ
        Second  ///< Φξ + ½ξᵀHξ, if the frame has H
    };

    FrameAtXi(const FlexibleFrame& frame, const double* xi, Order order);

    const FlexibleFramePose& getPose() const { return m_pose; }
    /** Returns the frame with its tangent shapes, for rates and forces. **/
    const FlexibleFrame& getTangent() const { return m_tangent; }

    FrameMotion calcMotion(const BodyFrame& body, const double* xiDot) const;
    /** As calcFrameAcceleration(). **/
    SimTK::SpatialVec calcAcceleration(const BodyFrame& body, const double* xiDot,
                                       const SimTK::Vec3& omegaDot_B, const SimTK::Vec3& vDot_G,
                                       const double* xiDotDot) const;

private:
    FlexibleFrame m_tangent;
    FlexibleFramePose m_pose;
    std::shared_ptr<const FrameShapes> m_curved;  ///< null at first order
};

/** Maps a constraint row `d_ω·ω_A + d_v·v_A` of the frame to the generalized speeds [ω_B (3), v_G
(3), ξ̇ (n_f)] and adds it to `row`. **/
void addInConstraintRow(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                        const SimTK::Rotation& R_GB, const SimTK::SpatialVec& d, double* row);

}  // namespace simflex
