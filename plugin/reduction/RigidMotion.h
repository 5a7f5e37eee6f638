#pragma once
/** @file
The rigid motions of a part about its centre of mass. Internal to reduction. **/

#include <Eigen/Dense>
#include <string>

#include "SymmetricProduct.h"

namespace simflex {

/** Velocity of position `arm` for the six rigid motions about the origin: [1₃, −arm×], 3×6. **/
Eigen::Matrix<double, 3, 6> calcRigidMotion(const Eigen::Vector3d& arm);

/** The six rigid motions about the centre of mass. **/
struct RigidMotion {
    double mass = 0;
    Eigen::Vector3d center;   ///< deck coordinates [m]
    Eigen::Matrix3d inertia;  ///< about the centre of mass, with the FE mass matrix [kg m²]
    Shapes R;                 ///< numDofs×6: translations, rotations about the centre of mass
};

RigidMotion calcRigidMotions(const FeModel& model, const FeProducts& products);

/** Why a thin part's own bending may look as if nothing resisted it: words to end a message with.
Nothing for other parts. **/
std::string describeSlenderness(const RigidMotion& rigid);

/** X ← X − R (RᵀMR)⁻¹ RᵀM X, twice, for round-off. @returns the coefficients taken out, 6×k. **/
Eigen::MatrixXd removeRigidMotion(const RigidMotion& rigid, const FeProducts& products, Shapes& X);

/** XᵀY where that is symmetric, made exactly so. **/
Eigen::MatrixXd symmetricGram(const Shapes& X, const Shapes& Y);

}  // namespace simflex
