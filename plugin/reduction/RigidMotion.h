#pragma once
/** @file
The rigid motions of a part about its centre of mass. Internal to reduction. **/

#include <Eigen/Dense>
#include <string>

#include "SymmetricProduct.h"

namespace simflex {

/** Returns the velocity at position `arm` of the six unit rigid motions about the origin: [1₃,
−arm×], 3×6. **/
Eigen::Matrix<double, 3, 6> calcRigidMotion(const Eigen::Vector3d& arm);

/** The six rigid motions about the centre of mass. **/
struct RigidMotion {
    double mass = 0;
    Eigen::Vector3d center;   ///< deck coordinates [m]
    Eigen::Matrix3d inertia;  ///< about the centre of mass, with the FE mass matrix [kg m²]
    Shapes R;                 ///< numDofs×6: translations, rotations about the centre of mass
};

RigidMotion calcRigidMotions(const FeModel& model, const FeProducts& products);

/** Explains why the bending stiffness of a thin part may vanish in round-off, as the end of a
message; "" for other parts. **/
std::string describeSlenderness(const RigidMotion& rigid);

/** X ← X − R (RᵀMR)⁻¹ RᵀM X, twice because of round-off. @returns the coefficients removed,
6×k. **/
Eigen::MatrixXd removeRigidMotion(const RigidMotion& rigid, const FeProducts& products, Shapes& X);

/** Returns XᵀY, symmetric except for round-off, made exactly symmetric. **/
Eigen::MatrixXd symmetricGram(const Shapes& X, const Shapes& Y);

}  // namespace simflex
