#pragma once
/** @file
Sparse Cholesky factorization P A Pᵀ = L Lᵀ: ordered by CHOLMOD (supernodal, long indices), factored
by SupernodalFactorization, solved by SupernodalSolve. Internal to reduction. Bit-identical for any
number of threads.

    SparseCholesky cholesky;
    const auto& prediction = cholesky.analyze(A);   // seconds, and says what factor() will take
    cholesky.factor(A);
    const Vectors X = cholesky.solve(B);

The ordering is the better of METIS's nested dissection and, where it is cheap to try, AMD. **/

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "Vectors.h"
#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

class Archive;

class SparseCholesky {
public:
    /** Cost of the factorization, known from the pattern. **/
    struct Prediction {
        std::int64_t numEntries = 0;  ///< of L as stored
        double flops = 0;
        std::int64_t factorBytes = 0;   ///< L with its indices, permanent
        std::int64_t workingBytes = 0;  ///< additional, during factorization
        const char* order = "";         ///< "METIS" or "AMD"
    };

    SparseCholesky();
    ~SparseCholesky();

    /** Orders A and determines the pattern of L. @throws std::runtime_error if memory is
    insufficient. **/
    const Prediction& analyze(const SymmetricMatrix& A);

    /** Factors A; analyses it first if necessary. The pattern must be the analysed one.
    @throws SingularMatrix if A is not positive definite to round-off.
    @throws Cancelled after the factorization, if progress requests it. **/
    void factor(const SymmetricMatrix& A, const ProgressCallback& progress = {});

    /** Write the factor to an archive and read it back. @pre for save: factor(). **/
    void save(Archive& out) const;
    void load(Archive& in);

    /** Returns A⁻¹ B for many right-hand sides. @pre factor(). **/
    Vectors solve(const Vectors& B) const;

    /** X ← L⁻¹ X and X ← L⁻ᵀ X for many right-hand sides, in the order of L. @pre factor(). **/
    void solveLower(Vectors& X) const;
    void solveUpper(Vectors& X) const;

    /** Returns the row of A that each row of L belongs to: that of the non-zero in a row of P.
    @pre analyze(). **/
    std::vector<int> listOrder() const;

    /** Returns a rough estimate of 1/cond(A). @pre factor(). **/
    double estimateReciprocalCondition() const;

    int size() const;
    long numFactorEntries() const;

    /** Thrown with the row (of A) of the vanishing pivot. **/
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
