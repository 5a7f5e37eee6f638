#pragma once
/** @file
Slopes of functions that may have kinks, such as the force of a stop (private header). From samples
at −2h, −h, 0, h, 2h,

    slope = (f(−2h) − 8 f(−h) + 8 f(h) − f(2h)) / 12h

for the longest h = h₀/16^k at which the function is smooth and has the same slope as close to the
point. Third and fourth differences show a kink among the samples; two samples at h₀/32768 show one
between the point and the longest step, such as the gap of a stop. At a kink there is no slope: the
mean of both sides is used, and the kink is reported.

Round-off is estimated from the function's size and its change over the length of which h₀ is a
part, independent of units. Terms that cancel, such as inertial forces, leave round-off that may
shrink with the step and so cannot be distinguished from a slope, except by the change of the terms.
Six samples per column where functions are smooth. **/

#include <Eigen/Dense>
#include <functional>
#include <utility>
#include <vector>

namespace simflex {

// SimTK declares a class Eigen, which makes the name ambiguous for clang after
// `using namespace SimTK`.
namespace Eigen = ::Eigen;

/** DifferenceWeights of f(−2h), f(−h), f(h), f(2h) in h·f′. **/
constexpr int DifferencePlaces[] = {-2, -1, 1, 2};
constexpr double DifferenceWeights[] = {1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12};

/** A value without a slope. **/
struct Kink {
    int value;             ///< its index in the column
    double before, after;  ///< slopes on either side
    bool isJump;           ///< the value jumps, or its slope is infinite
};

/** A column, the rows of f that it may affect, and the destination of its slopes. **/
struct DifferenceColumn {
    int speed;
    std::vector<std::pair<int, int>> rows;  ///< first and number
    std::function<void(const Eigen::VectorXd& slopes, const std::vector<Kink>& kinks)> take;
};

/** Computes slopes along columns; those of a group are displaced together, because no row depends
on two of them.
@param evaluate  writes f for displacements δ
@param steps  h₀, by speed: StepFraction of the displacement of a body by its size
@param terms  change over h₀ of the terms of each value that may cancel; empty: unknown
@param originDistance  distance from Ground's origin, in sizes of a body, which limits the precision
of positions **/
void differentiate(
    const std::function<void(const std::vector<double>& delta, Eigen::VectorXd& f)>& evaluate,
    const std::vector<double>& steps, const Eigen::VectorXd& middle,
    const std::vector<std::vector<DifferenceColumn>>& groups, const Eigen::VectorXd& terms = {},
    double originDistance = 0);

}  // namespace simflex
