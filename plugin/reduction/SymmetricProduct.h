#pragma once
/** @file
Products of the finite element matrices with many vectors at once. Internal to reduction. **/

#include <Eigen/Dense>

#include "Vectors.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/elements/SectionUnknowns.h"

namespace simflex {

/** Displacements of all degrees of freedom (rows, 3·node + axis) in several shapes (columns). **/
using Shapes = Vectors;

/** Both triangles of a symmetric sparse matrix, by rows. **/
class FullRows {
public:
    explicit FullRows(const SymmetricMatrix& lower);

    int size() const { return int(m_starts.size()) - 1; }

    /** Returns A·X; X and the result are size×k. Bit-identical for any number of threads. **/
    Shapes multiply(const Shapes& X) const { return multiplyBlocks(X, 1); }

    /** Returns (A ⊗ 1₃)·X; X and the result are (3·size)×k. **/
    Shapes multiplyPerAxis(const Shapes& X) const { return multiplyBlocks(X, 3); }

private:
    Shapes multiplyBlocks(const Shapes& X, int rowsPerEntry) const;

    std::vector<std::int64_t> m_starts;
    std::vector<std::int32_t> m_columns;
    std::vector<double> m_values;
};

/** Products with a symmetric matrix given by its lower triangle: slower than FullRows for few
vectors, but without additional memory. **/
class LowerTriangle {
public:
    /** Keeps a reference. **/
    explicit LowerTriangle(const SymmetricMatrix& lower) : m_lower(lower) {}

    /** Returns A·X; X and the result are size×k. Bit-identical for any number of threads. **/
    Shapes multiply(const Shapes& X) const;

    /** Returns Σ |x_i||A_ij||x_j| for each column x: the magnitude of the terms of xᵀAx. **/
    Eigen::VectorXd sumSizes(const Shapes& X) const;

private:
    const SymmetricMatrix& m_lower;
};

/** Stiffness of a part; for shells and beams in unknowns that preserve its digits. **/
class Stiffness {
public:
    /** Keeps a reference to the model.
    @param tieOf  see SectionUnknowns **/
    Stiffness(const FeModel& model, const std::vector<int>& tieOf);

    /** Returns K u; u and the result are size×k. **/
    Shapes multiply(const Shapes& u) const;

    /** Returns the magnitude of the terms of uᵀKu for each column u, see
    LowerTriangle::sumSizes(). **/
    Eigen::VectorXd sumSizes(const Shapes& u) const;

    const SectionUnknowns& unknowns() const { return m_unknowns; }
    /** Returns K in these unknowns. **/
    const SymmetricMatrix& matrix() const { return m_unknowns.empty() ? m_model.K : m_own; }

private:
    /** Returns q for displacements u. **/
    Shapes toUnknowns(const Shapes& u) const;

    const FeModel& m_model;
    SectionUnknowns m_unknowns;
    SymmetricMatrix m_own;
};

/** The finite element matrices in the form used for products. **/
struct FeProducts {
    FeProducts(const FeModel& model, const std::vector<int>& tieOf) : K(model, tieOf), m(model.m) {}
    Stiffness K;  ///< numDofs
    FullRows m;   ///< numNodes, M = m ⊗ 1₃
};

}  // namespace simflex
