#pragma once
/** @file
J = LU without exchanges, eight rows at a time (private header): for matrices of some dozens of rows
whose symmetric part is positive definite, as a flexible body's Newton matrix with gyroscopic terms
is. Their pivots cannot vanish (Golub and Van Loan, Matrix Computations, 4.3.2); a pivot that loses
most of its diagonal entry is refused, and the caller has to pivot. **/

#include <Eigen/Dense>

namespace simflex {

class ChunkedLu {
public:
    /** Factors J (n×n) and writes W = J⁻¹B, B n×m. O(n³) in L1 cache.
    @returns false if a pivot is not positive or lost all but 1e-8 of J's own diagonal entry. **/
    bool factor(const double* J, int n, const Eigen::MatrixXd& B, Eigen::MatrixXd& W);

    /** x ← J⁻¹x. **/
    void solveInPlace(double* x);

private:
    /** X ← U⁻¹X for `count` padded columns. **/
    void substituteBack(double* X, int count);
    double* column(int j) { return m_LU.data() + j * m_LU.rows(); }

    int m_n = 0;
    Eigen::MatrixXd m_LU;       ///< and B behind it; columns padded with zeros to whole chunks
    Eigen::VectorXd m_inverse;  ///< of U's diagonal
    Eigen::VectorXd m_x, m_above;
};

}  // namespace simflex
