#pragma once
/** @file
Multifrontal LDLᵀ or LU of a sparse matrix that is a sum of small dense ones, one per clique
(private header). The matrix has a symmetric pattern; its symmetric part is definite or
quasi-definite, so that diagonal pivots exist in any order. Inside a front the largest pivot comes
first.

A pivot that has shrunk below RankThreshold of its diagonal's first value belongs to a redundant
unknown: it is set aside, its null vector is found, and solve() returns the least-squares solution
of least norm.

    FrontSolver<double> solver(pattern);
    solver.setSymmetric(true);
    solver.factor(values, threads);    // values[c]: k×k column-major, k = size of clique c
    solver.solve(x, threads);          // in place
    solver.solve(X, 20, threads);      // twenty columns, eight side by side **/

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <vector>

#include "simflex/solver/elimination/FrontTree.h"
#include "simflex/solver/elimination/ScalarChunk.h"

namespace simflex {

template <class Scalar>
class FrontSolver {
public:
    static constexpr double RankThreshold = 1e-12;

    explicit FrontSolver(const CliquePattern& pattern);

    /** Symmetric: LDLᵀ, of the values only one triangle is read; otherwise LU. **/
    void setSymmetric(bool symmetric) { m_isSymmetric = symmetric; }

    /** @param values  one pointer per clique; null: zero **/
    void factor(const std::vector<const Scalar*>& values, int threads);

    /** Replaces the right-hand side by the solution. **/
    void solve(Scalar* x, int threads);
    /** The same for `count` right-hand sides, one after another. **/
    void solve(Scalar* x, int count, int threads);

    /** Number of negative pivots of a real LDLᵀ, equal to that of negative eigenvalues
    (Sylvester). **/
    int countNegativePivots() const;

    /** Unknowns set aside, ascending. **/
    const std::vector<int>& getRedundantUnknowns() const { return m_redundant; }

    /** All unknowns of the k-th redundancy, including the redundant one, ascending. **/
    std::vector<int> findInvolvedUnknowns(int k) const;

    const FrontTree& getTree() const { return m_tree; }

private:
    struct NullVector {
        int first = 0;                ///< elimination position of the first entry
        std::vector<double> entries;  ///< at consecutive positions
    };

    /** A row of eight right-hand sides. **/
    struct Wide {
        ChunkOf<Scalar> values{};
    };

    Scalar* matrixOf(int front) { return m_storage.data() + m_offsets[size_t(front)]; }
    Scalar* vectorOf(int front) { return m_vectors.data() + m_vectorOffsets[size_t(front)]; }
    double* originalOf(int front) { return m_originals.data() + m_vectorOffsets[size_t(front)]; }

    void factorFront(int f, const std::vector<const Scalar*>& values);
    void assembleFront(int f, const std::vector<const Scalar*>& values);
    void eliminate(int f, int from, int to);
    void swapPivots(int f, int p, int q);
    void updateTrailing(int f, int from, int to);
    void forwardFront(int f);
    void backwardFront(int f, Scalar* x);
    void forwardWide(int f);
    void backwardWide(int f);
    void findNullVectors();
    void projectOffNullSpace(Scalar* x) const;
    template <class Visit>
    void visitUpwards(int threads, Visit visit);
    template <class Visit>
    void visitDownwards(int threads, Visit visit);

    FrontTree m_tree;
    bool m_isSymmetric = true;
    std::vector<size_t> m_offsets, m_vectorOffsets;
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1>
        m_storage;  ///< the fronts' matrices; aligned, so that sums never depend on addresses
    std::vector<Scalar> m_vectors;    ///< right-hand side of each front
    std::vector<double> m_originals;  ///< diagonal before elimination, by row of each front
    std::vector<int> m_pivotOrder;    ///< position in the front of each pivot, in elimination order
    std::vector<Scalar> m_inversePivots;
    std::vector<char> m_isRedundant;  ///< in elimination order after pivoting
    std::vector<Scalar> m_x;
    std::vector<Wide> m_wideX,
        m_wideVectors;             ///< as m_x and m_vectors, for several right-hand sides
    std::vector<int> m_unknownAt;  ///< in elimination order

    std::vector<int> m_redundant;
    std::vector<NullVector> m_nullVectors;
    Eigen::SparseMatrix<double> m_nullSpace;  ///< rows in elimination order
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> m_gram;
};

template <>
int FrontSolver<double>::countNegativePivots() const;

}  // namespace simflex
