#pragma once
/** @file
Blocked products of the finite element matrices with many vectors at once. Internal to reduction.

Vectors are the columns of row-major matrices: the numbers of one degree of freedom for all
vectors lie side by side, so that each matrix entry is read once for all of them. **/

#include <Eigen/Dense>

#include "simflex/fe/FeModel.h"
#include "simflex/fe/elements/SectionUnknowns.h"

namespace simflex {

/** Displacements of every degree of freedom (rows, 3·node + axis) in several shapes (columns). **/
using Shapes = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/** Both triangles of a symmetric sparse matrix by rows. **/
class FullRows {
public:
    explicit FullRows(const SymmetricMatrix& lower);

    int size() const { return int(m_starts.size()) - 1; }

    /** A·X, X and the result size×k. Bits do not depend on the number of threads. **/
    Shapes multiply(const Shapes& X) const { return multiplyBlocks(X, 1); }

    /** (A ⊗ 1₃)·X, X and the result (3·size)×k. **/
    Shapes multiplyPerAxis(const Shapes& X) const { return multiplyBlocks(X, 3); }

private:
    Shapes multiplyBlocks(const Shapes& X, int rowsPerEntry) const;

    std::vector<std::int64_t> m_starts;
    std::vector<std::int32_t> m_columns;
    std::vector<double> m_values;
};

/** Products with a symmetric matrix of which the lower triangle is at hand: slower than those of
FullRows for few vectors, but it takes no memory. **/
class LowerTriangle {
public:
    /** Keeps a reference. **/
    explicit LowerTriangle(const SymmetricMatrix& lower) : m_lower(lower) {}

    /** A·X, X and the result size×k. Bits do not depend on the number of threads. **/
    Shapes multiply(const Shapes& X) const;

    /** Σ |x_i||A_ij||x_j| of each column x: what xᵀAx is the sum of. **/
    Eigen::VectorXd sumSizes(const Shapes& X) const;

private:
    const SymmetricMatrix& m_lower;
};

/** K of a part, of shells and beams in the unknowns that keep its digits. **/
class Stiffness {
public:
    /** Keeps a reference to the model.
    @param tieOf  see SectionUnknowns **/
    Stiffness(const FeModel& model, const std::vector<int>& tieOf);

    /** K u of displacements u, and the result, size×k. **/
    Shapes multiply(const Shapes& u) const;

    /** What uᵀKu is the sum of for each column u: see LowerTriangle. **/
    Eigen::VectorXd sumSizes(const Shapes& u) const;

    const SectionUnknowns& unknowns() const { return m_unknowns; }
    /** In these unknowns. **/
    const SymmetricMatrix& matrix() const { return m_unknowns.empty() ? m_model.K : m_own; }

private:
    /** q of u. **/
    Shapes toUnknowns(const Shapes& u) const;

    const FeModel& m_model;
    SectionUnknowns m_unknowns;
    SymmetricMatrix m_own;
};

/** The finite element matrices in the form that the reduction multiplies with. **/
struct FeProducts {
    FeProducts(const FeModel& model, const std::vector<int>& tieOf) : K(model, tieOf), m(model.m) {}
    Stiffness K;  ///< numDofs
    FullRows m;   ///< numNodes, M = m ⊗ 1₃
};

}  // namespace simflex
