#pragma once
/** @file
Fields over time as a few fixed shapes: d(t) ≈ Σ_k w_k(t) D_k. Internal to the renderer.

Given d(t) = B c(t), with the columns of B (rows × m) in single precision and few against the rows,
the singular vectors of all d(t) follow from the m×m matrices BᵀB and (R C)(R C)ᵀ, RᵀR = BᵀB. As
many are kept as hold, at every time, the norm of what is left out below a tolerance: no component,
and no displacement of a node, is off by more. **/

#include <cstddef>
#include <vector>

namespace simflex {

struct ShapeSeries {
    std::vector<std::vector<float>> shapes;   ///< of `rows` each, scaled to a largest weight of 1
    std::vector<std::vector<float>> weights;  ///< of each time, one a shape
    double error = 0;                         ///< at most, as above
};

/** O(rows·m² + times·m²).
@param fields  B, column after column
@param coefficients  c at each time **/
ShapeSeries findShapes(const std::vector<float>& fields, std::size_t rows,
                       const std::vector<std::vector<double>>& coefficients, double tolerance);

}  // namespace simflex
