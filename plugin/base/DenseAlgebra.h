#pragma once
/** @file
Decompositions of dense matrices, by Eigen: compiled once for all libraries, since each costs a
compiler 5 to 10 s. Internal. **/

#include <Eigen/Core>
#include <memory>
#include <vector>

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

/** Eigenvalues of any real matrix, in no order, and vectors of length 1. **/
struct GeneralEigen {
    Eigen::VectorXcd values;
    Eigen::MatrixXcd vectors;
    bool hasConverged = false;
};

GeneralEigen calcGeneralEigen(const Eigen::MatrixXd& A);

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

/** A = Q R of a matrix with no more columns than rows: Qᵀ Q = 1, R upper triangular. **/
struct ThinQr {
    Eigen::MatrixXd Q, R;
};

ThinQr calcThinQr(const Eigen::MatrixXd& A);

/** The shortest x of least ‖A x − b‖. **/
class LeastSquares {
public:
    explicit LeastSquares(const Eigen::MatrixXd& A, double threshold = -1);
    ~LeastSquares();
    int getRank() const;
    Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;  ///< for each column of B

private:
    struct Factors;
    std::unique_ptr<Factors> m_factors;
};

inline Eigen::MatrixXd solveLeastSquares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                         double threshold = -1) {
    return LeastSquares(A, threshold).solve(B);
}

/** A x = b by LU with partial pivoting. **/
class SquareSystem {
public:
    explicit SquareSystem(const Eigen::MatrixXd& A);
    ~SquareSystem();
    double getSmallestPivot() const;  ///< its size
    Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
    Eigen::MatrixXd solveEach(const Eigen::MatrixXd& B) const;  ///< for each column of B

private:
    struct Factors;
    std::unique_ptr<Factors> m_factors;
};

/** A x = b by LU with partial pivoting, for each column of B. **/
Eigen::MatrixXcd solveEach(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B);

Eigen::MatrixXd calcInverse(const Eigen::MatrixXd& A);
Eigen::MatrixXcd calcInverse(const Eigen::MatrixXcd& A);

/** A x = b by LDLᵀ with pivoting; only the lower triangle of A is read. **/
Eigen::VectorXd solveSymmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd solveEachSymmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/** ZᵀAZ. **/
Eigen::MatrixXd calcCongruent(const Eigen::MatrixXd& Z, const Eigen::MatrixXd& A);

/** Columns in the order in which QR decomposition with column pivoting takes them: always the one
farthest from those before. **/
std::vector<int> orderColumns(const Eigen::MatrixXd& A);

}  // namespace simflex
