#pragma once
/** @file
Points at which equations of motion are not evaluated (private header). An iterate that is not
finite or absurdly large would cause an exception, a failed assertion or meaningless results in
Simbody or in a user's force. Evaluation refuses such a point first, and the step is retried with a
shorter length. **/

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace simflex {

class UnusablePoint : public std::runtime_error {
public:
    /** @param culpritBlock  −1: unknown **/
    explicit UnusablePoint(const std::string& message, int culpritBlock = -1)
        : std::runtime_error(message), block(culpritBlock) {}
    const int block;
};

/** No quantity of a mechanism reaches this value in any system of units, and products of a few such
numbers do not overflow. **/
constexpr double LargestUsable = 1e50;
/** Limit for lengths of quaternions, which have no unit. Steps of tens of radians stretch them by
factors of millions on the way to their end; their squares do not overflow. **/
constexpr double ShortestQuaternion = 1e-30, LongestQuaternion = 1e30;

/** False if an entry is not a number, or too large. **/
inline bool areUsable(const double* values, int count) {
    bool areGood = true;
    for (int i = 0; i < count; ++i) areGood &= std::abs(values[i]) < LargestUsable;
    return areGood;
}

/** False for a quaternion that does not define a rotation. **/
inline bool isUsableQuaternion(const double* q) {
    const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return square > ShortestQuaternion * ShortestQuaternion &&
           square < LongestQuaternion * LongestQuaternion;
}

/** std::max() that propagates NaN. **/
inline double largerOrNaN(double a, double b) {
    return std::isnan(a) || a > b ? a : b;
}

}  // namespace simflex
