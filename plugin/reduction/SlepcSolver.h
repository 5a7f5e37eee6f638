#pragma once
/** @file
Stiffness solves and normal modes distributed over MPI processes: Cholesky by MUMPS through PETSc,
Krylov–Schur by SLEPc. Internal to reduction; only the program simflex_mpi contains it.

Rank 0 runs the program and holds the model; the other ranks serve it until it ends. The matrices,
the factor and the Krylov basis are distributed by rows, so a model can exceed the memory of one
machine. Every method is called on rank 0 only. Errors detected by all ranks alike are thrown on
rank 0. An error of a single rank ends all of them with its message, because the others would wait
for it forever. Each rank uses one BLAS thread.

    return runWithSlepc(argc, argv, [&] { return runProgram(argc, argv); });  **/

#include <functional>

#include "StiffnessSolver.h"

namespace simflex {

/** Starts MPI and SLEPc, runs `program` on rank 0 and ends all ranks. PETSc options on the command
line are ignored. @returns the result of `program`. **/
int runWithSlepc(int argc, char** argv, const std::function<int()>& program);

/** Returns the number of MPI processes; 1 without runWithSlepc(). **/
int countProcesses();

class SlepcSolver : public StiffnessSolver {
public:
    SlepcSolver() = default;
    ~SlepcSolver() override;
    SlepcSolver(const SlepcSolver&) = delete;
    SlepcSolver& operator=(const SlepcSolver&) = delete;

    void factor(const SymmetricMatrix& K) override;
    Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const override;
    Eigenpairs calcModes(const CorrectedMatrix& M, const Eigen::MatrixXd& D, const ModeRange& range,
                         const std::string& phase, const ProgressCallback& progress) const override;
    long numFactorEntries() const override;

private:
    int m_size = 0;
};

}  // namespace simflex
