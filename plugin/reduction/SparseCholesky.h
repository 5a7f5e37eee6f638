#pragma once
/** @file
Sparse Cholesky factorization P A Pᵀ = L Lᵀ: ordered by CHOLMOD (supernodal, long indices), factored
by SupernodalFactorization, solved by SupernodalSolve. Internal to reduction. Bits do not depend on
the number of threads.

    SparseCholesky cholesky;
    const auto& prediction = cholesky.analyze(A);   // seconds, and says what factor() will take
    cholesky.factor(A);
    cholesky.solveLower(B, Y);

The order is the better of METIS's nested dissection and, where it is cheap to try, AMD. **/

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <stdexcept>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

class Archive;

class SparseCholesky {
public:
    /** What the factorization will take, known from the pattern alone. **/
    struct Prediction {
        std::int64_t numEntries = 0;  ///< of L as it is stored
        double flops = 0;
        std::int64_t factorBytes = 0;   ///< L with its indices, kept
        std::int64_t workingBytes = 0;  ///< besides, while factoring
        const char* order = "";         ///< "METIS" or "AMD"
    };

    SparseCholesky();
    ~SparseCholesky();

    /** Orders A and finds the pattern of L. @throws std::runtime_error for want of memory. **/
    const Prediction& analyze(const SymmetricMatrix& A);

    /** Factors A, analysed first if that has not been done; its pattern must be the analysed one.
    @throws SingularMatrix if A is not positive definite to round-off.
    @throws Cancelled when it is done, if progress asks to stop. **/
    void factor(const SymmetricMatrix& A, const ProgressCallback& progress = {});

    /** Writes the factor, and takes one that was written. @pre of save: factor(). **/
    void save(Archive& out) const;
    void load(Archive& in);

    /** A⁻¹ B for many right-hand sides. @pre factor(). **/
    Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;

    /** Y ← L⁻¹ P X for many right-hand sides; Y may be X. @pre factor(). **/
    void solveLower(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const;

    /** Y ← Pᵀ L⁻ᵀ X for many right-hand sides; Y may be X. @pre factor(). **/
    void solveUpper(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const;

    /** A rough estimate of 1/cond(A). @pre factor(). **/
    double estimateReciprocalCondition() const;

    int size() const;
    long numFactorEntries() const;

    /** Thrown with the row (of A) at which the pivot vanished. **/
    struct SingularMatrix : std::runtime_error {
        explicit SingularMatrix(int pivotRow)
            : std::runtime_error("the matrix is not positive definite"), row(pivotRow) {}
        int row;
    };

private:
    struct Data;
    std::unique_ptr<Data> m_data;
};

}  // namespace simflex
