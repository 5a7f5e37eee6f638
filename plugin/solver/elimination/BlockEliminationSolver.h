#pragma once
/** @file
Solves a NewtonSystem by block Gaussian elimination over bodies, then over multipliers:

    1. per block, in parallel:  factor J_b,  S_b = G_b J_b⁻¹ G_bᵀ
    2. Schur complement:        S = Σ_b S_b, sparse: its graph is that of joints sharing a body
    3.                          S Δλ = c − Σ_b G_b z_b,   z_b = J_b⁻¹ r_b
    4. per block, in parallel:  Δu_b = −z_b − J_b⁻¹ G_bᵀ Δλ

An arrow block costs O(36 n). S is factored by fronts in a nested-dissection order found once, or as
one dense matrix if it is small; LDLᵀ if every block is symmetric and there are
neither pairs nor couplings, else LU. A body with very many
joints would couple them all: it is late, its speeds stay in step 3 as unknowns instead.

Redundant constraints leave S singular: then Δλ is the least-squares solution of least norm, and
getRedundantRows() names them. Sums over blocks have a fixed order, so results are the same to the
bit for any number of threads.

    BlockEliminationSolver solver(system);   // symbolic: sizes and rows
    solver.factor(system);
    solver.solve(system);
    solver.getDeltaU(), solver.getDeltaLambda()

States: symbolic (after construction) → factored (after factor()); solve() may follow any number of
times. After the first of each, neither allocates memory (redundant constraints excepted).

Complex systems take the same way, ComplexBlockEliminationSolver: a symmetric J is then complex
symmetric, its real part positive definite. **/

#include <complex>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/solver/NewtonSystem.h"

namespace simflex {

/** A block whose matrix is singular or not finite. **/
class SingularBlock : public std::runtime_error {
public:
    SingularBlock(int singularBlock, const std::string& message)
        : std::runtime_error(message), block(singularBlock) {}
    const int block;
};

template <class Scalar>
class BlockElimination {
public:
    using System = BasicNewtonSystem<Scalar>;

    /** Wall time of the phases since construction [s], without eliminate() and substitute(). **/
    struct Timing {
        double factor = 0;            ///< step 1
        double schur = 0;             ///< steps 2 and 3
        double backSubstitution = 0;  ///< z_b and step 4
    };

    /** Analyses sizes and rows; numbers are not looked at. **/
    explicit BlockElimination(const System& system);
    ~BlockElimination();
    BlockElimination(BlockElimination&&) noexcept;
    BlockElimination& operator=(BlockElimination&&) noexcept;

    /** Threads to use at most; small systems get fewer. **/
    void setNumThreads(int threads);

    /** True if the last factor() succeeded. **/
    bool isFactored() const;
    /** True while blocks with very many columns stay unknowns of step 3; factor() gives that up for
    good where it finds redundancies beside them. **/
    bool hasLateBlocks() const;
    /** Gives it up now. **/
    void dissolveLateBlocks(const System& system);

    /** Factors every J_b and S. @pre same topology as in the constructor.
    @throws std::runtime_error that names the block if a J_b is singular or not finite. **/
    void factor(const System& system);

    /** Solves for the r and c of `system`; of its matrices only Gt is read. @pre factor().
    @throws std::logic_error if nothing was factored. **/
    void solve(const System& system);

    /** @name solve() in three steps
    for who passes over the blocks anyway and has each in cache: the first for every block, from any
    threads, then the second, then the last for every block. **/
    /**@{**/
    /** z_b and G_b z_b. **/
    void eliminate(const System& system, int block);
    /** S Δλ = c − Σ_b G_b z_b. **/
    void solveForMultipliers(const System& system);
    /** The block's Δu. **/
    void substitute(const System& system, int block);
    /**@}**/

    /** The same with r = 0 whatever the system holds: the projection onto the constraints. **/
    void solveForConstraints(const System& system);

    /** Of all speeds, block after block. **/
    const std::vector<Scalar>& getDeltaU() const;
    const Scalar* getDeltaLambda() const;
    int getNumRedundant() const;
    /** Rows of Δλ that follow from others, one for each redundancy; of the last factor(). **/
    const std::vector<int>& getRedundantRows() const;
    /** All rows that take part in the k-th redundancy, ascending, its own row among them. **/
    std::vector<int> findInvolvedRows(int k) const;
    const Timing& getTiming() const;

private:
    class Implementation;
    std::unique_ptr<Implementation> m_impl;
};

using BlockEliminationSolver = BlockElimination<double>;
using ComplexBlockEliminationSolver = BlockElimination<std::complex<double>>;

}  // namespace simflex
