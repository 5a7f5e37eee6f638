#pragma once
/** @file
Removes the rigid motions from a mode basis and orthonormalises it. Internal to reduction. **/

#include <stdexcept>

#include "CraigBampton.h"

namespace simflex {

/** Thrown if there is a seventh motion without stiffness. **/
class LoosePieces : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/** Orthonormal modes of the mean-axis frame. **/
struct MeanAxisModes {
    Shapes Phi;                    ///< numDofs×n_f
    Shapes boundary;               ///< numBoundaryDofs×n_f
    Eigen::VectorXd omegaSquared;  ///< n_f, ascending
};

/** Replaces the first six shapes of `basis` by the rigid motions, projects the others off them and
orthonormalises these, twice: ΦᵀMΦ = 1, ΦᵀKΦ = Ω², RᵀMΦ = 0. The sign of a mode makes its first
(nearly) largest displacement positive.
@param masters  deck coordinates of the interface masters, 3×interfaces.
@throws LoosePieces if a seventh motion has no stiffness beyond the round-off of K
@throws std::invalid_argument if the reduced mass matrix is singular. **/
MeanAxisModes calcMeanAxisModes(const std::string& part, const FeProducts& products,
                                const RigidMotion& rigid, const Eigen::Matrix3Xd& masters,
                                const ModeBasis& basis);

}  // namespace simflex
