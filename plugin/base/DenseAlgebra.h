#pragma once
/** @file
Decompositions of dense matrices, by Eigen: compiled once for all libraries, since each costs a
compiler 5 to 10 s. Internal. **/

#include <Eigen/Core>

namespace simflex {

/** Eigenvalues, ascending, and orthonormal vectors of a symmetric matrix. **/
struct SymmetricEigen {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
    bool hasConverged = false;
};

/** A v = λ v; only the lower triangle of A is read. **/
SymmetricEigen calcSymmetricEigen(const Eigen::MatrixXd& A);

/** A v = λ B v with vᵀBv = 1; B is positive definite. **/
SymmetricEigen calcSymmetricEigen(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

bool isPositiveDefinite(const Eigen::MatrixXd& A);  ///< symmetric: only its lower triangle is read

/** Of LDLᵀ with pivoting; that of a matrix it does not suit is −∞. **/
double calcSmallestPivot(const Eigen::MatrixXd& A);

/** Columns of a matrix as a rank-revealing QR decomposition sees them. **/
struct ColumnSpace {
    int rank = 0;
    Eigen::MatrixXd complement;     ///< orthonormal: all that is orthogonal to the columns
    Eigen::MatrixXd pseudoInverse;  ///< Moore and Penrose's
};

/** @param threshold  relative to the largest pivot, below which a column depends on the others;
Eigen's own, round-off, where it is negative. **/
ColumnSpace calcColumnSpace(const Eigen::MatrixXd& A, double threshold = -1);

/** The shortest x of least ‖A x − b‖, for each column of B. **/
Eigen::MatrixXd solveLeastSquares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                  double threshold = -1);

}  // namespace simflex
