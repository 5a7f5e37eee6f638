#pragma once
/** @file
Decompositions of dense matrices by Eigen. They are compiled once for all libraries, because each
takes a compiler 5 to 10 s. Internal. **/

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace simflex {

/** Eigenvalues in ascending order and orthonormal eigenvectors of a symmetric matrix. **/
struct SymmetricEigen {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
    bool hasConverged = false;
};

/** Solves A v = λ v. Only the lower triangle of A is read. **/
SymmetricEigen calcSymmetricEigen(const Eigen::MatrixXd& A);

/** Solves A v = λ B v with vᵀBv = 1. B must be positive definite. **/
SymmetricEigen calcSymmetricEigen(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/** Eigenvalues of a general real matrix, unordered, and eigenvectors of unit length. **/
struct GeneralEigen {
    Eigen::VectorXcd values;
    Eigen::MatrixXcd vectors;
    bool hasConverged = false;
};

GeneralEigen calcGeneralEigen(const Eigen::MatrixXd& A);

bool isPositiveDefinite(const Eigen::MatrixXd& A);  ///< reads the lower triangle only

/** Returns the smallest pivot of LDLᵀ with pivoting, −∞ if the decomposition fails. **/
double calcSmallestPivot(const Eigen::MatrixXd& A);

/** Column space of a matrix by rank-revealing QR. **/
struct ColumnSpace {
    int rank = 0;
    Eigen::MatrixXd complement;     ///< orthonormal basis of the orthogonal complement
    Eigen::MatrixXd pseudoInverse;  ///< Moore–Penrose
};

/** @param threshold  relative to the largest pivot: columns with smaller pivots count as dependent.
Negative: Eigen's default, round-off. **/
ColumnSpace calcColumnSpace(const Eigen::MatrixXd& A, double threshold = -1);

/** A = Q R of a matrix with at most as many columns as rows: QᵀQ = 1, R upper triangular. **/
struct ThinQr {
    Eigen::MatrixXd Q, R;
};

ThinQr calcThinQr(const Eigen::MatrixXd& A);

/** Minimum-norm solution x of min ‖A x − b‖. **/
class LeastSquares {
public:
    explicit LeastSquares(const Eigen::MatrixXd& A, double threshold = -1);
    ~LeastSquares();
    int getRank() const;
    Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;  ///< column by column

private:
    struct Factors;
    std::unique_ptr<Factors> m_factors;
};

inline Eigen::MatrixXd solveLeastSquares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                         double threshold = -1) {
    return LeastSquares(A, threshold).solve(B);
}

/** Solves A x = b by LU with partial pivoting. **/
class SquareSystem {
public:
    explicit SquareSystem(const Eigen::MatrixXd& A);
    ~SquareSystem();
    double getSmallestPivot() const;  ///< absolute value
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
    Eigen::MatrixXd solveEach(const Eigen::MatrixXd& B) const;  ///< column by column

private:
    struct Factors;
    std::unique_ptr<Factors> m_factors;
};

/** Solves A X = B by LU with partial pivoting. **/
Eigen::MatrixXcd solveEach(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B);

Eigen::MatrixXd calcInverse(const Eigen::MatrixXd& A);
Eigen::MatrixXcd calcInverse(const Eigen::MatrixXcd& A);

/** Solves A x = b by LDLᵀ with pivoting. Only the lower triangle of A is read. **/
Eigen::VectorXd solveSymmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd solveEachSymmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/** Returns ZᵀAZ. **/
Eigen::MatrixXd calcCongruent(const Eigen::MatrixXd& Z, const Eigen::MatrixXd& A);

/** Returns the columns in the order in which QR with column pivoting selects them. **/
std::vector<int> orderColumns(const Eigen::MatrixXd& A);

}  // namespace simflex
