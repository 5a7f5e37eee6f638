#pragma once
/** @file
Slopes of functions that may have kinks, such as the force of a stop (private header). From samples
at −2h, −h, 0, h, 2h,

    slope = (f(−2h) − 8 f(−h) + 8 f(h) − f(2h)) / 12h

for the longest h = h₀/16^k at which a function is smooth and has the slope that it has next to the
place itself. Third and fourth differences show a kink among the samples; two samples at
h₀/32768 show one between the place and the longest step, such as the gap of a stop. A place that is
a kink has no slope: the mean of those on both sides is taken, and the kink is told.

What may be round-off follows from the function's size and from what it changes over the length
that h₀ is a part of, so that nothing depends on units. Terms that cancel, such as forces of
inertia, leave round-off that may shrink with the step: no step tells it from a slope, only what the
terms change does. Six samples of each column where functions are smooth. **/

#include <Eigen/Dense>
#include <functional>
#include <utility>
#include <vector>

namespace simflex {

// SimTK has a class Eigen: where `using namespace SimTK` reaches, clang would not know which is
// meant.
namespace Eigen = ::Eigen;

/** DifferenceWeights of f(−2h), f(−h), f(h), f(2h) in h·f′. **/
constexpr int DifferencePlaces[] = {-2, -1, 1, 2};
constexpr double DifferenceWeights[] = {1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12};

/** Of a value that has no slope. **/
struct Kink {
    int value;             ///< its number among those of the column
    double before, after;  ///< slopes on both sides
    bool isJump;           ///< the value itself jumps, or its slope is infinite
};

/** A column, the rows of f that it may change, and where its slopes go. **/
struct DifferenceColumn {
    int speed;
    std::vector<std::pair<int, int>> rows;  ///< first and number
    std::function<void(const Eigen::VectorXd& slopes, const std::vector<Kink>& kinks)> take;
};

/** Slopes along columns, those of a group together: no row belongs to two of them.
@param evaluate  writes f for displacements δ
@param steps  h₀, by speed: StepFraction of what moves a body by its size
@param terms  what terms of each value may change over h₀, and cancel; empty: not known
@param originDistance  distance from Ground's origin in sizes of a body: places have its round-off
**/
void differentiate(
    const std::function<void(const std::vector<double>& delta, Eigen::VectorXd& f)>& evaluate,
    const std::vector<double>& steps, const Eigen::VectorXd& middle,
    const std::vector<std::vector<DifferenceColumn>>& groups, const Eigen::VectorXd& terms = {},
    double originDistance = 0);

}  // namespace simflex
