#pragma once
/** @file
Conversion of States to numbers for files and probes. Internal. **/

#include <vector>

#include "Simbody.h"

namespace simflex {
namespace model {

template <class Vector>
std::vector<double> toNumbers(const Vector& vector) {
    std::vector<double> numbers;
    for (int i = 0; i < vector.size(); ++i) numbers.push_back(vector[i]);
    return numbers;
}

inline SimTK::Vector toVector(const std::vector<double>& numbers) {
    return SimTK::Vector(int(numbers.size()), numbers.data());
}

/** Sets a State's time, coordinates and speeds.
@throws std::out_of_range if there are too few numbers. **/
inline void setNumbers(SimTK::State& state, double time, const std::vector<double>& q,
                       const std::vector<double>& u) {
    state.setTime(time);
    for (int k = 0; k < state.getNQ(); ++k) state.updQ()[k] = q.at(size_t(k));
    for (int k = 0; k < state.getNU(); ++k) state.updU()[k] = u.at(size_t(k));
}

}  // namespace model
}  // namespace simflex
