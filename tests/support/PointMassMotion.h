#pragma once
/** @file
Motion of a PointMassPart's masses, for sums that do not use modal invariants.

    location      p + R(s + Φξ)
    velocity      v + R(ω×r + Φξ̇)
    acceleration  v̇ + R(ω̇×r + ω×(ω×r) + 2ω×Φξ̇ + Φξ̈)

with r = s + Φξ; ω, ω̇ in B; p, v, v̇ in Ground. **/

#include <Eigen/Dense>
#include <random>

#include "support/PointMassPart.h"

namespace simflex::test {

struct PointMassMotion {
    /** At rest, undeformed, B on Ground. **/
    explicit PointMassMotion(int numModes);

    /** Returns a random motion: pose, velocities, |ξ̇| and |ξ̈| of order 1, |ξ| of order
    `deformation`. **/
    static PointMassMotion makeRandom(int numModes, unsigned seed, double deformation = 0.05);

    int numModes() const { return int(xi.size()); }

    Eigen::Matrix3d R_GB = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p_GB, omega_B, v_G, omegaDot_B, vDot_G;
    Eigen::VectorXd xi, xiDot, xiDotDot;
};

/** 3×(number of masses), in Ground. **/
Eigen::Matrix3Xd calcMassLocations(const PointMassPart& part, const PointMassMotion& motion);
Eigen::Matrix3Xd calcMassVelocities(const PointMassPart& part, const PointMassMotion& motion);
Eigen::Matrix3Xd calcMassAccelerations(const PointMassPart& part, const PointMassMotion& motion);

double calcKineticEnergy(const PointMassPart& part, const PointMassMotion& motion);
Eigen::Vector3d calcLinearMomentum(const PointMassPart& part, const PointMassMotion& motion);
/** About Ground's origin. **/
Eigen::Vector3d calcAngularMomentum(const PointMassPart& part, const PointMassMotion& motion);

/** Returns the virtual power Σm a·δv (d'Alembert) for each of the virtual velocities [ω_B (3), v_G
(3), ξ̇ (n_f)]. **/
Eigen::VectorXd calcInertiaForces(const PointMassPart& part, const PointMassMotion& motion);

/** Returns a vector of `size` random numbers between ±largest. **/
Eigen::VectorXd makeRandomVector(int size, double largest, std::mt19937& random);

}  // namespace simflex::test
