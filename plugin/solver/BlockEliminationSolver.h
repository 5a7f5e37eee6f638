#pragma once
/** @file
Solves a NewtonSystem by block Gaussian elimination over bodies, then over multipliers:

    1. per block, in parallel:  factor J_b,  W_b = J_b⁻¹ G_bᵀ
    2. Schur complement:        S = Σ_b G_b W_b
    3.                          S Δλ = c − Σ_b G_b z_b,   z_b = J_b⁻¹ r_b
    4. per block, in parallel:  Δu_b = −z_b − W_b Δλ

An arrow block costs O(36 n). Redundant constraints leave S singular: then Δλ is the least-squares
solution of minimum norm (in rows scaled by diag S), and getNumRedundant() says how many. Sums over
blocks have a fixed order, so results are the same to the bit for any number of threads.

    BlockEliminationSolver solver(system);   // symbolic: sizes and rows
    solver.factor(system);
    solver.solve(system);
    const double* du = solver.getDeltaU(block);  const double* dlambda = solver.getDeltaLambda();

States: symbolic (after construction) → factored (after factor()); solve() may follow any number of
times. **/

#include <memory>

#include "simflex/solver/NewtonSystem.h"

namespace simflex {

class BlockEliminationSolver {
public:
    /** Wall time of the phases since construction [s]. **/
    struct Timing {
        double factor = 0;            ///< step 1
        double schur = 0;             ///< steps 2 and 3
        double backSubstitution = 0;  ///< z_b and step 4
    };

    /** Analyses sizes and rows; numbers are not looked at. **/
    explicit BlockEliminationSolver(const NewtonSystem& system);
    ~BlockEliminationSolver();
    BlockEliminationSolver(BlockEliminationSolver&&) noexcept;
    BlockEliminationSolver& operator=(BlockEliminationSolver&&) noexcept;

    /** Threads used in steps 1 and 4; at least 1. **/
    void setNumThreads(int threads);

    /** Factors every J_b and S. @pre same topology as in the constructor.
    @throws std::runtime_error that names the block if a J_b is singular or not finite. **/
    void factor(const NewtonSystem& system);

    /** Solves for the r and c of `system`; of its matrices only Gt is read. @pre factor().
    @throws std::logic_error if nothing was factored. **/
    void solve(const NewtonSystem& system);

    const double* getDeltaU(int block) const;
    const double* getDeltaLambda() const;
    int getNumRedundant() const;
    const Timing& getTiming() const;

private:
    class Implementation;
    std::unique_ptr<Implementation> m_impl;
};

}  // namespace simflex
