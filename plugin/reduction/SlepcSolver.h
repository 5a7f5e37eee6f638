#pragma once
/** @file
Stiffness solves and normal modes shared out over MPI processes: Cholesky by MUMPS through PETSc,
Krylov–Schur by SLEPc. Internal to reduction; only the program simflex_mpi holds it.

One process, rank 0, runs the program and holds the model; the others serve it until it ends. The
matrices, the factor, and the Krylov basis are distributed by rows, so that a model can be larger
than one machine's memory. Every method is called on rank 0 alone. An error that all ranks find
alike is thrown on rank 0. One that a rank finds alone ends all of them, with its message: the
others are in the middle of their work, and would wait for that rank for ever. Each rank has one
BLAS thread.

    return runWithSlepc(argc, argv, [&] { return runProgram(argc, argv); }); **/

#include <functional>

#include "StiffnessSolver.h"

namespace simflex {

/** Starts MPI and SLEPc, runs `program` on rank 0 and ends all. Options of PETSc are not read from
the command line. @returns what `program` does. **/
int runWithSlepc(int argc, char** argv, const std::function<int()>& program);

/** Number of MPI processes; 1 without runWithSlepc(). **/
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
