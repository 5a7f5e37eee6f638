#pragma once
/** @file
J = LU without pivoting, eight rows at a time (private header), for matrices of some dozens of rows
with positive definite symmetric part, such as a flexible body's Newton matrix with gyroscopic
terms. Their pivots cannot vanish (Golub and Van Loan, Matrix Computations, 4.3.2), nor can those of
a complex matrix with such a real part; a pivot that loses most of its diagonal entry is refused,
and the caller has to pivot. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/solver/elimination/ScalarChunk.h"

namespace simflex {

template <class Scalar>
class ChunkedLu {
public:
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

    /** Factors J (n×n) and writes W = J⁻¹B, B n×m. O(n³) in L1 cache.
    @returns false if a pivot is not positive (if complex: not finite) or lost all but 1e-8 of J's
    own diagonal entry. **/
    bool factor(const Scalar* J, int n, const Eigen::MatrixXd& B, Matrix& W);

    /** x ← J⁻¹x. **/
    void solveInPlace(Scalar* x);

private:
    /** X ← U⁻¹X for `count` columns of X from `first` on. **/
    void substituteBack(PaddedColumns<Scalar>& X, int first, int count);

    int m_n = 0;
    PaddedColumns<Scalar> m_LU;     ///< followed by B
    std::vector<Scalar> m_inverse;  ///< of U's diagonal
    PaddedColumns<Scalar> m_x, m_above;
};

}  // namespace simflex
