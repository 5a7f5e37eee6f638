#include "SkinProduct.h"

#include <Eigen/Core>

namespace simflex {

void multiplySkin(const float* matrix, std::size_t rows, std::size_t stride, int columns,
                  const float* x, float* y) {
    const Eigen::Map<const Eigen::MatrixXf, 0, Eigen::OuterStride<>> A(
        matrix, Eigen::Index(rows), columns, Eigen::OuterStride<>(Eigen::Index(stride)));
    const Eigen::Map<const Eigen::VectorXf> factors(x, columns);
    Eigen::Map<Eigen::VectorXf> product(y, Eigen::Index(rows));
    forSkinChunks(rows, rows * std::size_t(columns), [&](std::size_t first, std::size_t end) {
        const Eigen::Index at = Eigen::Index(first), count = Eigen::Index(end - first);
        product.segment(at, count).noalias() = A.middleRows(at, count) * factors;
    });
}

}  // namespace simflex
