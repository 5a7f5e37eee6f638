#pragma once
/** @file
Assembles a NewtonSystem into one matrix and solves it without elimination over bodies: the
reference for BlockElimination. Real or complex.

    A x = b,   x = [Δu₁; Δu₂; …; Δλ],   b = −[r₁; r₂; …; c]

    const Eigen::VectorXd x = solveDense(system);   // partial pivoting on the whole matrix
**/

#include <Eigen/Dense>
#include <Eigen/SparseCore>

#include "simflex/solver/NewtonSystem.h"

namespace simflex::test {

template <class Scalar>
using MatrixOf = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using VectorOf = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/** Returns J_b of one block as a dense matrix. For an arrow, head, coupling, its transpose and
diagonal are written out. **/
template <class Scalar>
MatrixOf<Scalar> assembleBlock(const BasicNewtonSystem<Scalar>& system,
                               const typename BasicNewtonSystem<Scalar>::Block& block);

/** Returns G_bᵀ of one block, n×m. **/
template <class Scalar>
Eigen::MatrixXd assembleGt(const BasicNewtonSystem<Scalar>& system, const NewtonBlock& block);

/** Returns the whole matrix A. **/
template <class Scalar>
MatrixOf<Scalar> assembleDense(const BasicNewtonSystem<Scalar>& system);

/** Returns the whole matrix A in compressed form without zeros. **/
Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system);

/** Returns A x, computed block by block for systems too large to assemble. **/
template <class Scalar>
VectorOf<Scalar> multiply(const BasicNewtonSystem<Scalar>& system, const VectorOf<Scalar>& x);

/** Returns b = −[r; c]. **/
template <class Scalar>
VectorOf<Scalar> assembleRightHandSide(const BasicNewtonSystem<Scalar>& system);

/** Returns x by dense LU with partial pivoting. **/
template <class Scalar>
VectorOf<Scalar> solveDense(const BasicNewtonSystem<Scalar>& system);

/** Returns the minimum-norm x by complete orthogonal decomposition, for redundant constraints. **/
template <class Scalar>
VectorOf<Scalar> solveLeastNorm(const BasicNewtonSystem<Scalar>& system);

}  // namespace simflex::test
