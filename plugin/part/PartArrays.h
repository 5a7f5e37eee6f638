#pragma once
/** @file
A reduced part as matrices for MATLAB (.mat) and NumPy (.npz). SI units.

    K, M    (6+n_f)×(6+n_f) of the free part, linear about rest: M q̈ + K q = Lᵀ f
    L       (6·interfaces)×(6+n_f): translation and rotation of each interface, L q

where q consists of translation and rotation of the mean-axis frame, then ξ. Also written:
interface_names, interface_positions (interfaces×3), center_of_mass, mass, inertia (3×3),
frequencies [Hz], nodes (number x y z) and Phi ((3·nodes)×n_f). Positions are in deck
coordinates. **/

#include <string>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** @throws std::invalid_argument if body.validate() does. @throws std::runtime_error if the file
cannot be written. **/
void writePartArrays(const std::string& path, const ReducedBody& body);

}  // namespace simflex
