#pragma once
/** @file
Takes the rigid motions out of a mode basis and makes it orthonormal. Internal to reduction. **/

#include "CraigBampton.h"

namespace simflex {

/** The six rigid motions about the centre of mass. **/
struct RigidMotion {
    double mass = 0;
    Eigen::Vector3d center;   ///< deck coordinates [m]
    Eigen::Matrix3d inertia;  ///< about the centre of mass, with the FE mass matrix [kg m²]
    Shapes R;                 ///< numDofs×6: translations, rotations about the centre of mass
};

RigidMotion calcRigidMotions(const FeModel& model, const FeProducts& products);

/** X ← X − R (RᵀMR)⁻¹ RᵀM X, twice, for round-off. @returns the coefficients taken out, 6×k. **/
Eigen::MatrixXd removeRigidMotion(const RigidMotion& rigid, const FeProducts& products, Shapes& X);

/** Orthonormal modes of the mean-axis frame. **/
struct MeanAxisModes {
    Shapes Phi;                    ///< numDofs×n_f
    Shapes boundary;               ///< numBoundaryDofs×n_f
    Eigen::VectorXd omegaSquared;  ///< n_f, ascending
};

/** Solves the pencil of `basis`, drops its six zeros, projects the rest off the rigid motions and
makes it orthonormal again: ΦᵀMΦ = 1, ΦᵀKΦ = Ω², RᵀMΦ = 0. The sign of a mode is that which makes
its first (nearly) largest displacement positive.
@param masters  deck coordinates of the interface masters, 3×interfaces.
@throws std::invalid_argument if the pencil has other than six zeros. **/
MeanAxisModes calcMeanAxisModes(const std::string& part, const FeProducts& products,
                                const RigidMotion& rigid, const Eigen::Matrix3Xd& masters,
                                const ModeBasis& basis);

}  // namespace simflex
