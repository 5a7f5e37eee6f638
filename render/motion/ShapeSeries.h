#pragma once
/** @file
Approximates time-dependent fields by a few fixed shapes: d(t) ≈ Σ_k w_k(t) D_k. Internal to the
renderer.

Given d(t) = B c(t), with B (rows × m) in single precision and m much smaller than rows, the
singular vectors of all d(t) follow from the m×m matrices BᵀB and (R C)(R C)ᵀ, RᵀR = BᵀB. The
smallest number of shapes is kept for which the norm of the remainder is below a tolerance at every
time, which bounds the error of every component and of every node's displacement. **/

#include <cstddef>
#include <vector>

namespace simflex {

struct ShapeSeries {
    std::vector<std::vector<float>> shapes;   ///< `rows` values each, scaled to a largest weight of
                                              ///< 1
    std::vector<std::vector<float>> weights;  ///< by time, one per shape
    double error = 0;                         ///< upper bound, as above
};

/** O(rows·m² + times·m²).
@param fields  B, column-major
@param coefficients  c at each time **/
ShapeSeries findShapes(const std::vector<float>& fields, std::size_t rows,
                       const std::vector<std::vector<double>>& coefficients, double tolerance);

}  // namespace simflex
