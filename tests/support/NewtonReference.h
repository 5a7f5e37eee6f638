#pragma once
/** @file
A NewtonSystem as one matrix, and its solution without elimination over bodies: the reference for
BlockEliminationSolver.

    A x = b,   x = [Δu₁; Δu₂; …; Δλ],   b = −[r₁; r₂; …; c]

    const Eigen::VectorXd x = solveDense(system);   // partial pivoting on the whole matrix
**/

#include <Eigen/Dense>
#include <Eigen/SparseCore>

#include "simflex/solver/NewtonSystem.h"

namespace simflex::test {

/** J_b of one block, dense: an arrow's head, coupling, its transpose and the diagonal written out.
 * **/
Eigen::MatrixXd assembleBlock(const NewtonSystem& system, const NewtonSystem::Block& block);

/** G_bᵀ of one block, n×m. **/
Eigen::MatrixXd assembleGt(const NewtonSystem& system, const NewtonSystem::Block& block);

/** The whole matrix A. **/
Eigen::MatrixXd assembleDense(const NewtonSystem& system);

/** The whole matrix A, compressed, zeros left out. **/
Eigen::SparseMatrix<double> assembleSparse(const NewtonSystem& system);

/** A x, block by block: for systems too large to write out. **/
Eigen::VectorXd multiply(const NewtonSystem& system, const Eigen::VectorXd& x);

/** b = −[r; c]. **/
Eigen::VectorXd assembleRightHandSide(const NewtonSystem& system);

/** x by LU with partial pivoting of the dense A. **/
Eigen::VectorXd solveDense(const NewtonSystem& system);

/** x of least norm by a complete orthogonal decomposition: for redundant constraints. **/
Eigen::VectorXd solveLeastNorm(const NewtonSystem& system);

}  // namespace simflex::test
