#pragma once
/** @file
A complex Newton system as a linear combination of three real ones of the same state and topology
(private header), J = w₀J_a + w₁J_b + w₂J_c.

Constraints are the same in all three. A force element's row adds gᵀg/D to its system's J, where g
depends nonlinearly on the system's stiffness factor; a and c have the same factor, b another one.
The combination has each such row twice, g_a with D_a/(w₀ + w₂) and g_b with D_b/w₁.

    ComplexNewtonSystem combined = makeCombined(a, firstElementRow);
    combine(a, b, c, weights, combined);      // as often as wanted **/

#include <complex>

#include "simflex/solver/NewtonSystem.h"

namespace simflex {

/** @returns a system of the sizes of `real` with the rows from firstElementRow on duplicated: row k
also as row numMultipliers + k − firstElementRow.
@throws std::logic_error if a Side holds rows of both kinds **/
ComplexNewtonSystem makeCombined(const NewtonSystem& real, int firstElementRow);

/** Writes all but r and c; does not allocate memory after the first call.
@param result  from makeCombined()
@throws std::logic_error if a block is an arrow in one system and not in another **/
void combine(const NewtonSystem& a, const NewtonSystem& b, const NewtonSystem& c,
             const std::complex<double> (&weights)[3], ComplexNewtonSystem& result);

}  // namespace simflex
