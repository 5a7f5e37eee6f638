#pragma once
/** @file
Form in which eigenmodes are returned (private header): unit modal mass, the largest displacement
real and positive. **/

#include <Eigen/Core>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

/** Error of force differences in a free motion, relative to the terms of the sum. **/
constexpr double RoundOffOfSum = 1e-10;
/** Rate below which a mode of a steady motion, also from differences, is free, relative to the
fastest speed. **/
constexpr double SlowestMotion = 1e-5;
/** Eigenvalues of free motions, which are defective, due to noise of differences; relative to the
rate that scales the pencil. **/
constexpr double NearZero = 1e-4;
/** Relative to the frequency of the stiffest motion: the root of round-off in λ². **/
constexpr double LeastFrequency = 1e-7;

/** @param x, momentum  shape and M x, Simbody's numbering of u
@param metres  displacement per unit of each [m] **/
Eigenmode makeEigenmode(SimTK::Complex lambda, const Eigen::VectorXcd& x,
                        const Eigen::VectorXcd& momentum, const SimTK::Vector& metres);

/** Whether the motion rotates a shape while carrying it along; the shape now and a radian
later. **/
bool isTurned(const Eigen::VectorXcd& x, const Eigen::VectorXcd& later,
              const SimTK::Vector& metres);

/** @throws NoEquilibrium **/
[[noreturn]] void refuseImbalance(const std::string& imbalance);
/** @throws std::invalid_argument **/
[[noreturn]] void refuseUnsteadiness(const std::string& unsteady);
/** Describes an unsteady motion: a frequency, and that with coefficients averaged over a
radian. **/
std::string describeChange(double frequency, double later);

}  // namespace simflex
