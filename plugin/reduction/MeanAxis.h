#pragma once
/** @file
Takes the rigid motions out of a mode basis and makes it orthonormal. Internal to reduction. **/

#include "CraigBampton.h"

namespace simflex {

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
