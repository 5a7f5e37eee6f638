#pragma once
/** @file
Conversion between Simbody's dense matrices, used in public headers, and Eigen's, used for algebra
(private header). **/

#include <SimTKcommon.h>

#include <Eigen/Core>

namespace simflex {

inline ::Eigen::MatrixXd toDense(const SimTK::Matrix& from) {
    ::Eigen::MatrixXd to(from.nrow(), from.ncol());
    for (int j = 0; j < from.ncol(); ++j)
        for (int i = 0; i < from.nrow(); ++i) to(i, j) = from(i, j);
    return to;
}

inline SimTK::Matrix toSimbody(const ::Eigen::MatrixXd& from) {
    SimTK::Matrix to(int(from.rows()), int(from.cols()));
    for (int j = 0; j < to.ncol(); ++j)
        for (int i = 0; i < to.nrow(); ++i) to(i, j) = from(i, j);
    return to;
}

}  // namespace simflex
