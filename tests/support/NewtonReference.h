#pragma once
/** @file
A NewtonSystem as one matrix, and its solution without elimination over bodies: the reference for
BlockElimination. Real or complex.

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

/** J_b of one block, dense: an arrow's head, coupling, its transpose and the diagonal written out.
 * **/
template <class Scalar>
MatrixOf<Scalar> assembleBlock(const BasicNewtonSystem<Scalar>& system,
                               const typename BasicNewtonSystem<Scalar>::Block& block);

/** G_bᵀ of one block, n×m. **/
template <class Scalar>
Eigen::MatrixXd assembleGt(const BasicNewtonSystem<Scalar>& system, const NewtonBlock& block);

/** The whole matrix A. **/
template <class Scalar>
MatrixOf<Scalar> assembleDense(const BasicNewtonSystem<Scalar>& system);

/** The whole matrix A, compressed, zeros left out. **/
Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system);

/** A x, block by block: for systems too large to write out. **/
template <class Scalar>
VectorOf<Scalar> multiply(const BasicNewtonSystem<Scalar>& system, const VectorOf<Scalar>& x);

/** b = −[r; c]. **/
template <class Scalar>
VectorOf<Scalar> assembleRightHandSide(const BasicNewtonSystem<Scalar>& system);

/** x by LU with partial pivoting of the dense A. **/
template <class Scalar>
VectorOf<Scalar> solveDense(const BasicNewtonSystem<Scalar>& system);

/** x of least norm by a complete orthogonal decomposition: for redundant constraints. **/
template <class Scalar>
VectorOf<Scalar> solveLeastNorm(const BasicNewtonSystem<Scalar>& system);

}  // namespace simflex::test
