#pragma once
/** @file
Takes the rigid motions out of a mode basis and makes it orthonormal. Internal to reduction. **/

#include <stdexcept>

#include "CraigBampton.h"

namespace simflex {

/** A seventh motion that nothing resists. **/
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

/** Puts the six rigid motions in the place of the first six shapes of `basis`, projects the others
off them and makes these orthonormal, twice: ΦᵀMΦ = 1, ΦᵀKΦ = Ω², RᵀMΦ = 0. The sign of a mode is
that which makes its first (nearly) largest displacement positive.
@param masters  deck coordinates of the interface masters, 3×interfaces.
@throws LoosePieces if there is a seventh motion that nothing resists: less than what round-off in
    K can make of its shape
@throws std::invalid_argument if the reduced mass matrix is singular. **/
MeanAxisModes calcMeanAxisModes(const std::string& part, const FeProducts& products,
                                const RigidMotion& rigid, const Eigen::Matrix3Xd& masters,
                                const ModeBasis& basis);

}  // namespace simflex
