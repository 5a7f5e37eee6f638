#pragma once
/** @file
Motions of little stiffness along a path of equilibria, and where it passes zero (private header).

    K x + Gᵀν = κ M x,   G x = 0,   xᵀM x = 1

with κ next to zero. They are the largest of θ = 1/κ, on both sides, of x ← A⁻¹M x along the joints:
block Lanczos with all of M's inner products, so that a multiple κ, as of a column that may bend in
two planes, is found as often as it is there. Between two places of the path κ is Hermite's cubic of
its values and slopes. What that cubic cannot be trusted to say is reported as unknown: a shorter
step tells. **/

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

namespace simflex {

struct CriticalMotion {
    double stiffness = 0;   ///< κ [1/s²]
    double slope = 0;       ///< of κ along the path
    Eigen::VectorXd x;      ///< speeds
    Eigen::VectorXd inert;  ///< M x
};

using ApplyToSpeeds = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/** The few of least |κ|.
@param multiplyMass  M x
@param invert  A⁻¹f along the joints
@param scale  of the speeds; zero where they are held **/
std::vector<CriticalMotion> calcCriticalMotions(const Eigen::VectorXd& scale,
                                                const ApplyToSpeeds& multiplyMass,
                                                const ApplyToSpeeds& invert);

/** The one that is most like `motion`, if any is. **/
const CriticalMotion* findSameMotion(const CriticalMotion& motion,
                                     const std::vector<CriticalMotion>& among);

/** A motion that gains (−1) or loses (+1) stability on the way from one place to another. **/
struct StabilityChange {
    CriticalMotion start, end;
    double at;  ///< about where, from 0 to the width
    int getSign() const { return start.stiffness > 0 ? 1 : -1; }
};

/** All on a way of this width. Empty: it is not known; also if their signs do not add up to
`change`, by which the number of negative κ differs. **/
std::optional<std::vector<StabilityChange>> findStabilityChanges(
    const std::vector<CriticalMotion>& start, const std::vector<CriticalMotion>& end, double width,
    int change);

/** The zero between those two of the samples (place, value) that are next to each other and differ
in sign, by the parabola through them and one not far from them. @pre there are such two
@param first  set to the index of the first of the two, in the order of places
@param weights  set to those of all samples in anything smooth at that place **/
double interpolateZero(const std::vector<std::pair<double, double>>& sorted, size_t& first,
                       std::vector<double>& weights);

}  // namespace simflex
