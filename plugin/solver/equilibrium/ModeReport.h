#pragma once
/** @file
How eigenmodes are told (private header): in units of modal mass, the largest displacement real and
positive. **/

#include <Eigen/Core>

#include "simflex/solver/Eigenmodes.h"

namespace simflex {

/** Of a sum's parts: what differences of forces leave of a motion that nothing holds. **/
constexpr double RoundOffOfSum = 1e-10;
/** Of the fastest speed: what is slower in a steady motion, a matter of differences too, is free.
 * **/
constexpr double SlowestMotion = 1e-5;
/** Of the rate that a pencil is scaled by: eigenvalues, which are defective, of what is free, as
noise in differences leaves them. **/
constexpr double NearZero = 1e-4;
/** Of the stiffest motion's frequency: the root of round-off in λ². **/
constexpr double LeastFrequency = 1e-7;

/** @param x, momentum  shape and M x, Simbody's numbering of u
@param metres  displacement that a unit of each causes **/
Eigenmode makeEigenmode(SimTK::Complex lambda, const Eigen::VectorXcd& x,
                        const Eigen::VectorXcd& momentum, const SimTK::Vector& metres);

/** Whether a motion turns what it is carried along from: a shape, and what it is a radian later.
 * **/
bool isTurned(const Eigen::VectorXcd& x, const Eigen::VectorXcd& later,
              const SimTK::Vector& metres);

/** @throws NoEquilibrium **/
[[noreturn]] void refuseImbalance(const std::string& imbalance);
/** @throws std::invalid_argument **/
[[noreturn]] void refuseUnsteadiness(const std::string& unsteady);
/** Of an unsteady motion: a frequency, and the one with the mean of coefficients over a radian. **/
std::string describeChange(double frequency, double later);

}  // namespace simflex
