#pragma once
/** @file
Motions of small stiffness along a path of equilibria, and zeros of the stiffness (private header).

    K x + Gᵀν = κ M x,   G x = 0,   xᵀM x = 1

with κ next to zero: the largest θ = 1/κ, of both signs, of x ← A⁻¹M x on the null space of G, by
block Lanczos iteration with full M-orthogonalisation, so that multiple κ, as of a column that may
buckle in two planes, are found with their multiplicity. Between two points of the path κ is the
Hermite cubic of its values and slopes. Cases that this cubic does not decide reliably are reported
as unknown, and need a shorter step. **/

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

/** Returns the few of least |κ|.
@param multiplyMass  M x
@param invert  A⁻¹f on the null space of G
@param scale  of the speeds; zero where they are held **/
std::vector<CriticalMotion> calcCriticalMotions(const Eigen::VectorXd& scale,
                                                const ApplyToSpeeds& multiplyMass,
                                                const ApplyToSpeeds& invert);

/** Returns the motion most similar to `motion`, or null if none is similar. **/
const CriticalMotion* findSameMotion(const CriticalMotion& motion,
                                     const std::vector<CriticalMotion>& among);

/** A motion that gains (−1) or loses (+1) stability between two points. **/
struct StabilityChange {
    CriticalMotion start, end;
    double at;  ///< approximate position, from 0 to the width
    int getSign() const { return start.stiffness > 0 ? 1 : -1; }
};

/** Finds all changes over this width. Empty if unknown, also if their signs do not add up to
`change`, the difference of the numbers of negative κ. **/
std::optional<std::vector<StabilityChange>> findStabilityChanges(
    const std::vector<CriticalMotion>& start, const std::vector<CriticalMotion>& end, double width,
    int change);

/** Locates a zero between two neighbouring samples (position, value) of different sign, by the
parabola through them and a third one nearby. @pre there are two such samples
@param first  receives the index of the first of the two, in the order of positions
@param weights  receives the samples' weights for interpolating any smooth quantity there **/
double interpolateZero(const std::vector<std::pair<double, double>>& sorted, size_t& first,
                       std::vector<double>& weights);

}  // namespace simflex
